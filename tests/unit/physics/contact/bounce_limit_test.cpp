// Shows that a body which overlaps others parts from them, and that rows which part against each other give it no more
// than each of them would alone.
#include "physics/contact/bounce_limit.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

constexpr double mass_kg = 2.0;
constexpr double parts_m_s = 0.1;
constexpr SolveLimits limits{.sweeps_max = 30, .enough_m_s = 1e-9, .direct_rows_max = 10};

/// A ball that does not turn, in a cleft whose two walls stand at `half_angle_rad` to its middle. It overlaps both.
struct Cleft {
  explicit Cleft(double half_angle_rad, const Vec3d& free_m_s) {
    responses.emplace_back(RigidResponse(1.0 / mass_kg, Eigen::Matrix3d::Zero()));
    responses.emplace_back(FixedResponse{});
    for (const double side : {-1.0, 1.0}) {
      ContactRow& row = rows.emplace_back();
      row.first = {.body = 0};
      row.second = {.body = 1};
      row.normal = {std::sin(half_angle_rad), side * std::cos(half_angle_rad), 0.0};
      row.least_m_s = parts_m_s;
      row.free_m_s = free_m_s;
    }
  }
  // What walls that nearly face each other ask for has hardly an end, so the first need not come to one.
  void solve() {
    (void)solve_rows(rows, responses, limits);
    EXPECT_TRUE(limit_parting(rows, responses, limits));
  }
  [[nodiscard]] Vec3d velocity_m_s() const { return rows[0].free_m_s + change_m_s(responses[0], rows[0].first); }

  std::vector<Response> responses;
  std::vector<ContactRow> rows;
};

TEST(PartingLimit, OfWallsFarApartLetsABallPartFromBoth) {
  Cleft cleft(1.2, Vec3d::Zero());
  cleft.solve();
  for (const ContactRow& row : cleft.rows) EXPECT_NEAR(cleft.velocity_m_s().dot(row.normal), parts_m_s, 1e-8);
}

// To part from both it would have to leave the cleft at parts_m_s / sin(half angle). It has half the speed that both
// walls' energy would give it.
TEST(PartingLimit, OfWallsThatNearlyFaceEachOtherGivesLessThanBothWouldAlone) {
  for (const double half_angle_rad : {0.1, 1e-3, 1e-5}) {
    Cleft cleft(half_angle_rad, Vec3d::Zero());
    cleft.solve();
    const double given_j = 0.5 * mass_kg * cleft.velocity_m_s().squaredNorm();
    const double alone_j = 0.5 * mass_kg * parts_m_s * parts_m_s;
    EXPECT_NEAR(given_j, 0.25 * 2.0 * alone_j, 1e-6 * alone_j) << half_angle_rad;
    EXPECT_GT(cleft.velocity_m_s().x(), 0.0);
  }
}

// What comes in is stopped, and parts at half the speed that this and both walls would give.
TEST(PartingLimit, OfABallThatComesInGivesLessThanItTakes) {
  constexpr double comes_m_s = 3.0;
  Cleft cleft(1e-3, {-comes_m_s, 0.0, 0.0});
  cleft.solve();
  EXPECT_GT(cleft.velocity_m_s().x(), 0.0);
  EXPECT_NEAR(cleft.velocity_m_s().squaredNorm(), 0.25 * (comes_m_s * comes_m_s + 2.0 * parts_m_s * parts_m_s), 1e-6);
}

// The solution that the walls ask for takes more of the joint than it can; the one that is kept takes what it can too.
TEST(PartingLimit, LeavesABreakableJointItsLoad) {
  constexpr double most_n_s = 0.5;
  Cleft cleft(1e-3, {0.0, 0.0, 1.0});
  ContactRow& joint = cleft.rows.emplace_back();
  joint.kind = RowKind::tie;
  joint.first = {.body = 0};
  joint.second = {.body = 1};
  joint.free_m_s = {0.0, 0.0, 1.0};
  joint.most_n_s = most_n_s;
  cleft.solve();
  EXPECT_NEAR(joint.impulse_n_s.norm(), most_n_s, 0.01 * most_n_s);
}

}  // namespace
}  // namespace pneuma::physics
