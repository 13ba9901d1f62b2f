// A group of bodies that rows join, and that answer by the masses of their vertices. It is solved alone.
#pragma once

#include <cstddef>
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
#include "physics/contact/span_solids.h"
#include "physics/contact/surface_contacts.h"
#include "physics/machine/profile.h"

namespace pneuma::physics {

/// What a substep hands over besides the world: bounds one a soft body; who was touched, set of those that got an
/// impulse; and the stage whose timer runs.
template <class Real>
struct LumpedSubstep {
  const ContactWorld<Real>& world;
  std::span<const BodyBounds> bounds;
  std::span<std::uint8_t> soft_touched;
  std::span<std::uint8_t> rigid_touched;
  Stage stage = Stage::soft_contact;
};

/// Rows of surfaces against each other come first, then those of solids. Between surfaces, normals and shares stay over
/// a span and gaps follow the vertices; rows of solids are measured again in each substep.
template <class Real>
class LumpedGroup {
 public:
  using Substep = LumpedSubstep<Real>;

  // As a span begins, in this order.
  void clear();
  void add_soft(std::uint32_t body) { soft_.push_back(body); }    // in order
  void add_rigid(std::uint32_t body) { rigid_.push_back(body); }  // likewise
  /// A row of surfaces, in the solver's order. Rows stay where they are for the span.
  void add(ContactRow& row, const SurfaceContacts<Real>& surfaces);
  /// The rows of a body with a solid.
  void add(std::span<ContactRow> rows, const typename SpanSolids<Real>::Meeting& meeting, const SpanSolid& solid,
           const SurfaceContacts<Real>& surfaces);
  /// `warm` is sorted. `rigid_count`: of the world; `is_still`: one a collider.
  void begin(std::span<const WarmImpulse> warm, const SurfaceContacts<Real>& surfaces, std::size_t rigid_count,
             std::span<const std::uint8_t> is_still, SlotTable& table);
  [[nodiscard]] std::size_t row_count() const { return rows_.size(); }

  /// Answers the contacts of the moves `dr` by impulses: changes v and dr of its bodies, and the motion of its rigid
  /// ones, whose positions change only to undo an overlap. Writes only what is of its bodies.
  RowCounts answer(const Substep& substep, const SurfaceContacts<Real>& surfaces, RowMoments& moments);
  /// Tells the world's touches what the substep answered.
  void tally(const Substep& substep, const SurfaceContacts<Real>& surfaces) const;

  void append_impulses(std::vector<WarmImpulse>& warm) const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  // What each substep asks of a row. Rows themselves are large, and many are idle.
  struct SubstepRow {
    double near_m = 0.0;  // what neither begins nor ends nearer than this is idle
    double out_m = 0.0;   // what is too near a solid goes back by this at least
    double restitution = 0.0;
    BodyRef first = {}, second = {};
    bool is_vertex_on_solid = false;
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

  void load_values(const Substep& substep, const SurfaceContacts<Real>& surfaces);
  void measure(const Substep& substep);
  void list_due(const Substep& substep, const SurfaceContacts<Real>& surfaces);
  [[nodiscard]] double impact_m_s(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t row,
                                  double share);
  [[nodiscard]] bool may_bounce(const Substep& substep, const SurfaceContacts<Real>& surfaces, std::uint32_t row);
  [[nodiscard]] const Whole& whole_of(const Substep& substep, const SurfaceContacts<Real>& surfaces,
                                      std::uint32_t body);
  [[nodiscard]] bool solve_velocities(const Substep& substep);
  void move_skins_by_velocity(double dt_s);
  [[nodiscard]] std::optional<double> carried_apart_m_s(const Substep& substep, std::uint32_t r) const;
  void take_back_pushes(const SubstepContext& context);
  // Calls visit(row) for each of these rows whose vertex does not come to its solid in the substep: it was there
  // before.
  template <class Visit>
  void for_held(const std::vector<std::uint32_t>& of_solids, const Visit& visit) const;
  void slide_hits(double dt_s);
  void solve_moves(const Substep& substep);
  void keep_out(std::uint32_t row);
  void store(const Substep& substep);
  void add_moments(const Substep& substep, const SurfaceContacts<Real>& surfaces, RowMoments& moments) const;
  void note(const Substep& substep) const;
  void note_row(const Substep& substep, std::uint32_t row) const;
  // Calls visit(row) for each that presses.
  template <class Visit>
  void for_pressed(const Visit& visit) const;
  [[nodiscard]] bool is_of_solid(std::uint32_t row) const { return row >= skin_rows_; }

  std::vector<std::uint32_t> soft_, rigid_;  // its bodies
  std::vector<ContactRow*> rows_;            // as the span found them
  std::vector<SubstepRow> brief_;            // one a row
  std::size_t skin_rows_ = 0;                // so many are of surfaces
  std::vector<double> kept_m_;               // one a row of surfaces: what is 0 of its gap
  LumpedSolids<Real> solids_;
  LumpedSolver solver_;
  // Four numbers a slot of the solver, in the substep under way.
  LumpedSolver::Values places_m_, velocities_m_s_, moves_m_, velocities_before_m_s_, free_moves_m_;
  std::vector<double> gaps_m_, opening_m_s_, ends_m_, least_m_;  // one a row
  LumpedSolver::Due due_;                                        // that may press in this substep
  double fastest_m_s_ = 0.0;                                     // of what opens or closes
  std::vector<Hit> hits_;
  std::vector<Whole> wholes_;  // one a soft body of its own
};

}  // namespace pneuma::physics
