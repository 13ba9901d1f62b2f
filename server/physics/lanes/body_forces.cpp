#include "physics/lanes/body_forces.h"

#include <algorithm>

#include "physics/forces/gas.h"

namespace pneuma::physics {

namespace {

// x, y, z, 0 a slot.
template <class Real>
void to_lanes(const Rings& rings, std::span<const Vec3d> points, const Vec3d& origin, LaneArray<Real>& lanes) {
  lanes.resize(4 * rings.slot_count());
  Real* to = lanes.data();
  for (const std::uint32_t vertex : rings.vertices) {
    const Vec3d point = points[vertex] - origin;
    *to++ = static_cast<Real>(point.x());
    *to++ = static_cast<Real>(point.y());
    *to++ = static_cast<Real>(point.z());
    *to++ = 0;
  }
}

template <class Real>
Vec3d from_lanes(const LaneArray<Real>& lanes, std::size_t slot) {
  const Real* from = lanes.data() + 4 * slot;
  return {static_cast<double>(from[0]), static_cast<double>(from[1]), static_cast<double>(from[2])};
}

template <class Real>
void to_points(std::span<const Vec3d> from, const Vec3d& origin, std::vector<Vec3<Real>>& points) {
  points.resize(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) points[i] = (from[i] - origin).template cast<Real>();
}

}  // namespace

template <class Real>
void BodyForces<Real>::evaluate(SoftState<Real>& body, const LaneTables<Real>& lanes, const SubstepContext& context,
                                std::span<const Vec3d> x, std::span<const Vec3d> v) {
  const Surroundings& surroundings = context.surroundings;
  const Rings& rings = lanes.mesh->rings;
  const bool gas = has_lane_gas(body, rings);
  const bool sprung = gas || SpringForce::is_present(body, surroundings);
  // Seen from the body itself, so that one far from its origin loses no digits: a grab alone asks for the place itself.
  const Vec3d origin = body.grabs.empty() ? x[0] : Vec3d(Vec3d::Zero());
  if (sprung) {
    const StageTimer timer(context.profile, Stage::springs);
    pass_over_rings(body, lanes, gas, x, v, origin);
  }
  if (gas) {
    const StageTimer timer(context.profile, Stage::pressure);
    update_pressure(body, surroundings.atmosphere.pressure_pa);
  }
  {
    const StageTimer timer(context.profile, Stage::integrate);
    const double sixth_pa = body.pressure_pa / 6.0;
    const Vec3d weight = static_cast<double>(body.vertex_mass_kg) * surroundings.gravity;
    force_.assign(x.size(), weight);
    for (std::size_t i = 0; i < body.mass_shares.size(); ++i) force_[i] *= body.mass_shares[i];
    volume_gradient_.resize(gas ? x.size() : 0);
    for (std::size_t i = 0; sprung && i < x.size(); ++i) {
      force_[i] += from_lanes(lane_force_, rings.slots[i]);
      if (!gas) continue;
      const Vec3d six_gradient = from_lanes(lane_gradient_, rings.slots[i]);
      force_[i] += sixth_pa * six_gradient;
      volume_gradient_[i] = six_gradient / 6.0;
    }
  }
  if (has_other_forces(body, rings, surroundings)) {
    to_points<Real>(x, origin, other_x_);
    to_points<Real>(v, Vec3d::Zero(), other_v_);
    other_force_.assign(x.size(), Vec3<Real>::Zero());
    add_other_forces<Real>(body,
                           {.x = other_x_, .v = other_v_, .surroundings = surroundings, .profile = context.profile},
                           &rings, other_force_);
    for (std::size_t i = 0; i < x.size(); ++i) force_[i] += other_force_[i].template cast<double>();
    if (body.gas && !gas) find_volume_gradient(*body.body.mesh, x);
  }
  for (std::size_t i = 0; i < body.pinned.size(); ++i) {
    if (body.pinned[i] == 0) continue;
    force_[i].setZero();
    if (body.gas) volume_gradient_[i].setZero();
  }
}

// Springs to lane_force_; with gas, 6 grad V to lane_gradient_ and the volume to the body.
template <class Real>
void BodyForces<Real>::pass_over_rings(SoftState<Real>& body, const LaneTables<Real>& lanes, bool gas,
                                       std::span<const Vec3d> x, std::span<const Vec3d> v, const Vec3d& origin) {
  const Rings& rings = lanes.mesh->rings;
  const Springs& springs = body.body.springs;
  const bool scaled = !lanes.mesh->stiffness_scales.empty();
  const bool damped = springs.damping_n_s_m > 0.0;
  to_lanes(rings, x, origin, lane_x_);
  if (damped) to_lanes(rings, v, Vec3d::Zero(), lane_v_);
  lane_force_.resize(lane_x_.size());
  if (gas) lane_gradient_.resize(lane_x_.size());
  RingPass<Real> pass;
  pass.packs = rings.packs.data();
  pass.neighbours = rings.neighbours.data();
  pass.lengths_m = lanes.mesh->lengths_m.data();
  pass.stiffness_scales = lanes.mesh->stiffness_scales.data();
  pass.x = lane_x_.data();
  pass.v = lane_v_.data();
  pass.force = lane_force_.data();
  pass.gradient = lane_gradient_.data();
  std::ranges::fill(pass.stiffness_n_m.lanes, static_cast<Real>(springs.stiffness_n_m));
  std::ranges::fill(pass.rest_scale.lanes, static_cast<Real>(springs.rest_scale));
  std::ranges::fill(pass.damping_n_s_m.lanes, static_cast<Real>(springs.damping_n_s_m));
  PerLane<Real> volumes_18_m3;
  pass.volumes_18_m3 = &volumes_18_m3;
  double volume_18_m3 = 0.0;
  for (pass.begin = 0; pass.begin < rings.packs.size(); pass.begin = pass.end) {
    pass.end = std::min(pass.begin + block_packs, rings.packs.size());
    (*lanes.kernels)(LaneLayout::alone, scaled, damped, gas, pass);
    volume_18_m3 += static_cast<double>(volumes_18_m3.lanes[0]);
  }
  if (gas) body.volume_m3 = volume_18_m3 / 18.0;
}

template <class Real>
void BodyForces<Real>::find_volume_gradient(const Mesh& mesh, std::span<const Vec3d> x) {
  volume_gradient_.assign(x.size(), Vec3d::Zero());
  for (const auto& [a, b, c] : mesh.faces) {
    const Vec3d share = (x[b] - x[a]).cross(x[c] - x[a]) / 6.0;
    volume_gradient_[a] += share;
    volume_gradient_[b] += share;
    volume_gradient_[c] += share;
  }
}

template <class Real>
std::size_t BodyForces<Real>::bytes() const {
  const std::size_t numbers = lane_x_.capacity() + lane_v_.capacity() + lane_force_.capacity() +
                              lane_gradient_.capacity() +
                              3 * (other_x_.capacity() + other_v_.capacity() + other_force_.capacity());
  return numbers * sizeof(Real) + (force_.capacity() + volume_gradient_.capacity()) * sizeof(Vec3d);
}

template class BodyForces<float>;
template class BodyForces<double>;

}  // namespace pneuma::physics
