#include "physics/contact/joint.h"

#include <algorithm>

#include "physics/contact/groups.h"
#include "physics/contact/surface_shell.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {
namespace {

// Ends that are apart come together at this speed, and as much faster as they themselves turn: by what a turn leaves
// its circle in one substep it comes back in the next, and that keeps a pendulum on its way.
constexpr double closing_speed_m_s = 3.0;
constexpr double closing_speed_rad_s = 10.0;
// Of the room that contact keeps between two surfaces: a joint does not pull them nearer than this.
constexpr double joint_kept_share = 1.5;
// Of the bound: a row that took as much has given way.
constexpr double given_way_share = 1.0 - 1e-9;
// Of the longest length: ends nearer to each other have no direction.
constexpr double coincident_share = 1e-12;
// A rope that is too long by more than this share of its longest length, and than the spacing of vertices at an end,
// was put so.
constexpr double put_apart_share = 0.1;
// Ends on rigid bodies are off by this share of the body's size in their work.
constexpr double solid_off_share = 0.02;
// Rows of joints come after those of contacts.
constexpr std::uint64_t joint_bit = std::uint64_t{1} << 63U;

template <class Body, class Name>
std::uint32_t index_named(std::span<const Body> bodies, const std::string& name, const Name& name_of) {
  return static_cast<std::uint32_t>(std::ranges::find(bodies, name, name_of) - bodies.begin());
}

template <class Real>
JointEnd find_end(const Anchor& anchor, std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid,
                  std::span<const ColliderState> colliders) {
  JointEnd end;
  end.of = anchor.of;
  switch (anchor.of) {
    case Anchor::Of::world:
      break;
    case Anchor::Of::soft: {
      end.index = index_named(soft, anchor.body, [](const SoftState<Real>& state) { return state.body.name; });
      if (anchor.vertex) {
        end.support.add(*anchor.vertex, 1.0);
        break;
      }
      const Face& face = soft[end.index].body.mesh->faces[*anchor.face];
      for (std::size_t i = 0; i < 3; ++i) end.support.add(face[i], anchor.face_weights[static_cast<int>(i)]);
      break;
    }
    case Anchor::Of::rigid:
      end.index = index_named(rigid, anchor.body, [](const RigidState& state) { return state.body.name; });
      break;
    case Anchor::Of::collider:
      end.index = index_named(colliders, anchor.body, [](const ColliderState& state) { return state.collider.name; });
      break;
  }
  return end;
}

/// The frame that an end's point is told in.
struct EndFrame {
  Vec3d position = Vec3d::Zero();
  Quatd orientation = Quatd::Identity();
};

EndFrame frame_of(const JointEnd& end, std::span<const RigidState> rigid, std::span<const ColliderState> colliders) {
  if (end.of == Anchor::Of::rigid) return {rigid[end.index].position, rigid[end.index].orientation};
  if (end.of == Anchor::Of::collider) return {colliders[end.index].position, colliders[end.index].orientation};
  return {};
}

Vec3d limited(const Vec3d& error, double most) {
  const double size = error.norm();
  return size > most ? Vec3d(most / size * error) : error;
}

double turning_speed_m(const EndPlace& end) {
  return end.turn_ahead_rad.norm() * (end.at - end.centre).norm();
}

Vec3d across(const Vec3d& vector, const Vec3d& axis) {
  return vector - axis * axis.dot(vector);
}

/// A joint's axis, which goes with the second end.
Vec3d axis_now(const JointState& joint, const Vec3d& axis, const EndPlace& second) {
  return second.orientation * (joint.turn * axis);
}

/// The rows of one joint under way.
class JointRows {
 public:
  JointRows(const JointState& joint, std::uint32_t index, const EndPlace& first, const EndPlace& second,
            const JointStep& step, std::vector<ContactRow>& rows)
      : joint_(joint),
        index_(index),
        first_(first),
        second_(second),
        dt_s_(step.dt_s),
        repairs_(step.repairs),
        rows_(rows) {}

  void add_point(const Vec3d& left_m) {
    ContactRow& row = add(RowKind::tie);
    // Both get their impulses at one place, or a pair that is off by a little would turn by itself.
    const bool both_solid = first_.support.count == 0 && second_.support.count == 0;
    const Vec3d middle = 0.5 * (first_.at + second_.at);
    if (both_solid && first_.yields && second_.yields) {
      row.first.arm = middle - first_.centre;
      row.second.arm = middle - second_.centre;
    }
    const Vec3d error_m = first_.at - second_.at - left_m;
    row.free_m_s = (error_m + first_.ahead_at(first_.at) - second_.ahead_at(second_.at)) / dt_s_;
    bound(row);
  }

  void add_longest(double longest_m) {
    const Vec3d apart = first_.at - second_.at;
    const double length_m = apart.norm();
    if (!(length_m > coincident_share * longest_m)) return;
    ContactRow& row = add(RowKind::contact);
    row.normal = -apart / length_m;
    row.gap_m = longest_m - length_m;
    row.free_m_s = (first_.ahead_at(first_.at) - second_.ahead_at(second_.at)) / dt_s_;
    const bool gives_way = joint_.joint.compliance_m_n > 0.0;
    const double closing_m_s =
        gives_way ? std::numeric_limits<double>::infinity()
                  : closing_speed_m_s + (first_.ahead_at(first_.at) - second_.ahead_at(second_.at)).norm() / dt_s_;
    row.least_m_s = std::min(-row.gap_m / dt_s_, repairs_ || gives_way ? closing_m_s : 0.0);
    bound(row);
  }

  void add_slide(const Vec3d& axis, const Vec3d& left_m) {
    ContactRow& row = add(RowKind::guide);
    row.normal = axis;
    row.second.arm = first_.at - second_.centre;
    const Vec3d error_m = across(first_.at - second_.at, axis) - left_m;
    row.free_m_s = (error_m + first_.ahead_at(first_.at) - second_.ahead_at(first_.at)) / dt_s_;
    bound(row);
  }

  /// `error_rad`: of the first, as the second sees it.
  void add_turn(RowKind kind, const Vec3d& axis, const Vec3d& error_rad) {
    ContactRow& row = add(kind);
    row.normal = axis;
    row.first.turns = row.second.turns = true;
    const double most_rad = closing_speed_rad_s * dt_s_ + first_.turn_ahead_rad.norm() + second_.turn_ahead_rad.norm();
    row.free_m_s =
        (limited(error_rad, repairs_ ? most_rad : 0.0) + first_.turn_ahead_rad - second_.turn_ahead_rad) / dt_s_;
  }

  // The solver wants one that yields first.
  void turn_round() {
    if (first_.yields) return;
    for (; next_ < rows_.size(); ++next_) {
      ContactRow& row = rows_[next_];
      std::swap(row.first, row.second);
      row.free_m_s = -row.free_m_s;
      if (row.kind == RowKind::contact) row.normal = -row.normal;
    }
  }

 private:
  ContactRow& add(RowKind kind) {
    ContactRow& row = rows_.emplace_back();
    row.key = {joint_bit | index_, parts_++};
    row.kind = kind;
    row.first = first_.support;
    row.second = second_.support;
    row.first.arm = first_.at - first_.centre;
    row.second.arm = second_.at - second_.centre;
    return row;
  }
  void bound(ContactRow& row) const {
    row.softness_1_kg = joint_.joint.compliance_m_n / (dt_s_ * dt_s_);
    row.most_n_s = joint_.joint.break_force_n * dt_s_;
  }

  const JointState& joint_;
  std::uint32_t index_;
  const EndPlace& first_;
  const EndPlace& second_;
  double dt_s_;
  bool repairs_;
  std::vector<ContactRow>& rows_;
  std::uint64_t parts_ = 0;
  std::size_t next_ = rows_.size();
};

}  // namespace

template <class Real>
void find_ends(JointState& joint, std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid,
               std::span<const ColliderState> colliders) {
  joint.ends = {find_end(joint.joint.first, soft, rigid, colliders),
                find_end(joint.joint.second, soft, rigid, colliders)};
}

template <class Real>
JointState make_joint(const Joint& joint, std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid,
                      std::span<const ColliderState> colliders) {
  JointState state;
  state.joint = joint;
  find_ends(state, soft, rigid, colliders);
  const auto& [first, second] = state.ends;
  const EndFrame at_first = frame_of(first, rigid, colliders);
  const EndFrame at_second = frame_of(second, rigid, colliders);
  state.turn = at_second.orientation.conjugate() * at_first.orientation;
  state.points_m[0] = joint.first.point_m.value_or(Vec3d::Zero());
  if (joint.second.point_m || second.of == Anchor::Of::soft) {
    state.points_m[1] = joint.second.point_m.value_or(Vec3d::Zero());
    return state;
  }
  Vec3d place = at_first.position + at_first.orientation * state.points_m[0];
  if (first.of == Anchor::Of::soft) {
    place.setZero();
    for (std::uint32_t i = 0; i < first.support.count; ++i) {
      place += first.support.weights[i] * soft[first.index].position_m(first.support.vertices[i]);
    }
  }
  state.points_m[1] = at_second.orientation.conjugate() * (place - at_second.position);
  return state;
}

template <class Real>
void tie_bodies(std::span<JointState> joints, std::span<SoftState<Real>> soft, std::span<RigidState> rigid) {
  const std::size_t count = soft.size() + rigid.size();
  JoinedBodies joined;
  joined.begin(count);
  const auto is_body = [](const JointEnd& end) { return end.of == Anchor::Of::soft || end.of == Anchor::Of::rigid; };
  const auto body_of = [&](const JointEnd& end) {
    return end.of == Anchor::Of::soft ? end.index : static_cast<std::uint32_t>(soft.size()) + end.index;
  };
  std::vector<std::uint8_t> tied(count, 0);
  for (const JointState& joint : joints) {
    for (const JointEnd& end : joint.ends) {
      if (is_body(end)) tied[body_of(end)] = 1;
    }
    if (is_body(joint.ends[0]) && is_body(joint.ends[1])) joined.join(body_of(joint.ends[0]), body_of(joint.ends[1]));
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    std::uint32_t& tie = i < soft.size() ? soft[i].tie : rigid[i - soft.size()].tie;
    tie = tied[i] != 0 ? joined.lowest_with(i) + 1 : 0;
  }
  for (JointState& joint : joints) {
    const JointEnd& end = is_body(joint.ends[0]) ? joint.ends[0] : joint.ends[1];
    joint.has_soft = joined.lowest_with(body_of(end)) < soft.size();  // soft bodies come first
  }
}

EndPlace place_of_solid(const JointState& joint, std::size_t which, const Vec3d& centre, const Quatd& orientation,
                        const Vec3d& velocity_m_s, const Vec3d& turning_rad_s, double dt_s) {
  EndPlace place;
  place.centre = centre;
  place.orientation = orientation;
  place.at = centre + orientation * joint.points_m[which];
  place.centre_ahead_m = dt_s * velocity_m_s;
  place.turn_ahead_rad = dt_s * turning_rad_s;
  return place;
}

template <class Real>
double kept_of_end(const JointState& joint, std::size_t which, std::span<const SoftState<Real>> soft,
                   std::span<const RigidState> rigid, std::span<const ColliderState> colliders) {
  const JointEnd& end = joint.ends[which];
  const JointEnd& other = joint.ends[1 - which];
  const bool meets_soft = end.of == Anchor::Of::soft || other.of == Anchor::Of::soft;
  if (!meets_soft || end.of == Anchor::Of::world || other.of == Anchor::Of::world) return 0.0;
  if (end.of == Anchor::Of::rigid) return rigid[end.index].body.surface.thickness_m;
  if (end.of == Anchor::Of::collider) return colliders[end.index].collider.surface.thickness_m;
  const auto meets_others = [&](const JointEnd& one) {
    return one.of != Anchor::Of::soft || soft[one.index].body.collision.soft != SoftCollision::none;
  };
  const bool both_soft = other.of == Anchor::Of::soft;
  return both_soft && !(meets_others(end) && meets_others(other)) ? 0.0 : shell_m(soft[end.index]);
}

template <class Real>
bool is_apart(const JointState& joint, std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid,
              std::span<const ColliderState> colliders) {
  double allowed_m = 0.0;
  double spacing_max_m = 0.0;
  std::array<Vec3d, 2> at;
  for (std::size_t i = 0; i < 2; ++i) {
    const JointEnd& end = joint.ends[i];
    allowed_m += joint_kept_share * kept_of_end<Real>(joint, i, soft, rigid, colliders);
    at[i] = joint.points_m[i];
    if (end.of == Anchor::Of::soft) {
      const SoftState<Real>& body = soft[end.index];
      at[i].setZero();
      for (std::uint32_t k = 0; k < end.support.count; ++k)
        at[i] += end.support.weights[k] * body.position_m(end.support.vertices[k]);
      allowed_m += shell_m(body);
      spacing_max_m = std::max(spacing_max_m, spacing_m(body));
    } else if (end.of != Anchor::Of::world) {
      const EndFrame frame = frame_of(end, rigid, colliders);
      if (end.of == Anchor::Of::rigid)
        allowed_m += solid_off_share * half_extents_m(rigid[end.index].body.shape).norm();
      at[i] = frame.position + frame.orientation * joint.points_m[i];
    }
  }
  Vec3d apart_m = at[0] - at[1];
  if (const auto* rope = std::get_if<DistanceLimit>(&joint.joint.kind))
    return apart_m.norm() > (1.0 + put_apart_share) * rope->longest_m + spacing_max_m;
  if (const auto* slider = std::get_if<SliderJoint>(&joint.joint.kind)) {
    apart_m = across(apart_m, frame_of(joint.ends[1], rigid, colliders).orientation * (joint.turn * slider->axis));
  }
  return apart_m.norm() > allowed_m;
}

Vec3d error_left_m(const JointState& joint, const EndPlace& first, const EndPlace& second, const JointStep& step) {
  if (std::holds_alternative<DistanceLimit>(joint.joint.kind)) return Vec3d::Zero();
  Vec3d error_m = first.at - second.at;
  if (const auto* slider = std::get_if<SliderJoint>(&joint.joint.kind)) {
    error_m = across(error_m, axis_now(joint, slider->axis, second));
  }
  const double size_m = error_m.norm();
  const double kept_m = first.kept_m + second.kept_m > 0.0 ? joint_kept_share * (first.kept_m + second.kept_m) : 0.0;
  if (size_m <= kept_m) return error_m;
  if (joint.joint.compliance_m_n > 0.0) return limited(error_m, kept_m);
  if (!step.repairs) return error_m;
  const double closed_m = closing_speed_m_s * step.dt_s + turning_speed_m(first) + turning_speed_m(second);
  return limited(error_m, std::max(kept_m, size_m - closed_m));
}

void append_joint_rows(const JointState& joint, std::uint32_t index, const EndPlace& first, const EndPlace& second,
                       const Vec3d& left_m, const JointStep& step, std::vector<ContactRow>& rows) {
  if (!first.yields && !second.yields) return;
  JointRows parts(joint, index, first, second, step, rows);
  struct Adder {
    const JointState& joint;
    const EndPlace& first;
    const EndPlace& second;
    const Vec3d& left_m;
    JointRows& parts;
    void operator()(const PointJoint&) const { parts.add_point(left_m); }
    void operator()(const DistanceLimit& limit) const { parts.add_longest(limit.longest_m); }
    void operator()(const HingeJoint& hinge) const {
      parts.add_point(left_m);
      const Vec3d axis = axis_now(joint, hinge.axis, second);
      parts.add_turn(RowKind::guide, axis, axis.cross(first.orientation * hinge.axis));
    }
    void operator()(const SliderJoint& slider) const {
      const Vec3d axis = axis_now(joint, slider.axis, second);
      parts.add_slide(axis, left_m);
      const Quatd off = first.orientation * (second.orientation * joint.turn).conjugate();
      parts.add_turn(RowKind::tie, axis, sign_of(off.w()) * 2.0 * off.vec());
    }
  };
  std::visit(Adder{joint, first, second, left_m, parts}, joint.joint.kind);
  parts.turn_round();
}

std::optional<std::uint32_t> joint_of(const ContactRow& row) {
  if ((row.key.bodies & joint_bit) == 0) return std::nullopt;
  return static_cast<std::uint32_t>(row.key.bodies & ~joint_bit);
}

bool has_given_way(const ContactRow& row) {
  return row.is_given || row.impulse_n_s.norm() >= given_way_share * row.most_n_s;
}

#define PNEUMA_INSTANTIATE(Real)                                                                                    \
  template void find_ends<Real>(JointState&, std::span<const SoftState<Real>>, std::span<const RigidState>,         \
                                std::span<const ColliderState>);                                                    \
  template JointState make_joint<Real>(const Joint&, std::span<const SoftState<Real>>, std::span<const RigidState>, \
                                       std::span<const ColliderState>);                                             \
  template void tie_bodies<Real>(std::span<JointState>, std::span<SoftState<Real>>, std::span<RigidState>);         \
  template double kept_of_end<Real>(const JointState&, std::size_t, std::span<const SoftState<Real>>,               \
                                    std::span<const RigidState>, std::span<const ColliderState>);                   \
  template bool is_apart<Real>(const JointState&, std::span<const SoftState<Real>>, std::span<const RigidState>,    \
                               std::span<const ColliderState>);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
