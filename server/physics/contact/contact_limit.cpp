#include "physics/contact/contact_limit.h"

#include <algorithm>
#include <cmath>

#include "physics/forces/measures.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

namespace {

// The least share of contact by vertices that is tried. Stretching goes with its square: of a body a million times too
// stiff for its step, a thousandth is left.
constexpr double share_min = 1.0 / 4096.0;
// Each meets what the last one left; the touches of one share the two bodies' masses, which no pass can make gain.
constexpr int impulse_passes = 8;
constexpr int move_passes = 4;

/// The change of a body that answers to its touches as a rigid body.
struct WholeAnswer {
  Vec3d velocity = Vec3d::Zero();
  Vec3d angular_velocity = Vec3d::Zero();
  Vec3d move = Vec3d::Zero();
  double work_j = 0.0;  // of surfaces that do not give way
};

struct Collision {
  std::span<const VertexTouch> touches;
  std::span<const Vec3d> places;  // of the touches, where the substep began
  double resting_m_s = 0.0;
  double dt_s = 0.0;
};

Vec3d as_velocity(const RigidPart& part, const Vec3d& place) {
  return velocity_at(part.velocity, part.angular_velocity, place - part.centre);
}

void push(RigidPart& part, const Vec3d& impulse_n_s, const Vec3d& moment_n_m_s) {
  if (part.mass_kg <= 0.0) return;
  part.velocity += impulse_n_s / part.mass_kg;
  part.angular_velocity += part.inverse_inertia_1_kg_m2 * moment_n_m_s;
}

Eigen::Matrix3d inverse_mass_1_kg(const RigidPart& part, const Vec3d& place) {
  if (part.mass_kg <= 0.0) return Eigen::Matrix3d::Zero();
  return Eigen::Matrix3d::Identity() / part.mass_kg +
         turning_inverse_mass(place - part.centre, part.inverse_inertia_1_kg_m2);
}

WholeAnswer answer_as_a_whole(RigidPart whole, const Partner& partner, const Collision& collision) {
  const RigidPart before = whole;
  RigidPart other = partner.rigid;
  const bool gives_way = other.mass_kg > 0.0;
  const auto shares = static_cast<double>(collision.touches.size());
  WholeAnswer answer;
  Vec3d normals = Vec3d::Zero();
  for (int pass = 0; pass < impulse_passes; ++pass) {
    Exchange sum;
    Vec3d moment_of_other_n_m_s = Vec3d::Zero();
    for (std::size_t i = 0; i < collision.touches.size(); ++i) {
      const VertexTouch& touch = collision.touches[i];
      const Vec3d& place = collision.places[i];
      const Vec3d of_surface = gives_way ? as_velocity(other, place) : touch.of_surface;
      const Vec3d relative = as_velocity(whole, place) - of_surface;
      const double gained_m_s = pass == 0 ? touch.gained_m_s : 0.0;
      const double impact_m_s = impact_speed(relative.dot(touch.normal), gained_m_s, collision.resting_m_s);
      const Eigen::Matrix3d inverse_mass = shares * (inverse_mass_1_kg(whole, place) + inverse_mass_1_kg(other, place));
      const Vec3d impulse_n_s = contact_impulse(relative, touch.normal, impact_m_s, touch.surface, inverse_mass);
      sum.impulse_n_s += impulse_n_s;
      sum.moment_n_m_s += (place - whole.centre).cross(impulse_n_s);
      moment_of_other_n_m_s += (place - other.centre).cross(impulse_n_s);
      if (!gives_way) answer.work_j += impulse_n_s.dot(touch.of_surface);
      if (pass == 0) normals += touch.normal;
    }
    push(whole, sum.impulse_n_s, sum.moment_n_m_s);
    push(other, -sum.impulse_n_s, -moment_of_other_n_m_s);
  }
  answer.velocity = whole.velocity - before.velocity;
  answer.angular_velocity = whole.angular_velocity - before.angular_velocity;

  // Along the surface the move follows the velocity; away from it, it only has to end outside.
  Vec3d apart = answer.velocity - (other.velocity - partner.rigid.velocity);
  if (normals.squaredNorm() > 0.0) apart -= apart.dot(normals) / normals.squaredNorm() * normals;
  apart *= collision.dt_s;
  for (int pass = 0; pass < move_passes; ++pass) {
    for (const VertexTouch& touch : collision.touches) {
      apart += std::max(0.0, touch.depth_m - apart.dot(touch.normal)) * touch.normal;
    }
  }
  const bool shared = partner.parts && gives_way;
  answer.move = shared ? Vec3d(other.mass_kg / (whole.mass_kg + other.mass_kg) * apart) : apart;
  return answer;
}

// Takes the largest share, or nearly so, that `place` finds no more than most_j for. Where not even 0 will do, 0 or 1,
// whichever has less. What it finds grows with about the square of the share.
template <class Place>
void take_share(const Place& place, double all_j, double most_j) {
  const double none_j = place(0.0);
  if (!(none_j < most_j)) {
    if (all_j < none_j) place(1.0);
    return;
  }
  for (double share = std::sqrt((most_j - none_j) / (all_j - none_j)); share > share_min; share *= 0.5) {
    if (place(share) <= most_j) return;
  }
  place(0.0);
}

// What the impulse's opposite does to the partner.
double gain_j(const RigidPart& part, const Exchange& taken) {
  if (part.mass_kg <= 0.0) return 0.0;
  const Vec3d moment_n_m_s = taken.moment_n_m_s + (taken.about - part.centre).cross(taken.impulse_n_s);
  return 0.5 * taken.impulse_n_s.squaredNorm() / part.mass_kg - part.velocity.dot(taken.impulse_n_s) +
         0.5 * moment_n_m_s.dot(part.inverse_inertia_1_kg_m2 * moment_n_m_s) - part.angular_velocity.dot(moment_n_m_s);
}

template <class Real>
double kinetic_j(const SoftState<Real>& body, std::span<const Vec3<Real>> v) {
  double squares = 0.0;
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < v.size(); ++i) squares += share(i) * v[i].template cast<double>().squaredNorm();
  });
  return 0.5 * static_cast<double>(body.vertex_mass_kg) * squares;
}

}  // namespace

template <class Real>
void ContactLimit<Real>::begin_substep(const Surroundings& surroundings, double resting_m_s, double dt_s) {
  surroundings_ = surroundings;
  resting_m_s_ = resting_m_s;
  dt_s_ = dt_s;
}

template <class Real>
double ContactLimit<Real>::energy_j(const SoftState<Real>& body, std::span<const Vec3<Real>> v,
                                    std::span<const Vec3<Real>> dr) {
  x_.resize(body.x.size());
  for (std::size_t i = 0; i < body.x.size(); ++i) x_[i] = (body.x[i] + dr[i]).template cast<double>();
  return potential_j(body, x_, surroundings_.atmosphere.pressure_pa, surroundings_.gravity) + kinetic_j<Real>(body, v);
}

template <class Real>
double ContactLimit<Real>::start_energy_j(const SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s) {
  x_.resize(body.x.size());
  for (std::size_t i = 0; i < body.x.size(); ++i) x_[i] = body.x[i].template cast<double>();
  return potential_j(body, x_, surroundings_.atmosphere.pressure_pa, surroundings_.gravity) +
         kinetic_j<Real>(body, start_m_s);
}

template <class Real>
void ContactLimit<Real>::limit_step(SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s) {
  const double most_j = start_energy_j(body, start_m_s);
  if (energy_j(body, body.v, body.dr) <= most_j) return;
  v_ = body.v;
  dr_ = body.dr;
  RigidPart solved;
  fit_rigid(body, solved);
  RigidPart whole = solved;
  fit_turning(body, solved);
  std::ranges::copy(start_m_s, body.v.begin());
  fit_turning(body, whole);
  Vec3d move = Vec3d::Zero();
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < dr_.size(); ++i) {
      move += share(i) * dr_[i].template cast<double>() / static_cast<double>(dr_.size());
    }
  });
  const Quatd solved_turn = turned(Quatd::Identity(), solved.angular_velocity, dt_s_);
  const Quatd turn = turned(Quatd::Identity(), whole.angular_velocity, dt_s_);
  const auto keep = [&](double share) {
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      const Vec3d place = body.position_m(i);
      const Vec3d arm = place - whole.centre;
      const Vec3d own_m_s = v_[i].template cast<double>() - as_velocity(solved, place);
      const Vec3d own_m = dr_[i].template cast<double>() - (move + solved_turn * arm - arm);
      body.v[i] = (as_velocity(whole, place) + share * own_m_s).template cast<Real>();
      body.dr[i] = (move + turn * arm - arm + share * own_m).template cast<Real>();
    }
    return energy_j(body, body.v, body.dr);
  };
  const double all_j = keep(1.0);
  if (all_j > most_j) take_share(keep, all_j, most_j);
}

template <class Real>
void ContactLimit<Real>::begin(const SoftState<Real>& body, std::span<const Vec3<Real>> start_m_s) {
  touches_.clear();
  start_m_s_ = start_m_s;
  v_ = body.v;
  dr_ = body.dr;
}

template <class Real>
Exchange ContactLimit<Real>::taken(const SoftState<Real>& body, const Vec3d& about) const {
  const auto mean_kg = static_cast<double>(body.vertex_mass_kg);
  Exchange sum{.about = about};
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      const double mass_kg = mean_kg * share(i);
      const Vec3d impulse_n_s = mass_kg * (body.v[i] - v_[i]).template cast<double>();
      sum.impulse_n_s += impulse_n_s;
      sum.moment_n_m_s += (body.position_m(i) - about).cross(impulse_n_s);
      sum.shift_kg_m += mass_kg * (body.dr[i] - dr_[i]).template cast<double>();
    }
  });
  return sum;
}

template <class Real>
Exchange ContactLimit<Real>::end(SoftState<Real>& body, const Partner& partner, double work_j, EnergyLimit& limit) {
  given_j_ = 0.0;
  if (touches_.empty()) return {};
  if (!limit.most_j) {
    limit.most_j = energy_j(body, v_, dr_);
    if (!start_m_s_.empty()) {
      limit.most_j = std::max(*limit.most_j, start_energy_j(body, start_m_s_) + limit.given_j);
    }
  }
  const double most_j = *limit.most_j;
  Exchange exchange;
  double by_surfaces_j = work_j;
  const auto total_j = [&] {
    exchange = taken(body, partner.rigid.centre);
    given_j_ = gain_j(partner.rigid, exchange);
    return energy_j(body, body.v, body.dr) + given_j_ - by_surfaces_j;
  };
  const double by_vertices_j = total_j();
  if (by_vertices_j > most_j) {
    by_vertex_v_.swap(body.v);
    by_vertex_dr_ = body.dr;
    body.v = v_;
    RigidPart whole;
    fit_rigid(body, whole);
    fit_turning(body, whole);
    places_.clear();
    for (const VertexTouch& touch : touches_) places_.push_back(body.position_m(touch.vertex));
    const WholeAnswer answer = answer_as_a_whole(whole, partner, {touches_, places_, resting_m_s_, dt_s_});
    const auto mix = [&](double share) {
      for (std::size_t i = 0; i < body.x.size(); ++i) {
        const Vec3d arm = body.position_m(i) - whole.centre;
        const Vec3d velocity = velocity_at(answer.velocity, answer.angular_velocity, arm);
        const Vec3d by_vertex_m_s = (by_vertex_v_[i] - v_[i]).template cast<double>();
        const Vec3d by_vertex_m = (by_vertex_dr_[i] - dr_[i]).template cast<double>();
        body.v[i] = v_[i] + (share * by_vertex_m_s + (1.0 - share) * velocity).template cast<Real>();
        body.dr[i] = dr_[i] + (share * by_vertex_m + (1.0 - share) * answer.move).template cast<Real>();
      }
      by_surfaces_j = share * work_j + (1.0 - share) * answer.work_j;
      return total_j();
    };
    take_share(mix, by_vertices_j, most_j);
  }
  limit.most_j = most_j + by_surfaces_j - given_j_;
  return exchange;
}

template <class Real>
std::size_t ContactLimit<Real>::bytes() const {
  return touches_.capacity() * sizeof(VertexTouch) + (places_.capacity() + x_.capacity()) * sizeof(Vec3d) +
         (v_.capacity() + dr_.capacity() + by_vertex_v_.capacity() + by_vertex_dr_.capacity()) * sizeof(Vec3<Real>);
}

template class ContactLimit<float>;
template class ContactLimit<double>;

}  // namespace pneuma::physics
