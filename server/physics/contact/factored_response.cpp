#include "physics/contact/factored_response.h"

#include <cmath>

namespace pneuma::physics {
namespace {

Eigen::Matrix3d factor_of_inverse(const Eigen::Matrix3d& matrix) {
  const Eigen::Matrix3d inverse = matrix.inverse();
  return Eigen::Matrix3d((0.5 * (inverse + inverse.transpose())).llt().matrixL());
}

// sum m ((X . Y) 1 - Y X^T), made symmetric.
Eigen::Matrix3d inertia_of(std::span<const double> masses_kg, std::span<const Vec3d> x, std::span<const Vec3d> y) {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) products += masses_kg[i] * y[i] * x[i].transpose();
  products = (0.5 * (products + products.transpose())).eval();
  return products.trace() * Eigen::Matrix3d::Identity() - products;
}

// Of the arms' squares: a body whose inertia is less than this share about an axis lies along it, and is not turned.
constexpr double metric_turning_share_min = 1e-9;

}  // namespace

void BodyMetric::begin(const ImplicitMatrix& matrix, bool turns, std::span<const Vec3d> x) {
  matrix_ = &matrix;
  turns_ = turns;
  gas_answer_.clear();
  if (!turns_) return;
  const std::vector<double>& masses_kg = matrix.diagonal;
  Vec3d centre = Vec3d::Zero();
  double mass_kg = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    centre += masses_kg[i] * x[i];
    mass_kg += masses_kg[i];
  }
  centre /= mass_kg;
  arms_.resize(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) arms_[i] = x[i] - centre;
  inertia_ = inertia_of(masses_kg, arms_, arms_);
  const double size = inertia_.trace();
  turns_ = inertia_.determinant() > metric_turning_share_min * size * size * size;
  if (!turns_) return;
  const std::span<const std::uint32_t> places = matrix.factor.places();
  rows4_.resize(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3d b = masses_kg[i] * arms_[i];
    rows4_[places[i]] = {{b.x(), b.y(), b.z(), 0.0}};
  }
  matrix.factor.solve(rows4_);
  slow_arms_.resize(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double* row = rows4_[places[i]].columns;
    slow_arms_[i] = {row[0], row[1], row[2]};
  }
  by_metric_ = factor_of_inverse(inertia_of(masses_kg, arms_, slow_arms_));
}

void BodyMetric::solve_with_gradient(std::span<const Vec3d> b, std::vector<Vec3d>& z) {
  const std::span<const std::uint32_t> places = matrix_->factor.places();
  rows8_.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    const Vec3d g = gas_answer_.empty() ? Vec3d(Vec3d::Zero()) : gas_answer_[i];
    rows8_[places[i]] = {{b[i].x(), b[i].y(), b[i].z(), g.x(), g.y(), g.z(), 0.0, 0.0}};
  }
  matrix_->factor.solve(rows8_);
  z.resize(b.size());
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double* row = rows8_[places[i]].columns;
    z[i] = {row[0], row[1], row[2]};
    if (!gas_answer_.empty()) gas_answer_[i] = {row[3], row[4], row[5]};
  }
}

void BodyMetric::add_rotations(std::span<const Vec3d> b, std::vector<Vec3d>& z) const {
  if (!turns_) return;
  Vec3d torque = Vec3d::Zero();
  Vec3d slow_torque = Vec3d::Zero();
  for (std::size_t i = 0; i < b.size(); ++i) {
    torque += arms_[i].cross(b[i]);
    slow_torque += slow_arms_[i].cross(b[i]);
  }
  const Vec3d turn = by_inertia_ * (by_inertia_.transpose() * torque);
  const Vec3d slow_turn = by_metric_ * (by_metric_.transpose() * slow_torque);
  for (std::size_t i = 0; i < b.size(); ++i) z[i] += turn.cross(arms_[i]) - slow_turn.cross(slow_arms_[i]);
}

void BodyMetric::move_to(const Place& place, std::span<const Vec3d> b_n_s, std::vector<Vec3d>& answer_m_s) {
  const double s = matrix_->constants.s;
  if (turns_) {
    by_inertia_ = factor_of_inverse(inertia_ + s * s * place.stress_n_m * Eigen::Matrix3d::Identity());
  }
  const bool gas = !place.volume_gradient_m2.empty() && place.gas_stiffness > 0.0;
  gas_answer_.clear();
  if (gas) gas_answer_.assign(place.volume_gradient_m2.begin(), place.volume_gradient_m2.end());
  solve_with_gradient(b_n_s, answer_m_s);
  add_rotations(b_n_s, answer_m_s);
  if (!gas) return;
  add_rotations(place.volume_gradient_m2, gas_answer_);
  double along = 0.0;
  double decrease = 0.0;
  for (std::size_t i = 0; i < b_n_s.size(); ++i) {
    along += place.volume_gradient_m2[i].dot(gas_answer_[i]);
    decrease += place.volume_gradient_m2[i].dot(answer_m_s[i]);
  }
  const double share = place.gas_stiffness / (1.0 + place.gas_stiffness * along);
  const double root = std::sqrt(share);
  for (std::size_t i = 0; i < b_n_s.size(); ++i) {
    answer_m_s[i] -= share * decrease * gas_answer_[i];
    gas_answer_[i] *= root;
  }
}

BodyMetric::LowRank BodyMetric::low_rank(const Support& at) const {
  LowRank columns = LowRank::Zero();
  Vec3d arm = Vec3d::Zero();
  Vec3d slow_arm = Vec3d::Zero();
  for (std::uint32_t i = 0; i < at.count; ++i) {
    const std::uint32_t vertex = at.vertices[i];
    if (turns_) {
      arm += at.weights[i] * arms_[vertex];
      slow_arm += at.weights[i] * slow_arms_[vertex];
    }
    if (!gas_answer_.empty()) columns.col(6) += at.weights[i] * gas_answer_[vertex];
  }
  if (turns_) {
    columns.leftCols<3>() = -cross_matrix(arm) * by_inertia_;
    columns.middleCols<3>(3) = -cross_matrix(slow_arm) * by_metric_;
  }
  return columns;
}

Vec3d BodyMetric::of_low_rank(std::size_t vertex, const Eigen::Matrix<double, 7, 1>& shares) const {
  Vec3d sum = Vec3d::Zero();
  if (turns_) {
    sum = (by_inertia_ * shares.head<3>()).cross(arms_[vertex]) -
          (by_metric_ * shares.segment<3>(3)).cross(slow_arms_[vertex]);
  }
  if (!gas_answer_.empty()) sum -= shares[6] * gas_answer_[vertex];
  return sum;
}

void FactoredResponse::add(Support& at) {
  if (local_of_.empty()) local_of_.assign(metric_->matrix().diagonal.size(), -1);
  at.slot = static_cast<std::uint32_t>(sides_.size());
  Side side;
  for (std::uint32_t i = 0; i < at.count; ++i) {
    std::int32_t& local = local_of_[at.vertices[i]];
    if (local < 0) {
      local = static_cast<std::int32_t>(vertices_.size());
      vertices_.push_back(at.vertices[i]);
    }
    side.locals[i] = static_cast<std::uint32_t>(local);
  }
  side.low_rank = metric_->low_rank(at);
  sides_.push_back(side);
  supports_.push_back(at);
}

void FactoredResponse::finish() {
  const std::size_t count = vertices_.size();
  const std::vector<std::span<const double>> inverse = metric_->matrix().inverse->columns(vertices_);
  columns_.assign(sides_.size() * count, 0.0);
  for (std::size_t k = 0; k < sides_.size(); ++k) {
    Side& side = sides_[k];
    side.column = k * count;
    double* column = columns_.data() + side.column;
    for (std::uint32_t i = 0; i < supports_[k].count; ++i) {
      const double weight = supports_[k].weights[i];
      const std::span<const double> full = inverse[side.locals[i]];
      for (std::size_t j = 0; j < count; ++j) column[j] += weight * full[vertices_[j]];
    }
  }
  changes_.assign(3 * count, 0.0);
  impulses_n_s_.assign(count, Vec3d::Zero());
}

Vec3d FactoredResponse::change_m_s(const Support& at) const {
  const Side& side = sides_[at.slot];
  const std::size_t count = vertices_.size();
  Vec3d sum = side.low_rank.leftCols<3>() * shares_.head<3>() - side.low_rank.rightCols<4>() * shares_.tail<4>();
  for (std::uint32_t i = 0; i < at.count; ++i) {
    const std::size_t local = side.locals[i];
    sum += at.weights[i] * Vec3d(changes_[local], changes_[count + local], changes_[2 * count + local]);
  }
  return sum;
}

double FactoredResponse::number_1_kg(const Support& at, const Support& by) const {
  const Side& side = sides_[at.slot];
  const double* column = column_of(sides_[by.slot]);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < at.count; ++i) sum += at.weights[i] * column[side.locals[i]];
  return sum;
}

LowRankColumns FactoredResponse::columns(const Support& at) const {
  LowRankColumns low_rank;
  low_rank.columns = sides_[at.slot].low_rank;
  low_rank.signs.tail<LowRankColumns::count - BodyMetric::added>().setConstant(-1.0);
  return low_rank;
}

Eigen::Matrix3d FactoredResponse::inverse_mass_1_kg(const Support& at, const Support& by) const {
  const Side& side = sides_[at.slot];
  const Side& other = sides_[by.slot];
  Eigen::Matrix3d matrix = number_1_kg(at, by) * Eigen::Matrix3d::Identity();
  matrix += side.low_rank.leftCols<3>().lazyProduct(other.low_rank.leftCols<3>().transpose());
  matrix -= side.low_rank.rightCols<4>().lazyProduct(other.low_rank.rightCols<4>().transpose());
  return matrix;
}

void FactoredResponse::push(const Support& at, const Vec3d& impulse_n_s) {
  const Side& side = sides_[at.slot];
  const std::size_t count = vertices_.size();
  const double* column = column_of(side);
  double* x = changes_.data();
  double* y = x + count;
  double* z = y + count;
  for (std::size_t i = 0; i < count; ++i) {
    x[i] += column[i] * impulse_n_s.x();
    y[i] += column[i] * impulse_n_s.y();
    z[i] += column[i] * impulse_n_s.z();
  }
  shares_ += side.low_rank.transpose() * impulse_n_s;
  for (std::uint32_t i = 0; i < at.count; ++i) impulses_n_s_[side.locals[i]] += at.weights[i] * impulse_n_s;
}

Vec3d FactoredResponse::impulse_n_s() const {
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& impulse : impulses_n_s_) sum += impulse;
  return sum;
}

void FactoredResponse::add_changes(std::span<Vec3d> u_m_s) const {
  const std::vector<std::span<const double>> inverse = metric_->matrix().inverse->columns(vertices_);
  for (std::size_t k = 0; k < vertices_.size(); ++k) {
    const Vec3d& impulse = impulses_n_s_[k];
    if (impulse.isZero(0.0)) continue;
    const std::span<const double> column = inverse[k];
    for (std::size_t i = 0; i < u_m_s.size(); ++i) u_m_s[i] += column[i] * impulse;
  }
  for (std::size_t i = 0; i < u_m_s.size(); ++i) u_m_s[i] += metric_->of_low_rank(i, shares_);
}

}  // namespace pneuma::physics
