// Shows that the answer of a factored body to impulses is that of the formula in factored_response.h, written out with
// dense matrices from the body's springs and masses: for one that is free and one that is held, with gas and without,
// of like masses and of different ones. And what the formula is for: that a free body keeps both momenta, moves as a
// whole, and that a stiff one turns by friction as a rigid one does.
#include "physics/contact/factored_response.h"

#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "support/eigen_solvers.h"
#include "unit/physics/contact/factored_rig.h"

namespace pneuma::physics {
namespace {

constexpr double factored_tolerance = 1e-9;

struct FactoredCase {
  std::string name;
  FactoredBallTraits traits;

  friend std::ostream& operator<<(std::ostream& out, const FactoredCase& of) { return out << of.name; }
};

/// Between a tenth and ten times the mean, in no order.
std::vector<double> unlike_masses(std::size_t count) {
  std::vector<double> masses;
  for (std::size_t i = 0; i < count; ++i) masses.push_back(std::pow(10.0, std::sin(3.0 * static_cast<double>(i))));
  return masses;
}

Eigen::MatrixXd dense_matrix(const FactoredBall& ball) {
  const SoftState<double>& state = ball.state();
  const auto count = static_cast<Eigen::Index>(state.x.size());
  const Springs& springs = state.body.springs;
  const double s = FactoredBall::step_s;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(3 * count, 3 * count);
  const auto block = [&](std::uint32_t i, std::uint32_t j) {
    return matrix.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j)).diagonal();
  };
  for (std::uint32_t i = 0; i < count; ++i) block(i, i).array() += state.mass_kg(i);
  for (const auto& [a, b] : state.body.mesh->edges) {
    const double tangent = s * springs.damping_n_s_m + s * s * springs.stiffness_n_m;
    block(a, a).array() += tangent;
    block(b, b).array() += tangent;
    block(a, b).array() -= tangent;
    block(b, a).array() -= tangent;
  }
  return matrix;
}

/// Of A, where held vertices answer nothing.
Eigen::MatrixXd dense_inverse(const FactoredBall& ball) {
  Eigen::MatrixXd matrix = dense_matrix(ball);
  const std::vector<std::uint32_t>& pins = ball.state().body.pins;
  for (const std::uint32_t pin : pins) {
    const auto at = 3 * static_cast<Eigen::Index>(pin);
    matrix.middleRows<3>(at).setZero();
    matrix.middleCols<3>(at).setZero();
    matrix.block<3, 3>(at, at).setIdentity();
  }
  Eigen::MatrixXd inverse = support::inverse(matrix);
  for (const std::uint32_t pin : pins) {
    inverse.block<3, 3>(3 * static_cast<Eigen::Index>(pin), 3 * static_cast<Eigen::Index>(pin)).setZero();
  }
  return inverse;
}

/// metric^-1 of the formula.
Eigen::MatrixXd dense_answer(const FactoredBall& ball, const FactoredBallTraits& traits) {
  const SoftState<double>& state = ball.state();
  const auto count = static_cast<Eigen::Index>(state.x.size());
  Eigen::MatrixXd answer = dense_inverse(ball);
  if (traits.pins.empty()) {
    Eigen::MatrixXd masses = Eigen::MatrixXd::Zero(3 * count, 3 * count);
    Eigen::MatrixXd turns(3 * count, 3);
    Vec3d moment = Vec3d::Zero();
    double mass_kg = 0.0;
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      moment += state.mass_kg(i) * state.x[i];
      mass_kg += state.mass_kg(i);
    }
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      const auto at = 3 * static_cast<Eigen::Index>(i);
      masses.block<3, 3>(at, at).diagonal().setConstant(state.mass_kg(i));
      turns.middleRows<3>(at) = cross_matrix(state.x[i] - moment / mass_kg).transpose();
    }
    const Eigen::MatrixXd moved = masses * turns;
    const Eigen::MatrixXd slow = answer * moved;
    const double stress = FactoredBall::step_s * FactoredBall::step_s * traits.stress_n_m;
    const Eigen::Matrix3d inertia = turns.transpose() * moved + stress * Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d turned = moved.transpose() * slow;
    answer -= (slow * turned.inverse() * slow.transpose()).eval();
    answer += turns * inertia.inverse() * turns.transpose();
  }
  if (traits.gas_stiffness > 0.0) {
    const Eigen::VectorXd gradient =
        Eigen::Map<const Eigen::VectorXd>(ball.volume_gradient_m2().front().data(), 3 * count);
    const Eigen::VectorXd of_gas = answer * gradient;
    const double c = traits.gas_stiffness / (1.0 + traits.gas_stiffness * gradient.dot(of_gas));
    answer -= c * of_gas * of_gas.transpose();
  }
  return answer;
}

/// Of three vertices, of two and of one.
std::vector<Support> some_supports() {
  constexpr std::array<std::uint32_t, 3> three{0, 12, 14};
  constexpr std::array<std::uint32_t, 3> other{3, 21, 37};
  std::vector<Support> supports;
  supports.push_back(support_at(0, three, std::array{0.2, 0.3, 0.5}));
  supports.push_back(support_at(0, other, std::array{0.7, 0.2, 0.1}));
  supports.push_back(support_at(0, three, std::array{0.4, 0.6, 0.0}));
  supports.push_back(support_at(0, other, std::array{0.0, 1.0, 0.0}));
  supports.push_back(support_at(0, std::array{5U}, std::array{1.0}));
  return supports;
}

Eigen::MatrixXd columns_of(const Support& at, std::size_t count) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(count), 3);
  for (std::uint32_t i = 0; i < at.count; ++i) {
    columns.middleRows<3>(3 * static_cast<Eigen::Index>(at.vertices[i])).diagonal().array() += at.weights[i];
  }
  return columns;
}

class Factored : public testing::TestWithParam<FactoredCase> {
 protected:
  Factored() : dense_(dense_answer(ball_, GetParam().traits)), response_(ball_.metric()) {
    for (Support& at : supports_) response_.add(at);
    response_.finish();
  }
  [[nodiscard]] Eigen::MatrixXd columns_of(const Support& at) const {
    return physics::columns_of(at, ball_.state().x.size());
  }

  FactoredBall ball_{GetParam().traits};
  Eigen::MatrixXd dense_;
  FactoredResponse response_;
  std::vector<Support> supports_ = some_supports();
};

TEST_P(Factored, InverseMassesAreThoseOfTheFormula) {
  const double size = dense_.cwiseAbs().maxCoeff();
  for (const Support& at : supports_) {
    for (const Support& by : supports_) {
      const Eigen::Matrix3d wanted = columns_of(at).transpose() * dense_ * columns_of(by);
      const Eigen::Matrix3d found = response_.inverse_mass_1_kg(at, by);
      EXPECT_LT((found - wanted).cwiseAbs().maxCoeff(), factored_tolerance * size);
      const LowRankColumns of_at = response_.columns(at);
      const Eigen::Matrix3d of_parts =
          response_.number_1_kg(at, by) * Eigen::Matrix3d::Identity() +
          of_at.columns * of_at.signs.asDiagonal() * response_.columns(by).columns.transpose();
      EXPECT_LT((found - of_parts).cwiseAbs().maxCoeff(), 1e-12 * size);
      EXPECT_LT((found - response_.inverse_mass_1_kg(by, at).transpose()).cwiseAbs().maxCoeff(), 1e-12 * size);
    }
  }
}

TEST_P(Factored, PushesChangeVelocitiesByTheFormulaAtSupportsAndEverywhere) {
  const double size = dense_.cwiseAbs().maxCoeff();
  Eigen::VectorXd impulses = Eigen::VectorXd::Zero(dense_.cols());
  Vec3d sum_n_s = Vec3d::Zero();
  for (std::size_t k = 0; k < supports_.size(); ++k) {
    const Vec3d impulse_n_s(1.0, -0.5 * static_cast<double>(k), std::cos(static_cast<double>(k)));
    response_.push(supports_[k], impulse_n_s);
    impulses += columns_of(supports_[k]) * impulse_n_s;
    sum_n_s += impulse_n_s;
  }
  EXPECT_LT((response_.impulse_n_s() - sum_n_s).norm(), 1e-12);
  const Eigen::VectorXd wanted = dense_ * impulses;
  for (const Support& at : supports_) {
    const Vec3d change_m_s = columns_of(at).transpose() * wanted;
    EXPECT_LT((response_.change_m_s(at) - change_m_s).norm(), factored_tolerance * size);
  }
  const Vec3d before(1, 2, 3);
  std::vector<Vec3d> u_m_s(ball_.state().x.size(), before);
  response_.add_changes(u_m_s);
  for (std::size_t i = 0; i < u_m_s.size(); ++i) {
    const Vec3d change_m_s = wanted.segment<3>(3 * static_cast<Eigen::Index>(i));
    EXPECT_LT((u_m_s[i] - before - change_m_s).norm(), factored_tolerance * size) << i;
  }
}

TEST_P(Factored, ImpulsesOnAllVerticesAreAnsweredByTheFormula) {
  std::vector<Vec3d> impulses_n_s;
  for (std::size_t i = 0; i < ball_.state().x.size(); ++i) {
    const auto phase = static_cast<double>(i);
    const Vec3d impulse_n_s(std::sin(phase), std::cos(4.0 * phase), std::sin(2.0 * phase));
    impulses_n_s.emplace_back(ball_.state().is_pinned(i) ? Vec3d(Vec3d::Zero()) : impulse_n_s);
  }
  const std::vector<Vec3d> found = ball_.answer(impulses_n_s);
  const Eigen::Map<const Eigen::VectorXd> all(impulses_n_s.front().data(), dense_.cols());
  const Eigen::VectorXd wanted = dense_ * all;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Vec3d of_formula = wanted.segment<3>(3 * static_cast<Eigen::Index>(i));
    EXPECT_LT((found[i] - of_formula).norm(), factored_tolerance * wanted.norm()) << i;
  }
}

TEST_P(Factored, MetricIsPositive) {
  const auto count = static_cast<Eigen::Index>(supports_.size());
  Eigen::MatrixXd all(3 * count, 3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      all.block<3, 3>(3 * i, 3 * j) =
          response_.inverse_mass_1_kg(supports_[static_cast<std::size_t>(i)], supports_[static_cast<std::size_t>(j)]);
    }
  }
  const Eigen::VectorXd eigenvalues = support::eigenvalues(all);
  EXPECT_GT(eigenvalues.minCoeff(), 1e-9 * eigenvalues.maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(
    Balls, Factored,
    testing::Values(FactoredCase{"Free", {}}, FactoredCase{"FreeWithGas", {.gas_stiffness = 2.0, .stress_n_m = 500.0}},
                    FactoredCase{"FreeAndStiff", {.stiffness_n_m = 1e6, .gas_stiffness = 0.5}},
                    FactoredCase{"FreeOfUnlikeMasses", {.gas_stiffness = 3.0, .mass_scale = unlike_masses(42)}},
                    FactoredCase{"Pinned", {.pins = {1, 7, 12}}},
                    FactoredCase{"PinnedWithGas", {.gas_stiffness = 2.0, .pins = {1, 7, 12}}}),
    [](const auto& info) { return info.param.name; });

FactoredBallTraits free_with_gas() {
  return {.stiffness_n_m = 1e4, .gas_stiffness = 2.0, .mass_scale = unlike_masses(42)};
}

TEST(FactoredResponse, OfAFreeBodyMovesAsAWholeByAUniformImpulse) {
  FactoredBall ball(free_with_gas());
  const Vec3d velocity(0.3, -2.0, 1.0);
  std::vector<Vec3d> impulses_n_s;
  for (std::size_t i = 0; i < ball.state().x.size(); ++i) impulses_n_s.emplace_back(ball.state().mass_kg(i) * velocity);
  for (const Vec3d& found : ball.answer(impulses_n_s)) EXPECT_LT((found - velocity).norm(), factored_tolerance);
}

TEST(FactoredResponse, OfAFreeBodyKeepsBothMomenta) {
  FactoredBall ball(free_with_gas());
  FactoredResponse response(ball.metric());
  const std::vector<double> one{1.0};
  Support at = support_at(0, std::array{8U}, one);
  response.add(at);
  response.finish();
  const Vec3d impulse_n_s(0.5, 1.0, -2.0);
  response.push(at, impulse_n_s);
  const SoftState<double>& state = ball.state();
  std::vector<Vec3d> u_m_s(state.x.size(), Vec3d::Zero());
  response.add_changes(u_m_s);
  Vec3d momentum = Vec3d::Zero();
  Vec3d angular = Vec3d::Zero();
  for (std::size_t i = 0; i < u_m_s.size(); ++i) {
    momentum += state.mass_kg(i) * u_m_s[i];
    angular += state.mass_kg(i) * state.x[i].cross(u_m_s[i]);
  }
  EXPECT_LT((momentum - impulse_n_s).norm(), factored_tolerance);
  EXPECT_LT((angular - state.x[8].cross(impulse_n_s)).norm(), factored_tolerance);
}

// A block on both sides rubs in opposite directions: dw = J^-1 sum r x p, and every vertex moves by dw x r.
TEST(FactoredResponse, OfAStiffFreeBallTurnsByFrictionAsARigidOneDoes) {
  FactoredBall ball({.subdivisions = 2, .stiffness_n_m = 1e9});
  FactoredResponse response(ball.metric());
  const SoftState<double>& state = ball.state();
  const double side_m = 0.8 * FactoredBall::radius_m;
  std::vector<Support> rubbed;
  for (std::uint32_t i = 0; i < state.x.size(); ++i) {
    if (std::abs(state.x[i].y()) > side_m) rubbed.push_back(support_at(0, std::array{i}, std::array{1.0}));
  }
  for (Support& at : rubbed) response.add(at);
  response.finish();
  Vec3d torque = Vec3d::Zero();
  for (const Support& at : rubbed) {
    const Vec3d& arm = state.x[at.vertices[0]];
    const Vec3d impulse_n_s(arm.y() > 0.0 ? 0.1 : -0.1, 0.0, 0.0);
    response.push(at, impulse_n_s);
    torque += arm.cross(impulse_n_s);
  }
  std::vector<Vec3d> u_m_s(state.x.size(), Vec3d::Zero());
  response.add_changes(u_m_s);
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const Eigen::Matrix3d arm = cross_matrix(state.x[i]);
    inertia += state.mass_kg(i) * arm * arm.transpose();
  }
  const Vec3d turning = inertia.inverse() * torque;
  for (std::size_t i = 0; i < u_m_s.size(); ++i) {
    const Vec3d rigid_m_s = turning.cross(state.x[i]);
    EXPECT_LT((u_m_s[i] - rigid_m_s).norm(), 0.01 * turning.norm() * FactoredBall::radius_m) << i;
  }
}

}  // namespace
}  // namespace pneuma::physics
