#include "physics/implicit/tr_bdf2.h"

#include <numbers>

#include "physics/implicit/implicit_euler.h"

namespace pneuma::physics {

namespace {

constexpr double part = 2.0 - std::numbers::sqrt2;
// y2 = late y1 - early y0 + (1 - part)/(2 - part) dt f(y2), and the last factor is part / 2.
constexpr double late = 1.0 / (part * (2.0 - part));
constexpr double early = late - 1.0;

// The trapezoidal half takes the force where the last step ended, which magnifies what that step left unsolved.
constexpr double tightening = 0.05;

// Of the body's length: where the trapezoidal half would throw a particle further than this, seen from the body, the
// motion is past resolving, and the half would only turn it round.
constexpr double throw_max = 0.25;

}  // namespace

template <class Real>
bool tr_bdf2(SoftState<Real>& body, ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
             const SubstepContext& context, ImplicitSolver<Real>& solver) {
  const double dt_s = context.dt_s;
  const double s = 0.5 * part * dt_s;
  const double mean_kg = static_cast<double>(body.vertex_mass_kg);
  const std::size_t count = body.x.size();
  std::vector<Vec3d> x(count);
  std::vector<Vec3d> v(count);
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = body.x[i].template cast<double>();
    v[i] = body.v[i].template cast<double>();
  }
  const std::span<const Vec3d> f = solver.force(body, tables, x, v, context);
  std::vector<Vec3d> x0(count);
  std::vector<Vec3d> u0(count);
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < count; ++i) {
      x0[i] = x[i] + s * v[i];
      u0[i] = v[i] + s / (mean_kg * share(i)) * f[i];
    }
  });
  if (!(s * spread(u0) <= throw_max * static_cast<double>(body.length_m))) {
    return implicit_euler(body, tables, accuracy, context, FirstGuess::straight, solver);
  }
  const StageAccuracy tight{accuracy.newton_iterations, tightening * accuracy.error_target, accuracy.turned_iterations};
  std::vector<Vec3d> u = v;
  if (!solver.solve(body, tables, {x0, u0, s}, tight, context, u)) return false;

  std::vector<Vec3d> move(count);  // from x to x1
  for (std::size_t i = 0; i < count; ++i) {
    move[i] = s * (v[i] + u[i]);
    x0[i] = x[i] + late * move[i];
    u0[i] = late * u[i] - early * v[i];
  }
  if (!solver.solve(body, tables, {x0, u0, s}, tight, context, u)) return false;
  for (std::size_t i = 0; i < count; ++i) {
    body.v[i] = u[i].cast<Real>();
    body.dr[i] = (late * move[i] + s * u[i]).template cast<Real>();
  }
  return true;
}

template bool tr_bdf2<float>(SoftState<float>&, ImplicitTables<float>&, const StageAccuracy&, const SubstepContext&,
                             ImplicitSolver<float>&);
template bool tr_bdf2<double>(SoftState<double>&, ImplicitTables<double>&, const StageAccuracy&, const SubstepContext&,
                              ImplicitSolver<double>&);

}  // namespace pneuma::physics
