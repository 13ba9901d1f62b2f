// How fast the bodies of a scene move at rest, from their stiffness.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// The fastest and the breathing motion of a body at rest.
struct Frequencies {
  double fastest_rad_s = 0.0;        // square root of the largest eigenvalue of M^-1 K: springs, bending, gas
  double fastest_decay_1_s = 0.0;    // largest eigenvalue of M^-1 D: the decay of motion by spring damping and wind
  double decay_lacking_1_s = 0.0;    // of that, what the fastest motion may lack where springs differ in stiffness
  double stretched_rad_s = 0.0;      // of the springs alone, in no shape more: as stiff across as along
  double gas_rad_s = 0.0;            // of the gas alone, along gradV
  double gas_give_m4_kg = 0.0;       // gas_rad_s^2 over the gas's stiffness -dP/dV
  double bending_rad_s = 0.0;        // of bending alone, which nothing damps
  double breathing_rad_s = 0.0;      // Rayleigh quotient of uniform scaling, or of the softest part's alone
  double breathing_decay_1_s = 0.0;  // of that, by spring damping alone
  bool operator==(const Frequencies&) const = default;
};

/// By power iteration on the springs linearised at the start, with what pulls them there, and on bending; the gas's
/// rank-one term (g P / V) gradV gradV^T is added by a bound from above. Drag counts as it is in a wind of the
/// atmosphere's own speed.
[[nodiscard]] Frequencies estimate_frequencies(const SoftBody& body, const Atmosphere& atmosphere);

/// What the frequencies of a skin follow from, whatever its mass and gas: of its stiffness K (springs and bending) and
/// of gradV, and of uniform scaling as a displacement: where springs differ, of the softest part, if that is slower.
/// All in coordinates in which every vertex has the mean mass: x_i sqrt(m_i / mean).
struct SkinModes {
  double volume_m3 = 0.0;
  double fastest_n_m = 0.0;     // largest eigenvalue of K
  double stretched_n_m = 0.0;   // likewise of springs that are as stiff across as along
  double damping_n_s_m = 0.0;   // largest eigenvalue of D
  double lacking_n_s_m = 0.0;   // of that, what may not be along K's
  double bending_n_m = 0.0;     // largest eigenvalue of bending alone
  double gradient_m4 = 0.0;     // gradV . gradV
  double gradient_n_m3 = 0.0;   // gradV . K gradV
  double gradient_n2_m2 = 0.0;  // |K gradV|^2
  double scaling_m2 = 0.0;      // of scaling s: s . s
  double scaling_j = 0.0;       // s . K s
  double scaling_j_s = 0.0;     // s . D s
  double scaling_m3 = 0.0;      // s . gradV
};

/// The modes of a world's skins, kept from edit to edit: they are found once for bodies of one mesh, equal springs and
/// equal shares of the mass, and again only where these change. Gas, mass and wind are added for each body.
class FrequencyTable {
 public:
  /// One a body. Forgets those of other bodies.
  [[nodiscard]] std::vector<Frequencies> estimate(std::span<const SoftBody> bodies, const Atmosphere& atmosphere);
  /// Of one body more; forgets none but where there are more than a world has bodies.
  [[nodiscard]] Frequencies estimate_another(const SoftBody& body, const Atmosphere& atmosphere);
  /// How many skins were not known yet, so far.
  [[nodiscard]] std::size_t skins_found() const { return skins_found_; }

 private:
  struct Entry {
    std::shared_ptr<const Mesh> mesh;
    Springs springs;
    std::vector<double> vertex_mass_scale;
    SkinModes modes;

    [[nodiscard]] bool is_of(const SoftBody& body) const;
  };
  /// From the skins of `entries`, to which the body's is added, found unless it is known.
  [[nodiscard]] Frequencies estimate_in(std::vector<Entry>& entries, const SoftBody& body,
                                        const Atmosphere& atmosphere);

  std::vector<Entry> entries_;
  std::size_t skins_found_ = 0;
};

/// No motion of the body is faster than these, which take one pass over the mesh: a vertex's own share of every spring
/// and hinge, doubled for its neighbour's (Gershgorin), and the gas.
[[nodiscard]] Frequencies bound_frequencies(const SoftBody& body, const Atmosphere& atmosphere);

}  // namespace pneuma::physics
