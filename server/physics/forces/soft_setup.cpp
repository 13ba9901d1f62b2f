#include "physics/forces/soft_setup.h"

#include <type_traits>

#include "physics/forces/gas.h"
#include "physics/forces/volume.h"
#include "physics/state/bounds.h"
#include "physics/state/origin.h"
#include "physics/state/vertex_masses.h"

namespace pneuma::physics {

namespace {

// About the middle of the shape that the body begins in.
Vec3d start_origin_m(const SoftBody& body) {
  const Aabb<double> box = fit_aabb<double>(body.start_shape_m());
  const Vec3d centre_m = body.position + body.orientation * Vec3d(0.5 * (box.min + box.max));
  return origin_near(centre_m, diagonal_m(body.mesh->positions_m));
}

std::vector<std::uint8_t> pinned_vertices(const SoftBody& body) {
  if (body.pins.empty() && !body.pin_boundary) return {};
  std::vector<std::uint8_t> pinned(body.mesh->positions_m.size(), 0);
  for (const std::uint32_t vertex : body.pins) pinned[vertex] = 1;
  if (body.pin_boundary) {
    for (const std::uint32_t vertex : body.mesh->boundary) pinned[vertex] = 1;
  }
  return pinned;
}

template <class Real>
void apply_constants(SoftState<Real>& state, const SoftBody& body) {
  state.body = body;
  state.vertex_mass_kg = static_cast<Real>(body.mass_kg / static_cast<double>(body.mesh->positions_m.size()));
  state.mass_shares = mass_shares(body);
  state.length_m = static_cast<Real>(diagonal_m(body.mesh->positions_m));
  state.hinges = body.springs.bend_stiffness_n_m > 0.0 ? make_hinges(*body.mesh) : std::vector<Hinge>();
  state.pinned = pinned_vertices(body);
  for (std::size_t i = 0; i < state.pinned.size(); ++i) {
    if (state.pinned[i] != 0) state.v[i].setZero();
  }
}

template <class Real>
double rest_volume_m3(const SoftBody& body) {
  std::vector<Vec3<Real>> x;
  x.reserve(body.mesh->positions_m.size());
  for (const Vec3d& position : body.mesh->positions_m) x.push_back(position.cast<Real>());
  return body_volume_m3<Real>(body, x);
}

// The gas as `body` has it, in the volume that the skin has now.
template <class Real>
void set_gas(SoftState<Real>& state, const SoftBody& body) {
  state.volume_m3 = body_volume_m3<Real>(body, state.x);
  state.gas = make_gas_state(*body.gas, state.volume_m3, rest_volume_m3<Real>(body));
}

// Whether from here on the temperature follows the volume from another one, or in another way.
bool goes_another_way(const SoftBody& before, const SoftBody& after) {
  return before.gas->temperature_k != after.gas->temperature_k || before.gas->law != after.gas->law ||
         before.gas->heat_capacity_ratio != after.gas->heat_capacity_ratio || before.volume != after.volume;
}

}  // namespace

template <class Real>
SoftState<Real> make_soft_state(const SoftBody& body) {
  SoftState<Real> state;
  const std::size_t count = body.mesh->positions_m.size();
  state.x.reserve(count);
  state.v.reserve(count);
  if constexpr (std::is_same_v<Real, float>) state.origin_m = start_origin_m(body);
  const Vec3d from_origin = body.position - state.origin_m;
  for (const Vec3d& local : body.start_shape_m()) {
    const Vec3d arm = body.orientation * local;
    state.x.push_back((from_origin + arm).cast<Real>());
    state.v.push_back((body.velocity + body.angular_velocity.cross(arm)).cast<Real>());
  }
  state.dr.assign(count, Vec3<Real>::Zero());
  apply_constants(state, body);
  if (body.mesh->closed) state.volume_m3 = body_volume_m3<Real>(body, state.x);
  if (!body.gas) return state;
  state.gas = body.start_positions_m.empty() ? make_gas_state(*body.gas, state.volume_m3)
                                             : make_gas_state(*body.gas, state.volume_m3, rest_volume_m3<Real>(body));
  return state;
}

bool continues(const SoftBody& before, const SoftBody& after) {
  return same_mesh(*before.mesh, *after.mesh) && before.position == after.position &&
         before.orientation.coeffs() == after.orientation.coeffs() && before.velocity == after.velocity &&
         before.angular_velocity == after.angular_velocity && before.start_positions_m == after.start_positions_m;
}

template <class Real>
void change_soft_state(SoftState<Real>& state, const SoftBody& body) {
  if (!body.gas) {
    lose_gas(state);
  } else if (!state.gas || goes_another_way(live_body(state), body)) {
    set_gas(state, body);
  } else {
    state.gas->moles = body.gas->moles;
  }
  apply_constants(state, body);
}

template <class Real>
SoftBody live_body(const SoftState<Real>& state) {
  SoftBody body = state.body;  // without a gas that it lost
  if (state.gas) {
    body.gas->moles = state.gas->moles;
    body.gas->temperature_k = gas_temperature_k(*state.gas, *state.body.gas, state.volume_m3);
  }
  return body;
}

template SoftState<float> make_soft_state<float>(const SoftBody&);
template SoftState<double> make_soft_state<double>(const SoftBody&);
template void change_soft_state<float>(SoftState<float>&, const SoftBody&);
template void change_soft_state<double>(SoftState<double>&, const SoftBody&);
template SoftBody live_body<float>(const SoftState<float>&);
template SoftBody live_body<double>(const SoftState<double>&);

}  // namespace pneuma::physics
