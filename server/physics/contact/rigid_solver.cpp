#include "physics/contact/rigid_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/contact/bounce_limit.h"
#include "physics/contact/crowding.h"
#include "physics/contact/solver.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {
namespace {

// A box on a floor settles in about 10 sweeps, a stack of five in 40; most substeps end early.
constexpr std::uint32_t velocity_sweeps_max = 50;
// Sweeps hand a weight down by a share of it. A box on one of a tenth of its mass sank through it, and five equal boxes
// fell over at 60 substeps a second. So groups of few rows are solved together, and of unequal masses also larger ones.
// Not all are: a heap of 12 equal boxes has 50 to 90 rows and took 16 ms a substep.
constexpr double unequal_masses_ratio = 4.0;
constexpr std::size_t unequal_rows_max = 64;
constexpr std::size_t equal_rows_max = 40;
constexpr std::uint32_t push_sweeps_max = 10;
// Of a contact's size: a sweep whose impulses move less than this in the substep is the last.
constexpr double settled_change = 2e-13;
// Of a contact's size: an overlap this small is left, and of a larger one a fifth is undone in a substep: bodies at
// rest keep their contacts.
constexpr double overlap_kept_share = 1e-5;
constexpr double overlap_share = 0.2;
// Of a contact's size: points of two bodies that meet within this of each other hit together; of others the first one
// bounces alone.
constexpr double together_share = 1e-4;
// Of the least half extent of what meets: by how much points may leave their straight ways in a piece of a substep.
constexpr double bend_share = 0.5;
// A slab of 2 x 2 m and 1 cm may then turn more than twice in a substep. One that turns further, while it may touch
// something, loses spin.
constexpr int pieces_max = 256;
// Contacts solved in all pieces of a substep, about: one or two seconds' work. What is left of the substep is one piece
// then.
constexpr std::size_t piece_rows_max = 400'000;
// Of a contact's size: by how much less the end of a bounce may move things.
constexpr double cut_share = 1e-3;
// Times that a piece is made shorter until it is short enough for the spin that its contacts leave.
constexpr int piece_halvings_max = 8;
// Of the length that would just do: the spin may be faster than the last one.
constexpr double shortened = 0.9;
// Of the time to a bounce: a piece ends before it, so that the next one begins with it.
constexpr double nearly = 0.999;

// Of the inverse mass: the corners of a box say the same several times over, and friction at them does too. Four times
// as many factorisations were spent on choosing among equal answers.
constexpr double softness_share = 1e-7;
// Of a contact's size: where an approach goes no further than this in a substep, another solver has answered it.
constexpr double met_share = 1e-5;

// Of a free body's inverse mass: along what gives way less than this, locked axes hold the body.
constexpr double free_share_min = 1e-6;

double inverse_mass_along(const RigidState& body, const Vec3d& arm, const Vec3d& direction) {
  return inverse_mass_along_1_kg(body, direction) +
         inverse_inertia_times(body, arm.cross(direction)).cross(arm).dot(direction);
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

double distance_after_m(std::span<const RigidState> rigid, const RigidContact& c, double dt_s) {
  return c.distance_m + dt_s * relative_velocity(rigid, c).dot(c.normal);
}

// Not where locked axes hold both.
bool gives_way(std::span<const RigidState> rigid, const RigidContact& c, double inverse_mass_1_kg) {
  const double free_1_kg = rigid[c.a].inverse_mass_1_kg + (c.b == no_body ? 0.0 : rigid[c.b].inverse_mass_1_kg);
  return inverse_mass_1_kg > free_share_min * free_1_kg;
}

RigidResponse response_of(const RigidState& body) {
  return {inverse_masses_1_kg(body), inverse_inertia_1_kg_m2(body)};
}

bool has_bounced(const RigidContact& c) {
  return c.bounces && c.normal_impulse_n_s > 0.0;
}

/// By how much the ends of a body that turns leave their straight ways, over the square of the time, m/s^2.
double bend_m_s2(const RigidState& body, const Vec3d& angular_velocity_rad_s) {
  if (std::holds_alternative<SphereShape>(body.body.shape)) return 0.0;
  return 0.5 * angular_velocity_rad_s.squaredNorm() * radius_about_centre(body.body.shape);
}

/// Slows what turns too far for a piece of a substep.
void hold_spin(std::span<RigidState> rigid, const RigidContact& c, double dt_s) {
  for (const std::uint32_t i : {c.a, c.b}) {
    if (i == no_body) continue;
    const double over = bend_m_s2(rigid[i], rigid[i].angular_velocity) * dt_s * dt_s / (bend_share * c.thin_m);
    if (over > 1.0) rigid[i].angular_velocity /= std::sqrt(over);
  }
}

}  // namespace

std::size_t RigidSolver::bytes() const {
  const std::size_t indices =
      order_.capacity() + groups_.capacity() + groups_in_pieces_.capacity() + members_.capacity();
  return indices * sizeof(std::uint32_t) + pairs_.capacity() * sizeof(RigidPair) +
         contacts_.capacity() * sizeof(RigidContact) + rows_.capacity() * sizeof(ContactRow) + joined_.bytes() +
         row_groups_.capacity() * sizeof(RowGroup) + yields_.capacity() + still_m_s_.capacity() * sizeof(double) +
         responses_.capacity() * sizeof(Response) + pressed_.capacity() + before_.capacity() * sizeof(Motion) +
         shifts_m_.capacity() * sizeof(Vec3d) + colliders_.capacity() * sizeof(ColliderState);
}

void RigidSolver::solve(std::span<RigidState> rigid, std::span<const ColliderState> colliders, const Met& met,
                        const Vec3d& gravity_m_s2, double dt_s, TouchTally* touches) {
  const std::span<const std::uint8_t> touched = met.touched;
  touches_ = touches;
  begin(rigid, colliders, gravity_m_s2, dt_s);
  leave_out_met(rigid, met.solved, dt_s);
  solve_velocities(rigid, dt_s);
  take_groups_for_pieces(rigid, dt_s);
  note_pressed();
  cut_moves(rigid);
  undo_overlaps(rigid, 1.0);
  for (const std::uint32_t group : groups_in_pieces_) {
    members_.clear();
    for (std::uint32_t i = group; i < rigid.size(); ++i) {
      if (groups_[i] == group) members_.push_back(i);
    }
    move_in_pieces(rigid, colliders, touched, gravity_m_s2, dt_s);
  }

  // accelerate_rigid_bodies gave a whole substep's gravity; on average over the substep it is half of that.
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    const bool in_flight = touched[i] == 0 && pressed_[i] == 0 && !rigid[i].has_moved;
    if (rigid[i].is_awake() && is_active(rigid[i]) && in_flight) {
      rigid[i].position -= 0.5 * dt_s * dt_s * pull_m_s2(rigid[i], gravity_m_s2);
    }
  }
}

// Whole groups: what supports a body is not left out of what pushes it.
void RigidSolver::leave_out_met(std::span<const RigidState> rigid, std::span<const std::uint8_t> solved, double dt_s) {
  std::vector<std::uint8_t> is_open(rigid.size(), 0);
  for (const RigidContact& c : contacts_) {
    const bool was_solved = solved[c.a] != 0 && (c.b == no_body || solved[c.b] != 0);
    const double off_m_s = relative_velocity(rigid, c).dot(c.normal) - c.target_m_s;
    if (!was_solved || off_m_s < -met_share * c.size_m / dt_s) is_open[groups_[c.a]] = 1;
  }
  for (RigidContact& c : contacts_) c.is_met = is_open[groups_[c.a]] == 0;
}

void RigidSolver::append_rows(std::span<RigidState> rigid, std::span<const ColliderState> colliders,
                              const Vec3d& gravity_m_s2, double dt_s, std::uint32_t first,
                              std::vector<ContactRow>& rows) {
  begin(rigid, colliders, gravity_m_s2, dt_s);
  std::vector<std::uint8_t> is_left_out(rigid.size(), 0);
  for (const RigidContact& c : contacts_) {
    if (c.bounces || bend_over(rigid, c, dt_s) > 1.0) is_left_out[groups_[c.a]] = 1;
  }
  load_rows(rigid);
  const auto first_collider = static_cast<std::uint32_t>(first + rigid.size());
  const auto all_colliders = static_cast<std::uint32_t>(first_collider + colliders.size());
  for (ContactRow& row : rows_) {
    const RigidContact& c = contacts_[row.key.features];
    if (is_left_out[groups_[c.a]] != 0) continue;
    aim_row(rigid, row);
    soften(rigid, row);
    row.first.body = first + c.a;
    row.second.body = c.b == no_body ? first_collider + c.collider : first + c.b;
    row.key = feature_key(FeatureKind::rigid, row.first.body, c.b == no_body ? all_colliders : row.second.body,
                          row.key.features);
    rows.push_back(row);
  }
}

// As bodies and colliders are now.
void RigidSolver::begin(std::span<RigidState> rigid, std::span<const ColliderState> colliders,
                        const Vec3d& gravity_m_s2, double dt_s) {
  pressed_.assign(rigid.size(), 0);
  before_.clear();
  for (const RigidState& body : rigid) before_.push_back({body.velocity, body.angular_velocity});
  find_contacts(rigid, colliders, dt_s);
  find_groups(rigid.size());
  prepare(rigid, gravity_m_s2, resting_substeps * gravity_m_s2.norm() * dt_s, dt_s, false);
}

void RigidSolver::find_contacts(std::span<RigidState> rigid, std::span<const ColliderState> colliders, double dt_s) {
  find_rigid_pairs(rigid, dt_s, order_, pairs_);
  const auto takes_part = [&](std::uint32_t i) { return rigid[i].is_awake() && is_active(rigid[i]); };
  contacts_.clear();
  const auto find = [&](const auto& is_full) {
    auto pair = pairs_.begin();
    for (std::uint32_t a = 0; a < rigid.size() && !is_full(); ++a) {
      if (takes_part(a)) find_contacts_of(rigid, a, colliders, dt_s);
      for (; pair != pairs_.end() && pair->a == a && !is_full(); ++pair) {
        if (takes_part(a) && takes_part(pair->b)) find_rigid_contacts(rigid, a, pair->b, dt_s, contacts_);
      }
    }
  };
  leave_out_crowds(rigid, rigid_contacts_max(rigid.size()), contacts_, find,
                   [](const RigidContact& c, Takings& contacts_of) {
                     contacts_of.add(c.a, 1);
                     if (c.b != no_body) contacts_of.add(c.b, 1);
                   });
}

void RigidSolver::find_contacts_of(std::span<const RigidState> rigid, std::uint32_t a,
                                   std::span<const ColliderState> colliders, double dt_s) {
  for (std::uint32_t i = 0; i < colliders.size(); ++i) {
    const std::size_t before = contacts_.size();
    find_collider_contacts(rigid, a, colliders[i], dt_s, contacts_);
    for (RigidContact& c : std::span(contacts_).subspan(before)) c.collider = i;
  }
}

void RigidSolver::find_contacts_of_group(std::span<RigidState> rigid, double dt_s) {
  contacts_.clear();
  for (const std::uint32_t a : members_) {
    if (contacts_.size() > rigid_contacts_max(rigid.size())) {
      rigid[a].is_crowded = true;
      continue;
    }
    find_contacts_of(rigid, a, colliders_, dt_s);
    auto pair = std::ranges::lower_bound(pairs_, a, {}, &RigidPair::a);
    for (; pair != pairs_.end() && pair->a == a; ++pair) {
      if (groups_[pair->b] == groups_[a]) find_rigid_contacts(rigid, a, pair->b, dt_s, contacts_);
    }
  }
}

// Of all contacts that may come; row_groups_ are those of the rows alone.
void RigidSolver::find_groups(std::size_t bodies) {
  joined_.begin(bodies);
  for (const RigidContact& c : contacts_) {
    if (c.b != no_body) joined_.join(c.a, c.b);
  }
  groups_.resize(bodies);
  for (std::uint32_t i = 0; i < bodies; ++i) groups_[i] = joined_.lowest_with(i);
}

// What bounces in a piece flies on in it, and what gravity does to it then counts. In a whole substep it stays where it
// bounced (cut_moves).
void RigidSolver::prepare(std::span<const RigidState> rigid, const Vec3d& gravity_m_s2, double resting_m_s, double dt_s,
                          bool is_piece) {
  for (RigidContact& c : contacts_) {
    c.bounces = c.is_met = false;
    c.normal_impulse_n_s = 0.0;
    c.arm_a = c.point - rigid[c.a].position;
    if (c.b != no_body) c.arm_b = c.point - rigid[c.b].position;
    c.gives_way = gives_way(rigid, c, inverse_mass_along(rigid, c, c.normal));
    const double normal_m_s = relative_velocity(rigid, c).dot(c.normal);
    c.closing_m_s = -normal_m_s;
    c.target_m_s = -std::max(0.0, c.distance_m) / dt_s;
    if (normal_m_s >= c.target_m_s) continue;  // would not meet
    const double after_s = dt_s + std::max(0.0, c.distance_m) / normal_m_s;
    const double gained_m_s = c.b == no_body ? after_s * c.normal.dot(pull_m_s2(rigid[c.a], gravity_m_s2)) : 0.0;
    const double impact_m_s = impact_speed(normal_m_s, gained_m_s, resting_m_s);
    if (impact_m_s < 0.0 && c.surface.restitution > 0.0) {
      c.target_m_s = std::max(c.target_m_s, -c.surface.restitution * impact_m_s + (is_piece ? gained_m_s : 0.0));
      c.bounces = true;
    }
  }
  // What belongs to two bodies, or to a body and all colliders, lies side by side.
  const auto are_others = [](const RigidContact& c, const RigidContact& next) {
    return c.a != next.a || c.b != next.b;
  };
  for (auto first = contacts_.begin(); first != contacts_.end();) {
    auto last = std::adjacent_find(first, contacts_.end(), are_others);
    if (last != contacts_.end()) ++last;
    for (RigidContact& c : std::span(first, last)) {
      const auto hits_before = [&c](const RigidContact& other) {
        if (!other.bounces || other.normal.dot(c.normal) <= 0.0) return false;
        const double until_other_s = std::max(0.0, other.distance_m) / other.closing_m_s;
        return c.distance_m - until_other_s * c.closing_m_s > together_share * c.size_m;
      };
      if (!c.bounces || std::none_of(first, last, hits_before)) continue;
      c.bounces = false;
      c.target_m_s = -std::max(0.0, c.distance_m) / dt_s;
    }
    first = last;
  }
}

// One a contact whose bodies can give way, with nothing to reach yet; its key is the contact's place.
void RigidSolver::load_rows(std::span<const RigidState> rigid) {
  const auto fixed = static_cast<std::uint32_t>(rigid.size());
  rows_.clear();
  responses_.assign(rigid.size() + 1, FixedResponse{});
  yields_.assign(rigid.size() + 1, 0);
  for (std::uint32_t i = 0; i < contacts_.size(); ++i) {
    const RigidContact& c = contacts_[i];
    if (!c.gives_way) continue;
    for (const std::uint32_t body : {c.a, c.b}) {
      if (body == no_body || yields_[body] != 0) continue;
      responses_[body] = response_of(rigid[body]);
      yields_[body] = 1;
    }
    ContactRow& row = rows_.emplace_back();
    row.key.features = i;
    row.first.body = c.a;
    row.first.arm = c.arm_a;
    row.second.body = c.b == no_body ? fixed : c.b;
    row.second.arm = c.arm_b;
    row.normal = c.normal;
  }
}

// Sets what the row of a contact is to reach.
void RigidSolver::aim_row(std::span<const RigidState> rigid, ContactRow& row) const {
  const RigidContact& c = contacts_[row.key.features];
  const Vec3d tangent = c.normal.unitOrthogonal();
  const double across_1_kg =
      std::max(inverse_mass_along(rigid, c, tangent), inverse_mass_along(rigid, c, c.normal.cross(tangent)));
  row.friction = gives_way(rigid, c, across_1_kg) ? c.surface.friction : 0.0;
  row.free_m_s = relative_velocity(rigid, c);
  row.least_m_s = c.target_m_s;
}

void RigidSolver::soften(std::span<const RigidState> rigid, ContactRow& row) const {
  const RigidContact& c = contacts_[row.key.features];
  row.softness_1_kg = softness_share * inverse_mass_along(rigid, c, c.normal);
}

// From no impulse, and softer.
void RigidSolver::begin_again(std::span<const RigidState> rigid, ContactRow& row) {
  row.impulse_n_s.setZero();
  soften(rigid, row);
  for (const std::uint32_t body : {row.first.body, row.second.body}) {
    if (yields_[body] == 0) continue;
    responses_[body] = response_of(rigid[body]);
  }
}

// A group ends its sweeps by itself, so that it has the same bits whoever else there is.
void RigidSolver::solve_velocities(std::span<RigidState> rigid, double dt_s) {
  load_rows(rigid);
  std::erase_if(rows_, [this](const ContactRow& row) { return contacts_[row.key.features].is_met; });
  group_rows(rows_, yields_, row_groups_);
  for (ContactRow& row : rows_) aim_row(rigid, row);
  for (const RowGroup& group : row_groups_) {
    const auto rows = std::span(rows_).subspan(group.begin, group.end - group.begin);
    double size_m = std::numeric_limits<double>::infinity();
    double lightest_1_kg = 0.0;
    double heaviest_1_kg = std::numeric_limits<double>::infinity();
    for (const ContactRow& row : rows) {
      const RigidContact& c = contacts_[row.key.features];
      size_m = std::min(size_m, c.size_m);
      for (const std::uint32_t body : {c.a, c.b}) {
        if (body == no_body) continue;
        lightest_1_kg = std::max(lightest_1_kg, rigid[body].inverse_mass_1_kg);
        heaviest_1_kg = std::min(heaviest_1_kg, rigid[body].inverse_mass_1_kg);
      }
    }
    const bool are_unequal = lightest_1_kg > unequal_masses_ratio * heaviest_1_kg;
    const bool are_few = rows.size() <= (are_unequal ? unequal_rows_max : equal_rows_max);
    const SolveLimits limits{.sweeps_max = velocity_sweeps_max,
                             .enough_m_s = settled_change * size_m / dt_s,
                             .direct_rows_max = are_few ? rows.size() : 0};
    bool converged = solve_rows(rows, responses_, limits).converged;
    if (!converged && are_few) {
      for (ContactRow& row : rows) begin_again(rigid, row);
      converged = solve_rows(rows, responses_, limits).converged;
    }
    if (std::ranges::any_of(rows, [this](const ContactRow& row) { return contacts_[row.key.features].bounces; })) {
      still_m_s_.clear();
      for (const ContactRow& row : rows) {
        const RigidContact& c = contacts_[row.key.features];
        still_m_s_.push_back(c.bounces ? -std::max(0.0, c.distance_m) / dt_s : row.least_m_s);
      }
      converged = limit_bounce(rows, responses_, still_m_s_, {}, limits) && converged;
    }
    counts_.unconverged += converged ? 0 : 1;
  }
  counts_.rows += rows_.size();
  for (const ContactRow& row : rows_) {
    RigidContact& c = contacts_[row.key.features];
    c.normal_impulse_n_s = row.impulse_n_s.dot(row.normal);
    c.impulse_n_s = row.impulse_n_s;
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (yields_[i] == 0) continue;
    const auto& response = std::get<RigidResponse>(responses_[i]);
    rigid[i].velocity += response.velocity_change_m_s();
    rigid[i].angular_velocity += response.turning_change_rad_s();
  }
}

// How often over its points leave their straight ways by more than they may: with the spins that contact found, or
// those it left.
double RigidSolver::bend_over(std::span<const RigidState> rigid, const RigidContact& c, double dt_s) const {
  const auto of = [&](std::uint32_t i) {
    return std::max(bend_m_s2(rigid[i], before_[i].angular_velocity), bend_m_s2(rigid[i], rigid[i].angular_velocity));
  };
  const double bend = of(c.a) + (c.b == no_body ? c.bend_m_s2 : of(c.b));
  return bend * dt_s * dt_s / (bend_share * c.thin_m);
}

// Gives the groups that one look at their contacts is not enough for their velocities back, and forgets the contacts.
void RigidSolver::take_groups_for_pieces(std::span<RigidState> rigid, double dt_s) {
  groups_in_pieces_.clear();
  find_shifts(rigid, dt_s);
  for (const RigidContact& c : contacts_) {
    const double after_m = distance_after_m(rigid, c, dt_s);
    const double shift_m = c.normal.dot(shift_between_m(c));
    // Where one corner bounced, the shift may push another one in. And two bodies that pass each other would change
    // their angular momentum by it.
    const bool is_pushed_in = shift_m < 0.0 && after_m + shift_m < std::min(c.distance_m, 0.0) - cut_share * c.size_m;
    const bool bounces_far =
        has_bounced(c) && after_m > (c.b == no_body ? bend_share * c.thin_m : cut_share * c.size_m);
    if (bend_over(rigid, c, dt_s) > 1.0 || is_pushed_in || bounces_far) groups_in_pieces_.push_back(groups_[c.a]);
  }
  if (groups_in_pieces_.empty()) return;
  std::ranges::sort(groups_in_pieces_);
  const auto same = std::ranges::unique(groups_in_pieces_);
  groups_in_pieces_.erase(same.begin(), same.end());
  const auto turns = [&](std::uint32_t body) { return std::ranges::binary_search(groups_in_pieces_, groups_[body]); };
  std::erase_if(contacts_, [&](const RigidContact& c) { return turns(c.a); });
  for (std::uint32_t i = 0; i < rigid.size(); ++i) {
    if (!turns(i)) continue;
    rigid[i].velocity = before_[i].velocity;
    rigid[i].angular_velocity = before_[i].angular_velocity;
    shifts_m_[i].setZero();
  }
}

// When the first contact bounces that is not there yet.
double RigidSolver::first_bounce_s(std::span<const RigidState> rigid) const {
  double first_s = std::numeric_limits<double>::infinity();
  for (const RigidContact& c : contacts_) {
    if (!c.bounces || c.distance_m < rigid_margin_share * c.size_m) continue;
    first_s = std::min(first_s, -c.distance_m / relative_velocity(rigid, c).dot(c.normal));
  }
  return first_s;
}

// Conservative advancement: each piece is as long as its own motion allows, and ends where something bounces.
void RigidSolver::move_in_pieces(std::span<RigidState> rigid, std::span<const ColliderState> colliders,
                                 std::span<const std::uint8_t> touched, const Vec3d& gravity_m_s2, double dt_s) {
  const double resting_m_s = resting_substeps * gravity_m_s2.norm() * dt_s;
  const auto begin_piece = [&](double piece_s) {
    for (const std::uint32_t i : members_) {
      rigid[i].velocity = before_[i].velocity + piece_s * pull_m_s2(rigid[i], gravity_m_s2);
      rigid[i].angular_velocity = before_[i].angular_velocity;
    }
    prepare(rigid, gravity_m_s2, resting_m_s, piece_s, true);
  };
  colliders_.assign(colliders.begin(), colliders.end());
  for (const std::uint32_t i : members_) rigid[i].velocity -= dt_s * pull_m_s2(rigid[i], gravity_m_s2);
  double left_s = dt_s;
  std::size_t rows_solved = 0;
  for (int pieces_left = pieces_max; pieces_left > 0 && left_s > 0.0; --pieces_left) {
    if (rows_solved > piece_rows_max) pieces_left = 1;
    const double least_s = left_s / pieces_left;
    for (const std::uint32_t i : members_) {
      before_[i] = {rigid[i].velocity, rigid[i].angular_velocity};
      rigid[i].velocity += left_s * pull_m_s2(rigid[i], gravity_m_s2);
    }
    find_contacts_of_group(rigid, left_s);
    for (const RigidContact& c : contacts_) hold_spin(rigid, c, least_s);
    for (const std::uint32_t i : members_) before_[i].angular_velocity = rigid[i].angular_velocity;
    begin_piece(left_s);
    double piece_s = std::clamp(nearly * first_bounce_s(rigid), least_s, left_s);
    for (int shortening = 0;; ++shortening) {
      begin_piece(piece_s);
      solve_velocities(rigid, piece_s);
      rows_solved += contacts_.size();
      double over = 0.0;
      for (const RigidContact& c : contacts_) over = std::max(over, bend_over(rigid, c, piece_s));
      const bool is_short = over <= 1.0 || piece_s <= least_s || rows_solved > piece_rows_max;
      if (is_short || shortening == piece_halvings_max) break;
      piece_s = std::max(least_s, shortened * piece_s / std::sqrt(over));
    }
    for (const std::uint32_t i : members_) pressed_[i] = 0;
    note_pressed();
    undo_overlaps(rigid, piece_s / dt_s);
    for (const RigidContact& c : contacts_) hold_spin(rigid, c, piece_s);
    for (const std::uint32_t i : members_) {
      if (touched[i] == 0 && pressed_[i] == 0) {
        rigid[i].position -= 0.5 * piece_s * piece_s * pull_m_s2(rigid[i], gravity_m_s2);
      }
      move_rigid(rigid[i], piece_s);
    }
    move_solids({}, colliders_, piece_s);
    left_s -= piece_s;
  }
  for (const std::uint32_t i : members_) rigid[i].has_moved = true;
}

void RigidSolver::note_pressed() {
  for (const RigidContact& c : contacts_) {
    if (c.normal_impulse_n_s <= 0.0) continue;
    pressed_[c.a] = 1;
    if (c.b != no_body) pressed_[c.b] = 1;
    if (touches_ == nullptr) continue;
    const BodyRef other = c.b == no_body ? BodyRef{BodyKind::collider, c.collider} : BodyRef{BodyKind::rigid, c.b};
    touches_->add({BodyKind::rigid, c.a}, other, c.impulse_n_s, c.point, c.normal);
  }
}

// What bounced ends the substep where it touched: the height it gets back is then that of its speed, whatever the step.
void RigidSolver::find_shifts(std::span<const RigidState> rigid, double dt_s) {
  shifts_m_.assign(rigid.size(), Vec3d::Zero());
  for (const RigidContact& c : contacts_) {
    if (!has_bounced(c)) continue;
    const double past_m = distance_after_m(rigid, c, dt_s) + c.normal.dot(shift_between_m(c));
    if (past_m <= 0.0) continue;
    const double inverse_a = inverse_mass_along_1_kg(rigid[c.a], c.normal);
    const double inverse_b = c.b == no_body ? 0.0 : inverse_mass_along_1_kg(rigid[c.b], c.normal);
    if (!gives_way(rigid, c, inverse_a + inverse_b)) continue;
    const auto share_of = [&](const RigidState& body) -> Vec3d {
      return (past_m * inverse_masses_1_kg(body) / (inverse_a + inverse_b)).cwiseProduct(c.normal);
    };
    shifts_m_[c.a] -= share_of(rigid[c.a]);
    if (c.b != no_body) shifts_m_[c.b] += share_of(rigid[c.b]);
  }
}

Vec3d RigidSolver::shift_between_m(const RigidContact& c) const {
  return c.b == no_body ? shifts_m_[c.a] : Vec3d(shifts_m_[c.a] - shifts_m_[c.b]);
}

void RigidSolver::cut_moves(std::span<RigidState> rigid) const {
  for (std::size_t i = 0; i < rigid.size(); ++i) rigid[i].position += shifts_m_[i];
}

// The same rows, of moves in place of velocities.
void RigidSolver::undo_overlaps(std::span<RigidState> rigid, double share) {
  const auto wanted_m = [share](const RigidContact& c) {
    return share * overlap_share * (-c.distance_m - overlap_kept_share * c.size_m);
  };
  if (std::ranges::none_of(contacts_, [&](const RigidContact& c) { return wanted_m(c) > 0.0; })) return;
  load_rows(rigid);
  std::erase_if(rows_, [&](const ContactRow& row) { return wanted_m(contacts_[row.key.features]) <= 0.0; });
  for (ContactRow& row : rows_) row.least_m_s = wanted_m(contacts_[row.key.features]);
  (void)solve_rows(rows_, responses_, {.sweeps_max = push_sweeps_max});
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (yields_[i] == 0) continue;
    const auto& response = std::get<RigidResponse>(responses_[i]);
    rigid[i].position += response.velocity_change_m_s();
    rigid[i].orientation = turned(rigid[i].orientation, response.turning_change_rad_s(), 1.0);
  }
}

}  // namespace pneuma::physics
