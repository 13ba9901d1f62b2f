// Shows that bending's forces are minus the gradient of its energy, with no net force or torque, and that a hinge's
// angle is the one that its faces make.
#include "physics/mesh/hinge.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> out_of_shape(const Mesh& mesh) {
  std::vector<Vector3d> x = mesh.positions_m;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto phase = static_cast<double>(i);
    x[i] += 0.1 * Vector3d(std::sin(3.0 * phase), std::cos(5.0 * phase), std::sin(7.0 * phase + 1.0));
  }
  return x;
}

TEST(Hinge, AngleIsThatOfTwoFacesFoldedByIt) {
  for (const double angle : {-2.5, -0.3, 0.0, 1e-6, 1.0, 3.0}) {
    const std::array<Vector3d, 4> corners{Vector3d(0, 0, 0), Vector3d(0, 0, 2), Vector3d(0, 1, 0.5),
                                          Vector3d(-0.7 * std::sin(angle), -0.7 * std::cos(angle), 1.2)};
    const auto hinge = hinge_angle(corners);
    ASSERT_TRUE(hinge.has_value());
    EXPECT_NEAR(std::abs(hinge->angle_rad), std::abs(angle), 1e-12);
  }
  EXPECT_FALSE(hinge_angle({Vector3d(0, 0, 0), Vector3d(0, 0, 1), Vector3d(0, 0, 3), Vector3d(0, 1, 0)}).has_value());
}

TEST(Hinge, EveryInnerEdgeHasOneAndRestsAtTheMeshsOwnShape) {
  const auto ball = *make_icosphere(1, 1.0);
  const std::vector<Hinge> hinges = make_hinges(*ball);
  EXPECT_EQ(hinges.size(), ball->edges.size());
  EXPECT_EQ(bending_energy_j(hinges, 10.0, ball->positions_m), 0.0);
  const auto sheet = *make_grid(3, 2, 1.0, 1.0);
  EXPECT_EQ(make_hinges(*sheet).size(), sheet->edges.size() - 10);  // 10 edges on the border
}

TEST(Bending, ForceIsMinusTheGradientOfTheEnergy) {
  const auto mesh = *make_icosphere(1, 1.0);
  const std::vector<Hinge> hinges = make_hinges(*mesh);
  std::vector<Vector3d> x = out_of_shape(*mesh);
  std::vector<Vector3d> force(x.size(), Vector3d::Zero());
  const double stiffness_n_m = 3.0;
  add_bending<double>(hinges, stiffness_n_m, x, force);
  const double step_m = 1e-6;
  for (const std::size_t vertex : {0U, 7U, 20U}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double at = x[vertex][axis];
      x[vertex][axis] = at + step_m;
      const double above_j = bending_energy_j(hinges, stiffness_n_m, x);
      x[vertex][axis] = at - step_m;
      const double below_j = bending_energy_j(hinges, stiffness_n_m, x);
      x[vertex][axis] = at;
      EXPECT_NEAR(force[vertex][axis], -(above_j - below_j) / (2.0 * step_m), 1e-6 * (1.0 + force[vertex].norm()));
    }
  }
}

TEST(Bending, HasNoNetForceOrTorque) {
  const auto mesh = *make_icosphere(2, 1.0);
  const std::vector<Vector3d> x = out_of_shape(*mesh);
  std::vector<Vector3d> force(x.size(), Vector3d::Zero());
  add_bending<double>(make_hinges(*mesh), 1.0, x, force);
  Vector3d net = Vector3d::Zero();
  Vector3d torque = Vector3d::Zero();
  double sizes = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    net += force[i];
    torque += x[i].cross(force[i]);
    sizes += force[i].norm();
  }
  EXPECT_GT(sizes, 1.0);
  EXPECT_LT(net.norm(), 1e-12 * sizes);
  EXPECT_LT(torque.norm(), 1e-12 * sizes);
}

// Twice the stiffness of a plate of bending rigidity D is what makes a sheet rolled to radius R hold D / (2 R^2) a
// square metre; of hinges only the three directions of edges count, so the share is that of the mesh: it does not
// change with how finely the same mesh is cut.
TEST(Bending, EnergyOfARolledSheetDoesNotDependOnHowFinelyItIsCut) {
  const auto rolled_j = [](std::uint32_t cells) {
    const auto sheet = *make_grid(cells, cells, 1.0, 1.0);
    std::vector<Vector3d> x = sheet->positions_m;
    const double radius_m = 2.0;
    for (Vector3d& point : x) {
      const double turn = point.x() / radius_m;
      point = {radius_m * std::sin(turn), radius_m * (1.0 - std::cos(turn)), point.z()};
    }
    return bending_energy_j(make_hinges(*sheet), 1.0, x);
  };
  EXPECT_NEAR(rolled_j(40) / rolled_j(20), 1.0, 0.06);  // the border's edges, which are no hinges, are fewer
  EXPECT_GT(rolled_j(20), 0.0);
}

}  // namespace
}  // namespace pneuma::physics
