/* watch HOST:PORT WORLD: ten frames of a world of a server. */
#include <pneuma.h>
#include <stdio.h>

static int tell(const pneuma_error* error) {
  fprintf(stderr, "watch: %s%s%s\n", error->where, error->where[0] ? ": " : "", error->what);
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: watch HOST:PORT WORLD\n");
    return 2;
  }
  pneuma_error error;
  pneuma_client* client = pneuma_client_connect(argv[1], NULL, &error);
  if (!client) return tell(&error);
  const pneuma_stream stream = {.rate_hz = 30, .max_error_m = 1e-3};
  if (pneuma_client_watch(client, argv[2], &stream, &error) != PNEUMA_OK) return tell(&error);
  for (int shown = 0; shown < 10;) {
    const pneuma_frame* frame;
    if (pneuma_client_next(client, 5, &frame, &error) != PNEUMA_OK) return tell(&error);
    if (!frame) {
      fprintf(stderr, "watch: no frame in 5 s; is the world paused?\n");
      return 1;
    }
    ++shown;
    printf("tick %llu, %.2f s:", (unsigned long long)frame->tick, frame->time_s);
    for (size_t i = 0; i < frame->soft_body_count; ++i) {
      const pneuma_soft_body* body = &frame->soft_bodies[i];
      float height_m = 0;
      for (size_t k = 0; k < body->vertex_count; ++k) height_m += body->positions_m[3 * k + 1];
      printf(" %s %.3f m", body->name, height_m / (float)body->vertex_count);
    }
    printf("\n");
  }
  pneuma_client_close(client);
  return 0;
}
