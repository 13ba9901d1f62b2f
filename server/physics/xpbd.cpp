#include "physics/xpbd.h"

#include <algorithm>
#include <cmath>

#include "physics/gas.h"

namespace pneuma::physics {

namespace {

// Of the body's length: the furthest that its gas may push a particle in one pass.
constexpr double gas_move_max = 0.25;
constexpr int root_iterations_max = 60;

template <class Real>
class Xpbd {
 public:
  Xpbd(SoftState<Real>& body, const Surroundings& surroundings, double dt_s, XpbdScratch<Real>& scratch)
      : body_(body), surroundings_(surroundings), h_(dt_s), scratch_(scratch) {}

  [[nodiscard]] Real inverse_mass(std::size_t i) const {
    return body_.is_pinned(i) ? Real{0} : Real{1} / body_.vertex_mass_kg;
  }

  void predict() {
    const auto h = static_cast<Real>(h_);
    const Vec3<Real> fall = h * surroundings_.gravity.cast<Real>();
    const bool windy = has_wind(body_.body, surroundings_.atmosphere);
    if (windy) {
      scratch_.gradient.assign(body_.x.size(), Vec3<Real>::Zero());
      add_wind<Real>(body_.body, surroundings_.atmosphere, body_.x, body_.v, scratch_.gradient);
    }
    const Vec3<Real> wind = surroundings_.atmosphere.wind.cast<Real>();
    for (std::size_t i = 0; i < body_.x.size(); ++i) {
      if (body_.is_pinned(i)) {
        body_.dr[i].setZero();
        continue;
      }
      Vec3<Real> v = body_.v[i] + fall;
      if (windy) {
        // Drag brings a particle to the wind's speed, however light it is, and not past it.
        Vec3<Real> push = h * inverse_mass(i) * scratch_.gradient[i];
        const Real behind = (wind - body_.v[i]).norm();
        const Real length = push.norm();
        if (length > behind) push *= behind / length;
        v += push;
      }
      body_.dr[i] = h * v;
    }
  }

  void pull_springs() {
    const auto stiffness = static_cast<Real>(h_ * h_ * body_.body.springs.stiffness_n_m);
    if (!(stiffness > 0)) return;
    const std::vector<Edge>& edges = body_.body.mesh->edges;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const auto [a, b] = edges[i];
      const Vec3<Real> along = body_.x[b] - body_.x[a] + (body_.dr[b] - body_.dr[a]);
      const Real length = along.norm();
      if (!(length > 0)) continue;
      const Real give = inverse_mass(a) + inverse_mass(b);
      const Real stretch = stiffness * (length - body_.rest_length_m(i)) / (Real{1} + stiffness * give);
      const Vec3<Real> pull = stretch / length * along;
      body_.dr[a] += inverse_mass(a) * pull;
      body_.dr[b] -= inverse_mass(b) * pull;
    }
  }

  // Of velocities, after the move: in one constraint with the spring, as XPBD's paper has it, a damping with
  // h d / m far past 1 takes the springs' share of the pass and leaves the gas's, and the body grows.
  void damp() {
    const auto damping = static_cast<Real>(h_ * body_.body.springs.damping_n_s_m);
    if (!(damping > 0)) return;
    for (const auto& [a, b] : body_.body.mesh->edges) {
      const Vec3<Real> along = body_.x[b] - body_.x[a] + (body_.dr[b] - body_.dr[a]);
      const Real squared = along.squaredNorm();
      if (!(squared > 0)) continue;
      const Real give = inverse_mass(a) + inverse_mass(b);
      const Real apart = along.dot(body_.v[b] - body_.v[a]) / squared;
      const Vec3<Real> pull = damping * apart / (Real{1} + damping * give) * along;
      body_.v[a] += inverse_mass(a) * pull;
      body_.v[b] -= inverse_mass(b) * pull;
    }
  }

  void bend() {
    const double stiffness = h_ * h_ * body_.body.springs.bend_stiffness_n_m;
    for (const Hinge& hinge : body_.hinges) {
      std::array<Vec3d, 4> corners;
      for (std::size_t i = 0; i < 4; ++i) {
        const std::uint32_t vertex = hinge.vertices[i];
        corners[i] = (body_.x[vertex] + body_.dr[vertex]).template cast<double>();
      }
      const auto angle = hinge_angle(corners);
      if (!angle) continue;
      double give = 0.0;
      for (std::size_t i = 0; i < 4; ++i) {
        give += static_cast<double>(inverse_mass(hinge.vertices[i])) * angle->gradient[i].squaredNorm();
      }
      const double share = stiffness * hinge.weight;
      const double turn = share * bend_rad(hinge, *angle) / (1.0 + share * give);
      for (std::size_t i = 0; i < 4; ++i) {
        const std::uint32_t vertex = hinge.vertices[i];
        body_.dr[vertex] -= inverse_mass(vertex) * (turn * angle->gradient[i]).template cast<Real>();
      }
    }
  }

  void hold_grabs() {
    for (const Grab& grab : body_.grabs) {
      if (body_.is_pinned(grab.vertex)) continue;
      const double stiffness = h_ * h_ * grab.stiffness_n_m;
      const double damping = h_ * grab.damping_n_s_m;
      const auto weight = static_cast<double>(inverse_mass(grab.vertex));
      const Vec3d moved = body_.dr[grab.vertex].template cast<double>();
      const Vec3d offset = grab.target - body_.position_m(grab.vertex) - moved;
      const Vec3d pull = (stiffness * offset - damping * moved) / (1.0 + (stiffness + damping) * weight);
      body_.dr[grab.vertex] += (weight * pull).template cast<Real>();
    }
  }

  void press() {
    if (!body_.gas) return;
    const std::size_t count = body_.x.size();
    scratch_.position.resize(count);
    for (std::size_t i = 0; i < count; ++i) scratch_.position[i] = body_.x[i] + body_.dr[i];
    scratch_.gradient.assign(count, Vec3<Real>::Zero());
    add_pressure<Real>(body_, 1.0, scratch_.position, scratch_.gradient);
    double give = 0.0;  // volume a multiplier
    double longest = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto weight = static_cast<double>(inverse_mass(i));
      const auto squared = static_cast<double>(scratch_.gradient[i].squaredNorm());
      give += weight * squared;
      longest = std::max(longest, weight * weight * squared);
    }
    const double volume_m3 = body_volume_m3<Real>(body_.body, scratch_.position);
    double multiplier = gas_multiplier(volume_m3, give);
    const double move_m = std::abs(multiplier) * std::sqrt(longest);
    const double move_max_m = gas_move_max * static_cast<double>(body_.length_m);
    if (move_m > move_max_m) multiplier *= move_max_m / move_m;
    for (std::size_t i = 0; i < count; ++i) {
      body_.dr[i] += static_cast<Real>(multiplier) * inverse_mass(i) * scratch_.gradient[i];
    }
    body_.volume_m3 = volume_m3 + give * multiplier;
    body_.pressure_pa = pressure_pa(body_.volume_m3);
  }

  void finish() {
    const auto per_step = static_cast<Real>(1.0 / h_);
    for (std::size_t i = 0; i < body_.x.size(); ++i) body_.v[i] = per_step * body_.dr[i];
  }

 private:
  [[nodiscard]] double pressure_pa(double volume_m3) const {
    return gas_pressure_pa(*body_.gas, *body_.body.gas, volume_m3) - surroundings_.atmosphere.pressure_pa;
  }

  // The root of h^2 P(V + give x) - x. P falls with the volume, so that it lies between 0 and the first term at x = 0:
  // Newton's steps, halving where one leaves the bracket.
  [[nodiscard]] double gas_multiplier(double volume_m3, double give) const {
    const double h2 = h_ * h_;
    const double at_once = h2 * pressure_pa(volume_m3);
    double low = std::min(0.0, at_once);
    double high = std::max(0.0, at_once);
    double x = low + 0.5 * (high - low);
    for (int i = 0; i < root_iterations_max && high - low > 1e-15 * (high + std::abs(low)); ++i) {
      const double volume = volume_m3 + give * x;
      const double excess = h2 * pressure_pa(volume) - x;
      if (excess == 0.0) break;
      (excess > 0.0 ? low : high) = x;
      const double slope = 1.0 + h2 * give * gas_stiffness_pa_m3(*body_.gas, *body_.body.gas, volume);
      const double next = x + excess / slope;
      if (std::abs(next - x) <= 1e-14 * std::abs(x)) break;
      x = next > low && next < high ? next : low + 0.5 * (high - low);
    }
    return x;
  }

  SoftState<Real>& body_;
  const Surroundings& surroundings_;
  double h_;
  XpbdScratch<Real>& scratch_;
};

}  // namespace

template <class Real>
void xpbd(SoftState<Real>& body, const Surroundings& surroundings, double dt_s, XpbdScratch<Real>& scratch,
          Profile* profile) {
  Xpbd<Real> step(body, surroundings, dt_s, scratch);
  {
    const StageTimer timer(profile, Stage::integrate);
    step.predict();
  }
  {
    const StageTimer timer(profile, Stage::springs);
    step.pull_springs();
  }
  if (!body.hinges.empty()) {
    const StageTimer timer(profile, Stage::bending);
    step.bend();
  }
  if (!body.grabs.empty()) {
    const StageTimer timer(profile, Stage::grabs);
    step.hold_grabs();
  }
  if (body.gas) {
    const StageTimer timer(profile, Stage::pressure);
    step.press();
  }
  const StageTimer timer(profile, Stage::integrate);
  step.finish();
  step.damp();
}

template void xpbd<float>(SoftState<float>&, const Surroundings&, double, XpbdScratch<float>&, Profile*);
template void xpbd<double>(SoftState<double>&, const Surroundings&, double, XpbdScratch<double>&, Profile*);

}  // namespace pneuma::physics
