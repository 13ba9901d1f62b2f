// Contacts of soft bodies that answer by the masses of their vertices: by explicit methods and XPBD.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/contact/contact_world.h"
#include "physics/contact/lumped_solids.h"
#include "physics/contact/lumped_solver.h"
#include "physics/contact/row.h"
#include "physics/contact/row_moments.h"
#include "physics/contact/row_turns.h"
#include "physics/contact/surface_contacts.h"
#include "physics/machine/profile.h"

namespace pneuma::physics {

/// Rows are found once for some substeps of a tick, a span: of surfaces against each other, and against solids. Between
/// surfaces, normals and shares stay and gaps follow the vertices; rows of solids are measured again in each substep.
/// Where the span ends, nothing may have crossed since it began.
template <class Real>
class LumpedContacts {
 public:
  /// What a substep hands over besides the world: bounds one a soft body; who was touched, set of those that got an
  /// impulse; and the stage whose timer runs.
  struct Substep {
    const ContactWorld<Real>& world;
    std::span<const BodyBounds> bounds;
    std::span<std::uint8_t> soft_touched;
    std::span<std::uint8_t> rigid_touched;
    Stage stage = Stage::soft_contact;
  };

  /// Answers the contacts of the moves `dr` by impulses: changes v and dr, and the motion of rigid bodies, whose
  /// positions change only to undo an overlap.
  void answer(const Substep& substep, SurfaceContacts<Real>& surfaces);

  /// Once all else has changed the moves: where a span ends, cuts them so that nothing crosses.
  void cut(const Substep& substep, SurfaceContacts<Real>& surfaces);

  /// Since it was last asked.
  [[nodiscard]] RowCounts take_counts() { return std::exchange(counts_, {}); }
  /// Between ticks: lets go of what is the world's.
  void clear();
  [[nodiscard]] std::size_t bytes() const;

 private:
  // Of a row in the span before in this tick, from which the next one starts.
  struct WarmImpulse {
    FeatureKey key;
    Vec3d impulse_n_s = Vec3d::Zero();
  };
  // A row whose vertex comes to its solid in the substep, and the share of it that passes before.
  struct Hit {
    std::uint32_t row = 0;
    double share = 0.0;
  };
  // A soft body as a whole, found where a row asks.
  struct Whole {
    bool is_known = false;
    Vec3d velocity_m_s = Vec3d::Zero();
    double touching_m = 0.0;  // what is no further from a surface is on it
  };

  [[nodiscard]] bool is_as_begun(const ContactWorld<Real>& world) const;
  void begin_span(const Substep& substep, SurfaceContacts<Real>& surfaces);
  [[nodiscard]] double substeps_that_rows_hold(const Substep& substep, SurfaceContacts<Real>& surfaces) const;
  void find_rows(const Substep& substep, SurfaceContacts<Real>& surfaces);
  void keep_impulses(bool of_this_tick);
  void take_impulses();
  void load_values(const Substep& substep, const SurfaceContacts<Real>& surfaces);
  void measure(const Substep& substep);
  void list_due(const Substep& substep, const SurfaceContacts<Real>& surfaces);
  [[nodiscard]] double impact_m_s(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t row,
                                  double share);
  [[nodiscard]] bool may_bounce(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t row);
  [[nodiscard]] const Whole& whole_of(const Substep& substep, const SurfaceContacts<Real>& surfaces,
                                      std::uint32_t body);
  void solve_velocities(const Substep& substep);
  void take_back_pushes(const SubstepContext& context);
  void slide_hits(double dt_s);
  void solve_moves(const Substep& substep, const SurfaceContacts<Real>& surfaces);
  void keep_out(std::uint32_t row);
  [[nodiscard]] bool stop_missed(const Substep& substep, const SurfaceContacts<Real>& surfaces);
  void store(const Substep& substep);
  void add_moments(const Substep& substep, const SurfaceContacts<Real>& surfaces);
  void note(const Substep& substep, const SurfaceContacts<Real>& surfaces) const;
  void note_row(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t row) const;
  [[nodiscard]] bool is_of_solid(std::uint32_t row) const { return row >= skin_rows_; }

  std::uint32_t substeps_left_ = 0;  // of the span
  std::vector<std::uint8_t> awake_;  // one a soft body, then one a rigid one: as the span began
  std::vector<ContactRow> rows_;     // as the span found them: of surfaces in the solver's order, then of solids
  std::size_t skin_rows_ = 0;        // so many are of surfaces
  std::vector<double> kept_m_;       // one a row of surfaces: what is 0 of its gap
  LumpedSolids<Real> solids_;
  LumpedSolver solver_;
  RowTurns turns_;
  // Four numbers a slot of the solver, in the substep under way.
  LumpedSolver::Values places_m_, velocities_m_s_, moves_m_, velocities_before_m_s_, free_moves_m_;
  std::vector<double> gaps_m_, opening_m_s_, ends_m_, least_m_;  // one a row
  LumpedSolver::Due due_;                                        // that may press in this substep
  double fastest_m_s_ = 0.0;                                     // of what opens or closes
  std::vector<Hit> hits_;
  std::vector<Whole> wholes_;      // one a soft body
  std::vector<WarmImpulse> warm_;  // sorted
  RowMoments moments_;
  RowCounts counts_;
};

}  // namespace pneuma::physics
