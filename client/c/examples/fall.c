/* A ball falls on the floor, in this program: its lowest point, four times a second. */
#include <pneuma.h>
#include <stdio.h>

static int tell(const pneuma_error* error) {
  fprintf(stderr, "fall: %s%s%s\n", error->where, error->where[0] ? ": " : "", error->what);
  return 1;
}

int main(void) {
  pneuma_error error;
  pneuma_world* world = pneuma_world_create("bouncing-ball", 1, &error);
  if (!world) return tell(&error);
  /* Everything that the protocol can ask: here, a push to the right of 1 N s. */
  const char* push = "{\"impulse\": {\"body\": \"ball\", \"impulse\": {\"x\": 1}}}";
  if (pneuma_world_request(world, push, NULL, &error) != PNEUMA_OK) return tell(&error);

  for (int quarter = 0; quarter < 8; ++quarter) {
    if (pneuma_world_step(world, 15, &error) != PNEUMA_OK) return tell(&error);
    const pneuma_frame* frame = pneuma_world_frame(world);
    const pneuma_soft_body* ball = &frame->soft_bodies[0];
    float lowest_m = ball->positions_m[1];
    for (size_t i = 0; i < ball->vertex_count; ++i) {
      if (ball->positions_m[3 * i + 1] < lowest_m) lowest_m = ball->positions_m[3 * i + 1];
    }
    printf("%.2f s: the %s is %.3f m up\n", frame->time_s, ball->name, lowest_m);
  }
  pneuma_world_destroy(world);
  return 0;
}
