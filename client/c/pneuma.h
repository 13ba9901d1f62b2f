/* Pneuma in C: soft bodies with gas inside, in this program (pneuma_world) or in a server (pneuma_client).

   Functions that can fail take a pneuma_error, which may be NULL, and return a code or NULL. Strings are UTF-8. What a
   function lends (`const` pointers) is valid until the next call that takes the same object. An object is used by one
   thread at a time; objects know nothing of each other. */
#ifndef PNEUMA_H
#define PNEUMA_H

#include <stddef.h>
#include <stdint.h>

/* NOLINTBEGIN(readability-identifier-naming): names of C */

#ifdef __cplusplus
extern "C" {
#endif

#define PNEUMA_API __attribute__((visibility("default")))

/* Of what is declared here. It grows when something is added. When something else changes, so does the library's
   soname. */
#define PNEUMA_API_VERSION 1
/* Of the library that the program runs with. */
PNEUMA_API uint32_t pneuma_api_version(void);

/* As on the wire (proto/WIRE.md, "Errors"), but that PNEUMA_UNAUTHENTICATED is also what a token does not allow. */
typedef enum pneuma_code {
  PNEUMA_OK = 0,
  PNEUMA_INVALID_ARGUMENT = 1,
  PNEUMA_NOT_FOUND = 2,
  PNEUMA_ALREADY_EXISTS = 3,
  PNEUMA_LIMIT_EXCEEDED = 4,
  PNEUMA_UNAUTHENTICATED = 5,
  PNEUMA_FAILED_PRECONDITION = 6,
  PNEUMA_UNSUPPORTED = 7,
  PNEUMA_MALFORMED = 8,
  PNEUMA_UNAVAILABLE = 9,
  PNEUMA_INTERNAL = 10
} pneuma_code;

/* What went wrong, and where: the path of a field, or empty. Longer texts are cut. */
typedef struct pneuma_error {
  pneuma_code code;
  char what[512];
  char where[256];
} pneuma_error;

typedef struct pneuma_soft_body {
  const char* name;
  size_t vertex_count;
  size_t face_count;
  const float* positions_m;    /* x y z of each vertex */
  const float* velocities_m_s; /* likewise; NULL where they were not asked for */
  const uint32_t* faces;       /* three vertices each, counter-clockwise seen from outside */
} pneuma_soft_body;

/* A rigid body, or a collider. */
typedef struct pneuma_solid {
  const char* name;
  int is_dynamic; /* 1 of a rigid body */
  double position_m[3];
  double orientation[4]; /* w x y z of a unit quaternion */
} pneuma_solid;

/* A world at one tick. */
typedef struct pneuma_frame {
  const char* world;
  uint64_t tick;
  double time_s; /* simulated */
  size_t soft_body_count;
  const pneuma_soft_body* soft_bodies;
  size_t solid_count;
  const pneuma_solid* solids;
} pneuma_frame;

/* Texts that functions give are freed by this. It takes NULL, as the functions that destroy and close do; for others an
   object that is NULL is an error like any. */
PNEUMA_API void pneuma_text_free(char* text);

/* A world in this program. It has the same bits as a server's of the same scene. */
typedef struct pneuma_world pneuma_world;

/* `scene`: the text of a scene's file (JSON; server/scenes/README.md has the fields), or the name of a built-in scene
   ("five-balls"). `threads`: that step it, the caller's among them, 256 at most; 0 counts as 1. */
PNEUMA_API pneuma_world* pneuma_world_create(const char* scene, uint32_t threads, pneuma_error* error);
PNEUMA_API void pneuma_world_destroy(pneuma_world* world);
/* A tick is 1/60 s of the world's time, unless its scene has another rate. */
PNEUMA_API pneuma_code pneuma_world_step(pneuma_world* world, uint32_t ticks, pneuma_error* error);
/* Where everything is, in single precision, with velocities. NULL where there is no memory for it, or no world. */
PNEUMA_API const pneuma_frame* pneuma_world_frame(pneuma_world* world);
/* Two worlds with the same hash have the same bits. 0 where there is no world. */
PNEUMA_API uint64_t pneuma_world_state_hash(const pneuma_world* world);
/* Any request of the protocol that a paused world takes, as JSON: {"impulse": {"body": "ball", "impulse": {"y": 3}}},
   {"get_stats": {}}, {"edit": {"edit": {"changes": [{"set_gravity": {"y": -1.62}}]}}}. proto/pneuma/v1/session.proto
   lists them. The request's `world` is the scene's name, or left out. The reply is JSON too; `reply` may be NULL. */
PNEUMA_API pneuma_code pneuma_world_request(pneuma_world* world, const char* request, char** reply,
                                            pneuma_error* error);

/* A connection to a server. Where it breaks, every later call gives the same error. Pings of the server are answered
   while a call waits: one that makes no call for half a minute is closed. */
typedef struct pneuma_client pneuma_client;

/* What is 0 or NULL is as if there were no options. */
typedef struct pneuma_connection {
  const char* token;
  int tls;             /* 1: over TLS */
  const char* ca_file; /* PEM; NULL: the system's certificates */
} pneuma_connection;

/* `address`: HOST:PORT. `options` may be NULL. */
PNEUMA_API pneuma_client* pneuma_client_connect(const char* address, const pneuma_connection* options,
                                                pneuma_error* error);
PNEUMA_API void pneuma_client_close(pneuma_client* client);
/* Any request of the protocol but Subscribe, as JSON: {"pause": {"world": "five-balls"}}. It waits for the reply. */
PNEUMA_API pneuma_code pneuma_client_request(pneuma_client* client, const char* request, char** reply,
                                             pneuma_error* error);

/* What is 0 or NULL is as if there were no options. */
typedef struct pneuma_stream {
  double rate_hz;           /* frames a second; 0: the world's rate */
  double max_error_m;       /* no vertex is off by more; 0: a millimetre */
  uint32_t level_of_detail; /* each level has a quarter of the vertices of the one below */
  int velocities;           /* 1: send them */
} pneuma_stream;

/* Lets the server send frames of a world; several worlds may be watched. `options` may be NULL. */
PNEUMA_API pneuma_code pneuma_client_watch(pneuma_client* client, const char* world, const pneuma_stream* options,
                                           pneuma_error* error);
/* The next frame of all that are watched. Waits for `timeout_s` at most, and sets `frame` to NULL where none came. */
PNEUMA_API pneuma_code pneuma_client_next(pneuma_client* client, double timeout_s, const pneuma_frame** frame,
                                          pneuma_error* error);

#ifdef __cplusplus
}
#endif

/* NOLINTEND(readability-identifier-naming) */

#endif
