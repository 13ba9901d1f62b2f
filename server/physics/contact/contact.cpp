#include "physics/contact/contact.h"

#include <algorithm>
#include <functional>
#include <ranges>
#include <utility>

#include "physics/contact/touch_groups.h"
#include "physics/lanes/body_extents.h"
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

template <class Real>
bool may_meet_soft(std::span<const SoftState<Real>> soft) {
  const auto meets_soft = [](const SoftState<Real>& body) {
    return !body.frozen && body.body.collision.soft != SoftCollision::none;
  };
  return std::ranges::count_if(soft, meets_soft) > 1;
}

template <class Real>
bool may_meet_surfaces(std::span<const SoftState<Real>> soft, std::span<const ColliderState> colliders) {
  const auto meets_itself = [](const SoftState<Real>& body) { return !body.frozen && body.body.collision.self; };
  const auto is_mesh = [](const ColliderState& state) { return state.tree != nullptr; };
  return may_meet_soft(soft) || std::ranges::any_of(soft, meets_itself) ||
         (std::ranges::any_of(colliders, is_mesh) && !soft.empty());
}

template <class Real>
Aabb<double> swept_by(const SoftState<Real>& body, const BodyBounds& bounds) {
  const Vec3d thickness_m = Vec3d::Constant(body.body.surface.thickness_m);
  return {bounds.swept.min - thickness_m, bounds.swept.max + thickness_m};
}

}  // namespace

template <class Real>
template <class Work>
void Contacts<Real>::for_each(const ContactWorld<Real>& world, std::size_t count, const Work& work) {
  Workers* workers = world.substep.workers;
  if (workers != nullptr && workers->threads() > 1 && vertices_ >= parallel_vertices_min) {
    workers->for_each(count, std::cref(work));
    return;
  }
  for (std::size_t i = 0; i < count; ++i) work(i);
}

template <class Real>
void Contacts<Real>::resolve(const ContactWorld<Real>& world) {
  const Meetings may(world);
  if (!may.any) return;
  surface_stage_ = may.surfaces ? Stage::soft_contact : Stage::solid_contact;
  if (may.joints) hold_joints(world);
  find_bounds(world);
  forget_touches(world);
  if (may.surfaces) surfaces_.take_meshes(world.colliders, world.substep.dt_s);
  if (may.pairs) meet_bounding_volumes(world);
  const bool is_coupled = world.is_implicit() && meet_coupled(world);
  const bool is_lumped = !is_coupled && (may.surfaces || may.solids) && !world.soft.empty();
  const ContactWorld<Real> uncoupled = world.is_implicit() && !is_coupled ? without_coupling(world) : world;
  if (is_lumped) meet_lumped(uncoupled);
  wake_all_touched(world);
  meet_rigid_bodies(world);
  if (is_lumped) filter_moves(uncoupled);
  if (may.surfaces) surfaces_.part(world.soft, world.substep.dt_s);
}

template <class Real>
void Contacts<Real>::keep_start(const SubstepContext& context, const Moving<Real>& moving) {
  const bool has_solids = !moving.rigid.empty() || !moving.colliders.empty();
  if (!moving.soft.empty() && (has_solids || may_meet_surfaces<Real>(moving.soft, moving.colliders)))
    lumped_->keep_start(context, moving);
}

template <class Real>
std::uint32_t Contacts<Real>::take_back(const Moving<Real>& moving) {
  return lumped_.held() != nullptr ? lumped_->take_back(moving) : 0;
}

template <class Real>
void Contacts<Real>::end_tick() {
  lumped_.give_back(surfaces_.kept_bytes_max());
  surfaces_.give_back_room();
}

template <class Real>
Contacts<Real>::Meetings::Meetings(const ContactWorld<Real>& world) {
  const auto is_awake = [](const auto& body) { return body.is_awake(); };
  if (std::ranges::none_of(world.soft, is_awake) && std::ranges::none_of(world.rigid, is_awake)) return;
  solids = !world.rigid.empty() || !world.colliders.empty();
  pairs = may_meet_soft<Real>(world.soft);
  joints = !world.joints.empty();
  surfaces = may_meet_surfaces<Real>(world.soft, world.colliders);
  any = solids || surfaces || joints;
}

template <class Real>
void Contacts<Real>::find_bounds(const ContactWorld<Real>& world) {
  const std::span<SoftState<Real>> soft = world.soft;
  if (soft.empty()) return;
  const StageTimer timer(world.substep.profile, Stage::bounds);
  bounds_.resize(soft.size());
  vertices_ = 0;
  for (const SoftState<Real>& body : soft) {
    if (body.is_awake()) vertices_ += body.x.size();
  }
  if (!world.extents.empty() && world.joints.empty()) {  // joints would have changed the moves
    for (std::size_t i = 0; i < soft.size(); ++i) fit(soft[i], &world.extents[i], bounds_[i]);
  } else {
    for_each(world, bounds_.size(), [&](std::size_t i) { fit(soft[i], nullptr, bounds_[i]); });
  }
  swept_.resize(soft.size());
  for (std::size_t i = 0; i < soft.size(); ++i) swept_[i] = swept_by(soft[i], bounds_[i]);
}

// What a joint ties is touched.
template <class Real>
void Contacts<Real>::forget_touches(const ContactWorld<Real>& world) {
  pairs_.clear();
  soft_touched_.assign(world.soft.size(), 0);
  rigid_touched_.assign(world.rigid.size(), 0);
  rigid_solved_.assign(world.rigid.size(), 0);
  if (world.joints.empty()) return;
  for (std::size_t r = 0; r < world.rigid.size(); ++r) {
    if (world.rigid[r].tie != 0 && world.rigid[r].is_awake()) rigid_touched_[r] = 1;
  }
}

// An implicit step solves for its soft bodies' joints together with their contacts.
template <class Real>
void Contacts<Real>::hold_joints(const ContactWorld<Real>& world) {
  const StageTimer timer(world.substep.profile, Stage::joints);
  joints_.answer(world.joints, world.is_implicit(), world.soft, world.rigid, world.colliders, world.substep.dt_s);
}

template <class Real>
void Contacts<Real>::meet_lumped(const ContactWorld<Real>& world) {
  const StageTimer timer(world.substep.profile, surface_stage_);
  lumped_->answer({world, bounds_, soft_touched_, rigid_touched_, surface_stage_}, surfaces_);
}

// Answered by itself, as the next substep may be coupled.
template <class Real>
ContactWorld<Real> Contacts<Real>::without_coupling(const ContactWorld<Real>& world) {
  ContactWorld<Real> by_masses = world;
  by_masses.start_m_s = {};
  by_masses.substep.is_first_of_tick = true;
  by_masses.substep.substeps_left = 1;
  world.warm->clear();
  if (!world.joints.empty()) {
    hold_joints(by_masses);
    find_bounds(by_masses);
  }
  rigid_solved_.assign(world.rigid.size(), 0);
  return by_masses;
}

template <class Real>
bool Contacts<Real>::meet_coupled(const ContactWorld<Real>& world) {
  const StageTimer timer(world.substep.profile, surface_stage_);
  refit_stale(world);
  rigid_rows_.clear();
  if (!world.rigid.empty()) find_rigid_rows(world);
  return coupled_.run(
      {world, bounds_, soft_touched_, rigid_touched_, rigid_rows_, rigid_solver_.groups(), rigid_solved_}, surfaces_);
}

template <class Real>
void Contacts<Real>::find_rigid_rows(const ContactWorld<Real>& world) {
  const auto first = static_cast<std::uint32_t>(world.soft.size());
  rigid_solver_.append_rows(world.rigid, world.colliders, world.substep.surroundings.gravity, world.substep.dt_s, first,
                            rigid_rows_);
}

template <class Real>
void Contacts<Real>::meet_bounding_volumes(const ContactWorld<Real>& world) {
  const SubstepPhysics physics = world.physics();
  const std::span<SoftState<Real>> soft = world.soft;
  const HitResponse response = world.is_implicit() ? HitResponse::whole : HitResponse::vertices;
  {
    const StageTimer timer(world.substep.profile, Stage::broad_phase);
    find_soft_pairs<Real>(soft, bounds_, order_, pairs_);
    std::erase_if(pairs_,
                  [&](const SoftPair& pair) { return SurfaceContacts<Real>::asks_for(soft[pair.a], soft[pair.b]); });
  }
  if (pairs_.empty()) return;

  const StageTimer timer(world.substep.profile, Stage::soft_contact);
  near_.resize(std::min(pairs_.size(), pairs_at_once));
  for_each(world, bounds_.size(), [&](std::size_t i) {
    const bool is_paired = std::ranges::binary_search(pairs_, static_cast<std::uint32_t>(i), {}, &SoftPair::a);
    if (is_paired) fit_means(soft[i], bounds_[i]);
  });
  for (std::size_t first = 0; first < pairs_.size(); first += pairs_at_once) {
    const auto some = std::span(pairs_).subspan(first, std::min(pairs_at_once, pairs_.size() - first));
    for_each(world, some.size(), [&](std::size_t p) {
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
      for (const VertexHit& hit : hits_) {
        const BodyRef other{BodyKind::soft, b};
        if (!world.notes.empty()) world.notes[a].push_back({hit.vertex, other, hit.hit.normal});
        if (world.touches != nullptr) {
          world.touches->add({BodyKind::soft, a}, other, hit.impulse_n_s, soft[a].position_m(hit.vertex),
                             hit.hit.normal);
        }
      }
    }
  }
}

template <class Real>
void Contacts<Real>::meet_rigid_bodies(const ContactWorld<Real>& world) {
  if (world.rigid.empty()) return;
  const StageTimer timer(world.substep.profile, Stage::rigid);
  wake_near_rigid(world);
  rigid_solver_.solve(world.rigid, world.colliders, {rigid_touched_, rigid_solved_}, world.substep.surroundings.gravity,
                      world.substep.dt_s, world.touches);
}

template <class Real>
void Contacts<Real>::filter_moves(const ContactWorld<Real>& world) {
  const StageTimer timer(world.substep.profile, surface_stage_);
  lumped_->cut({world, bounds_, soft_touched_, rigid_touched_, surface_stage_}, surfaces_);
  lumped_counts_ = lumped_counts_ + lumped_->take_counts();
}

template <class Real>
void Contacts<Real>::refit_stale(const ContactWorld<Real>& world) {
  const std::span<SoftState<Real>> soft = world.soft;
  for (std::size_t i = 0; i < soft.size(); ++i) {
    if (!bounds_[i].active || !bounds_[i].stale) continue;
    fit_boxes(soft[i], bounds_[i]);
    swept_[i] = swept_by(soft[i], bounds_[i]);
  }
}

template <class Real>
void Contacts<Real>::fit(const SoftState<Real>& body, const Extents<Real>* known, BodyBounds& bounds) const {
  if (body.rest.asleep && bounds.asleep) return;
  bounds = {};
  if (body.frozen) return;
  fit_boxes(body, known != nullptr && body.is_awake() ? *known : extents_of(body), bounds);
  bounds.asleep = body.rest.asleep;
}

template <class Real>
void Contacts<Real>::wake_all_touched(const ContactWorld<Real>& world) {
  const SubstepPhysics physics = world.physics();
  const auto wake = [&](std::size_t body) { wake_touched(world.soft, world.rigid, body, physics); };
  for (const SoftPair& pair : pairs_) {
    if (!pair.hit) continue;
    wake(pair.a);
    wake(pair.b);
  }
  for (std::size_t i = 0; i < soft_touched_.size(); ++i) {
    if (soft_touched_[i] != 0) wake(i);
  }
  for (std::size_t r = 0; r < rigid_touched_.size(); ++r) {
    if (rigid_touched_[r] != 0) wake(world.soft.size() + r);
  }
}

template <class Real>
void Contacts<Real>::wake_near_rigid(const ContactWorld<Real>& world) {
  const SubstepPhysics physics = world.physics();
  const std::span<RigidState> rigid = world.rigid;
  for (std::uint32_t b = 0; b < rigid.size(); ++b) {
    for (std::uint32_t a = 0; a < rigid.size() && rigid[b].rest.asleep; ++a) {
      if (!rigid[a].is_awake() || !is_active(rigid[a])) continue;
      rigid_near_.clear();
      find_rigid_contacts(rigid, a, b, physics.dt_s, rigid_near_);
      if (!rigid_near_.empty()) wake_touched(world.soft, rigid, world.soft.size() + b, physics);
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
  add(surface_stage_, hits_.capacity() * sizeof(VertexHit) + near_bytes + surfaces_.bytes() + coupled_.bytes() +
                          (lumped_.held() != nullptr ? lumped_.held()->bytes() : 0));
  add(Stage::joints, joints_.bytes());
  add(Stage::rigid, rigid_touched_.capacity() + rigid_near_.capacity() * sizeof(RigidContact) + rigid_solver_.bytes() +
                        rigid_rows_.capacity() * sizeof(ContactRow));
}

template class Contacts<float>;
template class Contacts<double>;

}  // namespace pneuma::physics
