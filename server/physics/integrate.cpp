#include "physics/integrate.h"

#include <cassert>

#include "physics/implicit_euler.h"
#include "physics/tr_bdf2.h"

namespace pneuma::physics {

namespace {

template <class Real>
using Points = std::vector<Vec3<Real>>;

// One body's motion, seen as y' = f(y) with y = (x, v): what every method below is made of.
template <class Real>
class Motion {
 public:
  Motion(SoftState<Real>& body, const Surroundings& surroundings, double dt_s, IntegratorScratch<Real>& scratch,
         Profile* profile)
      : body_(body), surroundings_(surroundings), dt_s_(dt_s), scratch_(scratch), profile_(profile) {
    scratch_.force.resize(body.x.size());
    body.dr.resize(body.x.size());
  }

  void explicit_euler() {
    evaluate(body_.x, body_.v);
    const StageTimer timer(profile_, Stage::integrate);
    const auto h = static_cast<Real>(dt_s_);
    for (std::size_t i = 0; i < body_.x.size(); ++i) {
      body_.dr[i] = h * body_.v[i];
      body_.v[i] += h * acceleration(i);
    }
  }

  void symplectic_euler() {
    evaluate(body_.x, body_.v);
    const StageTimer timer(profile_, Stage::integrate);
    const auto h = static_cast<Real>(dt_s_);
    for (std::size_t i = 0; i < body_.x.size(); ++i) {
      body_.v[i] += h * acceleration(i);
      body_.dr[i] = h * body_.v[i];
    }
  }

  void midpoint() {
    evaluate(body_.x, body_.v);
    step_to_stage(Real{0.5}, body_.v);
    evaluate(scratch_.x_stage, scratch_.v_stage);
    const StageTimer timer(profile_, Stage::integrate);
    const auto h = static_cast<Real>(dt_s_);
    for (std::size_t i = 0; i < body_.x.size(); ++i) {
      body_.dr[i] = h * scratch_.v_stage[i];
      body_.v[i] += h * acceleration(i);
    }
  }

  void rk4() {
    scratch_.x_slope_sum.assign(body_.x.size(), Vec3<Real>::Zero());
    scratch_.v_slope_sum.assign(body_.x.size(), Vec3<Real>::Zero());
    evaluate(body_.x, body_.v);
    add_slopes(Real{1}, body_.v);
    step_to_stage(Real{0.5}, body_.v);
    evaluate(scratch_.x_stage, scratch_.v_stage);
    add_slopes(Real{2}, scratch_.v_stage);
    step_to_stage(Real{0.5}, scratch_.v_stage);
    evaluate(scratch_.x_stage, scratch_.v_stage);
    add_slopes(Real{2}, scratch_.v_stage);
    step_to_stage(Real{1}, scratch_.v_stage);
    evaluate(scratch_.x_stage, scratch_.v_stage);
    add_slopes(Real{1}, scratch_.v_stage);
    const StageTimer timer(profile_, Stage::integrate);
    const auto sixth = static_cast<Real>(dt_s_ / 6.0);
    for (std::size_t i = 0; i < body_.x.size(); ++i) {
      body_.dr[i] = sixth * scratch_.x_slope_sum[i];
      body_.v[i] += sixth * scratch_.v_slope_sum[i];
    }
  }

 private:
  void evaluate(const Points<Real>& x, const Points<Real>& v) {
    compute_forces<Real>(body_, x, v, surroundings_, dt_s_, scratch_.force, profile_);
    for (std::size_t i = 0; i < body_.pinned.size(); ++i) {
      if (body_.pinned[i] != 0) scratch_.force[i].setZero();
    }
  }

  [[nodiscard]] Vec3<Real> acceleration(std::size_t i) const { return scratch_.force[i] / body_.vertex_mass_kg; }

  // The state a share of dt on from the start, along the slopes (velocity, acceleration) last evaluated. `velocity` may
  // be v_stage itself: each particle is read before it is written.
  void step_to_stage(Real share, const Points<Real>& velocity) {
    const StageTimer timer(profile_, Stage::integrate);
    scratch_.x_stage.resize(body_.x.size());
    scratch_.v_stage.resize(body_.x.size());
    const Real h = share * static_cast<Real>(dt_s_);
    for (std::size_t i = 0; i < body_.x.size(); ++i) {
      scratch_.x_stage[i] = body_.x[i] + h * velocity[i];
      scratch_.v_stage[i] = body_.v[i] + h * acceleration(i);
    }
  }

  void add_slopes(Real weight, const Points<Real>& velocity) {
    const StageTimer timer(profile_, Stage::integrate);
    for (std::size_t i = 0; i < body_.x.size(); ++i) {
      scratch_.x_slope_sum[i] += weight * velocity[i];
      scratch_.v_slope_sum[i] += weight * acceleration(i);
    }
  }

  SoftState<Real>& body_;
  const Surroundings& surroundings_;
  double dt_s_;
  IntegratorScratch<Real>& scratch_;
  Profile* profile_;
};

}  // namespace

template <class Real>
std::size_t IntegratorScratch<Real>::bytes() const {
  return (force.capacity() + x_stage.capacity() + v_stage.capacity() + x_slope_sum.capacity() +
          v_slope_sum.capacity()) *
             sizeof(Vec3<Real>) +
         (implicit ? implicit->bytes() : 0) + xpbd.bytes();
}

template <class Real>
void integrate(SoftState<Real>& body, const Method& method, const Surroundings& surroundings, double dt_s,
               IntegratorScratch<Real>& scratch, Profile* profile) {
  Motion<Real> motion(body, surroundings, dt_s, scratch, profile);
  switch (method.integrator) {
    case Integrator::explicit_euler:
      return motion.explicit_euler();
    case Integrator::midpoint:
      return motion.midpoint();
    case Integrator::rk4:
      return motion.rk4();
    case Integrator::symplectic_euler:
      return motion.symplectic_euler();
    case Integrator::implicit_euler:
      if (!scratch.implicit) scratch.implicit.emplace();
      body.solve_failed = !implicit_euler(body, method.accuracy, surroundings, dt_s, *scratch.implicit, profile);
      return;
    case Integrator::tr_bdf2:
      if (!scratch.implicit) scratch.implicit.emplace();
      body.solve_failed = !tr_bdf2(body, method.accuracy, surroundings, dt_s, *scratch.implicit, profile);
      return;
    case Integrator::xpbd:
      return xpbd(body, surroundings, dt_s, scratch.xpbd, profile);
    case Integrator::automatic:
      assert(false && "an integrator is chosen when the scene is compiled");
  }
}

template struct IntegratorScratch<float>;
template struct IntegratorScratch<double>;
template void integrate<float>(SoftState<float>&, const Method&, const Surroundings&, double, IntegratorScratch<float>&,
                               Profile*);
template void integrate<double>(SoftState<double>&, const Method&, const Surroundings&, double,
                                IntegratorScratch<double>&, Profile*);

}  // namespace pneuma::physics
