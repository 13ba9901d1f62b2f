/* A world of a server as its newest frame shows it. Knows nothing of Godot. */
#ifndef PNEUMA_WATCHED_WORLD_H
#define PNEUMA_WATCHED_WORLD_H

#include <pneuma.h>

typedef struct {
  char* name;
  size_t vertex_count;
  size_t face_count;
  float* positions_m; /* x y z of each vertex */
  uint32_t* faces;    /* three vertices each, counter-clockwise seen from outside */
} watched_body;

/* All zeros is a world that is not watched. */
typedef struct {
  pneuma_client* client; /* NULL: not watched */
  pneuma_error error;    /* of the last call that failed */
  int has_frame;
  uint64_t tick;
  double time_s; /* simulated */
  size_t body_count;
  watched_body* bodies;
} watched_world;

/* `token` may be NULL. What was watched before is closed first. Waits until the server has answered, or for 5 s to
   connect and 10 s for the reply. */
pneuma_code watched_world_open(watched_world* world, const char* address, const char* name, const char* token);
/* Takes in the newest frame of those that have come. Does not wait. An error closes the connection; the newest frame
   stays. */
pneuma_code watched_world_poll(watched_world* world);
void watched_world_close(watched_world* world);

/* NULL where no body has the name. */
const watched_body* watched_world_body(const watched_world* world, const char* name);
/* x y z of the unit normal of each vertex, outwards: the mean of its faces' normals, by their areas. */
void watched_body_normals(const watched_body* body, float* normals);

#endif
