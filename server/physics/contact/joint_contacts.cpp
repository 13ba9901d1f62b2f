#include "physics/contact/joint_contacts.h"

#include <algorithm>
#include <limits>

#include "physics/contact/joint_solver.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {
namespace {

// What a slack rope may be too long by a second and stay slack.
constexpr double joint_enough_m_s = 1e-9;
// Of a body's inertia: what the stiffness of its turning times the substep's square may come to, and be resolved.
constexpr double resolved_share = 0.5;

}  // namespace

template <class Real>
void JointContacts<Real>::find_held_vertices(std::span<const JointState> joints, bool only_solid,
                                             std::span<const SoftState<Real>> soft) {
  held_.clear();
  for (const JointState& joint : joints) {
    if (only_solid && joint.has_soft) continue;
    for (const JointEnd& end : joint.ends) {
      for (std::uint32_t i = 0; i < end.support.count; ++i) held_.emplace_back(end.index, end.support.vertices[i]);
    }
  }
  std::ranges::sort(held_);
  held_.erase(std::unique(held_.begin(), held_.end()), held_.end());
  inverse_masses_1_kg_.clear();
  for (const auto& [body, vertex] : held_) {
    inverse_masses_1_kg_.push_back(soft[body].is_pinned(vertex) ? 0.0 : 1.0 / soft[body].mass_kg(vertex));
  }
  changes_m_s_.assign(held_.size(), Vec3d::Zero());
}

template <class Real>
EndPlace JointContacts<Real>::place_of(const JointState& joint, std::size_t which, std::span<SoftState<Real>> soft,
                                       std::span<const RigidState> rigid, std::span<const ColliderState> colliders,
                                       double dt_s) {
  const JointEnd& end = joint.ends[which];
  EndPlace place;
  place.support.body = static_cast<std::uint32_t>(soft.size() + rigid.size());
  switch (end.of) {
    case Anchor::Of::world:
      place.at = joint.points_m[which];
      break;
    case Anchor::Of::soft: {
      const SoftState<Real>& body = soft[end.index];
      place.support = end.support;
      place.support.body = end.index;
      place.yields = body.is_awake();
      for (std::uint32_t i = 0; i < end.support.count; ++i) {
        const std::pair<std::uint32_t, std::uint32_t> key{end.index, end.support.vertices[i]};
        const auto slot = std::ranges::lower_bound(held_, key) - held_.begin();
        place.support.vertices[i] = static_cast<std::uint32_t>(slot);
        place.at += end.support.weights[i] * body.position_m(key.second);
        if (place.yields) place.ahead_m += end.support.weights[i] * body.dr[key.second].template cast<double>();
      }
      break;
    }
    case Anchor::Of::rigid: {
      const RigidState& body = rigid[end.index];
      const bool yields = body.is_awake() && is_active(body);
      const Vec3d still = Vec3d::Zero();
      place = place_of_solid(joint, which, body.position, body.orientation, yields ? body.velocity : still,
                             yields ? body.angular_velocity : still, dt_s);
      place.yields = yields;
      place.support.body = static_cast<std::uint32_t>(soft.size() + (yields ? end.index : rigid.size()));
      break;
    }
    case Anchor::Of::collider: {
      const ColliderState& body = colliders[end.index];
      const std::uint32_t fixed = place.support.body;
      place = place_of_solid(joint, which, body.position, body.orientation, body.collider.velocity,
                             body.collider.angular_velocity, dt_s);
      place.support.body = fixed;
      break;
    }
  }
  place.kept_m = kept_of_end<Real>(joint, which, soft, rigid, colliders);
  return place;
}

template <class Real>
void JointContacts<Real>::find_rows(std::span<const JointState> joints, bool only_solid,
                                    std::span<SoftState<Real>> soft, std::span<const RigidState> rigid,
                                    std::span<const ColliderState> colliders, double dt_s) {
  rows_.clear();
  for (std::uint32_t i = 0; i < joints.size(); ++i) {
    if (only_solid && joints[i].has_soft) continue;
    const EndPlace first = place_of(joints[i], 0, soft, rigid, colliders, dt_s);
    const EndPlace second = place_of(joints[i], 1, soft, rigid, colliders, dt_s);
    append_joint_rows(joints[i], i, first, second, error_left_m(joints[i], first, second, {dt_s}), {dt_s}, rows_);
    if (rope_softness_1_kg_[i] == 0.0) continue;
    ContactRow across = rows_.back();
    ++across.key.features;
    across.kind = RowKind::guide;
    across.softness_1_kg = rope_softness_1_kg_[i];
    across.most_n_s = std::numeric_limits<double>::infinity();
    rows_.push_back(across);
  }
}

// The implicit step of a turn against its stiffness: (I + h^2 K) w' = I w, before the joints act on it.
template <class Real>
void JointContacts<Real>::slow_unresolved(std::span<RigidState> rigid) const {
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (stiffness_kg_m2_[i] <= 0.0) continue;
    const Vec3d inertia = rigid[i].inverse_inertia_1_kg_m2.cwiseInverse();
    const Vec3d kept = inertia.cwiseQuotient(inertia + Vec3d::Constant(stiffness_kg_m2_[i]));
    const Quatd axes = principal_orientation(rigid[i]);
    rigid[i].angular_velocity = axes * kept.cwiseProduct(axes.conjugate() * rigid[i].angular_velocity);
  }
}

// All groups; returns how many did not come to an end.
template <class Real>
std::uint64_t JointContacts<Real>::solve(std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid) {
  responses_.clear();
  for (const SoftState<Real>& body : soft) {
    if (body.is_awake()) {
      responses_.emplace_back(LumpedResponse(inverse_masses_1_kg_, changes_m_s_));
    } else {
      responses_.emplace_back(FixedResponse{});
    }
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    Eigen::Matrix3d inverse_1_kg_m2 = inverse_inertia_1_kg_m2(rigid[i]);
    if (stiffness_kg_m2_[i] > 0.0) {
      const Eigen::Matrix3d rotation = principal_orientation(rigid[i]).toRotationMatrix();
      const Vec3d inertia_kg_m2 = rigid[i].inverse_inertia_1_kg_m2.cwiseInverse();
      const Vec3d inverse = (inertia_kg_m2 + Vec3d::Constant(stiffness_kg_m2_[i])).cwiseInverse();
      inverse_1_kg_m2 = rotation * inverse.asDiagonal() * rotation.transpose();
    }
    responses_.emplace_back(RigidResponse(inverse_masses_1_kg(rigid[i]), inverse_1_kg_m2));
  }
  responses_.emplace_back(FixedResponse{});
  std::uint64_t unconverged = 0;
  for (const RowGroup& group : groups_) {
    const SolveOutcome outcome =
        solve_joint_rows(std::span(rows_).subspan(group.begin, group.end - group.begin), responses_, joint_enough_m_s);
    unconverged += outcome.converged ? 0 : 1;
  }
  return unconverged;
}

// A rope resists being swung aside like a spring of its load over its length. Where the substep does not resolve that,
// the rope gets a row across it, which takes the implicit step of that spring. False where there is none.
template <class Real>
bool JointContacts<Real>::find_rope_stiffness(std::span<const JointState> joints, double dt_s) {
  bool any = false;
  for (const ContactRow& row : rows_) {
    if (row.kind != RowKind::contact || !(row.impulse_n_s.dot(row.normal) > 0.0)) continue;
    const std::uint32_t index = *joint_of(row);
    const double length_m = std::get<DistanceLimit>(joints[index].joint.kind).longest_m - row.gap_m;
    const double stiffness_kg = dt_s * row.impulse_n_s.norm() / length_m;
    const double inverse_mass_1_kg = coupling_1_kg(responses_, row, row).trace() / 3.0;
    if (stiffness_kg * inverse_mass_1_kg <= resolved_share) continue;
    rope_softness_1_kg_[index] = 1.0 / stiffness_kg;
    any = true;
  }
  return any;
}

// A force on an arm resists turning like a spring. Where a body is so light that the substep does not resolve that, as
// a link between heavy things, its turning counts as slower. False where there is none.
template <class Real>
bool JointContacts<Real>::find_turning_stiffness(std::size_t first, std::span<const RigidState> rigid, double dt_s) {
  bool any = false;
  pulls_.assign(rigid.size(), {});
  for (const ContactRow& row : rows_) {
    for (const Support* side : {&row.first, &row.second}) {
      if (side->turns || side->body < first || side->body >= first + rigid.size()) continue;
      const double impulse_n_s = row.impulse_n_s.norm();
      Pull& pull = pulls_[side->body - first];
      pull.impulse_n_s += impulse_n_s;
      pull.by_arm += impulse_n_s * side->arm;
      stiffness_kg_m2_[side->body - first] += dt_s * impulse_n_s * side->arm.norm();
    }
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    // Guides hold a body whose turning is locked; a rope adds nothing to that.
    if (std::ranges::count(rigid[i].body.locked.rotation, true) > 0) stiffness_kg_m2_[i] = 0.0;
    if (!(stiffness_kg_m2_[i] > 0.0)) continue;
    // What is held at one end turns about that.
    const double turns_about_m = pulls_[i].by_arm.norm() / pulls_[i].impulse_n_s;
    const double inertia_kg_m2 =
        1.0 / rigid[i].inverse_inertia_1_kg_m2.maxCoeff() + rigid[i].body.mass_kg * turns_about_m * turns_about_m;
    if (stiffness_kg_m2_[i] <= resolved_share * inertia_kg_m2) stiffness_kg_m2_[i] = 0.0;
    any |= stiffness_kg_m2_[i] > 0.0;
  }
  return any;
}

template <class Real>
void JointContacts<Real>::answer(std::span<JointState> joints, bool only_solid, std::span<SoftState<Real>> soft,
                                 std::span<RigidState> rigid, std::span<const ColliderState> colliders, double dt_s) {
  find_held_vertices(joints, only_solid, soft);
  rope_softness_1_kg_.assign(joints.size(), 0.0);
  find_rows(joints, only_solid, soft, rigid, colliders, dt_s);
  if (rows_.empty()) return;
  counts_.rows += rows_.size();
  yields_.assign(soft.size() + rigid.size() + 1, 1);
  yields_.back() = 0;
  group_rows(rows_, yields_, groups_);
  stiffness_kg_m2_.assign(rigid.size(), 0.0);
  const std::uint64_t unconverged = solve(soft, rigid);
  const bool turns_stiffly = find_turning_stiffness(soft.size(), rigid, dt_s);
  const bool swings_stiffly = find_rope_stiffness(joints, dt_s);
  if (turns_stiffly || swings_stiffly) {
    slow_unresolved(rigid);
    find_rows(joints, only_solid, soft, rigid, colliders, dt_s);
    group_rows(rows_, yields_, groups_);
    changes_m_s_.assign(held_.size(), Vec3d::Zero());
    counts_.unconverged += solve(soft, rigid);
  } else {
    counts_.unconverged += unconverged;
  }
  for (std::size_t k = 0; k < held_.size(); ++k) {
    const auto [body, vertex] = held_[k];
    if (!soft[body].is_awake() || changes_m_s_[k].isZero(0.0)) continue;
    soft[body].v[vertex] += changes_m_s_[k].template cast<Real>();
    soft[body].dr[vertex] += (dt_s * changes_m_s_[k]).template cast<Real>();
  }
  for (std::size_t k = 0; k < rigid.size(); ++k) {
    const auto& response = std::get<RigidResponse>(responses_[soft.size() + k]);
    rigid[k].velocity += response.velocity_change_m_s();
    rigid[k].angular_velocity += response.turning_change_rad_s();
  }
  for (const ContactRow& row : rows_) {
    if (has_given_way(row)) joints[*joint_of(row)].broken = true;
  }
}

template <class Real>
std::size_t JointContacts<Real>::bytes() const {
  return held_.capacity() * sizeof(held_[0]) + inverse_masses_1_kg_.capacity() * sizeof(double) +
         changes_m_s_.capacity() * sizeof(Vec3d) + rows_.capacity() * sizeof(ContactRow) +
         groups_.capacity() * sizeof(RowGroup) + yields_.capacity() + responses_.capacity() * sizeof(Response);
}

template class JointContacts<float>;
template class JointContacts<double>;

}  // namespace pneuma::physics
