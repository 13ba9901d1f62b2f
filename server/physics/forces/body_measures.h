// What is measured of a soft body at one instant.
#pragma once

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// The columns of `pneuma-sim --csv`. Each energy's gradient is the force that the step applies, so that their sum is
/// kept where nothing damps, collides, blows, leaks or is grabbed (for gas: with exact volume and forces spread by
/// faces).
struct BodyMeasures {
  double volume_m3 = 0.0;  // exact, whatever method the body steps by; 0 for an open mesh
  double area_m2 = 0.0;
  double pressure_pa = 0.0;  // of the gas, over the outside; by the volume that the body steps by
  double temperature_k = 0.0;
  double moles = 0.0;
  double kinetic_j = 0.0;
  double elastic_j = 0.0;
  // Free energy, p the outside pressure: -nRT ln(V / V_start) + p (V - V_start) where isothermal,
  // PV / (g - 1) + p (V - V_start) where adiabatic.
  double gas_j = 0.0;
  double gravity_j = 0.0;                  // 0 at the origin's height
  Vec3d momentum = Vec3d::Zero();          // kg m/s
  Vec3d angular_momentum = Vec3d::Zero();  // about the origin, kg m^2/s
  Vec3d centre_of_mass = Vec3d::Zero();
  double max_speed_m_s = 0.0;
};

}  // namespace pneuma::physics
