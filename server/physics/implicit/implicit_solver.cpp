#include "physics/implicit/implicit_solver.h"

#include <algorithm>
#include <cmath>

#include "physics/forces/gas.h"

namespace pneuma::physics {

namespace {

// Of the error target times the body's length: the move that a step may leave out, so that a settled body costs one
// solve of the preconditioner. What steps leave out adds up as a force would, so shorter ones than this may leave out
// an acceleration that comes to as much within it.
constexpr double settled_share = 1e-3;
constexpr double settled_time_s = 1.0 / 60.0;
// Of the mean spacing of the particles: moves up to it change no edge's direction by much, and are taken as they are.
constexpr double small_move = 0.1;
// Of the body's length: the furthest that velocities are trusted to tell where a particle will be, seen from the body.
constexpr double trusted_move = 0.25;
constexpr int shortenings_max = 12;
Vec3d mean(std::span<const Vec3d> points) {
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

// Of the centre of mass.
template <class Real>
Vec3d mean_velocity(const SoftState<Real>& body, std::span<const Vec3d> velocities) {
  Vec3d sum = Vec3d::Zero();
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < velocities.size(); ++i) sum += share(i) * velocities[i];
  });
  return sum / static_cast<double>(velocities.size());
}

template <class Real>
double settled_speed_m_s(const SoftState<Real>& body, const ImplicitStage& stage, const StageAccuracy& accuracy) {
  return settled_share * accuracy.error_target * static_cast<double>(body.length_m) *
         std::min(stage.s / (settled_time_s * settled_time_s), 1.0 / stage.s);
}

// What turning edges does to springs beyond what a linear system knows: each may end longer by the move's square over
// twice its length.
template <class Real>
double turning_j(const SoftState<Real>& body, double move_m, double spacing_m) {
  const double longer_m = 0.5 * move_m * move_m / spacing_m;
  const Springs& springs = body.body.springs;
  auto edges = static_cast<double>(body.body.mesh->edges.size());
  if (!springs.vertex_stiffness_scale.empty()) {
    edges = 0.0;
    for (const Edge& edge : body.body.mesh->edges) edges += springs.stiffness_scale(edge);
  }
  return 0.5 * springs.stiffness_n_m * edges * longer_m * longer_m;
}

}  // namespace

double spread(std::span<const Vec3d> points) {
  const Vec3d centre = mean(points);
  double squared = 0.0;
  for (const Vec3d& point : points) squared = std::max(squared, (point - centre).squaredNorm());
  return std::sqrt(squared);
}

template <class Real>
std::span<const Vec3d> ImplicitSolver<Real>::force(SoftState<Real>& body, const ImplicitTables<Real>& tables,
                                                   std::span<const Vec3d> x, std::span<const Vec3d> v,
                                                   const SubstepContext& context) {
  forces_.evaluate(body, tables.lanes, context, x, v);
  return forces_.force_n();
}

// Sets residual_ to M (u0 - u) + s f. False where it is not finite.
template <class Real>
bool ImplicitSolver<Real>::find_residual(SoftState<Real>& body, const ImplicitTables<Real>& tables,
                                         const ImplicitStage& stage, const SubstepContext& context,
                                         std::span<const Vec3d> u) {
  x_.resize(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) x_[i] = stage.x0[i] + stage.s * u[i];
  const std::span<const Vec3d> f = force(body, tables, x_, u, context);
  const StageTimer timer(context.profile, Stage::integrate);
  const double mean_kg = static_cast<double>(body.vertex_mass_kg);
  residual_.resize(u.size());
  Vec3d sum = Vec3d::Zero();  // it is finite where all are
  body.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < u.size(); ++i) {
      residual_[i] = mean_kg * share(i) * (stage.u0[i] - u[i]) + stage.s * f[i];
      sum += residual_[i];
    }
  });
  return sum.allFinite();
}

template <class Real>
bool ImplicitSolver<Real>::solve(SoftState<Real>& body, ImplicitTables<Real>& tables, const ImplicitStage& stage,
                                 const StageAccuracy& accuracy, const SubstepContext& context, std::vector<Vec3d>& u) {
  tables.matrices->update(tables.held.steps, body, context.surroundings, stage.s);
  if (!tables.held.steps) return false;
  const double length_m = static_cast<double>(body.length_m);
  const double guess_m = stage.s * spread(u);
  if (guess_m > trusted_move * length_m) {
    const Vec3d centre = mean_velocity(body, u);
    for (std::size_t i = 0; i < u.size(); ++i) {
      if (!body.is_pinned(i)) u[i] = centre + trusted_move * length_m / guess_m * (u[i] - centre);
    }
  }
  const double settled_m_s = settled_speed_m_s(body, stage, accuracy);
  const double settled_j = tables.held.steps->least_share * body.body.mass_kg * settled_m_s * settled_m_s;
  const double spacing_m = length_m / std::sqrt(static_cast<double>(u.size()));

  if (!find_residual(body, tables, stage, context, u)) return false;
  std::uint32_t iterations_max = accuracy.newton_iterations;
  for (std::uint32_t iteration = 1; iteration <= iterations_max; ++iteration) {
    Correction correction;
    {
      const StageTimer timer(context.profile, Stage::integrate);
      correction.slope_j =
          system_.solve(body, *tables.held.steps, context.surroundings,
                        {x_, u, residual_, forces_.volume_gradient_m2()}, {accuracy.error_target, settled_m_s}, step_);
      correction.spread_m = stage.s * spread(step_);
    }
    if (!std::isfinite(correction.slope_j) || !std::isfinite(correction.spread_m)) return false;
    if (turning_j(body, correction.spread_m, spacing_m) > settled_j) {
      iterations_max = std::max(iterations_max, accuracy.turned_iterations);
    }
    if (correction.spread_m > small_move * spacing_m) {
      // What nothing holds moves as a whole by the step of its centre of mass, exactly: that part is not to be
      // shortened.
      if (!is_driven(body, context.surroundings)) correction.whole_m_s = mean_velocity(body, step_);
      if (!take_step(body, tables, stage, context, correction, u)) return false;
      continue;
    }
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += step_[i];
    const bool last = iteration == iterations_max || correction.slope_j <= settled_j;
    if (last) {
      move_volume(body, stage, context);
      return true;
    }
    if (!find_residual(body, tables, stage, context, u)) return false;
  }
  return true;
}

// From where the force was found to a step further.
template <class Real>
void ImplicitSolver<Real>::move_volume(SoftState<Real>& body, const ImplicitStage& stage,
                                       const SubstepContext& context) const {
  if (!body.gas) return;
  body.volume_m3 += stage.s * system_.volume_change_m3(step_);
  body.pressure_pa =
      gas_pressure_pa(*body.gas, *body.body.gas, body.volume_m3) - context.surroundings.atmosphere.pressure_pa;
}

// Goes along step_ as far as is safe, and leaves the residual there.
template <class Real>
bool ImplicitSolver<Real>::take_step(SoftState<Real>& body, const ImplicitTables<Real>& tables,
                                     const ImplicitStage& stage, const SubstepContext& context,
                                     const Correction& correction, std::vector<Vec3d>& u) {
  double share = std::min(1.0, static_cast<double>(body.length_m) / correction.spread_m);
  const Vec3d& whole = correction.whole_m_s;
  for (int shortening = 0; shortening <= shortenings_max; ++shortening, share *= 0.5) {
    trial_.resize(u.size());
    for (std::size_t i = 0; i < u.size(); ++i) trial_[i] = u[i] + whole + share * (step_[i] - whole);
    if (!find_residual(body, tables, stage, context, trial_)) continue;
    // Of a potential that is convex along the step, this bounds where it may end to no more than where it began.
    const bool safe = dot(residual_, step_) >= -correction.slope_j;
    if (safe || shortening == shortenings_max) {
      u.swap(trial_);
      return true;
    }
  }
  return false;
}

template <class Real>
std::size_t ImplicitSolver<Real>::bytes() const {
  return system_.bytes() + forces_.bytes() +
         (x_.capacity() + residual_.capacity() + step_.capacity() + trial_.capacity()) * sizeof(Vec3d);
}

template class ImplicitSolver<float>;
template class ImplicitSolver<double>;

}  // namespace pneuma::physics
