#include "physics/implicit_system.h"

#include <algorithm>
#include <cmath>

#include "physics/gas.h"

namespace pneuma::physics {

namespace {

using Triplet = Eigen::Triplet<double>;

// Measured with this preconditioner: 15 to 33 iterations to 1e-8 from 162 to 40,962 vertices and h^2 k/m from 1 to 1e6.
// A step that needs more is taken as far as it got.
constexpr int iterations_max = 60;

// Of the inertia along a direction: the least resistance at which the system still counts as one.
constexpr double inertia_share_min = 0.5;

double dot(std::span<const Vec3d> a, std::span<const Vec3d> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

void remove_mean(std::vector<Vec3d>& points) {
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& point : points) sum += point;
  const Vec3d mean = sum / static_cast<double>(points.size());
  for (Vec3d& point : points) point -= mean;
}

// A third of the faces around each vertex, at rest.
std::vector<double> vertex_areas_m2(const Mesh& mesh) {
  std::vector<double> areas_m2(mesh.positions_m.size(), 0.0);
  for (const auto& [a, b, c] : mesh.faces) {
    const std::vector<Vec3d>& x = mesh.positions_m;
    const double share_m2 = (x[b] - x[a]).cross(x[c] - x[a]).norm() / 6.0;
    for (const std::uint32_t vertex : {a, b, c}) areas_m2[vertex] += share_m2;
  }
  return areas_m2;
}

// Rounded up to a power of two, so that the matrix that depends on it is rarely factored anew.
template <class Real>
double drag_n_s_m3(const SoftState<Real>& body, const Atmosphere& atmosphere) {
  if (!has_wind(body.body, atmosphere)) return 0.0;
  double squared_max = 1.0;
  for (const Vec3<Real>& v : body.v) squared_max = std::max(squared_max, static_cast<double>(v.squaredNorm()));
  const double speed_m_s = atmosphere.wind.norm() + std::exp2(std::ceil(0.5 * std::log2(squared_max)));
  return atmosphere.density_kg_m3 * std::max(body.body.drag.normal, body.body.drag.tangential) * speed_m_s;
}

}  // namespace

template <class Real>
bool ImplicitSystem::set_up(const SoftState<Real>& body, const Surroundings& surroundings, double s) {
  const Springs& springs = body.body.springs;
  Constants constants{s,
                      static_cast<double>(body.vertex_mass_kg),
                      springs.stiffness_n_m,
                      springs.damping_n_s_m,
                      springs.bend_stiffness_n_m,
                      drag_n_s_m3(body, surroundings.atmosphere),
                      {},
                      body.pinned};
  for (const Grab& grab : body.grabs) {
    constants.grabs.insert(constants.grabs.end(),
                           {static_cast<double>(grab.vertex), grab.stiffness_n_m, grab.damping_n_s_m});
  }
  if (factored_ && mesh_ == body.body.mesh && constants == constants_) return true;

  if (mesh_ != body.body.mesh) {
    mesh_ = body.body.mesh;
    if (mesh_->closed) opposite_ = opposite_vertices(*mesh_);
  }
  constants_ = std::move(constants);
  rest_lengths_m_.resize(mesh_->edges.size());
  for (std::size_t i = 0; i < rest_lengths_m_.size(); ++i)
    rest_lengths_m_[i] = static_cast<double>(body.rest_length_m(i));
  diagonal_.assign(mesh_->positions_m.size(), constants_.vertex_mass_kg);
  for (const Grab& grab : body.grabs) diagonal_[grab.vertex] += s * (grab.damping_n_s_m + s * grab.stiffness_n_m);
  factored_ = factor_.factor(preconditioner(body.hinges));
  return factored_;
}

Eigen::SparseMatrix<double> ImplicitSystem::preconditioner(std::span<const Hinge> hinges) const {
  const std::size_t count = mesh_->positions_m.size();
  const double s = constants_.s;
  std::vector<Triplet> entries;
  entries.reserve(count + 4 * mesh_->edges.size() + 16 * hinges.size());
  const auto is_pinned = [&](std::uint32_t i) { return !constants_.pinned.empty() && constants_.pinned[i] != 0; };
  const auto add = [&](std::uint32_t i, std::uint32_t j, double value) {
    if (i == j || (!is_pinned(i) && !is_pinned(j))) {
      entries.emplace_back(static_cast<int>(i), static_cast<int>(j), value);
    }
  };
  for (std::uint32_t i = 0; i < count; ++i) add(i, i, diagonal_[i]);
  const double spring = s * (constants_.damping_n_s_m + s * constants_.stiffness_n_m);
  for (const auto& [a, b] : mesh_->edges) {
    add(a, a, spring);
    add(b, b, spring);
    add(a, b, -spring);
    add(b, a, -spring);
  }
  for (const Hinge& hinge : hinges) {
    // At rest all four gradients are near one line: their lengths, with signs, are the row of a Laplacian.
    std::array<Vec3d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = mesh_->positions_m[hinge.vertices[i]];
    const auto angle = hinge_angle(corners);
    if (!angle) continue;
    const double stiffness = s * s * constants_.bend_stiffness_n_m * hinge.weight;
    std::array<double, 4> lengths{};
    for (std::size_t i = 0; i < 4; ++i) {
      lengths[i] = std::copysign(angle->gradient[i].norm(), angle->gradient[i].dot(angle->gradient[2]));
    }
    lengths[0] = -(lengths[1] + lengths[2] + lengths[3]);  // a move of the whole is none
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        add(hinge.vertices[i], hinge.vertices[j], stiffness * lengths[i] * lengths[j]);
      }
    }
  }
  if (constants_.drag_n_s_m3 > 0.0) {
    const std::vector<double> areas_m2 = vertex_areas_m2(*mesh_);
    for (std::uint32_t i = 0; i < count; ++i) add(i, i, s * constants_.drag_n_s_m3 * areas_m2[i]);
  }
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

template <class Real>
void ImplicitSystem::linearise_gas(const SoftState<Real>& body, std::span<const Vec3d> x) {
  volume_gradient_.clear();
  if (!body.gas) return;
  gas_stiffness_ = constants_.s * constants_.s * gas_stiffness_pa_m3(*body.gas, *body.body.gas, body.volume_m3);
  volume_gradient_.assign(x.size(), Vec3d::Zero());
  for (const auto& [a, b, c] : mesh_->faces) {
    const Vec3d share = (x[b] - x[a]).cross(x[c] - x[a]) / 6.0;
    volume_gradient_[a] += share;
    volume_gradient_[b] += share;
    volume_gradient_[c] += share;
  }
  clear_pinned(volume_gradient_);
}

template <class Real>
void ImplicitSystem::linearise_rest(const SoftState<Real>& body, const Surroundings& surroundings,
                                    const Problem& problem) {
  linearise_edges(problem.x, body.gas ? constants_.s * constants_.s * body.pressure_pa : 0.0);
  linearise_bending(body.hinges, problem.x);
  drags_.clear();
  if (constants_.drag_n_s_m3 > 0.0) linearise_wind(body.body, surroundings.atmosphere, problem.x, problem.v);
}

void ImplicitSystem::linearise_edges(std::span<const Vec3d> x, double turn) {
  const double s = constants_.s;
  const double spring = s * s * constants_.stiffness_n_m;
  const double damping = s * constants_.damping_n_s_m;
  edges_.resize(mesh_->edges.size());
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const auto [a, b] = mesh_->edges[i];
    EdgeTangent& tangent = edges_[i];
    tangent.direction = x[b] - x[a];
    const double length = tangent.direction.norm();
    const double per_length = length > 0.0 ? 1.0 / length : 0.0;
    tangent.direction *= per_length;
    tangent.along = length > 0.0 ? spring + damping : 0.0;
    tangent.across = spring * std::max(0.0, 1.0 - rest_lengths_m_[i] * per_length);
    tangent.turn = turn != 0.0 ? Vec3d(turn / 6.0 * (x[opposite_[i][0]] - x[opposite_[i][1]])) : Vec3d(Vec3d::Zero());
  }
}

void ImplicitSystem::linearise_bending(std::span<const Hinge> hinges, std::span<const Vec3d> x) {
  bends_.clear();
  for (const Hinge& hinge : hinges) {
    std::array<Vec3d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = x[hinge.vertices[i]];
    const auto angle = hinge_angle(corners);
    if (!angle) continue;
    bends_.push_back(
        {hinge.vertices, angle->gradient, constants_.s * constants_.s * constants_.bend_stiffness_n_m * hinge.weight});
  }
}

// d/dv of 1/2 rho A (C_n |u.n| u.n n + C_t |u_t| u_t), shared by thirds as the force is, of the mean of three speeds.
void ImplicitSystem::linearise_wind(const SoftBody& body, const Atmosphere& atmosphere, std::span<const Vec3d> x,
                                    std::span<const Vec3d> v) {
  for (const auto& [a, b, c] : mesh_->faces) {
    Eigen::Matrix3d drag = Eigen::Matrix3d::Zero();
    const Vec3d cross = (x[b] - x[a]).cross(x[c] - x[a]);
    const double twice_area = cross.norm();
    if (twice_area > 0.0) {
      const Vec3d normal = cross / twice_area;
      const Vec3d stream = atmosphere.wind - (v[a] + v[b] + v[c]) / 3.0;
      const double through = stream.dot(normal);
      const Vec3d along = stream - through * normal;
      const double speed_along = along.norm();
      drag = 2.0 * body.drag.normal * std::abs(through) * normal * normal.transpose();
      if (speed_along > 0.0) {
        drag += body.drag.tangential * (speed_along * (Eigen::Matrix3d::Identity() - normal * normal.transpose()) +
                                        along * along.transpose() / speed_along);
      }
      drag *= constants_.s * 0.5 * atmosphere.density_kg_m3 * 0.5 * twice_area / 9.0;
    }
    drags_.push_back(drag);
  }
}

void ImplicitSystem::multiply(std::span<const Vec3d> u, std::vector<Vec3d>& product) const {
  product.resize(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) product[i] = diagonal_[i] * u[i];
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const auto [a, b] = mesh_->edges[i];
    const EdgeTangent& tangent = edges_[i];
    const Vec3d du = u[b] - u[a];
    const double stretch = (tangent.along - tangent.across) * tangent.direction.dot(du);
    const Vec3d pull = stretch * tangent.direction + tangent.across * du;
    // -P grad^2 V: what an edge does to both its ends is one and the same, as the ring around a vertex closes.
    const Vec3d turned = du.cross(tangent.turn);
    product[a] -= pull + turned;
    product[b] += pull - turned;
  }
  for (const HingeTangent& bend : bends_) {
    double angle = 0.0;
    for (std::size_t i = 0; i < 4; ++i) angle += bend.gradient[i].dot(u[bend.vertices[i]]);
    for (std::size_t i = 0; i < 4; ++i) product[bend.vertices[i]] += bend.stiffness * angle * bend.gradient[i];
  }
  for (std::size_t i = 0; i < drags_.size(); ++i) {
    const auto [a, b, c] = mesh_->faces[i];
    const Vec3d share = drags_[i] * (u[a] + u[b] + u[c]);
    product[a] += share;
    product[b] += share;
    product[c] += share;
  }
  if (has_gas()) {
    const double along = gas_stiffness_ * dot(volume_gradient_, u);
    for (std::size_t i = 0; i < u.size(); ++i) product[i] += along * volume_gradient_[i];
  }
  clear_pinned(product);
}

void ImplicitSystem::clear_pinned(std::vector<Vec3d>& points) const {
  for (std::size_t i = 0; i < constants_.pinned.size(); ++i) {
    if (constants_.pinned[i] != 0) points[i].setZero();
  }
}

// Of b and of the gas's gradient at once: one pass over the factor serves both.
void ImplicitSystem::solve_with_gas(std::span<const Vec3d> b, std::vector<Vec3d>& z) {
  rows6_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    const Vec3d& g = volume_gradient_[i];
    rows6_[i] = {b[i].x(), b[i].y(), b[i].z(), g.x(), g.y(), g.z()};
  }
  factor_.solve<6>(rows6_);
  z.resize(b.size());
  gas_answer_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    z[i] = {rows6_[i][0], rows6_[i][1], rows6_[i][2]};
    gas_answer_[i] = {rows6_[i][3], rows6_[i][4], rows6_[i][5]};
  }
  gas_share_ = gas_stiffness_ / (1.0 + gas_stiffness_ * dot(volume_gradient_, gas_answer_));
}

void ImplicitSystem::precondition(std::span<const Vec3d> b, std::vector<Vec3d>& z) {
  rows4_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) rows4_[i] = {b[i].x(), b[i].y(), b[i].z(), 0.0};
  factor_.solve<4>(rows4_);
  z.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) z[i] = {rows4_[i][0], rows4_[i][1], rows4_[i][2]};
}

void ImplicitSystem::add_gas(std::vector<Vec3d>& z) const {
  if (!has_gas()) return;
  const double share = gas_share_ * dot(volume_gradient_, z);
  for (std::size_t i = 0; i < z.size(); ++i) z[i] -= share * gas_answer_[i];
}

template <class Real>
double ImplicitSystem::solve(const SoftState<Real>& body, const Surroundings& surroundings, const Problem& problem,
                             const Tolerance& tolerance, std::vector<Vec3d>& step) {
  const std::span<const Vec3d> b = problem.b;
  linearise_gas(body, problem.x);
  if (has_gas()) {
    solve_with_gas(b, step);
  } else {
    precondition(b, step);
  }
  add_gas(step);

  const double decrease = dot(b, step);
  const double mass_kg = constants_.vertex_mass_kg * static_cast<double>(b.size());
  const double enough = std::max(tolerance.relative * tolerance.relative * decrease,
                                 mass_kg * tolerance.absolute_m_s * tolerance.absolute_m_s);
  if (!(decrease > enough)) return decrease;

  linearise_rest(body, surroundings, problem);
  multiply(step, product_);
  residual_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) residual_[i] = b[i] - product_[i];
  iterate(enough, step);
  return dot(b, step);
}

// Conjugate gradients from `step`, whose residual is residual_.
void ImplicitSystem::iterate(double enough, std::vector<Vec3d>& step) {
  double before = 0.0;
  // A body that nothing holds moves as a whole by b alone, which the first guess has in full. Left in, the rounding of
  // that motion grows with each iteration.
  const bool is_free = constants_.pinned.empty() && constants_.grabs.empty() && drags_.empty();
  for (int iteration = 0; iteration < iterations_max; ++iteration) {
    if (is_free) remove_mean(residual_);
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
    if (!(curvature > inertia_share_min * constants_.vertex_mass_kg * dot(direction_, direction_))) break;
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
  const std::size_t points = volume_gradient_.capacity() + gas_answer_.capacity() + residual_.capacity() +
                             direction_.capacity() + product_.capacity() + conditioned_.capacity();
  return factor_.bytes() + points * sizeof(Vec3d) +
         (diagonal_.capacity() + rest_lengths_m_.capacity()) * sizeof(double) +
         opposite_.capacity() * sizeof(opposite_[0]) + edges_.capacity() * sizeof(EdgeTangent) +
         bends_.capacity() * sizeof(HingeTangent) + drags_.capacity() * sizeof(Eigen::Matrix3d) +
         rows4_.capacity() * sizeof(rows4_[0]) + rows6_.capacity() * sizeof(rows6_[0]);
}

#define PNEUMA_INSTANTIATE(Real)                                                                           \
  template bool ImplicitSystem::set_up<Real>(const SoftState<Real>&, const Surroundings&, double);         \
  template double ImplicitSystem::solve<Real>(const SoftState<Real>&, const Surroundings&, const Problem&, \
                                              const Tolerance&, std::vector<Vec3d>&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
