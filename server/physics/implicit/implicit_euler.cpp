#include "physics/implicit/implicit_euler.h"

#include <utility>

#include <Eigen/Geometry>

#include "physics/forces/force_terms.h"
#include "physics/machine/portable_math.h"
#include "physics/state/whole_motion.h"

namespace pneuma::physics {
namespace {

// A turn by less shears edges by half its square, which is nothing.
constexpr double turn_min_rad = 3e-3;

}  // namespace

template <class Real>
void turn_straight_ways(const SoftState<Real>& body, std::span<const Vec3d> x, double dt_s, std::vector<Vec3d>& u) {
  const WholeMotion whole = whole_motion(
      x.size(), [&](std::size_t i) { return body.mass_kg(i); }, [&](std::size_t i) { return x[i]; },
      [&](std::size_t i) { return u[i]; });
  const Vec3d turning = whole.turning_rad_s();
  const double angle = dt_s * turning.norm();
  if (!(angle > turn_min_rad)) return;
  const auto [sine, cosine] = portable_sincos(0.5 * angle);
  const Vec3d axis = sine * turning.normalized();
  const Eigen::Matrix3d rotation = Quatd(cosine, axis.x(), axis.y(), axis.z()).toRotationMatrix();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3d arm = x[i] - whole.centre;
    u[i] += (rotation * arm - arm) / dt_s - turning.cross(arm);
  }
}

template <class Real>
bool implicit_euler(SoftState<Real>& body, ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
                    const SubstepContext& context, FirstGuess guess, ImplicitSolver<Real>& solver) {
  const double dt_s = context.dt_s;
  std::vector<Vec3d> x(body.x.size());
  std::vector<Vec3d> v(body.x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = body.x[i].template cast<double>();
    v[i] = body.v[i].template cast<double>();
  }
  std::vector<Vec3d> u = v;
  if (guess == FirstGuess::turned) turn_straight_ways(body, x, dt_s, u);
  if (!solver.solve(body, tables, {x, v, dt_s}, accuracy, context, u)) return false;
  for (std::size_t i = 0; i < u.size(); ++i) {
    body.v[i] = u[i].cast<Real>();
    body.dr[i] = (dt_s * u[i]).template cast<Real>();
  }
  return true;
}

template <class Real>
bool euler_again(SoftState<Real>& body, ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
                 const SubstepContext& context, ImplicitSolver<Real>& solver) {
  const FirstGuess guess = is_driven(body, context.surroundings) ? FirstGuess::straight : FirstGuess::turned;
  std::swap(tables.held.steps, tables.held.first_order);
  const bool solved = implicit_euler(body, tables, accuracy, context.of_body(nullptr, nullptr), guess, solver);
  std::swap(tables.held.steps, tables.held.first_order);
  return solved;
}

#define PNEUMA_INSTANTIATE(Real)                                                                                       \
  template void turn_straight_ways<Real>(const SoftState<Real>&, std::span<const Vec3d>, double, std::vector<Vec3d>&); \
  template bool euler_again<Real>(SoftState<Real>&, ImplicitTables<Real>&, const StageAccuracy&,                       \
                                  const SubstepContext&, ImplicitSolver<Real>&);                                       \
  template bool implicit_euler<Real>(SoftState<Real>&, ImplicitTables<Real>&, const StageAccuracy&,                    \
                                     const SubstepContext&, FirstGuess, ImplicitSolver<Real>&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
