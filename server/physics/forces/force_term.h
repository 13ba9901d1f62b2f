// What a force on a soft body is to the rest of the engine. Each force is a struct with all the parts that ForceTerm
// asks for, in a file of its own, and a name in the list of force_terms.h. A part that does not apply to it is None,
// with the reason; a part that is forgotten does not compile.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/forces/body_measures.h"
#include "physics/forces/skin_motion.h"
#include "physics/forces/tangents.h"
#include "physics/forces/xpbd_part.h"
#include "physics/machine/none.h"
#include "physics/mesh/ring.h"
#include "physics/state/state.h"
#include "physics/state/substep_context.h"

namespace pneuma::physics {

/// Where and how a force is asked for.
template <class Real>
struct ForcePlace {
  std::span<const Vec3<Real>> x;  // m; seen from the body's origin_m, or from the body itself where nobody grabs it
  std::span<const Vec3<Real>> v;  // m/s
  Surroundings surroundings = {};
  double explicit_dt_s = 0.0;  // of an explicit step, which bounds how stiff a hand may be; 0 of the others
  Profile* profile = nullptr;
};

/// Where a potential is asked for.
struct EnergyPlace {
  std::span<const Vec3d> x;              // m
  Vec3d origin_m = Vec3d::Zero();        // that x is seen from
  std::optional<double> volume_m3 = {};  // there, by the body's own method, where it is known
};

/// What adds up to the preconditioner of an implicit step (implicit_matrix.h).
struct MatrixEntries {
  /// As Eigen::Triplet is read.
  struct Entry {
    std::uint32_t i = 0, j = 0;
    double amount = 0.0;
    [[nodiscard]] int row() const { return static_cast<int>(i); }
    [[nodiscard]] int col() const { return static_cast<int>(j); }
    [[nodiscard]] double value() const { return amount; }
  };

  std::vector<double> diagonal = {};  // kg, also of what holds single vertices
  std::vector<Entry> entries = {};    // beside it
  std::span<const std::uint8_t> pinned;

  /// A pinned vertex is tied to nobody.
  void add(std::uint32_t i, std::uint32_t j, double amount) {
    const auto is_pinned = [this](std::uint32_t vertex) { return !pinned.empty() && pinned[vertex] != 0; };
    if (i == j || (!is_pinned(i) && !is_pinned(j))) entries.push_back({i, j, amount});
  }
};

/// A step of length s, whose matrix is asked for.
struct MatrixPlace {
  const Mesh& mesh;
  double s = 0.0;
  double pressure_stiffness_n_m = 0.0;  // of every edge, beside its spring's
};

/// The parts, each for a body in one precision.
namespace term_parts {

// The term says that it goes without.
template <class Term>
concept NoAdding = requires {
  { Term::add } -> std::same_as<const None&>;
};
template <class Term>
concept NoPotential = requires {
  { Term::potential_j } -> std::same_as<const None&>;
};
template <class Term>
concept NoTangent = requires {
  { Term::linearise } -> std::same_as<const None&>;
};
template <class Term>
concept NoVolumeStiffness = requires {
  { Term::volume_stiffness_pa_m3 } -> std::same_as<const None&>;
};
template <class Term>
concept NoStiffening = requires {
  { Term::stiffen } -> std::same_as<const None&>;
};

template <class Term, class Real>
concept Presence = requires(const SoftState<Real>& body, const Surroundings& surroundings, const Rings& rings) {
  { Term::stage } -> std::same_as<const Stage&>;                   // whose time and bytes it takes
  { Term::is_present(body, surroundings) } -> std::same_as<bool>;  // whether it acts on the body
  { Term::is_in_rings(body, rings) } -> std::same_as<bool>;        // whether the lane kernels add it
  { Term::bytes(body) } -> std::same_as<std::size_t>;              // that the body holds for it
};

// Adds the force to `force` (N, one a vertex). None: only the lane kernels know it.
template <class Term, class Real>
concept Adding =
    NoAdding<Term> || requires(SoftState<Real>& body, const ForcePlace<Real>& at, std::span<Vec3<Real>> force) {
      { Term::add(body, at, force) } -> std::same_as<void>;
    };

// What the choice of steps asks of it, of a body at rest. None: it makes no motion faster.
template <class Term>
concept NoSkin = requires {
  { Term::add_to_skin } -> std::same_as<const None&>;
};
template <class Term>
concept Skin = NoSkin<Term> || requires(const Mesh& mesh, const Springs& springs, SkinMotion& skin) {
  { Term::add_to_skin(mesh, springs, skin) } -> std::same_as<void>;  // whatever the body's mass and gas
};
template <class Term>
concept NoRestVolumeStiffness = requires {
  { Term::rest_volume_stiffness_pa_m3 } -> std::same_as<const None&>;
};
template <class Term>
concept RestVolumeStiffness = NoRestVolumeStiffness<Term> || requires(const SoftBody& body, double volume_m3) {
  { Term::rest_volume_stiffness_pa_m3(body, volume_m3) } -> std::same_as<double>;  // -dP/dV
};
template <class Term>
concept NoDragAtRest = requires {
  { Term::drag_at_rest_n_s_m } -> std::same_as<const None&>;
};
template <class Term>
concept DragAtRest =
    NoDragAtRest<Term> || requires(const SoftBody& body, const Atmosphere& atmosphere, double area_m2) {
      { Term::drag_at_rest_n_s_m(body, atmosphere, area_m2) } -> std::same_as<double>;  // of a vertex with that area
    };

// The energy whose gradient is minus the force, and the sum of BodyMeasures that it goes into. None: it has no energy
// to give back.
template <class Term, class Real>
concept Potential = NoPotential<Term> ||
                    requires(const SoftState<Real>& body, const EnergyPlace& at, const Surroundings& surroundings) {
                      { Term::potential_j(body, at, surroundings) } -> std::same_as<double>;
                      { Term::measure } -> std::same_as<double BodyMeasures::* const&>;
                    };

// The derivative of the force, s D + s^2 K, in elements that a solver multiplies with. None: it has none, or all of it
// is in Stiffening or in VolumeStiffness.
template <class Term, class Real>
concept Tangent = NoTangent<Term> || requires(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents) {
  { Term::linearise(body, at, tangents) } -> std::same_as<void>;
};

// Of the tangent, what goes along the volume's gradient: -dP/dV.
template <class Term, class Real>
concept VolumeStiffness = NoVolumeStiffness<Term> || requires(const SoftState<Real>& body) {
  { Term::volume_stiffness_pa_m3(body) } -> std::same_as<double>;
};

// What the preconditioner holds of it, which is not to be softer than the tangent; and what that depends on, so that
// bodies that are alike share a matrix. None: the preconditioner goes without.
template <class Term, class Real>
concept Stiffening =
    NoStiffening<Term> || requires(const SoftState<Real>& body, const Surroundings& surroundings,
                                   const typename Term::Bound& bound, const MatrixPlace& at, MatrixEntries& entries) {
      { Term::bound(body, surroundings) } -> std::same_as<typename Term::Bound>;
      { bound == bound } -> std::convertible_to<bool>;
      { bound.bytes() } -> std::same_as<std::size_t>;
      { Term::stiffen(body, bound, at, entries) } -> std::same_as<void>;
    };

// What it is in XPBD.
template <class Term, class Real>
concept Constraining = XpbdPart<typename Term::template Xpbd<Real>, Real>;

template <class Term, class Real>
concept Judgement = requires(const SoftState<Real>& body, const Surroundings& surroundings) {
  // Whether it moves or holds the body as a whole, as neither the body's own springs nor gravity do.
  { Term::drives(body, surroundings) } -> std::same_as<bool>;
  { Term::keeps_awake(body, surroundings) } -> std::same_as<bool>;  // whether the body never rests by it
  // Whether readers of a stream know the force as it is (app/mechanics.h).
  { Term::is_predictable(body, surroundings) } -> std::same_as<bool>;
};

}  // namespace term_parts

template <class Term, class Real>
concept ForceTermIn =
    term_parts::Presence<Term, Real> && term_parts::Adding<Term, Real> && term_parts::Potential<Term, Real> &&
    term_parts::Tangent<Term, Real> && term_parts::VolumeStiffness<Term, Real> && term_parts::Stiffening<Term, Real> &&
    term_parts::Constraining<Term, Real> && term_parts::Judgement<Term, Real>;

/// A force on soft bodies, with all its parts.
template <class Term>
concept ForceTerm = ForceTermIn<Term, float> && ForceTermIn<Term, double> && term_parts::Skin<Term> &&
                    term_parts::RestVolumeStiffness<Term> && term_parts::DragAtRest<Term>;

}  // namespace pneuma::physics
