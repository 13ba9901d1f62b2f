#include "physics/implicit/implicit_system.h"

#include <algorithm>
#include <cmath>

#include "physics/forces/force_terms.h"

namespace pneuma::physics {

namespace {

// Measured with this preconditioner: 15 to 33 iterations to 1e-8 from 162 to 40,962 vertices and h^2 k/m from 1 to 1e6.
// A step that needs more is taken as far as it got.
constexpr int iterations_max = 60;
// Of the inertia along a direction: the least resistance at which the system still counts as one.
constexpr double inertia_share_min = 0.5;

// The sum of the impulses, from each by its share of the mass.
void remove_sum(std::vector<Vec3d>& impulses_n_s, std::span<const double> mass_shares) {
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& impulse : impulses_n_s) sum += impulse;
  const Vec3d mean = sum / static_cast<double>(impulses_n_s.size());
  if (mass_shares.empty()) {
    for (Vec3d& impulse : impulses_n_s) impulse -= mean;
  } else {
    for (std::size_t i = 0; i < impulses_n_s.size(); ++i) impulses_n_s[i] -= mass_shares[i] * mean;
  }
}

// u . M u
double inertia(const ImplicitConstants& constants, std::span<const Vec3d> u) {
  if (constants.mass_shares.empty()) return constants.vertex_mass_kg * dot(u, u);
  double sum = 0.0;
  for (std::size_t i = 0; i < u.size(); ++i) sum += constants.mass_shares[i] * u[i].squaredNorm();
  return constants.vertex_mass_kg * sum;
}

// The energy at which a solve ends. Where vertices are of different mass, it is the lightest whose motion that must
// bound: beside a heavy one, what the whole body's energy leaves out is all of theirs.
double enough_j(const ImplicitMatrix& matrix, const ImplicitSystem::Tolerance& tolerance, double decrease_j,
                std::size_t count) {
  const double mass_kg = matrix.constants.vertex_mass_kg * static_cast<double>(count);
  return matrix.least_share * std::max(tolerance.relative * tolerance.relative * decrease_j,
                                       mass_kg * tolerance.absolute_m_s * tolerance.absolute_m_s);
}

}  // namespace

double dot(std::span<const Vec3d> a, std::span<const Vec3d> b) {
  Vec3d sum = Vec3d::Zero();  // an axis each, so that not every addition waits for the last
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].cwiseProduct(b[i]);
  return sum.sum();
}

void ImplicitSystem::multiply(std::span<const Vec3d> u, std::vector<Vec3d>& product) const {
  const Mesh& mesh = *matrix_->constants.mesh;
  product.resize(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) product[i] = matrix_->diagonal[i] * u[i];
  tangents_.add_product(mesh, u, product);
  if (has_gas()) {
    const double along = gas_stiffness_ * dot(volume_gradient_, u);
    for (std::size_t i = 0; i < u.size(); ++i) product[i] += along * volume_gradient_[i];
  }
  clear_pinned(product);
}

void ImplicitSystem::clear_pinned(std::vector<Vec3d>& points) const {
  const std::vector<std::uint8_t>& pinned = matrix_->constants.pinned;
  for (std::size_t i = 0; i < pinned.size(); ++i) {
    if (pinned[i] != 0) points[i].setZero();
  }
}

// Of b and of the gas's gradient at once: one pass over the factor serves both.
void ImplicitSystem::solve_with_gas(std::span<const Vec3d> b, std::vector<Vec3d>& z) {
  const std::span<const std::uint32_t> places = matrix_->factor.places();
  rows8_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    const Vec3d& g = volume_gradient_[i];
    rows8_[places[i]] = {{b[i].x(), b[i].y(), b[i].z(), g.x(), g.y(), g.z(), 0.0, 0.0}};
  }
  matrix_->factor.solve(rows8_);
  z.resize(b.size());
  gas_answer_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double* row = rows8_[places[i]].columns;
    z[i] = {row[0], row[1], row[2]};
    gas_answer_[i] = {row[3], row[4], row[5]};
  }
  gas_share_ = gas_stiffness_ / (1.0 + gas_stiffness_ * dot(volume_gradient_, gas_answer_));
}

void ImplicitSystem::precondition(std::span<const Vec3d> b, std::vector<Vec3d>& z) {
  const std::span<const std::uint32_t> places = matrix_->factor.places();
  rows4_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) rows4_[places[i]] = {{b[i].x(), b[i].y(), b[i].z(), 0.0}};
  matrix_->factor.solve(rows4_);
  z.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double* row = rows4_[places[i]].columns;
    z[i] = {row[0], row[1], row[2]};
  }
}

void ImplicitSystem::add_gas(std::vector<Vec3d>& z) const {
  if (!has_gas()) return;
  const double share = gas_share_ * dot(volume_gradient_, z);
  for (std::size_t i = 0; i < z.size(); ++i) z[i] -= share * gas_answer_[i];
}

template <class Real>
void ImplicitSystem::begin(const SoftState<Real>& body, const ImplicitMatrix& matrix, const Surroundings& surroundings,
                           const Problem& problem) {
  matrix_ = &matrix;
  is_free_ = !is_driven(body, surroundings);
  volume_gradient_ = {};
  if (body.gas) {
    volume_gradient_ = problem.volume_gradient_m2;
    gas_stiffness_ = matrix.constants.s * matrix.constants.s * volume_stiffness_pa_m3(body);
  }
}

template <class Real>
double ImplicitSystem::solve(const SoftState<Real>& body, const ImplicitMatrix& matrix,
                             const Surroundings& surroundings, const Problem& problem, const Tolerance& tolerance,
                             std::vector<Vec3d>& step) {
  const std::span<const Vec3d> b = problem.b;
  begin(body, matrix, surroundings, problem);
  if (has_gas()) {
    solve_with_gas(b, step);
  } else {
    precondition(b, step);
  }
  add_gas(step);

  const double decrease = dot(b, step);
  const double enough = enough_j(matrix, tolerance, decrease, b.size());
  if (!(decrease > enough)) return decrease;

  linearise(body, {problem.x, problem.v, matrix.constants.s, surroundings, matrix.opposite}, tangents_);
  multiply(step, product_);
  residual_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) residual_[i] = b[i] - product_[i];
  iterate(enough, step);
  return dot(b, step);
}

// Conjugate gradients from `step`, whose residual is residual_.
void ImplicitSystem::iterate(double enough, std::vector<Vec3d>& step) {
  const ImplicitConstants& constants = matrix_->constants;
  double before = 0.0;
  // A body that nothing holds moves as a whole by b alone, which the first guess has in full. Left in, the rounding of
  // that motion grows with each iteration.
  for (int iteration = 0; iteration < iterations_max; ++iteration) {
    if (is_free_) remove_sum(residual_, constants.mass_shares);
    precondition(residual_, conditioned_);
    add_gas(conditioned_);
    const double now = dot(residual_, conditioned_);
    if (!(now > enough)) break;
    if (iteration == 0) {
      direction_ = conditioned_;
    } else {
      const double share = now / before;
      for (std::size_t i = 0; i < step.size(); ++i) direction_[i] = conditioned_[i] + share * direction_[i];
    }
    before = now;
    multiply(direction_, product_);
    const double curvature = dot(direction_, product_);
    // The gas's second term can take away more than springs and inertia give, and the way on is then without end or
    // nearly so: what was found so far is still a descent.
    if (!(curvature > inertia_share_min * inertia(constants, direction_))) break;
    const double length = now / curvature;
    for (std::size_t i = 0; i < step.size(); ++i) {
      step[i] += length * direction_[i];
      residual_[i] -= length * product_[i];
    }
  }
}

double ImplicitSystem::volume_change_m3(std::span<const Vec3d> step) const {
  return volume_gradient_.empty() ? 0.0 : dot(volume_gradient_, step);
}

std::size_t ImplicitSystem::bytes() const {
  const std::size_t points = gas_answer_.capacity() + residual_.capacity() + direction_.capacity() +
                             product_.capacity() + conditioned_.capacity();
  return points * sizeof(Vec3d) + tangents_.bytes() + rows4_.capacity() * sizeof(rows4_[0]) +
         rows8_.capacity() * sizeof(rows8_[0]);
}

template double ImplicitSystem::solve<float>(const SoftState<float>&, const ImplicitMatrix&, const Surroundings&,
                                             const Problem&, const Tolerance&, std::vector<Vec3d>&);
template double ImplicitSystem::solve<double>(const SoftState<double>&, const ImplicitMatrix&, const Surroundings&,
                                              const Problem&, const Tolerance&, std::vector<Vec3d>&);

}  // namespace pneuma::physics
