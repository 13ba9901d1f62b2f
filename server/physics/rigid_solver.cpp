#include <algorithm>
#include <cmath>
#include <numeric>

#include "physics/rigid.h"
#include "physics/shape.h"

namespace pneuma::physics {
namespace {

// A box on a floor settles in about 10 rounds, a stack of five in 40; most substeps end early.
constexpr int velocity_rounds_max = 50;
constexpr int push_rounds_max = 10;
// A round whose impulses change a velocity by less than this is the last.
constexpr double settled_m_s = 1e-10;
// An overlap this small is left, and of a larger one a fifth is undone in a substep: bodies at rest keep their
// contacts.
constexpr double overlap_kept_m = 1e-5;
constexpr double overlap_share = 0.2;
// Points of two bodies that meet within this of each other hit together; of others the first one bounces alone.
constexpr double together_m = 1e-4;

double inverse_mass_along(const RigidState& body, const Vec3d& arm, const Vec3d& direction) {
  return body.inverse_mass_1_kg + inverse_inertia_times(body, arm.cross(direction)).cross(arm).dot(direction);
}

double inverse_mass_along(std::span<const RigidState> rigid, const RigidContact& c, const Vec3d& direction) {
  const double a = inverse_mass_along(rigid[c.a], c.arm_a, direction);
  return c.b == no_body ? a : a + inverse_mass_along(rigid[c.b], c.arm_b, direction);
}

Vec3d relative_velocity(std::span<const RigidState> rigid, const RigidContact& c) {
  const Vec3d a = velocity_at(rigid[c.a].velocity, rigid[c.a].angular_velocity, c.arm_a);
  return c.b == no_body ? Vec3d(a - c.velocity_b)
                        : Vec3d(a - velocity_at(rigid[c.b].velocity, rigid[c.b].angular_velocity, c.arm_b));
}

void apply(RigidState& body, const Vec3d& arm, const Vec3d& impulse_n_s) {
  body.velocity += body.inverse_mass_1_kg * impulse_n_s;
  body.angular_velocity += inverse_inertia_times(body, arm.cross(impulse_n_s));
}

void apply(std::span<RigidState> rigid, const RigidContact& c, const Vec3d& impulse_n_s) {
  apply(rigid[c.a], c.arm_a, impulse_n_s);
  if (c.b != no_body) apply(rigid[c.b], c.arm_b, -impulse_n_s);
}

/// One round of one contact; returns the change of velocity that it made.
double solve_contact(std::span<RigidState> rigid, RigidContact& c) {
  const double normal_m_s = relative_velocity(rigid, c).dot(c.normal);
  const double before_n_s = c.normal_impulse_n_s;
  c.normal_impulse_n_s = std::max(0.0, before_n_s + (c.target_m_s - normal_m_s) * c.mass_normal_kg);
  const double change_n_s = c.normal_impulse_n_s - before_n_s;
  apply(rigid, c, change_n_s * c.normal);

  const Vec3d relative = relative_velocity(rigid, c);
  const Vec3d sliding = relative - relative.dot(c.normal) * c.normal;
  Vec3d tangent_n_s = c.tangent_impulse_n_s - c.mass_tangent_kg * sliding;
  const double limit_n_s = c.surface.friction * c.normal_impulse_n_s;
  const double size_n_s = tangent_n_s.norm();
  if (size_n_s > limit_n_s) tangent_n_s *= limit_n_s / size_n_s;
  const Vec3d tangent_change_n_s = tangent_n_s - c.tangent_impulse_n_s;
  c.tangent_impulse_n_s = tangent_n_s;
  apply(rigid, c, tangent_change_n_s);
  return std::max(std::abs(change_n_s) / c.mass_normal_kg, tangent_change_n_s.norm() / c.mass_tangent_kg);
}

}  // namespace

std::size_t RigidSolver::bytes() const {
  return order_.capacity() * sizeof(std::uint32_t) + pairs_.capacity() * sizeof(RigidPair) +
         contacts_.capacity() * sizeof(RigidContact) + pushes_.capacity() * sizeof(Push) +
         groups_.capacity() * sizeof(std::uint32_t) + changes_m_s_.capacity() * sizeof(double) + settled_.capacity();
}

void RigidSolver::solve(std::span<RigidState> rigid, std::span<const ColliderState> colliders,
                        std::span<const std::uint8_t> touched, const Vec3d& gravity_m_s2, double dt_s) {
  find_contacts(rigid, colliders, dt_s);
  find_groups(rigid.size());
  prepare(rigid, gravity_m_s2, dt_s);
  solve_velocities(rigid);
  cut_moves(rigid, dt_s);
  undo_overlaps(rigid);

  // accelerate_rigid_bodies gave a whole substep's gravity; on average over the substep it is half of that.
  const auto in_flight = [&](std::uint32_t i) {
    const auto holds = [i](const RigidContact& c) { return (c.a == i || c.b == i) && c.normal_impulse_n_s > 0.0; };
    return touched[i] == 0 && std::ranges::none_of(contacts_, holds);
  };
  for (std::uint32_t i = 0; i < rigid.size(); ++i) {
    if (rigid[i].is_awake() && is_active(rigid[i]) && in_flight(i))
      rigid[i].position -= 0.5 * dt_s * dt_s * gravity_m_s2;
  }
}

void RigidSolver::find_contacts(std::span<const RigidState> rigid, std::span<const ColliderState> colliders,
                                double dt_s) {
  find_rigid_pairs(rigid, dt_s, order_, pairs_);
  const auto takes_part = [&](std::uint32_t i) { return rigid[i].is_awake() && is_active(rigid[i]); };
  contacts_.clear();
  auto pair = pairs_.begin();
  for (std::uint32_t a = 0; a < rigid.size(); ++a) {
    if (!takes_part(a)) continue;
    for (const ColliderState& collider : colliders) find_collider_contacts(rigid, a, collider, dt_s, contacts_);
    for (; pair != pairs_.end() && pair->a == a; ++pair) find_rigid_contacts(rigid, a, pair->b, dt_s, contacts_);
  }
}

// A group ends its rounds by itself, so that it has the same bits whoever else there is.
void RigidSolver::find_groups(std::size_t bodies) {
  groups_.resize(bodies);
  std::iota(groups_.begin(), groups_.end(), 0U);
  const auto first_of = [this](std::uint32_t body) {
    while (groups_[body] != body) body = groups_[body] = groups_[groups_[body]];
    return body;
  };
  for (const RigidContact& c : contacts_) {
    if (c.b == no_body) continue;
    const std::uint32_t a = first_of(c.a);
    const std::uint32_t b = first_of(c.b);
    groups_[std::max(a, b)] = std::min(a, b);
  }
  for (std::uint32_t i = 0; i < bodies; ++i) groups_[i] = first_of(i);
}

void RigidSolver::prepare(std::span<const RigidState> rigid, const Vec3d& gravity_m_s2, double dt_s) {
  const double resting_m_s = resting_substeps * gravity_m_s2.norm() * dt_s;
  for (RigidContact& c : contacts_) {
    c.arm_a = c.point - rigid[c.a].position;
    if (c.b != no_body) c.arm_b = c.point - rigid[c.b].position;
    const Vec3d tangent = c.normal.unitOrthogonal();
    c.mass_normal_kg = 1.0 / inverse_mass_along(rigid, c, c.normal);
    c.mass_tangent_kg =
        1.0 / std::max(inverse_mass_along(rigid, c, tangent), inverse_mass_along(rigid, c, c.normal.cross(tangent)));
    const double normal_m_s = relative_velocity(rigid, c).dot(c.normal);
    c.target_m_s = -std::max(0.0, c.distance_m) / dt_s;
    if (normal_m_s >= c.target_m_s) continue;  // would not meet
    const double after_s = dt_s + std::max(0.0, c.distance_m) / normal_m_s;
    const double gained_m_s = c.b == no_body ? after_s * c.normal.dot(gravity_m_s2) : 0.0;
    const double impact_m_s = impact_speed(normal_m_s, gained_m_s, resting_m_s);
    if (impact_m_s < 0.0 && c.surface.restitution > 0.0) {
      c.target_m_s = -c.surface.restitution * impact_m_s;
      c.bounces = true;
    }
  }
  for (RigidContact& c : contacts_) {
    const auto hits_before = [&c](const RigidContact& other) {
      return other.bounces && other.a == c.a && other.b == c.b && other.distance_m < c.distance_m - together_m &&
             other.normal.dot(c.normal) > 0.0;
    };
    if (!c.bounces || std::ranges::none_of(contacts_, hits_before)) continue;
    c.bounces = false;
    c.target_m_s = -std::max(0.0, c.distance_m) / dt_s;
  }
}

void RigidSolver::solve_velocities(std::span<RigidState> rigid) {
  settled_.assign(rigid.size(), 0);
  bool going_on = true;
  for (int round = 0; round < velocity_rounds_max && going_on; ++round) {
    changes_m_s_.assign(rigid.size(), 0.0);
    for (RigidContact& c : contacts_) {
      const std::uint32_t group = groups_[c.a];
      if (settled_[group] == 0) changes_m_s_[group] = std::max(changes_m_s_[group], solve_contact(rigid, c));
    }
    going_on = false;
    for (const RigidContact& c : contacts_) {
      const bool settled = changes_m_s_[groups_[c.a]] < settled_m_s;
      settled_[groups_[c.a]] = settled ? 1 : 0;
      going_on |= !settled;
    }
  }
}

// What bounced ends the substep where it touched: the height it gets back is then that of its speed, whatever the step.
void RigidSolver::cut_moves(std::span<RigidState> rigid, double dt_s) {
  pushes_.assign(rigid.size(), Push{});
  for (const RigidContact& c : contacts_) {
    if (!c.bounces || c.normal_impulse_n_s <= 0.0) continue;
    const Vec3d shift_b = c.b == no_body ? Vec3d(Vec3d::Zero()) : pushes_[c.b].linear_m;
    const double past_m =
        c.distance_m + dt_s * relative_velocity(rigid, c).dot(c.normal) + c.normal.dot(pushes_[c.a].linear_m - shift_b);
    if (past_m <= 0.0) continue;
    const double inverse_a = rigid[c.a].inverse_mass_1_kg;
    const double inverse_b = c.b == no_body ? 0.0 : rigid[c.b].inverse_mass_1_kg;
    pushes_[c.a].linear_m -= past_m * inverse_a / (inverse_a + inverse_b) * c.normal;
    if (c.b != no_body) pushes_[c.b].linear_m += past_m * inverse_b / (inverse_a + inverse_b) * c.normal;
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) rigid[i].position += pushes_[i].linear_m;
}

void RigidSolver::undo_overlaps(std::span<RigidState> rigid) {
  pushes_.assign(rigid.size(), Push{});
  const auto moved = [&](std::uint32_t i, const Vec3d& arm) -> Vec3d {
    return velocity_at(pushes_[i].linear_m, pushes_[i].angular_rad, arm);
  };
  const auto push = [&](std::uint32_t i, const Vec3d& arm, const Vec3d& kg_m) {
    pushes_[i].linear_m += rigid[i].inverse_mass_1_kg * kg_m;
    pushes_[i].angular_rad += inverse_inertia_times(rigid[i], arm.cross(kg_m));
  };
  bool pushed = false;
  for (int round = 0; round < push_rounds_max; ++round) {
    for (RigidContact& c : contacts_) {
      const double wanted_m = overlap_share * (-c.distance_m - overlap_kept_m);
      if (wanted_m <= 0.0) continue;
      const Vec3d relative = c.b == no_body ? moved(c.a, c.arm_a) : Vec3d(moved(c.a, c.arm_a) - moved(c.b, c.arm_b));
      const double before_kg_m = c.push_kg_m;
      c.push_kg_m = std::max(0.0, before_kg_m + (wanted_m - relative.dot(c.normal)) * c.mass_normal_kg);
      const Vec3d change = (c.push_kg_m - before_kg_m) * c.normal;
      push(c.a, c.arm_a, change);
      if (c.b != no_body) push(c.b, c.arm_b, -change);
      pushed = true;
    }
    if (!pushed) return;
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    rigid[i].position += pushes_[i].linear_m;
    rigid[i].orientation = turned(rigid[i].orientation, pushes_[i].angular_rad, 1.0);
  }
}

}  // namespace pneuma::physics
