#include "numerics/report/precision_peers.h"

#include <cmath>

#include "bench/peers.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::report::precision {

namespace {

constexpr int frames = 600;
constexpr int rest_frames = 30;

bench::BulletBall bullet_ball(const RestingBall& ball, int iterations) {
  const bench::BallCase in_void{.nrt_j = ball.nrt_j, .gravity_m_s2 = 0.0, .dt_s = 1.0 / rate_hz};
  return {**physics::make_icosphere(2, 1.0), in_void, {.iterations = iterations, .link_stiffness = 1.0}};
}

}  // namespace

std::vector<Peer> bullet_peers(const RestingBall& ball, double rest_m3) {
  std::vector<Peer> peers;
  for (const int iterations : {1, 2, 5, 10, 20, 50}) {
    bench::BulletBall bullet = bullet_ball(ball, iterations);
    double sum_m3 = 0.0;
    for (int frame = 0; frame < frames; ++frame) {
      bullet.step();
      if (frame >= frames - rest_frames) sum_m3 += bullet.volume_m3();
    }
    peers.push_back({.iterations = iterations, .volume_error = std::abs(sum_m3 / rest_frames / rest_m3 - 1.0)});
  }
  return peers;
}

std::vector<Timed> timed_peers(const RestingBall& ball, std::vector<Peer>& peers) {
  std::vector<Timed> timed;
  for (Peer& peer : peers) {
    const auto race = [&ball, iterations = peer.iterations] {
      bench::BulletBall bullet = bullet_ball(ball, iterations);
      for (int frame = 0; frame < frames; ++frame) bullet.step();
    };
    timed.push_back({race, frames / rate_hz, &peer.cpu_ms_per_s});
  }
  return timed;
}

}  // namespace pneuma::report::precision
