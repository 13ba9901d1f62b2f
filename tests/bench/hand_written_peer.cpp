#include <algorithm>
#include <string>

#include "bench/peers.h"
#include "physics/forces/soft_setup.h"
#include "physics/lanes/isa.h"

namespace pneuma::bench {

physics::SoftBody soft_ball(std::shared_ptr<const physics::Mesh> mesh, const BallCase& ball, std::size_t index) {
  physics::SoftBody body;
  body.name = std::string("ball-").append(std::to_string(index));
  body.mesh = std::move(mesh);
  body.position = {3.0 * static_cast<double>(index), 0.0, 0.0};
  body.mass_kg = ball.mass_kg;
  body.springs = {.stiffness_n_m = ball.stiffness_n_m,
                  .damping_n_s_m = ball.damping_n_s_m,
                  .bend_stiffness_n_m = ball.bend_stiffness_n_m};
  if (ball.nrt_j > 0.0) body.gas = physics::Gas{.moles = ball.nrt_j / (physics::gas_constant_j_mol_k * 293.15)};
  body.collision.soft = physics::SoftCollision::none;
  return body;
}

physics::Scene ball_scene(const std::shared_ptr<const physics::Mesh>& mesh, const BallCase& ball, std::size_t count,
                          std::uint32_t substeps) {
  physics::Scene scene;
  scene.gravity = {0.0, ball.gravity_m_s2, 0.0};
  scene.stepping = {.rate_hz = 1.0 / (substeps * ball.dt_s),
                    .substeps = substeps,
                    .integrator = physics::Integrator::symplectic_euler,
                    .precision = physics::Precision::single_precision,
                    .sleep = false};
  for (std::size_t i = 0; i < count; ++i) scene.soft_bodies.push_back(soft_ball(mesh, ball, i));
  return scene;
}

HandWrittenBall::HandWrittenBall(const physics::Mesh& mesh, const BallCase& ball)
    : gas_(ball.nrt_j > 0.0),
      damped_(ball.damping_n_s_m > 0.0),
      bend_stiffness_n_m_(ball.bend_stiffness_n_m),
      kernels_(physics::lane_kernels<float>(physics::isa_in_use())) {
  const physics::SoftState<float> state =
      physics::make_soft_state<float>(soft_ball(std::make_shared<physics::Mesh>(mesh), ball, 0));
  nrt_j_ = gas_ ? state.gas->moles * physics::gas_constant_j_mol_k * state.gas->temperature_ref_k : 0.0;
  hinges_ = state.hinges;
  bent_m_ = state.x;
  bending_n_.resize(state.x.size());
  mesh_.rings = physics::make_rings(mesh);
  mesh_.lengths_m = physics::ring_lengths_m<float>(mesh, mesh_.rings, kernels_.slot_of_place);
  const physics::Rings& rings = mesh_.rings;
  for (physics::LaneArray<float>* array : {&x_, &v_, &force_, &gradient_}) array->assign(4 * rings.slot_count(), 0.0F);
  for (std::size_t slot = 0; slot < rings.slot_count(); ++slot) {
    for (std::size_t c = 0; c < 3; ++c) {
      x_[4 * slot + c] = state.x[rings.vertices[slot]][static_cast<Eigen::Index>(c)];
    }
  }
  ring_.packs = rings.packs.data();
  ring_.end = rings.packs.size();
  ring_.neighbours = rings.neighbours.data();
  ring_.lengths_m = mesh_.lengths_m.data();
  ring_.x = update_.x = x_.data();
  ring_.v = update_.v = v_.data();
  ring_.force = force_.data();
  ring_.gradient = gradient_.data();
  ring_.volumes_18_m3 = &volumes_18_m3_;
  update_.force = force_.data();
  update_.gradient = gradient_.data();
  update_.end = rings.slot_count();
  update_.dt_s = static_cast<float>(ball.dt_s);
  update_.gravity_m_s2[1] = static_cast<float>(ball.gravity_m_s2);
  std::ranges::fill(ring_.stiffness_n_m.lanes, static_cast<float>(ball.stiffness_n_m));
  std::ranges::fill(ring_.rest_scale.lanes, 1.0F);
  std::ranges::fill(ring_.damping_n_s_m.lanes, static_cast<float>(ball.damping_n_s_m));
  std::ranges::fill(update_.inverse_mass_1_kg.lanes, 1.0F / state.vertex_mass_kg);
}

void HandWrittenBall::add_bending() {
  const std::vector<std::uint32_t>& slots = mesh_.rings.slots;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    bent_m_[i] = Eigen::Vector3f::Map(&x_[4 * slots[i]]);
    bending_n_[i].setZero();
  }
  physics::add_bending<float>(hinges_, bend_stiffness_n_m_, bent_m_, bending_n_);
  for (std::size_t i = 0; i < slots.size(); ++i) Eigen::Vector3f::Map(&force_[4 * slots[i]]) += bending_n_[i];
}

void HandWrittenBall::step(std::uint32_t substeps) {
  for (std::uint32_t i = 0; i < substeps; ++i) {
    kernels_(physics::LaneLayout::alone, false, damped_, gas_, ring_);
    if (!hinges_.empty()) add_bending();
    if (gas_) {
      const double volume_m3 = static_cast<double>(volumes_18_m3_.lanes[0]) / 18.0;
      const auto pressure_sixth_pa = static_cast<float>(nrt_j_ / volume_m3 / 6.0);
      for (float& lane : update_.pressure_sixth_pa.lanes) lane = pressure_sixth_pa;
    }
    kernels_(physics::LaneLayout::alone, physics::Substage::symplectic, gas_, true, update_);
  }
}

bool HandWrittenBall::is_where(const physics::World& world) const {
  std::vector<double> positions(3 * mesh_.rings.slots.size());
  world.copy_positions(0, positions);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (positions[i] != static_cast<double>(x_[4 * mesh_.rings.slots[i / 3] + i % 3])) return false;
  }
  return true;
}

}  // namespace pneuma::bench
