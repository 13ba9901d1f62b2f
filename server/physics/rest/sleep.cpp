#include "physics/rest/sleep.h"

#include <algorithm>
#include <cmath>

#include "physics/contact/solid_move.h"
#include "physics/contact/touch_groups.h"
#include "physics/forces/force_terms.h"
#include "physics/forces/soft_setup.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {

namespace {

double length_m(const RigidState& body) {
  return 2.0 * radius_about_centre(body.body.shape);
}

// What is thrown up stands still at its top. Gravity must move it out of the places that it has within the time, a kept
// one and one that it is near: by 0.086 g t^2 at least, wherever in its flight that begins.
double fall_m(const Vec3d& gravity_m_s2) {
  return gravity_m_s2.norm() * rest_time_s * rest_time_s / 16.0;
}

double kept_place_m(double length_m, const Vec3d& gravity_m_s2) {
  const double share_m = rest_place_share * length_m;
  return gravity_m_s2.isZero() ? share_m : std::min(share_m, fall_m(gravity_m_s2));
}

// What gravity does not hold together drifts, and is near nothing.
double near_place_m(double length_m, const Vec3d& gravity_m_s2) {
  return std::min(near_place_share * length_m, fall_m(gravity_m_s2) / 4.0);
}

// On a floor some vertices tremble at rest, so most must be fast.
template <class Real>
bool is_mostly_faster(const SoftState<Real>& body, double speed_m_s) {
  std::size_t fast = 0;
  for (std::size_t k = 0; k < sampled_vertices; ++k) {
    const Vec3<Real>& v = body.v[body.sampled_vertex(k)];
    if (static_cast<double>(v.squaredNorm()) > speed_m_s * speed_m_s) ++fast;
  }
  return 2 * fast > sampled_vertices;
}

std::uint32_t rest_ticks(double period_s) {
  return static_cast<std::uint32_t>(std::ceil(rest_time_s / period_s)) + 1;  // a count of 1 spans no time yet
}

double turned_m(const RigidState& body, const Quatd& from) {
  return 0.5 * length_m(body) * body.orientation.angularDistance(from);
}

template <class Real>
void begin_near(SoftState<Real>& body) {
  for (std::size_t k = 0; k < sampled_vertices; ++k) body.near_place[k] = body.x[body.sampled_vertex(k)];
}

void begin_near(RigidState& body) {
  body.near_place = body.position;
  body.near_orientation = body.orientation;
}

template <class Real>
double from_near_m(const SoftState<Real>& body) {
  Real most_m2 = 0;
  for (std::size_t k = 0; k < sampled_vertices; ++k) {
    most_m2 = std::max(most_m2, (body.x[body.sampled_vertex(k)] - body.near_place[k]).squaredNorm());
  }
  return std::sqrt(static_cast<double>(most_m2));
}

double from_near_m(const RigidState& body) {
  return (body.position - body.near_place).norm() + turned_m(body, body.near_orientation);
}

// A body at rest needs no second place. Another has one from when it leaves a place slowly: `left` is for how many
// ticks it had kept that, or 0.
template <class Body>
void note_near(Body& body, double length_m, std::uint32_t left, const Vec3d& gravity_m_s2, double period_s) {
  const std::uint32_t needed = rest_ticks(period_s);
  if (body.rest.ticks >= needed) {
    body.rest.near_ticks = 0;
  } else if (body.rest.near_ticks == 0) {
    if (left == 0) return;
    begin_near(body);
    body.rest.near_ticks = std::min(left, needed - 1);
  } else if (from_near_m(body) > near_place_m(length_m, gravity_m_s2)) {
    body.rest.near_ticks = 0;
  } else if (++body.rest.near_ticks >= 2 * needed) {
    begin_near(body);  // it creeps
    body.rest.near_ticks = needed;
  }
}

template <class Real>
void note_rest(SoftState<Real>& body, const Surroundings& surroundings, double period_s) {
  if (is_kept_awake(body, surroundings)) {
    wake(body);
    return;
  }
  const auto length_m = static_cast<double>(body.length_m);
  const double tolerance_m = kept_place_m(length_m, surroundings.gravity);
  std::uint32_t left = 0;
  if (body.rest.ticks == 0) {
    if (!is_mostly_faster(body, tolerance_m / period_s)) {
      body.place = body.x;
      body.rest.ticks = 1;
    }
  } else {
    const auto squared_m2 = static_cast<Real>(tolerance_m * tolerance_m);
    std::size_t kept = 0;
    while (kept < body.x.size() && (body.x[kept] - body.place[kept]).squaredNorm() <= squared_m2) ++kept;
    if (kept == body.x.size()) {
      ++body.rest.ticks;
    } else {
      left = is_mostly_faster(body, tolerance_m / period_s) ? 0 : body.rest.ticks;
      body.rest.ticks = 0;
    }
  }
  if (body.rest.ticks == 0) body.place.clear();
  note_near(body, length_m, left, surroundings.gravity, period_s);
}

void note_rest(RigidState& body, const Surroundings& surroundings, double period_s) {
  const double tolerance_m = kept_place_m(length_m(body), surroundings.gravity);
  const double moved_m = (body.position - body.place).norm() + turned_m(body, body.place_orientation);
  std::uint32_t left = 0;
  if (body.rest.ticks > 0 && moved_m <= tolerance_m) {
    ++body.rest.ticks;
  } else {
    left = body.rest.ticks > 1 ? body.rest.ticks : 0;  // who moves fast begins a place at each tick
    body.rest.ticks = 1;
    body.place = body.position;
    body.place_orientation = body.orientation;
  }
  note_near(body, length_m(body), left, surroundings.gravity, period_s);
}

template <class Real>
bool is_slow(const SoftState<Real>& body) {
  double squares_m2_s2 = 0.0;
  for (const Vec3<Real>& v : body.v) squares_m2_s2 += static_cast<double>(v.squaredNorm());
  const double speed_m_s = rest_speed_1_s * static_cast<double>(body.length_m);
  return squares_m2_s2 <= static_cast<double>(body.v.size()) * speed_m_s * speed_m_s;
}

bool is_slow(const RigidState& body) {
  const double rim_m_s = 0.5 * length_m(body) * body.angular_velocity.norm();
  const double speed_m_s = rest_speed_1_s * length_m(body);
  return body.velocity.squaredNorm() + rim_m_s * rim_m_s <= speed_m_s * speed_m_s;
}

template <class Real>
void fall_asleep(SoftState<Real>& body) {
  std::ranges::fill(body.v, Vec3<Real>::Zero());
  std::ranges::fill(body.dr, Vec3<Real>::Zero());
  body.rest = {.asleep = true};
  body.place = {};
}

void fall_asleep(RigidState& body) {
  body.velocity.setZero();
  body.angular_velocity.setZero();
  body.rest = {.asleep = true};
}

// Calls visit(i, body) for each body, soft ones first.
template <class Real, class Visit>
void for_each_body(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, const Visit& visit) {
  for (std::size_t i = 0; i < soft.size(); ++i) visit(i, soft[i]);
  for (std::size_t i = 0; i < rigid.size(); ++i) visit(soft.size() + i, rigid[i]);
}

/// Whether a moving collider may reach the body in the next tick.
bool is_reached(const Extent& extent, std::span<const SolidMove> moves, double period_s) {
  BodyBounds bounds;
  bounds.moved = bounds.swept = extent.box;
  return std::ranges::any_of(moves, [&](const SolidMove& solid) {
    return may_meet(bounds, solid, extent.reach_m + solid.surface->thickness_m, period_s);
  });
}

template <class Real>
void keep_awake_near_moving(std::span<SoftState<Real>> soft, std::span<RigidState> rigid,
                            std::span<const ColliderState> colliders, double period_s) {
  std::vector<SolidMove> moves;
  for (const ColliderState& collider : colliders) {
    if (is_moving(collider.collider)) moves.push_back(move_of(collider, period_s));
  }
  if (moves.empty()) return;
  for_each_body(soft, rigid, [&](std::size_t i, const auto& body) {
    const bool rests = body.rest.asleep || body.rest.ticks > 0 || body.rest.near_ticks > 0;
    if (rests && is_reached(extent_of(body), moves, period_s)) (void)wake_group(soft, rigid, i);
  });
}

enum class Rests : std::uint8_t { no, nearly, yes, asleep };

template <class Body>
Rests rests_of(const Body& body, std::uint32_t ticks_needed) {
  if (body.rest.asleep) return Rests::asleep;
  if (!body.is_awake()) return Rests::no;
  if (body.rest.ticks >= ticks_needed) return Rests::yes;
  return body.rest.near_ticks >= ticks_needed && body.tie == 0 ? Rests::nearly : Rests::no;
}

// Sleepers sleep on, and say nothing of the others.
bool is_at_rest(const std::vector<std::size_t>& group, const std::vector<Rests>& rests) {
  const auto count = [&](Rests which) {
    return static_cast<std::size_t>(
        std::ranges::count_if(group, [&](std::size_t body) { return rests[body] == which; }));
  };
  if (count(Rests::no) > 0) return false;
  const std::size_t resting = count(Rests::yes);
  const std::size_t awake = resting + count(Rests::nearly);
  if (resting == awake) return true;
  return awake > small_group_bodies_max &&
         static_cast<double>(resting) >= resting_share_min * static_cast<double>(awake);
}

template <class Real>
void put_groups_to_sleep(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, std::uint32_t ticks_needed) {
  std::vector<Rests> rests(soft.size() + rigid.size(), Rests::no);
  bool any = false;
  for_each_body(soft, rigid, [&](std::size_t i, auto& body) {
    const bool may_rest = body.is_awake() && std::max(body.rest.ticks, body.rest.near_ticks) >= ticks_needed;
    if (may_rest && !is_slow(body)) wake(body);
    rests[i] = rests_of(body, ticks_needed);
    any |= rests[i] == Rests::yes || rests[i] == Rests::nearly;
  });
  if (!any) return;
  std::vector<Extent> extents = extents_of<Real>(soft, rigid, [](const auto& body) { return !body.frozen; });
  std::vector<std::uint8_t> falls(rests.size(), 0);
  for (std::size_t i = 0; i < rests.size(); ++i) {
    if (!extents[i].counts) continue;
    const std::vector<std::size_t> group = take_group(extents, i);
    if (!is_at_rest(group, rests)) continue;
    for (const std::size_t body : group) falls[body] = 1;
  }
  for_each_body(soft, rigid, [&](std::size_t i, auto& body) {
    if (falls[i] != 0 && body.is_awake()) fall_asleep(body);
  });
}

bool same_collider(const Collider& a, const Collider& b) {
  return a.name == b.name && a.shape == b.shape && a.position == b.position &&
         a.orientation.coeffs().isApprox(b.orientation.coeffs()) && a.velocity == b.velocity &&
         a.angular_velocity == b.angular_velocity && a.surface == b.surface;
}

bool same_body(const SoftBody& a, const SoftBody& b) {
  return continues(a, b) && a.mass_kg == b.mass_kg && a.vertex_mass_scale == b.vertex_mass_scale &&
         a.springs == b.springs && a.gas == b.gas && a.volume == b.volume && a.pressure_spread == b.pressure_spread &&
         a.surface == b.surface && a.pins == b.pins && a.pin_boundary == b.pin_boundary && a.drag == b.drag &&
         a.collision == b.collision;
}

// An orientation that went through an edit was made unit length again, which may have changed its last bits.
bool same_body(const RigidBody& a, const RigidBody& b) {
  return a.shape == b.shape && a.mass_kg == b.mass_kg && a.position == b.position &&
         a.orientation.coeffs().isApprox(b.orientation.coeffs()) && a.velocity == b.velocity &&
         a.angular_velocity == b.angular_velocity && a.surface == b.surface && a.locked == b.locked;
}

// Wakes what the joints hold that are among `joints` alone.
template <class Real>
void wake_held(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, const std::vector<Joint>& joints,
               const std::vector<Joint>& others) {
  for (const Joint& joint : joints) {
    if (std::ranges::find(others, joint) != others.end()) continue;
    for (const Anchor* anchor : {&joint.first, &joint.second}) {
      for (std::size_t i = 0; i < soft.size(); ++i) {
        if (soft[i].body.name == anchor->body) (void)wake_group(soft, rigid, i);
      }
      for (std::size_t i = 0; i < rigid.size(); ++i) {
        if (rigid[i].body.name == anchor->body) (void)wake_group(soft, rigid, soft.size() + i);
      }
    }
  }
}

template <class Body>
bool goes_on(const Body& live, const std::vector<Body>& wanted) {
  return std::ranges::any_of(wanted, [&](const Body& body) { return body.name == live.name && same_body(live, body); });
}

}  // namespace

template <class Real>
void settle(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, std::span<const ColliderState> colliders,
            const Surroundings& surroundings, double period_s) {
  for (SoftState<Real>& body : soft) {
    if (body.is_awake()) note_rest(body, surroundings, period_s);
  }
  for (RigidState& body : rigid) {
    if (body.is_awake()) note_rest(body, surroundings, period_s);
  }
  keep_awake_near_moving(soft, rigid, colliders, period_s);
  put_groups_to_sleep(soft, rigid, rest_ticks(period_s));
}

template <class Real>
void wake_all(std::span<SoftState<Real>> soft, std::span<RigidState> rigid) {
  for_each_body(soft, rigid, [](std::size_t, auto& body) { wake(body); });
}

template <class Real>
void wake_changed(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, const Scene& live,
                  const Scene& wanted) {
  if (live.gravity != wanted.gravity || live.atmosphere != wanted.atmosphere || live.stepping != wanted.stepping ||
      !std::ranges::equal(live.colliders, wanted.colliders, same_collider)) {
    wake_all(soft, rigid);
    return;
  }
  wake_held(soft, rigid, live.joints, wanted.joints);
  wake_held(soft, rigid, wanted.joints, live.joints);
  for (std::size_t i = 0; i < soft.size(); ++i) {
    if (!goes_on(live.soft_bodies[i], wanted.soft_bodies)) (void)wake_group(soft, rigid, i);
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (!goes_on(live.rigid_bodies[i], wanted.rigid_bodies)) (void)wake_group(soft, rigid, soft.size() + i);
  }
}

#define PNEUMA_INSTANTIATE(Real)                                                                                \
  template void settle<Real>(std::span<SoftState<Real>>, std::span<RigidState>, std::span<const ColliderState>, \
                             const Surroundings&, double);                                                      \
  template void wake_all<Real>(std::span<SoftState<Real>>, std::span<RigidState>);                              \
  template void wake_changed<Real>(std::span<SoftState<Real>>, std::span<RigidState>, const Scene&, const Scene&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
