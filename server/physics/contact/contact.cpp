#include "physics/contact/contact.h"

#include <algorithm>
#include <functional>
#include <ranges>

#include "physics/contact/touch_groups.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {
namespace {

// Waking other threads takes some 10 us, in which one thread does about this many vertices.
constexpr std::size_t parallel_vertices_min = 2'048;

// The vertices of each that are near are listed for so many pairs at a time: in a heap of bodies each pair has many.
constexpr std::size_t pairs_at_once = 1'024;

// Wakes a sleeper that was touched in this substep, and its group. The rigid ones get the gravity that the others have
// already; soft ones do not move before the next substep.
template <class Real>
void wake_touched(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, std::size_t body,
                  const SubstepPhysics& physics) {
  const bool asleep = body < soft.size() ? soft[body].rest.asleep : rigid[body - soft.size()].rest.asleep;
  if (!asleep) return;
  for (const std::size_t i : wake_group(soft, rigid, body)) {
    if (i >= soft.size())
      rigid[i - soft.size()].velocity += physics.dt_s * pull_m_s2(rigid[i - soft.size()], physics.gravity_m_s2);
  }
}

// About all that a rigid body may touch in a substep, and a quarter of its size more.
Aabb<double> reach_of(const RigidState& body, double dt_s) {
  constexpr double generous = 1.25;
  const double reach_m =
      generous * (radius_about_centre(body.body.shape) + body.body.surface.thickness_m + dt_s * body.velocity.norm());
  return {body.position - Vec3d::Constant(reach_m), body.position + Vec3d::Constant(reach_m)};
}

template <class Real>
Aabb<double> swept_by(const SoftState<Real>& body, const BodyBounds& bounds) {
  const Vec3d thickness_m = Vec3d::Constant(body.body.surface.thickness_m);
  return {bounds.swept.min - thickness_m, bounds.swept.max + thickness_m};
}

bool is_in_reach(const Aabb<double>& swept, const Aabb<double>& reach) {
  return (swept.min.array() <= reach.max.array()).all() && (swept.max.array() >= reach.min.array()).all();
}

}  // namespace

template <class Real>
template <class Work>
void Contacts<Real>::for_each(Workers& workers, std::size_t count, const Work& work) {
  if (workers.threads() > 1 && vertices_ >= parallel_vertices_min) {
    workers.for_each(count, std::cref(work));
    return;
  }
  for (std::size_t i = 0; i < count; ++i) work(i);
}

template <class Real>
void Contacts<Real>::resolve(const ContactWorld<Real>& world, Workers& workers, Profile* profile) {
  const std::span<SoftState<Real>> soft = world.soft;
  const std::span<RigidState> rigid = world.rigid;
  const std::span<const ColliderState> colliders = world.colliders;
  const auto meets_soft = [](const SoftState<Real>& body) {
    return !body.frozen && body.body.collision.soft != SoftCollision::none;
  };
  const auto is_awake = [](const auto& body) { return body.is_awake(); };
  if (std::ranges::none_of(soft, is_awake) && std::ranges::none_of(rigid, is_awake)) return;
  const bool solids = !rigid.empty() || !colliders.empty();
  const bool pairs = std::ranges::count_if(soft, meets_soft) > 1;
  const bool self =
      std::ranges::any_of(soft, [](const auto& body) { return !body.frozen && body.body.collision.self; });
  const bool joints = !world.joints.empty();
  if (!solids && !pairs && !self && !joints) return;
  const bool meshes = std::ranges::any_of(colliders, [](const ColliderState& state) { return state.tree != nullptr; });
  const bool surfaces = pairs || self || (meshes && !soft.empty());

  const SubstepPhysics physics = SubstepPhysics::of(world.surroundings.gravity, world.dt_s);
  notes_ = world.notes;
  if (joints) hold_joints(world, profile);
  if (!soft.empty()) {
    const StageTimer timer(profile, Stage::bounds);
    bounds_.resize(soft.size());
    vertices_ = 0;
    for (const SoftState<Real>& body : soft) {
      if (body.is_awake()) vertices_ += body.x.size();
    }
    for_each(workers, bounds_.size(), [&](std::size_t i) { fit(soft[i], bounds_[i]); });
    swept_.resize(soft.size());
    for (std::size_t i = 0; i < soft.size(); ++i) swept_[i] = swept_by(soft[i], bounds_[i]);
  }
  pairs_.clear();
  soft_touched_.assign(soft.size(), 0);
  rigid_touched_.assign(rigid.size(), 0);
  for (std::size_t r = 0; joints && r < rigid.size(); ++r) {
    if (rigid[r].tie != 0 && rigid[r].is_awake()) rigid_touched_[r] = 1;
  }
  if (surfaces) surfaces_.take_meshes(colliders, physics.dt_s, physics.resting_m_s);
  if (surfaces && !world.is_implicit()) {
    const StageTimer timer(profile, Stage::soft_contact);
    meet_surfaces(world, physics);
  }
  if (pairs) meet_bounding_volumes(world, physics, workers, profile);
  if (world.is_implicit()) {
    const StageTimer timer(profile, Stage::soft_contact);
    meet_coupled(world, physics);
  }
  wake_hit_pairs(soft, rigid, physics);
  if (solids && !soft.empty() && !world.is_implicit()) {
    const StageTimer timer(profile, Stage::solid_contact);
    meet_solids(world, physics, workers);
  }
  if (!rigid.empty()) {
    const StageTimer timer(profile, Stage::rigid);
    wake_near_rigid(soft, rigid, physics);
    rigid_solver_.solve(rigid, colliders, rigid_touched_, world.surroundings.gravity, world.dt_s);
  }
  if (surfaces && !world.is_implicit()) {
    const StageTimer timer(profile, Stage::soft_contact);
    refit_stale(soft);
    surfaces_.cut({soft, bounds_, world.dt_s, world.is_first_of_tick});
  }
  if (surfaces) surfaces_.part(soft, world.dt_s);
}

// An implicit step solves for its soft bodies' joints together with their contacts.
template <class Real>
void Contacts<Real>::hold_joints(const ContactWorld<Real>& world, Profile* profile) {
  const StageTimer timer(profile, Stage::joints);
  joints_.answer(world.joints, world.is_implicit(), world.soft, world.rigid, world.colliders, world.dt_s);
}

template <class Real>
void Contacts<Real>::meet_surfaces(const ContactWorld<Real>& world, const SubstepPhysics& physics) {
  surfaces_.answer({world.soft, bounds_, physics.dt_s, world.is_first_of_tick}, notes_, soft_touched_);
  for (std::size_t i = 0; i < bounds_.size(); ++i) bounds_[i].stale = bounds_[i].stale || soft_touched_[i] != 0;
}

template <class Real>
void Contacts<Real>::meet_coupled(const ContactWorld<Real>& world, const SubstepPhysics& physics) {
  refit_stale(world.soft);
  coupled_.run({.soft = world.soft,
                .tables = world.tables,
                .start_m_s = world.start_m_s,
                .bounds = bounds_,
                .rigid = world.rigid,
                .colliders = world.colliders,
                .surroundings = world.surroundings,
                .resting_m_s = physics.resting_m_s,
                .dt_s = physics.dt_s,
                .first_order = world.first_order,
                .joints = world.joints,
                .notes = notes_,
                .soft_touched = soft_touched_,
                .rigid_touched = rigid_touched_},
               surfaces_);
  for (std::size_t r = 0; r < rigid_touched_.size(); ++r) {
    if (rigid_touched_[r] != 0) wake_touched(world.soft, world.rigid, world.soft.size() + r, physics);
  }
}

template <class Real>
void Contacts<Real>::meet_bounding_volumes(const ContactWorld<Real>& world, const SubstepPhysics& physics,
                                           Workers& workers, Profile* profile) {
  const std::span<SoftState<Real>> soft = world.soft;
  const HitResponse response = world.is_implicit() ? HitResponse::whole : HitResponse::vertices;
  {
    const StageTimer timer(profile, Stage::broad_phase);
    find_soft_pairs<Real>(soft, bounds_, order_, pairs_);
    std::erase_if(pairs_,
                  [&](const SoftPair& pair) { return SurfaceContacts<Real>::asks_for(soft[pair.a], soft[pair.b]); });
  }
  if (pairs_.empty()) return;

  const StageTimer timer(profile, Stage::soft_contact);
  near_.resize(std::min(pairs_.size(), pairs_at_once));
  for_each(workers, bounds_.size(), [&](std::size_t i) {
    const bool is_paired = std::ranges::binary_search(pairs_, static_cast<std::uint32_t>(i), {}, &SoftPair::a);
    if (is_paired) fit_means(soft[i], bounds_[i]);
  });
  for (std::size_t first = 0; first < pairs_.size(); first += pairs_at_once) {
    const auto some = std::span(pairs_).subspan(first, std::min(pairs_at_once, pairs_.size() - first));
    for_each(workers, some.size(), [&](std::size_t p) {
      const std::uint32_t a = some[p].a;
      const std::uint32_t b = some[p].b;
      near_[p].clear();
      find_near_vertices(soft[a], bounds_[a], soft[b], bounds_[b], near_[p]);
    });
    // One pair after the other: each meets what those before it left.
    for (std::size_t p = 0; p < some.size(); ++p) {
      const std::uint32_t a = some[p].a;
      const std::uint32_t b = some[p].b;
      meet_bounds(soft[a], bounds_[a], soft[b], bounds_[b], near_[p], physics.resting_m_s, physics.dt_s, response,
                  hits_);
      some[p].hit = !hits_.empty();
      if (notes_.empty()) continue;
      for (const VertexHit& hit : hits_)
        notes_[a].push_back({hit.vertex, VertexContact::Other::soft, b, hit.hit.normal});
    }
  }
}

// Colliders last: they do not give way, so what a rigid body pushed into them must come back.
template <class Real>
void Contacts<Real>::meet_solids(const ContactWorld<Real>& world, const SubstepPhysics& physics, Workers& workers) {
  const std::span<SoftState<Real>> soft = world.soft;
  const std::span<RigidState> rigid = world.rigid;
  const std::span<const ColliderState> colliders = world.colliders;
  for (std::uint32_t r = 0; r < rigid.size(); ++r) {
    if (!is_active(rigid[r])) continue;
    refit_stale(soft);
    Aabb<double> reach = reach_of(rigid[r], physics.dt_s);
    for (std::size_t i = 0; i < soft.size(); ++i) {
      if (!is_in_reach(swept_[i], reach)) continue;
      if (!bounds_[i].active || !(soft[i].is_awake() || rigid[r].is_awake())) continue;
      if (!meet_rigid(soft[i], bounds_[i], rigid[r], r, physics, notes_of(i))) continue;
      reach = reach_of(rigid[r], physics.dt_s);
      rigid_touched_[r] = 1;
      wake_touched(soft, rigid, i, physics);
      wake_touched(soft, rigid, soft.size() + r, physics);
    }
  }
  if (colliders.empty()) return;
  refit_stale(soft);
  collider_moves_.clear();
  for (const ColliderState& collider : colliders) collider_moves_.push_back(move_of(collider, physics.dt_s));
  const auto meet = [&](std::size_t i) {
    if (!bounds_[i].active || !soft[i].is_awake()) return;
    meet_colliders<Real>(soft[i], bounds_[i], collider_moves_, physics, notes_of(i));
  };
  for_each(workers, bounds_.size(), meet);
}

template <class Real>
void Contacts<Real>::refit_stale(std::span<SoftState<Real>> soft) {
  for (std::size_t i = 0; i < soft.size(); ++i) {
    if (!bounds_[i].active || !bounds_[i].stale) continue;
    fit_boxes(soft[i], bounds_[i]);
    swept_[i] = swept_by(soft[i], bounds_[i]);
  }
}

template <class Real>
void Contacts<Real>::fit(const SoftState<Real>& body, BodyBounds& bounds) const {
  if (body.rest.asleep && bounds.asleep) return;
  bounds = {};
  if (body.frozen) return;
  fit_boxes(body, bounds);
  bounds.asleep = body.rest.asleep;
}

template <class Real>
void Contacts<Real>::wake_hit_pairs(std::span<SoftState<Real>> soft, std::span<RigidState> rigid,
                                    const SubstepPhysics& physics) {
  for (const SoftPair& pair : pairs_) {
    if (!pair.hit) continue;
    wake_touched(soft, rigid, pair.a, physics);
    wake_touched(soft, rigid, pair.b, physics);
  }
  for (std::size_t i = 0; i < soft_touched_.size(); ++i) {
    if (soft_touched_[i] != 0) wake_touched(soft, rigid, i, physics);
  }
}

template <class Real>
void Contacts<Real>::wake_near_rigid(std::span<SoftState<Real>> soft, std::span<RigidState> rigid,
                                     const SubstepPhysics& physics) {
  for (std::uint32_t b = 0; b < rigid.size(); ++b) {
    for (std::uint32_t a = 0; a < rigid.size() && rigid[b].rest.asleep; ++a) {
      if (!rigid[a].is_awake() || !is_active(rigid[a])) continue;
      rigid_near_.clear();
      find_rigid_contacts(rigid, a, b, physics.dt_s, rigid_near_);
      if (!rigid_near_.empty()) wake_touched(soft, rigid, soft.size() + b, physics);
    }
  }
}

template <class Real>
void Contacts<Real>::add_bytes(Profile& profile) const {
  const auto add = [&](Stage stage, std::size_t bytes) { profile[static_cast<std::size_t>(stage)].bytes += bytes; };
  add(Stage::bounds, bounds_.capacity() * sizeof(BodyBounds));
  add(Stage::broad_phase, order_.capacity() * sizeof(std::uint32_t) + pairs_.capacity() * sizeof(SoftPair));
  std::size_t near_bytes = near_.capacity() * sizeof(std::vector<std::uint32_t>);
  for (const std::vector<std::uint32_t>& near : near_) near_bytes += near.capacity() * sizeof(std::uint32_t);
  add(Stage::soft_contact, hits_.capacity() * sizeof(VertexHit) + near_bytes + surfaces_.bytes() + coupled_.bytes());
  add(Stage::joints, joints_.bytes());
  add(Stage::solid_contact, collider_moves_.capacity() * sizeof(SolidMove));
  add(Stage::rigid, rigid_touched_.capacity() + rigid_near_.capacity() * sizeof(RigidContact) + rigid_solver_.bytes());
}

template class Contacts<float>;
template class Contacts<double>;

}  // namespace pneuma::physics
