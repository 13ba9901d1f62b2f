#include "physics/xpbd/xpbd.h"

#include <algorithm>
#include <cmath>

#include "physics/forces/gas.h"

namespace pneuma::physics {

namespace {

// Of the body's length: the furthest that its gas may push a particle in one pass.
constexpr double gas_move_max = 0.25;
constexpr int root_iterations_max = 60;

// `OwnMasses`: the vertices are of different mass.
template <class Real, bool OwnMasses>
class Xpbd {
 public:
  Xpbd(SoftState<Real>& body, const Surroundings& surroundings, double dt_s, XpbdScratch<Real>& scratch)
      : body_(body), surroundings_(surroundings), h_(dt_s), scratch_(scratch) {}

  [[nodiscard]] Real inverse_mass(std::size_t i) const {
    if (body_.is_pinned(i)) return Real{0};
    if constexpr (OwnMasses) return static_cast<Real>(1.0 / body_.mass_kg(i));
    return Real{1} / body_.vertex_mass_kg;
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

  // There and back, with the gas in between: a pass in one order only is no symmetric operator, and a step that takes
  // its velocity from it may have growing modes (a ball at rest began to spin).
  template <bool Scaled>
  void solve(Profile* profile) {
    scratch_.spring_pull.assign(body_.body.springs.stiffness_n_m > 0.0 ? body_.body.mesh->edges.size() : 0, Real{0});
    scratch_.hinge_turn.assign(body_.hinges.size(), 0.0);
    scratch_.grab_pull.assign(body_.grabs.size(), Vec3d::Zero());
    const std::size_t springs = scratch_.spring_pull.size();
    timed(profile, Stage::springs, springs, [&](std::size_t i) { pull_spring<Scaled>(i); });
    timed(profile, Stage::bending, body_.hinges.size(), [&](std::size_t i) { bend(i); });
    timed(profile, Stage::grabs, body_.grabs.size(), [&](std::size_t i) { hold_grab(i); });
    if (body_.gas) {
      const StageTimer timer(profile, Stage::pressure);
      press();
    }
    const auto backwards = [](std::size_t count, auto&& one) {
      return [count, one](std::size_t i) { one(count - 1 - i); };
    };
    timed(profile, Stage::grabs, body_.grabs.size(),
          backwards(body_.grabs.size(), [&](std::size_t i) { hold_grab(i); }));
    timed(profile, Stage::bending, body_.hinges.size(),
          backwards(body_.hinges.size(), [&](std::size_t i) { bend(i); }));
    timed(profile, Stage::springs, springs, backwards(springs, [&](std::size_t i) { pull_spring<Scaled>(i); }));
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

  void press() {
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
    // By the same rounded number that predict() multiplies with: its reciprocal would be off one way in every step.
    const auto h = static_cast<Real>(h_);
    for (std::size_t i = 0; i < body_.x.size(); ++i) body_.v[i] = body_.dr[i] / h;
  }

 private:
  template <class Constraint>
  static void timed(Profile* profile, Stage stage, std::size_t count, const Constraint& constraint) {
    if (count == 0) return;
    const StageTimer timer(profile, stage);
    for (std::size_t i = 0; i < count; ++i) constraint(i);
  }

  template <bool Scaled>
  void pull_spring(std::size_t i) {
    const auto [a, b] = body_.body.mesh->edges[i];
    const Vec3<Real> along = body_.x[b] - body_.x[a] + (body_.dr[b] - body_.dr[a]);
    const Real length = along.norm();
    if (!(length > 0)) return;
    const Springs& springs = body_.body.springs;
    auto stiffness = static_cast<Real>(h_ * h_ * springs.stiffness_n_m);
    if constexpr (Scaled) stiffness *= static_cast<Real>(springs.stiffness_scale({a, b}));
    const Real give = inverse_mass(a) + inverse_mass(b);
    Real& pull = scratch_.spring_pull[i];
    const Real more = (stiffness * (length - body_.rest_length_m(i)) - pull) / (Real{1} + stiffness * give);
    pull += more;
    const Vec3<Real> towards = more / length * along;
    body_.dr[a] += inverse_mass(a) * towards;
    body_.dr[b] -= inverse_mass(b) * towards;
  }

  void bend(std::size_t index) {
    const Hinge& hinge = body_.hinges[index];
    std::array<Vec3d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t vertex = hinge.vertices[i];
      corners[i] = (body_.x[vertex] + body_.dr[vertex]).template cast<double>();
    }
    const auto angle = hinge_angle(corners);
    if (!angle) return;
    double give = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      give += static_cast<double>(inverse_mass(hinge.vertices[i])) * angle->gradient[i].squaredNorm();
    }
    const double share = h_ * h_ * body_.body.springs.bend_stiffness_n_m * hinge.weight;
    double& turn = scratch_.hinge_turn[index];
    const double more = (share * bend_rad(hinge, *angle) - turn) / (1.0 + share * give);
    turn += more;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t vertex = hinge.vertices[i];
      body_.dr[vertex] -= inverse_mass(vertex) * (more * angle->gradient[i]).template cast<Real>();
    }
  }

  void hold_grab(std::size_t i) {
    const Grab& grab = body_.grabs[i];
    if (body_.is_pinned(grab.vertex)) return;
    const double stiffness = h_ * h_ * grab.stiffness_n_m;
    const double damping = h_ * grab.damping_n_s_m;
    const auto weight = static_cast<double>(inverse_mass(grab.vertex));
    const Vec3d moved = body_.dr[grab.vertex].template cast<double>();
    const Vec3d offset = grab.target - body_.position_m(grab.vertex) - moved;
    Vec3d& pull = scratch_.grab_pull[i];
    const Vec3d more = (stiffness * offset - damping * moved - pull) / (1.0 + (stiffness + damping) * weight);
    pull += more;
    body_.dr[grab.vertex] += (weight * more).template cast<Real>();
  }

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

template <class Real, bool OwnMasses>
void take_step(Xpbd<Real, OwnMasses> step, const Springs& springs, Profile* profile) {
  {
    const StageTimer timer(profile, Stage::integrate);
    step.predict();
  }
  if (springs.vertex_stiffness_scale.empty()) {
    step.template solve<false>(profile);
  } else {
    step.template solve<true>(profile);
  }
  const StageTimer timer(profile, Stage::integrate);
  step.finish();
  step.damp();
}

}  // namespace

template <class Real>
void xpbd(SoftState<Real>& body, const SubstepContext& context, XpbdScratch<Real>& scratch) {
  const Springs& springs = body.body.springs;
  if (body.mass_shares.empty()) {
    take_step(Xpbd<Real, false>(body, context.surroundings, context.dt_s, scratch), springs, context.profile);
  } else {
    take_step(Xpbd<Real, true>(body, context.surroundings, context.dt_s, scratch), springs, context.profile);
  }
}

template void xpbd<float>(SoftState<float>&, const SubstepContext&, XpbdScratch<float>&);
template void xpbd<double>(SoftState<double>&, const SubstepContext&, XpbdScratch<double>&);

}  // namespace pneuma::physics
