// Where a span of contact began: to step it again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/contact/contact_note.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What a substep moves.
template <class Real>
struct Moving {
  std::span<SoftState<Real>> soft;
  std::span<RigidState> rigid;
  std::span<ColliderState> colliders;
  TouchTally* touches = nullptr;            // of the tick; none where nobody asks
  std::size_t events = 0;                   // so many so far: bodies that froze, gases that burst, joints that broke
  std::span<const Vec3d> carried_m_s = {};  // CarriedOut's
};

/// The state of all that moves, between two substeps of a tick.
template <class Real>
class SpanStart {
 public:
  void keep(const Moving<Real>& moving, std::uint32_t substeps_left);
  /// How many substeps of the tick were left. 0: nothing is kept.
  [[nodiscard]] std::uint32_t substeps_left() const { return substeps_left_; }
  /// Whether all that changed since is put back by restore(): nobody woke, froze or is crowded, no gas burst or turned
  /// inside out, and no joint broke.
  [[nodiscard]] bool can_restore(const Moving<Real>& moving) const;
  void restore(const Moving<Real>& moving) const;
  void forget() { substeps_left_ = 0; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Soft {
    bool is_awake = false;
    std::vector<Vec3<Real>> x;
    std::vector<Vec3<Real>> v;
    std::optional<GasState> gas;
    double volume_m3 = 0.0;
    double pressure_pa = 0.0;
    bool inverted = false;
  };
  struct Rigid {
    bool is_awake = false;
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
    Vec3d velocity = Vec3d::Zero();
    Vec3d angular_velocity = Vec3d::Zero();
    bool has_moved = false;
  };
  struct Pose {
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
  };

  std::uint32_t substeps_left_ = 0;
  std::size_t events_ = 0;
  std::vector<Soft> soft_;  // the first of them: more to be used again
  std::vector<Rigid> rigid_;
  std::vector<Pose> colliders_;
  TouchTally touches_;
};

}  // namespace pneuma::physics
