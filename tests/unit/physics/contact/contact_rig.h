// A world of particles and solids under gravity alone, so that contact is all that can go wrong in it.
#pragma once

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "physics/contact/contact.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {

inline const Vec3d earth_gravity(0.0, -9.81, 0.0);
inline constexpr double rig_dt_s = 1.0 / 480.0;

template <class Real>
SoftState<Real> make_particles(std::shared_ptr<const Mesh> mesh, const Vec3d& position, const Vec3d& velocity,
                               const Surface& surface = {}, double mass_kg = 1.0) {
  SoftState<Real> state;
  state.body.name = "particles";
  state.body.mesh = mesh;
  state.body.mass_kg = mass_kg;
  state.body.surface = surface;
  state.body.collision.soft = SoftCollision::bounds;
  state.vertex_mass_kg = static_cast<Real>(mass_kg / static_cast<double>(mesh->positions_m.size()));
  state.length_m = static_cast<Real>(diagonal_m(mesh->positions_m));
  for (const Vec3d& p : mesh->positions_m) state.x.push_back((p + position).template cast<Real>());
  state.v.assign(state.x.size(), velocity.cast<Real>());
  state.dr.assign(state.x.size(), Vec3<Real>::Zero());
  return state;
}

inline Surface surface(double restitution, double friction, double thickness_m = 0.0) {
  return {.restitution = restitution, .friction = friction, .thickness_m = thickness_m};
}

/// A triangle small enough that its three particles are as good as one.
inline std::shared_ptr<const Mesh> speck() {
  return *make_mesh({Vec3d(0, 0, 0), Vec3d(0, 0, 1e-3), Vec3d(1e-3, 0, 0)}, {Face{0, 1, 2}});
}

inline ColliderState make_collider(Shape shape, const Vec3d& position = Vec3d::Zero(), const Surface& surface = {}) {
  Collider collider;
  collider.name = "collider";
  collider.shape = std::move(shape);
  collider.position = position;
  collider.surface = surface;
  const auto* mesh = std::get_if<MeshShape>(&collider.shape);
  return {collider, collider.position, collider.orientation, mesh != nullptr ? make_mesh_tree(mesh->mesh) : nullptr};
}

inline RigidState make_rigid(const Shape& shape, double mass_kg, const Vec3d& position,
                             const Vec3d& velocity = Vec3d::Zero(), const Surface& surface = {}) {
  RigidState state;
  state.body.name = "rigid";
  state.body.shape = shape;
  state.body.mass_kg = mass_kg;
  state.body.surface = surface;
  state.position = position;
  state.velocity = velocity;
  state.inverse_mass_1_kg = 1.0 / mass_kg;
  state.inverse_inertia_1_kg_m2 = principal_inertia_kg_m2(shape, mass_kg).cwiseInverse();
  state.principal_axes = principal_axes(shape);
  return state;
}

template <class Real>
struct Rig {
  std::vector<SoftState<Real>> soft;
  std::vector<RigidState> rigid;
  std::vector<ColliderState> colliders;
  Vec3d gravity_m_s2 = Vec3d::Zero();
  double dt_s = rig_dt_s;
  Contacts<Real> contacts;
  Profile profile{};

  void step(Workers& workers) {
    for (SoftState<Real>& body : soft) {
      for (std::size_t i = 0; i < body.x.size(); ++i) {
        if (body.is_pinned(i) || body.frozen) continue;
        const Vec3d before = body.v[i].template cast<double>();
        body.v[i] = (before + dt_s * gravity_m_s2).template cast<Real>();
        body.dr[i] = (dt_s * before + 0.5 * dt_s * dt_s * gravity_m_s2).template cast<Real>();
      }
    }
    accelerate_rigid_bodies(rigid, gravity_m_s2, dt_s);
    const SubstepContext substep{
        .surroundings = {gravity_m_s2, {}}, .dt_s = dt_s, .workers = &workers, .profile = &profile};
    contacts.resolve({.substep = substep, .soft = soft, .rigid = rigid, .colliders = colliders});
    for (SoftState<Real>& body : soft) {
      for (std::size_t i = 0; i < body.x.size(); ++i) body.x[i] += body.dr[i];
    }
    move_solids(rigid, colliders, dt_s);
  }
  void step() {
    Workers alone(1);
    step(alone);
  }
  void run(double seconds) {
    Workers alone(1);
    const auto steps = static_cast<int>(std::lround(seconds / dt_s));
    for (int i = 0; i < steps; ++i) step(alone);
  }

  [[nodiscard]] Vec3d momentum() const {
    Vec3d sum = Vec3d::Zero();
    for (const SoftState<Real>& body : soft) {
      for (std::size_t i = 0; i < body.v.size(); ++i) sum += body.mass_kg(i) * body.v[i].template cast<double>();
    }
    for (const RigidState& body : rigid) sum += body.velocity / body.inverse_mass_1_kg;
    return sum;
  }
  /// Of the soft bodies.
  [[nodiscard]] double kinetic_j() const {
    double sum = 0.0;
    for (const SoftState<Real>& body : soft) {
      for (std::size_t i = 0; i < body.v.size(); ++i) {
        sum += 0.5 * body.mass_kg(i) * body.v[i].template cast<double>().squaredNorm();
      }
    }
    return sum;
  }
  /// Mass times place, summed: its change is what moved the centre of mass.
  [[nodiscard]] Vec3d first_moment() const {
    Vec3d sum = Vec3d::Zero();
    for (const SoftState<Real>& body : soft) {
      for (std::size_t i = 0; i < body.x.size(); ++i) sum += body.mass_kg(i) * body.x[i].template cast<double>();
    }
    return sum;
  }
};

}  // namespace pneuma::physics
