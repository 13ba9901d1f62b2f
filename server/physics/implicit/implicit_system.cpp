#include "physics/implicit/implicit_system.h"

#include <algorithm>
#include <cmath>

#include "physics/forces/force_terms.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {

namespace {

// Measured with this preconditioner: 15 to 33 iterations to 1e-8 from 162 to 40,962 vertices and h^2 k/m from 1 to 1e6.
// A step that needs more is taken as far as it got.
constexpr int iterations_max = 60;
// Of the inertia along a direction: the least resistance at which the system still counts as one.
constexpr double inertia_share_min = 0.5;

Eigen::Map<Vec3d> vector_of(MotionRow& row) {
  return Eigen::Map<Vec3d>(row.columns);
}
Eigen::Map<const Vec3d> vector_of(const MotionRow& row) {
  return Eigen::Map<const Vec3d>(row.columns);
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

void to_rows(std::span<const Vec3d> points, std::span<const std::uint32_t> places, MotionRows& rows) {
  rows.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    rows[places[i]] = {{points[i].x(), points[i].y(), points[i].z(), 0.0}};
  }
}

void from_rows(const MotionRows& rows, std::span<const std::uint32_t> places, std::vector<Vec3d>& points) {
  points.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) points[i] = vector_of(rows[places[i]]);
}

void add_tangent_products(const Tangents& tangents, const ImplicitMatrix& matrix, const MotionRows& u,
                          MotionRows& product) {
  const std::span<const std::uint32_t> places = matrix.factor.places();
  system_kernels(isa_in_use())
      .add_edge_products(tangents.edges.data(), matrix.edge_places.data(), tangents.edges.size(), u.data(),
                         product.data());
  for (const FourPointTangent& tangent : tangents.four_points) {
    double moved = 0.0;
    for (std::size_t i = 0; i < 4; ++i) moved += tangent.gradient[i].dot(vector_of(u[places[tangent.vertices[i]]]));
    for (std::size_t i = 0; i < 4; ++i) {
      vector_of(product[places[tangent.vertices[i]]]) += tangent.stiffness * moved * tangent.gradient[i];
    }
  }
  const Mesh& mesh = *matrix.constants.mesh;
  for (std::size_t i = 0; i < tangents.faces.size(); ++i) {
    Vec3d moved = Vec3d::Zero();
    for (const std::uint32_t vertex : mesh.faces[i]) moved += vector_of(u[places[vertex]]);
    const Vec3d share = tangents.faces[i] * moved;
    for (const std::uint32_t vertex : mesh.faces[i]) vector_of(product[places[vertex]]) += share;
  }
}

double ImplicitSystem::dot(const MotionRows& a, const MotionRows& b) const {
  return kernels_->dot(a.data(), b.data(), a.size());
}

// u . M u
double ImplicitSystem::inertia(const MotionRows& u) const {
  const ImplicitConstants& constants = matrix_->constants;
  if (constants.mass_shares.empty()) return constants.vertex_mass_kg * dot(u, u);
  const std::span<const std::uint32_t> places = matrix_->factor.places();
  double sum = 0.0;
  for (std::size_t i = 0; i < u.size(); ++i) sum += constants.mass_shares[i] * vector_of(u[places[i]]).squaredNorm();
  return constants.vertex_mass_kg * sum;
}

// Takes the impulses' sum off, from each vertex by its share of the mass.
void ImplicitSystem::remove_sum(MotionRows& impulses_n_s) const {
  Vec3d sum = Vec3d::Zero();
  for (const MotionRow& row : impulses_n_s) sum += vector_of(row);
  const Vec3d mean = sum / static_cast<double>(impulses_n_s.size());
  const std::vector<double>& mass_shares = matrix_->constants.mass_shares;
  if (mass_shares.empty()) {
    for (MotionRow& row : impulses_n_s) vector_of(row) -= mean;
  } else {
    const std::span<const std::uint32_t> places = matrix_->factor.places();
    for (std::size_t i = 0; i < mass_shares.size(); ++i) vector_of(impulses_n_s[places[i]]) -= mass_shares[i] * mean;
  }
}

void ImplicitSystem::multiply(const MotionRows& u, MotionRows& product) const {
  product.resize(u.size());
  kernels_->scale_each(matrix_->diagonal_by_place.data(), u.data(), u.size(), product.data());
  add_tangent_products(tangents_, *matrix_, u, product);
  if (has_gas()) kernels_->add(gas_stiffness_ * dot(gradient_, u), gradient_.data(), u.size(), product.data());
  clear_pinned(product);
}

void ImplicitSystem::clear_pinned(MotionRows& rows) const {
  const std::span<const std::uint32_t> places = matrix_->factor.places();
  const std::vector<std::uint8_t>& pinned = matrix_->constants.pinned;
  for (std::size_t i = 0; i < pinned.size(); ++i) {
    if (pinned[i] != 0) rows[places[i]] = {};
  }
}

// Of b and of the gas's gradient at once: one pass over the factor serves both.
void ImplicitSystem::solve_with_gas() {
  const std::size_t count = b_.size();
  rows8_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::copy_n(b_[i].columns, 4, rows8_[i].columns);
    std::copy_n(gradient_[i].columns, 4, rows8_[i].columns + 4);
  }
  matrix_->factor.solve(rows8_);
  step_.resize(count);
  gas_answer_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::copy_n(rows8_[i].columns, 4, step_[i].columns);
    std::copy_n(rows8_[i].columns + 4, 4, gas_answer_[i].columns);
  }
  gas_share_ = gas_stiffness_ / (1.0 + gas_stiffness_ * dot(gradient_, gas_answer_));
}

void ImplicitSystem::add_gas(MotionRows& z) const {
  if (has_gas()) kernels_->add(-(gas_share_ * dot(gradient_, z)), gas_answer_.data(), z.size(), z.data());
}

template <class Real>
void ImplicitSystem::begin(const SoftState<Real>& body, const ImplicitMatrix& matrix, const Surroundings& surroundings,
                           const Problem& problem) {
  kernels_ = &system_kernels(isa_in_use());
  matrix_ = &matrix;
  is_free_ = !is_driven(body, surroundings);
  volume_gradient_ = {};
  to_rows(problem.b, matrix.factor.places(), b_);
  if (!body.gas) return;
  volume_gradient_ = problem.volume_gradient_m2;
  gas_stiffness_ = matrix.constants.s * matrix.constants.s * volume_stiffness_pa_m3(body);
  to_rows(volume_gradient_, matrix.factor.places(), gradient_);
}

template <class Real>
double ImplicitSystem::solve(const SoftState<Real>& body, const ImplicitMatrix& matrix,
                             const Surroundings& surroundings, const Problem& problem, const Tolerance& tolerance,
                             std::vector<Vec3d>& step) {
  begin(body, matrix, surroundings, problem);
  if (has_gas()) {
    solve_with_gas();
  } else {
    step_ = b_;
    matrix.factor.solve(step_);
  }
  add_gas(step_);

  double decrease = dot(b_, step_);
  const double enough = enough_j(matrix, tolerance, decrease, b_.size());
  if (decrease > enough) {
    linearise(body, {problem.x, problem.v, matrix.constants.s, surroundings, matrix.opposite}, tangents_);
    multiply(step_, product_);
    residual_ = b_;
    kernels_->add(-1.0, product_.data(), product_.size(), residual_.data());
    iterate(enough);
    decrease = dot(b_, step_);
  }
  from_rows(step_, matrix.factor.places(), step);
  return decrease;
}

// Conjugate gradients from step_, whose residual is residual_.
void ImplicitSystem::iterate(double enough) {
  const std::size_t count = step_.size();
  double before = 0.0;
  // A body that nothing holds moves as a whole by b alone, which the first guess has in full. Left in, the rounding of
  // that motion grows with each iteration.
  for (int iteration = 0; iteration < iterations_max; ++iteration) {
    if (is_free_) remove_sum(residual_);
    conditioned_ = residual_;
    matrix_->factor.solve(conditioned_);
    add_gas(conditioned_);
    const double now = dot(residual_, conditioned_);
    if (!(now > enough)) break;
    if (iteration == 0) {
      direction_ = conditioned_;
    } else {
      kernels_->add_to(conditioned_.data(), now / before, count, direction_.data());
    }
    before = now;
    multiply(direction_, product_);
    const double curvature = dot(direction_, product_);
    // The gas's second term can take away more than springs and inertia give, and the way on is then without end or
    // nearly so: what was found so far is still a descent.
    if (!(curvature > inertia_share_min * inertia(direction_))) break;
    const double length = now / curvature;
    kernels_->add(length, direction_.data(), count, step_.data());
    kernels_->add(-length, product_.data(), count, residual_.data());
  }
}

double ImplicitSystem::volume_change_m3(std::span<const Vec3d> step) const {
  return volume_gradient_.empty() ? 0.0 : physics::dot(volume_gradient_, step);
}

std::size_t ImplicitSystem::bytes() const {
  std::size_t rows = 0;
  for (const MotionRows* of :
       {&b_, &step_, &residual_, &direction_, &product_, &conditioned_, &gradient_, &gas_answer_}) {
    rows += of->capacity();
  }
  return rows * sizeof(MotionRow) + tangents_.bytes() + rows8_.capacity() * sizeof(rows8_[0]);
}

template double ImplicitSystem::solve<float>(const SoftState<float>&, const ImplicitMatrix&, const Surroundings&,
                                             const Problem&, const Tolerance&, std::vector<Vec3d>&);
template double ImplicitSystem::solve<double>(const SoftState<double>&, const ImplicitMatrix&, const Surroundings&,
                                              const Problem&, const Tolerance&, std::vector<Vec3d>&);

}  // namespace pneuma::physics
