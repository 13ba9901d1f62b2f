#include "physics/contact/implicit_contact.h"

#include <algorithm>
#include <cmath>

namespace pneuma::physics {

namespace {

// Rounds of the active set.
constexpr int rounds_max = 24;
// The first of them, in which what sticks may begin to slide. In the others it may only stick: too much friction takes
// energy, and a push along the way, where the two do not agree, would give some.
constexpr int sliding_rounds = 6;
// Of the mean spacing of the vertices: what a round may move them and still be the last. A turn by this much stretches
// edges by its square.
constexpr double last_move = 0.01;
// Directions nearer to each other than this are one wall.
constexpr double same_wall = 1e-3;

}  // namespace

// Whether there were any.
template <class Real>
bool ImplicitContact<Real>::add_new_stops() {
  bool added = false;
  for (const VertexStop& stop : stops_) {
    auto at = std::ranges::lower_bound(touches_, stop.vertex, {}, &Touch::vertex);
    if (at == touches_.end() || at->vertex != stop.vertex) {
      at = touches_.insert(at, {.vertex = stop.vertex, .sticks = stop.surface.friction > 0.0});
    }
    const bool known = std::ranges::any_of(
        at->stops(), [&](const VertexStop& other) { return other.normal.dot(stop.normal) > 1.0 - same_wall; });
    if (known || at->stop_count == Touch::stops_max) continue;
    at->all_stops[at->stop_count++] = stop;
    added = true;
  }
  return added;
}

template <class Real>
Hold ImplicitContact<Real>::hold_of(const Touch& touch) const {
  Hold hold{touch.vertex, Eigen::Matrix3d::Identity(), touch.stops()[0].of_surface};
  for (const VertexStop& stop : touch.stops()) {
    const Vec3d rest = hold.free * stop.normal;  // what no wall before holds
    const double squared = rest.squaredNorm();
    if (squared < same_wall) continue;
    hold.velocity += (stop.normal_m_s - stop.normal.dot(hold.velocity)) / squared * rest;
    hold.free -= rest * rest.transpose() / squared;
  }
  if (touch.sticks) hold.free.setZero();
  return hold;
}

// Lets go what is pulled, and slide what friction cannot hold. Whether any changed.
template <class Real>
bool ImplicitContact<Real>::follow_reactions(const ImplicitSolver<Real>& solver, bool may_slide) {
  bool changed = false;
  for (Touch& touch : touches_) {
    const Vec3d push = solver.holding_n_s(touch.vertex);
    double normal_n_s = 0.0;
    Vec3d along = push;
    for (const VertexStop& stop : touch.stops()) {
      normal_n_s += std::max(0.0, push.dot(stop.normal));
      along -= along.dot(stop.normal) * stop.normal;
    }
    const auto pulled = [&](const VertexStop& stop) { return push.dot(stop.normal) < 0.0; };
    const double most_n_s = touch.stops()[0].surface.friction * normal_n_s;
    const std::span stops = std::span(touch.all_stops).first(touch.stop_count);
    const std::size_t let_go = std::ranges::remove_if(stops, pulled).size();
    touch.stop_count -= let_go;
    changed = changed || let_go > 0;
    if (touch.stop_count == 0) continue;
    if (touch.sticks) {
      const double along_n_s = along.norm();
      if (!may_slide || along_n_s <= most_n_s) continue;
      touch.sticks = false;
      touch.friction_n_s = most_n_s / along_n_s * along;
      changed = true;
    } else if (touch.stops()[0].surface.friction > 0.0) {
      Vec3d slip = u_[touch.vertex] - touch.stops()[0].of_surface;
      for (const VertexStop& stop : touch.stops()) slip -= slip.dot(stop.normal) * stop.normal;
      const double speed = slip.norm();
      if (slip.dot(touch.friction_n_s) > 0.0 || !(speed > 0.0)) {
        touch.sticks = true;
        touch.friction_n_s.setZero();
        changed = true;
        continue;
      }
      if (!may_slide) continue;
      const Vec3d before = touch.friction_n_s;
      touch.friction_n_s = -most_n_s / speed * slip;
      changed = changed || (touch.friction_n_s - before).norm() > 0.05 * most_n_s;
    }
  }
  std::erase_if(touches_, [](const Touch& touch) { return touch.stop_count == 0; });
  return changed;
}

template <class Real>
double ImplicitContact<Real>::rebound(SoftState<Real>& body, const ImplicitSolver<Real>& solver) const {
  double work_j = 0.0;
  for (const Touch& touch : touches_) {
    Vec3d velocity = u_[touch.vertex];
    for (const VertexStop& stop : touch.stops()) {
      velocity += (stop.away_m_s - stop.normal.dot(velocity - stop.of_surface)) * stop.normal;
    }
    const Vec3d impulse_n_s = solver.holding_n_s(touch.vertex) + touch.friction_n_s +
                              body.mass_kg(touch.vertex) * (velocity - u_[touch.vertex]);
    work_j += impulse_n_s.dot(touch.stops()[0].of_surface);
    body.v[touch.vertex] = velocity.template cast<Real>();
  }
  return work_j;
}

template <class Real>
void ImplicitContact<Real>::limit_step(SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s,
                                       const Surroundings& surroundings, double dt_s) {
  limit_.begin_substep(surroundings, SubstepPhysics::of(surroundings.gravity, dt_s).resting_m_s, dt_s);
  limit_.limit_step(body, start_m_s);
}

template <class Real>
void ImplicitContact<Real>::meet_colliders(SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s,
                                           ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
                                           const Surroundings& surroundings, std::span<const SolidMove> colliders,
                                           double dt_s, ImplicitSolver<Real>& solver, ContactNotes* notes,
                                           Profile* profile) {
  const SubstepPhysics physics = SubstepPhysics::of(surroundings.gravity, dt_s);
  BodyBounds bounds;
  fit_boxes(body, bounds);
  find_stops(body, bounds, colliders, physics, stops_);
  if (stops_.empty()) return;

  EnergyLimit most;
  const bool limited = body.pinned.empty();
  if (limited) {
    limit_.begin_substep(surroundings, physics.resting_m_s, dt_s);
    limit_.begin(body, start_m_s);
    for (const VertexStop& stop : stops_) {
      const double depth_m = dt_s * stop.normal_m_s - stop.normal.dot(body.dr[stop.vertex].template cast<double>());
      limit_.note({stop.vertex, stop.normal, depth_m, stop.gained_m_s, stop.of_surface, stop.surface});
    }
  }

  touches_.clear();
  const std::size_t count = body.x.size();
  x_.resize(count);
  u0_.resize(count);
  u_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    x_[i] = body.x[i].template cast<double>();
    u0_[i] = start_m_s[i].template cast<double>();
    u_[i] = body.dr[i].template cast<double>() / dt_s;
  }
  const double last_move_m = last_move * static_cast<double>(body.length_m) / std::sqrt(static_cast<double>(count));
  bool changed = add_new_stops();
  for (int round = 0; round < rounds_max && changed; ++round) {
    holds_.clear();
    pushed_ = u0_;
    for (const Touch& touch : touches_) {
      holds_.push_back(hold_of(touch));
      pushed_[touch.vertex] += touch.friction_n_s / body.mass_kg(touch.vertex);
    }
    const ImplicitStage stage{x_, pushed_, dt_s};
    if (!solver.correct_held(body, tables, stage, holds_, accuracy, surroundings, u_, profile)) {
      if (round == 0) return;  // nothing is held: there are no reactions to read
      break;
    }
    for (std::size_t i = 0; i < count; ++i) {
      body.v[i] = u_[i].template cast<Real>();
      body.dr[i] = (dt_s * u_[i]).template cast<Real>();
    }
    changed = follow_reactions(solver, round < sliding_rounds);
    fit_boxes(body, bounds);
    find_stops(body, bounds, colliders, physics, stops_);
    changed = add_new_stops() || changed || solver.last_move_m() > last_move_m;
  }
  if (notes != nullptr) {
    for (const Touch& touch : touches_) {
      for (const VertexStop& stop : touch.stops()) {
        notes->push_back({touch.vertex, VertexContact::Other::collider, stop.collider, stop.normal});
      }
    }
  }
  const double work_j = rebound(body, solver);
  if (limited) (void)limit_.end(body, {}, work_j, most);
}

template <class Real>
std::size_t ImplicitContact<Real>::bytes() const {
  return limit_.bytes() + stops_.capacity() * sizeof(VertexStop) + touches_.capacity() * sizeof(Touch) +
         holds_.capacity() * sizeof(Hold) +
         (x_.capacity() + u0_.capacity() + pushed_.capacity() + u_.capacity()) * sizeof(Vec3d);
}

template class ImplicitContact<float>;
template class ImplicitContact<double>;

}  // namespace pneuma::physics
