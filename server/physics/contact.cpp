#include "physics/contact.h"

#include <algorithm>
#include <functional>
#include <ranges>

namespace pneuma::physics {
namespace {

// Waking other threads takes some 10 us, in which one thread does about this many vertices.
constexpr std::size_t parallel_vertices_min = 2'048;

void note_bytes(Profile* profile, Stage stage, std::size_t bytes) {
  if (profile != nullptr) (*profile)[static_cast<std::size_t>(stage)].bytes = bytes;
}

}  // namespace

template <class Real>
template <class Work>
void Contacts<Real>::for_each_body(Workers& workers, const Work& work) {
  if (workers.threads() > 1 && vertices_ >= parallel_vertices_min) {
    workers.for_each(bounds_.size(), std::cref(work));
    return;
  }
  for (std::size_t i = 0; i < bounds_.size(); ++i) work(i);
}

template <class Real>
void Contacts<Real>::resolve(std::span<SoftState<Real>> soft, std::span<RigidState> rigid,
                             std::span<const ColliderState> colliders, const Vec3d& gravity_m_s2, double dt_s,
                             Workers& workers, Profile* profile) {
  const auto meets_soft = [](const SoftState<Real>& body) {
    return !body.frozen && body.body.collision.soft != SoftCollision::none;
  };
  const bool solids = !rigid.empty() || !colliders.empty();
  const bool pairs = std::ranges::count_if(soft, meets_soft) > 1;
  if (!solids && !pairs) return;

  const SubstepPhysics physics{gravity_m_s2, dt_s, resting_substeps * gravity_m_s2.norm() * dt_s};
  if (!soft.empty()) {
    const StageTimer timer(profile, Stage::bounds);
    bounds_.assign(soft.size(), BodyBounds{});
    vertices_ = 0;
    for (const SoftState<Real>& body : soft) vertices_ += body.x.size();
    for_each_body(workers, [&](std::size_t i) {
      if (!soft[i].frozen) fit_boxes(soft[i], bounds_[i]);
    });
    note_bytes(profile, Stage::bounds, bounds_.capacity() * sizeof(BodyBounds));
  }
  if (pairs) meet_soft_bodies(soft, physics, workers, profile);
  rigid_touched_.assign(rigid.size(), 0);
  if (solids && !soft.empty()) {
    const StageTimer timer(profile, Stage::solid_contact);
    meet_solids(soft, rigid, colliders, physics, workers);
    note_bytes(profile, Stage::solid_contact, collider_moves_.capacity() * sizeof(SolidMove));
  }
  if (!rigid.empty()) {
    const StageTimer timer(profile, Stage::rigid);
    rigid_solver_.solve(rigid, colliders, rigid_touched_, gravity_m_s2, dt_s);
    note_bytes(profile, Stage::rigid, rigid_solver_.bytes());
  }
}

template <class Real>
void Contacts<Real>::meet_soft_bodies(std::span<SoftState<Real>> soft, const SubstepPhysics& physics, Workers& workers,
                                      Profile* profile) {
  {
    const StageTimer timer(profile, Stage::broad_phase);
    find_soft_pairs<Real>(soft, bounds_, order_, pairs_);
    note_bytes(profile, Stage::broad_phase,
               order_.capacity() * sizeof(std::uint32_t) + pairs_.capacity() * sizeof(SoftPair));
  }
  if (pairs_.empty()) return;

  const StageTimer timer(profile, Stage::soft_contact);
  const auto first_of = [this](std::size_t body) {
    const auto first = std::ranges::lower_bound(pairs_, static_cast<std::uint32_t>(body), {}, &SoftPair::a);
    return static_cast<std::size_t>(first - pairs_.begin());
  };
  if (near_.size() < pairs_.size()) near_.resize(pairs_.size());
  for_each_body(workers, [&](std::size_t i) {
    if (first_of(i) < first_of(i + 1)) fit_means(soft[i], bounds_[i]);
  });
  for_each_body(workers, [&](std::size_t i) {
    for (std::size_t p = first_of(i); p < first_of(i + 1); ++p) {
      near_[p].clear();
      const std::uint32_t b = pairs_[p].b;
      find_near_vertices(soft[i], bounds_[i], soft[b], bounds_[b], near_[p]);
    }
  });
  // One pair after the other: each meets what those before it left.
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const auto [a, b] = pairs_[p];
    meet_bounds(soft[a], bounds_[a], soft[b], bounds_[b], near_[p], physics.resting_m_s, physics.dt_s, hits_);
  }
  std::size_t bytes = hits_.capacity() * sizeof(VertexHit);
  for (const std::vector<std::uint32_t>& near : near_) bytes += near.capacity() * sizeof(std::uint32_t);
  note_bytes(profile, Stage::soft_contact, bytes);
}

// Colliders last: they do not give way, so what a rigid body pushed into them must come back.
template <class Real>
void Contacts<Real>::meet_solids(std::span<SoftState<Real>> soft, std::span<RigidState> rigid,
                                 std::span<const ColliderState> colliders, const SubstepPhysics& physics,
                                 Workers& workers) {
  for (std::size_t r = 0; r < rigid.size(); ++r) {
    if (!is_active(rigid[r])) continue;
    refit_stale(soft);
    for (std::size_t i = 0; i < soft.size(); ++i) {
      if (bounds_[i].active && meet_rigid(soft[i], bounds_[i], rigid[r], physics)) rigid_touched_[r] = 1;
    }
  }
  if (colliders.empty()) return;
  refit_stale(soft);
  collider_moves_.clear();
  for (const ColliderState& collider : colliders) collider_moves_.push_back(move_of(collider, physics.dt_s));
  for_each_body(workers, [&](std::size_t i) {
    if (bounds_[i].active) meet_colliders<Real>(soft[i], bounds_[i], collider_moves_, physics);
  });
}

template <class Real>
void Contacts<Real>::refit_stale(std::span<SoftState<Real>> soft) {
  for (std::size_t i = 0; i < soft.size(); ++i) {
    if (bounds_[i].active && bounds_[i].stale) fit_boxes(soft[i], bounds_[i]);
  }
}

template class Contacts<float>;
template class Contacts<double>;

}  // namespace pneuma::physics
