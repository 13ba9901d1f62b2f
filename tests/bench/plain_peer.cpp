#include <cmath>

#include "bench/peers.h"

namespace pneuma::bench {

PlainBall::PlainBall(const physics::Mesh& mesh, const BallCase& ball)
    : ball_(ball), edges_(mesh.edges), faces_(mesh.faces), force_(mesh.positions_m.size()) {
  for (const double length_m : mesh.edge_lengths_m) rest_lengths_m_.push_back(static_cast<float>(length_m));
  for (const auto& position : mesh.positions_m) {
    x_.push_back(
        {static_cast<float>(position.x()), static_cast<float>(position.y()), static_cast<float>(position.z())});
    v_.push_back({0.0F, 0.0F, 0.0F});
  }
}

void PlainBall::step() {
  const auto stiffness = static_cast<float>(ball_.stiffness_n_m);
  const auto damping = static_cast<float>(ball_.damping_n_s_m);
  const float mass = static_cast<float>(ball_.mass_kg) / static_cast<float>(x_.size());
  const float weight = mass * static_cast<float>(ball_.gravity_m_s2);
  for (Point& force : force_) force = {0.0F, weight, 0.0F};
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const auto [a, b] = edges_[e];
    const float dx = x_[b].x - x_[a].x;
    const float dy = x_[b].y - x_[a].y;
    const float dz = x_[b].z - x_[a].z;
    const float length = std::sqrt(dx * dx + dy * dy + dz * dz);
    if (length == 0.0F) continue;
    const float rate = ((v_[b].x - v_[a].x) * dx + (v_[b].y - v_[a].y) * dy + (v_[b].z - v_[a].z) * dz) / length;
    const float pull = (stiffness * (length - rest_lengths_m_[e]) + damping * rate) / length;
    force_[a].x += pull * dx;
    force_[a].y += pull * dy;
    force_[a].z += pull * dz;
    force_[b].x -= pull * dx;
    force_[b].y -= pull * dy;
    force_[b].z -= pull * dz;
  }
  float six_volumes = 0.0F;
  for (const auto& [a, b, c] : faces_) {
    six_volumes += x_[a].x * (x_[b].y * x_[c].z - x_[b].z * x_[c].y) +
                   x_[a].y * (x_[b].z * x_[c].x - x_[b].x * x_[c].z) +
                   x_[a].z * (x_[b].x * x_[c].y - x_[b].y * x_[c].x);
  }
  volume_m3_ = static_cast<double>(six_volumes) / 6.0;
  const auto share = static_cast<float>(ball_.nrt_j / volume_m3_ / 6.0);
  for (const auto& [a, b, c] : faces_) {
    const Point u{x_[b].x - x_[a].x, x_[b].y - x_[a].y, x_[b].z - x_[a].z};
    const Point w{x_[c].x - x_[a].x, x_[c].y - x_[a].y, x_[c].z - x_[a].z};
    const Point push{share * (u.y * w.z - u.z * w.y), share * (u.z * w.x - u.x * w.z), share * (u.x * w.y - u.y * w.x)};
    for (const std::uint32_t vertex : {a, b, c}) {
      force_[vertex].x += push.x;
      force_[vertex].y += push.y;
      force_[vertex].z += push.z;
    }
  }
  const auto h = static_cast<float>(ball_.dt_s);
  for (std::size_t i = 0; i < x_.size(); ++i) {
    v_[i].x += h * force_[i].x / mass;
    v_[i].y += h * force_[i].y / mass;
    v_[i].z += h * force_[i].z / mass;
    x_[i].x += h * v_[i].x;
    x_[i].y += h * v_[i].y;
    x_[i].z += h * v_[i].z;
  }
}

}  // namespace pneuma::bench
