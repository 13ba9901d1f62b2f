#include "watched_world.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A server that sends faster than we draw must not hold us. At 60 frames a second, this is a second of them. */
enum { FRAMES_A_POLL_MAX = 60 };

static pneuma_code fail(watched_world* world, pneuma_code code, const char* what) {
  world->error.code = code;
  snprintf(world->error.what, sizeof world->error.what, "%s", what);
  world->error.where[0] = '\0';
  return code;
}

static void free_bodies(watched_body* bodies, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    free(bodies[i].name);
    free(bodies[i].positions_m);
    free(bodies[i].faces);
  }
  free(bodies);
}

static void disconnect(watched_world* world) {
  pneuma_client_close(world->client);
  world->client = NULL;
}

void watched_world_close(watched_world* world) {
  if (world->client) disconnect(world);
  free_bodies(world->bodies, world->body_count);
  memset(world, 0, sizeof *world);
}

/* Of nothing, one byte: NULL means that there is no memory. */
static void* copy_of(const void* bytes, size_t count) {
  void* copy = malloc(count ? count : 1);
  if (copy && count) memcpy(copy, bytes, count);
  return copy;
}

static int copy_body(const pneuma_soft_body* from, watched_body* to) {
  to->name = copy_of(from->name, strlen(from->name) + 1);
  to->vertex_count = from->vertex_count;
  to->face_count = from->face_count;
  to->positions_m = copy_of(from->positions_m, 3 * from->vertex_count * sizeof *from->positions_m);
  to->faces = copy_of(from->faces, 3 * from->face_count * sizeof *from->faces);
  return to->name && to->positions_m && to->faces;
}

/* What the library lends ends with the next call, which may bring no frame. */
static pneuma_code keep(watched_world* world, const pneuma_frame* frame) {
  watched_body* bodies = calloc(frame->soft_body_count + 1, sizeof *bodies);
  int is_kept = bodies != NULL;
  for (size_t i = 0; is_kept && i < frame->soft_body_count; ++i) {
    is_kept = copy_body(&frame->soft_bodies[i], &bodies[i]);
  }
  if (!is_kept) {
    free_bodies(bodies, bodies ? frame->soft_body_count : 0);
    return fail(world, PNEUMA_LIMIT_EXCEEDED, "no memory for a frame");
  }
  free_bodies(world->bodies, world->body_count);
  world->bodies = bodies;
  world->body_count = frame->soft_body_count;
  world->tick = frame->tick;
  world->time_s = frame->time_s;
  world->has_frame = 1;
  return PNEUMA_OK;
}

pneuma_code watched_world_open(watched_world* world, const char* address, const char* name, const char* token) {
  watched_world_close(world);
  const pneuma_connection options = {.token = token};
  world->client = pneuma_client_connect(address, &options, &world->error);
  if (!world->client) return world->error.code;
  const pneuma_code code = pneuma_client_watch(world->client, name, NULL, &world->error);
  if (code != PNEUMA_OK) disconnect(world);
  return code;
}

pneuma_code watched_world_poll(watched_world* world) {
  if (!world->client) {
    return world->error.code ? world->error.code : fail(world, PNEUMA_FAILED_PRECONDITION, "no world is open");
  }
  for (int taken = 0; taken < FRAMES_A_POLL_MAX; ++taken) {
    const pneuma_frame* frame;
    pneuma_code code = pneuma_client_next(world->client, 0, &frame, &world->error);
    if (code == PNEUMA_OK && !frame) break;
    if (code == PNEUMA_OK) code = keep(world, frame);
    if (code != PNEUMA_OK) {
      disconnect(world);
      return code;
    }
  }
  return PNEUMA_OK;
}

const watched_body* watched_world_body(const watched_world* world, const char* name) {
  for (size_t i = 0; i < world->body_count; ++i) {
    if (strcmp(world->bodies[i].name, name) == 0) return &world->bodies[i];
  }
  return NULL;
}

/* The cross product of two edges is twice the area long: summed, it weighs by area. */
static void add_face_normal(const float* a, const float* b, const float* c, float* normals[3]) {
  float u[3], v[3];
  for (int k = 0; k < 3; ++k) {
    u[k] = b[k] - a[k];
    v[k] = c[k] - a[k];
  }
  const float normal[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  for (int corner = 0; corner < 3; ++corner) {
    for (int k = 0; k < 3; ++k) normals[corner][k] += normal[k];
  }
}

void watched_body_normals(const watched_body* body, float* normals) {
  for (size_t i = 0; i < 3 * body->vertex_count; ++i) normals[i] = 0;
  for (size_t i = 0; i < body->face_count; ++i) {
    const uint32_t* face = &body->faces[3 * i];
    const float* positions_m = body->positions_m;
    float* of_corners[3] = {&normals[3 * face[0]], &normals[3 * face[1]], &normals[3 * face[2]]};
    add_face_normal(&positions_m[3 * face[0]], &positions_m[3 * face[1]], &positions_m[3 * face[2]], of_corners);
  }
  for (size_t i = 0; i < body->vertex_count; ++i) {
    float* normal = &normals[3 * i];
    const float length = sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (int k = 0; length > 0 && k < 3; ++k) normal[k] /= length;
  }
}
