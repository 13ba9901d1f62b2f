#include "physics/contact/resting_start.h"

#include <algorithm>
#include <cmath>

#include "physics/contact/joint.h"
#include "physics/implicit/implicit_euler.h"

namespace pneuma::physics {
namespace {

// Of the mean edge. A body rests on another where the two begin the step nearer than this, and neither close nor part
// by more in it.
constexpr double resting_share = 0.05;
// Of the mean edge: a free step that bends a resting body by more is not where the passes begin. Without its load a
// skin springs back within the step. Passes that began there did not come back: a ball of 1e6 N/m under 1,000 kg stood
// 7 cm too high, and never came to rest.
constexpr double sprung_back_share = 0.1;

Vec3d start_velocity_m_s(const CoupledPasses& passes, const Support& side) {
  const std::size_t soft_count = passes.bodies.size();
  if (side.body < soft_count) return mean_of(side, passes.bodies[side.body].u0);
  if (side.body - soft_count >= passes.solids.size()) return Vec3d::Zero();  // the world
  const SolidPlace& solid = passes.solids[side.body - soft_count];
  return solid.velocity + solid.angular_velocity.cross(side.arm);
}

}  // namespace

// Not those that bounce off all that they touch: their velocities lead away from it.
void list_resting(const CoupledPasses& passes, double dt_s, std::vector<std::uint8_t>& rests) {
  rests.assign(passes.bodies.size(), 0);
  for (const ContactRow& row : passes.rows) {
    if (joint_of(row)) continue;
    const Vec3d relative_m_s = start_velocity_m_s(passes, row.first) - start_velocity_m_s(passes, row.second);
    const double parts_m = dt_s * std::abs(relative_m_s.dot(row.normal));
    for (const Support* side : {&row.first, &row.second}) {
      if (side->body >= passes.bodies.size()) continue;
      const double enough_m = resting_share * passes.surface(side->body).spacing_m;
      if (row.gap_m <= enough_m && parts_m <= enough_m) rests[side->body] = 1;
    }
  }
}

template <class Real>
void choose_start(const SoftState<Real>& state, double spacing_m, double dt_s, CoupledBody& body) {
  const auto count = static_cast<double>(body.u.size());
  Vec3d whole_m_s = Vec3d::Zero();
  for (std::size_t k = 0; k < body.u.size(); ++k) whole_m_s += (body.u[k] - body.u0[k]) / count;
  const double enough_m_s = sprung_back_share * spacing_m / dt_s;
  double most_m2_s2 = 0.0;
  for (std::size_t k = 0; k < body.u.size(); ++k) {
    most_m2_s2 = std::max(most_m2_s2, (body.u[k] - body.u0[k] - whole_m_s).squaredNorm());
  }
  if (most_m2_s2 <= enough_m_s * enough_m_s) return;
  body.u = body.u0;
  if (body.is_free) turn_straight_ways(state, body.x0, dt_s, body.u);
}

template void choose_start<float>(const SoftState<float>&, double, double, CoupledBody&);
template void choose_start<double>(const SoftState<double>&, double, double, CoupledBody&);

}  // namespace pneuma::physics
