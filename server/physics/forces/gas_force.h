// The pressure of the gas inside.
#pragma once

#include "physics/forces/force_term.h"
#include "physics/forces/gas.h"

namespace pneuma::physics {

/// Adds the pressure force alone: P A n of each face shared to its three particles, or the paper's spread by vertex
/// normals. Of `body` only its scratch changes; a second call allocates nothing.
template <class Real>
void add_pressure(SoftState<Real>& body, double pressure_pa, std::span<const Vec3<Real>> x,
                  std::span<Vec3<Real>> force);

struct GasForce {
  static constexpr Stage stage = Stage::pressure;
  template <class Real>
  [[nodiscard]] static bool is_present(const SoftState<Real>& body, const Surroundings&) {
    return body.gas.has_value();
  }
  /// Whether the kernels measure the body's volume and spread its pressure: exactly, and by faces.
  template <class Real>
  [[nodiscard]] static bool is_in_rings(const SoftState<Real>& body, const Rings& rings) {
    return body.body.volume.method == VolumeMethod::exact && body.body.pressure_spread == PressureSpread::faces &&
           rings.encloses;
  }
  template <class Real>
  [[nodiscard]] static std::size_t bytes(const SoftState<Real>&) {
    return 0;
  }

  /// Sets the body's volume and pressure to what they are at x.
  template <class Real>
  static void add(SoftState<Real>& body, const ForcePlace<Real>& at, std::span<Vec3<Real>> force);

  template <class Real>
  [[nodiscard]] static double potential_j(const SoftState<Real>& body, const EnergyPlace& at,
                                          const Surroundings& surroundings);
  static constexpr double BodyMeasures::* measure = &BodyMeasures::gas_j;

  /// -P grad^2 V.
  template <class Real>
  static void linearise(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents);
  /// At the body's volume.
  template <class Real>
  [[nodiscard]] static double volume_stiffness_pa_m3(const SoftState<Real>& body) {
    return body.gas ? gas_stiffness_pa_m3(*body.gas, *body.body.gas, body.volume_m3) : 0.0;
  }
  static constexpr None stiffen{"what goes along the volume's gradient is added by Sherman, Morrison and Woodbury"};

  static constexpr None add_to_skin{"a gas is the body's, and skins are kept from body to body"};
  [[nodiscard]] static double rest_volume_stiffness_pa_m3(const SoftBody& body, double volume_m3) {
    return body.gas ? gas_stiffness_pa_m3(make_gas_state(*body.gas, volume_m3), *body.gas, volume_m3) : 0.0;
  }
  static constexpr None drag_at_rest_n_s_m{"it damps nothing"};

  /// One constraint, whose multiplier meets P(V) exactly at the volume that it makes.
  template <class Real>
  struct Xpbd : XpbdNoPush, XpbdNoConstraints, XpbdNoDamping {
    std::vector<Vec3<Real>> position;
    std::vector<Vec3<Real>> gradient;  // of the volume

    void pass_between(const XpbdPlace<Real>& place);
    [[nodiscard]] std::size_t bytes() const { return (position.capacity() + gradient.capacity()) * sizeof(Vec3<Real>); }
  };

  template <class Real>
  [[nodiscard]] static bool drives(const SoftState<Real>&, const Surroundings&) {
    return false;
  }
  /// A pump or a leak does.
  template <class Real>
  [[nodiscard]] static bool keeps_awake(const SoftState<Real>& body, const Surroundings&) {
    return body.gas && flows(*body.body.gas);
  }
  /// Readers know a gas that stays, its exact volume and the spread by faces.
  template <class Real>
  [[nodiscard]] static bool is_predictable(const SoftState<Real>& body, const Surroundings&) {
    return !body.gas || (!flows(*body.body.gas) && body.body.volume.method == VolumeMethod::exact &&
                         body.body.pressure_spread == PressureSpread::faces);
  }
};

}  // namespace pneuma::physics
