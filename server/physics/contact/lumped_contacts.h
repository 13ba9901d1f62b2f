// Contacts of soft bodies that answer by the masses of their vertices: by explicit methods and XPBD.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "physics/contact/groups.h"
#include "physics/contact/lumped_group.h"
#include "physics/contact/row.h"
#include "physics/contact/row_moments.h"
#include "physics/contact/row_turns.h"
#include "physics/contact/span_solids.h"
#include "physics/contact/span_start.h"
#include "physics/contact/surface_contacts.h"

namespace pneuma::physics {

/// Rows are found once for some substeps of a tick, a span: of surfaces against each other, and against solids. The
/// bodies that they join are a group (lumped_group.h). Each group is answered alone, on any worker. So bodies of other
/// groups change nothing of the answer; but a span is the world's, and near bodies that move fast shorten it for all.
/// Where the span ends, nothing may have crossed since it began. Where that takes cuts that stretch stiff springs, the
/// span is stepped again, and rows are found more often.
template <class Real>
class LumpedContacts {
 public:
  using Substep = LumpedSubstep<Real>;

  /// Before a substep's free motion: keeps what it moves, where a span of several substeps may begin.
  void keep_start(const SubstepContext& context, const Moving<Real>& moving);
  /// After a substep: where its cuts ended a span that is to be stepped again, puts everything back to where it began.
  /// How many substeps of the tick are left then; 0: nothing was put back.
  [[nodiscard]] std::uint32_t take_back(const Moving<Real>& moving);

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
  // In group_of_: of a body without rows, and of one whose group has no number yet.
  static constexpr std::uint32_t no_group = 0xffff'ffff;
  static constexpr std::uint32_t unnumbered = no_group - 1;

  [[nodiscard]] bool is_as_begun(const ContactWorld<Real>& world) const;
  void begin_span(const Substep& substep, SurfaceContacts<Real>& surfaces, std::uint32_t substeps_max);
  [[nodiscard]] double substeps_that_rows_hold(const Substep& substep, SurfaceContacts<Real>& surfaces) const;
  void keep_impulses(bool of_this_tick);
  void find_rows(const Substep& substep, SurfaceContacts<Real>& surfaces);
  void join_bodies(const ContactWorld<Real>& world, const SurfaceContacts<Real>& surfaces);
  void number_groups(std::uint32_t soft_count);
  void deal_rows(std::size_t rigid_count, const SurfaceContacts<Real>& surfaces);
  void answer_groups(const Substep& substep, const SurfaceContacts<Real>& surfaces);
  [[nodiscard]] bool begins_span(const SubstepContext& context) const;
  void load_ends(std::span<const SoftState<Real>> soft, SurfaceContacts<Real>& surfaces) const;
  void mark_free(std::span<const SoftState<Real>> soft, SurfaceContacts<Real>& surfaces) const;
  [[nodiscard]] bool is_cut_short(const Substep& substep, const SurfaceContacts<Real>& surfaces,
                                  const StoppedFeatures& stopped) const;
  void stop_cut(const Substep& substep, const SurfaceContacts<Real>& surfaces, StoppedFeatures& stopped) const;
  [[nodiscard]] bool stop_missed(const Substep& substep, const SurfaceContacts<Real>& surfaces);

  std::uint32_t substeps_left_ = 0;  // of the span
  std::uint32_t span_substeps_ = 0;  // of the span, as it began
  std::uint32_t substeps_max_ = 0;   // of the tick's next span
  SpanStart<Real> start_;
  bool is_asked_ = false;       // keep_start() was, for the substep under way
  bool is_taken_back_ = false;  // the next span is the last one again
  bool is_to_be_taken_back_ = false;
  std::vector<std::uint8_t> awake_;  // one a soft body, then one a rigid one: as the span began
  std::vector<ContactRow> rows_;     // as the span found them: of surfaces in the solver's order, then of solids
  std::size_t skin_rows_ = 0;        // so many are of surfaces
  SpanSolids<Real> solids_;
  RowTurns turns_;
  JoinedBodies joined_;
  std::vector<std::uint32_t> group_of_;    // one a soft body, then one a rigid one
  std::vector<LumpedGroup<Real>> groups_;  // the first group_count_ of them; more to be used again
  std::size_t group_count_ = 0;
  std::size_t most_rows_ = 0;  // of one group
  std::vector<RowCounts> counts_of_groups_;
  SlotTable slots_;
  std::vector<WarmImpulse> warm_;                // sorted
  std::vector<std::vector<Vec3d>> free_ends_m_;  // of each soft body's vertices, where solids stopped some
  RowMoments moments_;
  RowMoments moments_before_;  // as the span found them
  RowCounts counts_;
};

}  // namespace pneuma::physics
