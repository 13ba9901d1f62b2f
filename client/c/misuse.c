/* Calls that are wrong are told, and crash nothing. Ends with how many were not told. */
#include <stdio.h>
#include <string.h>

#include "pneuma.h"

static int wrong;

static void expect(pneuma_code code, const pneuma_error* error, pneuma_code wanted, const char* where) {
  if (code == wanted && error->code == wanted && strstr(error->where, where) != NULL) return;
  fprintf(stderr, "code %d instead of %d: %s (%s, not %s)\n", code, wanted, error->what, error->where, where);
  ++wrong;
}

static void expect_no_world(const char* scene, uint32_t threads, pneuma_code wanted, const char* where) {
  pneuma_error error = {0};
  pneuma_world* const world = pneuma_world_create(scene, threads, &error);
  expect(world == NULL ? error.code : PNEUMA_OK, &error, wanted, where);
  pneuma_world_destroy(world);
}

int main(void) {
  pneuma_error error;
  const pneuma_frame* frame;
  char* reply;
  expect_no_world(NULL, 1, PNEUMA_INVALID_ARGUMENT, "scene");
  expect_no_world("ball.json", 1, PNEUMA_NOT_FOUND, "scene");
  expect_no_world("{\"bodies\": []}", 1, PNEUMA_INVALID_ARGUMENT, "scene_json.bodies");
  expect_no_world("five-balls", 257, PNEUMA_INVALID_ARGUMENT, "threads");
  expect(pneuma_world_step(NULL, 1, &error), &error, PNEUMA_INVALID_ARGUMENT, "world");
  expect(pneuma_world_request(NULL, "{}", &reply, &error), &error, PNEUMA_INVALID_ARGUMENT, "world");
  expect(pneuma_client_request(NULL, "{}", &reply, &error), &error, PNEUMA_INVALID_ARGUMENT, "client");
  expect(pneuma_client_watch(NULL, "five-balls", NULL, &error), &error, PNEUMA_INVALID_ARGUMENT, "client");
  expect(pneuma_client_next(NULL, 0, &frame, &error), &error, PNEUMA_INVALID_ARGUMENT, "client");
  expect(pneuma_client_next(NULL, 0, NULL, &error), &error, PNEUMA_INVALID_ARGUMENT, "frame");
  wrong += pneuma_world_frame(NULL) != NULL || pneuma_world_state_hash(NULL) != 0;
  pneuma_world_destroy(NULL);
  pneuma_client_close(NULL);
  pneuma_text_free(NULL);
  return wrong;
}
