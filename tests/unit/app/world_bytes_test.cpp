// Shows that the estimate of a world's memory is no less than what the allocator gives out for it while it is built and
// stepped, nor more by an order of magnitude and a half; and that a mesh whose factored matrix would fill the memory is
// refused.
#include "app/world_bytes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>
#include <malloc.h>

#include "app/factor_size.h"
#include "app/live_world.h"
#include "base/limits.h"
#include "physics/contact/contact.h"
#include "physics/machine/room_pool.h"
#include "physics/mesh/mesh_builders.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"
#include "support/process_memory.h"
#include "support/sanitizers.h"

namespace pneuma::app {
namespace {

using Integrator = v1::Stepping::Integrator;

/// Balls in rows over a floor, touching each other where they are close.
v1::Scene balls(std::uint32_t subdivisions, Integrator integrator, int count, double distance_m = 1.9,
                bool meets_itself = false) {
  v1::Scene scene;
  scene.set_name("balls");
  scene.mutable_gravity()->set_y(-9.81);
  scene.mutable_stepping()->set_integrator(integrator);
  scene.mutable_stepping()->set_substeps(8);
  scene.mutable_stepping()->set_on_unstable(v1::Stepping::SUBSTEP);
  scene.add_meshes()->set_name("sphere");
  scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(subdivisions);
  for (int i = 0; i < count; ++i) {
    v1::SoftBody& ball = *scene.add_soft_bodies();
    ball.set_name("ball-" + std::to_string(i));
    ball.set_mesh("sphere");
    const int row = i / 8;
    ball.mutable_position()->set_x(distance_m * (i % 8));
    ball.mutable_position()->set_z(distance_m * row);
    ball.mutable_position()->set_y(1.02);
    ball.mutable_springs()->set_stiffness_n_m(1'000.0);
    ball.mutable_springs()->set_damping_n_s_m(1.0);
    ball.mutable_gas()->set_moles(0.02);
    ball.mutable_collision()->set_self(meets_itself);
  }
  scene.add_colliders()->set_name("floor");
  scene.mutable_colliders(0)->mutable_shape()->mutable_plane();
  return scene;
}

/// Sheets that lie on a floor, one on the other: all their vertices touch it, or each other. Or they stand in one
/// plane, and begin across each other.
v1::Scene sheets(Integrator integrator, int count, bool stand = false) {
  v1::Scene scene = balls(0, integrator, count);
  scene.mutable_meshes(0)->mutable_grid()->set_columns(30);
  scene.mutable_meshes(0)->mutable_grid()->set_rows(30);
  scene.mutable_meshes(0)->mutable_grid()->set_width_m(2.0);
  scene.mutable_meshes(0)->mutable_grid()->set_height_m(2.0);
  for (int i = 0; i < count; ++i) {
    v1::SoftBody& sheet = *scene.mutable_soft_bodies(i);
    sheet.clear_gas();
    sheet.mutable_position()->set_x(0.0);
    sheet.mutable_position()->set_z(0.0);
    sheet.mutable_position()->set_y(0.02 * (i + 1));
    if (!stand) continue;
    sheet.mutable_orientation()->set_w(std::sqrt(0.5));
    sheet.mutable_orientation()->set_x(-std::sqrt(0.5));
  }
  return scene;
}

struct Case {
  std::string name;
  v1::Scene scene;
  int ticks;
  bool is_crowd = false;  // within a tick it takes as much as contact ever does
};

// docker/README.md, "Promises".
constexpr std::size_t crowd_bytes_max = 110'000'000;

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const char* builtin : {"ball-pit", "five-balls", "crumple", "hand", "balloon-under-load", "wind-cloth"}) {
    all.push_back({builtin, *scene_io::builtin_scene(builtin), 40});
  }
  for (const auto& [integrator, name] :
       {std::pair{v1::Stepping::SYMPLECTIC_EULER, "explicit"}, std::pair{v1::Stepping::RK4, "rk4"},
        std::pair{v1::Stepping::IMPLICIT_EULER, "implicit"}, std::pair{v1::Stepping::TR_BDF2, "bdf2"},
        std::pair{v1::Stepping::XPBD, "xpbd"}}) {
    all.push_back({name + std::string(", one ball"), balls(3, integrator, 1), 20});
    all.push_back({name + std::string(", five that touch"), balls(3, integrator, 5), 10});
    all.push_back({name + std::string(", many small ones"), balls(1, integrator, 64), 5});
    all.push_back({name + std::string(", one that meets itself"), balls(3, integrator, 1, 1.9, true), 10});
    all.push_back({name + std::string(", a sheet on a floor"), sheets(integrator, 1), 20});
    all.push_back({name + std::string(", three sheets"), sheets(integrator, 3), 20, true});
    all.push_back({name + std::string(", three sheets that stand"), sheets(integrator, 3, true), 5});
  }
  return all;
}

std::size_t bytes_in_use() {
  const struct mallinfo2 heap = mallinfo2();
  return heap.uordblks + heap.hblkhd;
}

/// Leaves a pool nothing to lend, so that a world's room is its own.
template <class Room>
std::vector<physics::Borrowed<Room>> all_rooms() {
  std::vector<physics::Borrowed<Room>> rooms(physics::pooled_rooms_max);
  for (auto& room : rooms) (void)*room;
  return rooms;
}

TEST(WorldBytes, AreNoLessThanWhatTheWorldTakes) {
  if (support::is_sanitized) GTEST_SKIP() << "a sanitizer has its own allocator";
  const auto rooms = std::tuple(all_rooms<physics::SurfaceRoom>(), all_rooms<physics::LumpedContacts<float>>(),
                                all_rooms<physics::LumpedContacts<double>>());
  for (Case& its : cases()) {
    SCOPED_TRACE(its.name);
    WorldEstimates estimates;
    WorldBytes estimate;
    const auto admit = [&](const v1::Scene& source, const physics::Scene& scene) {
      const auto found = estimates.of(source, scene);
      if (found.ok()) estimate = *found;
      return found.status();
    };
    // What is kept for later by the first world of its kind is not its own.
    ASSERT_TRUE(LiveWorld::create(its.scene).ok());
    const std::size_t before = bytes_in_use();
    auto live = LiveWorld::create(std::move(its.scene), admit);
    ASSERT_TRUE(live.ok()) << live.status().message();
    physics::Workers workers(1);
    std::size_t most = bytes_in_use();
    std::size_t most_within = most;
    for (int i = 0; i < its.ticks; ++i) {
      while (!live->physics().substep(workers)) most_within = std::max(most_within, bytes_in_use());
      most = std::max(most, bytes_in_use());
    }
    if (!its.is_crowd) most = std::max(most, most_within);
    EXPECT_LE(most_within - before, crowd_bytes_max);
    const std::size_t estimated = estimate.by(live->physics().integrator());
    EXPECT_GE(estimated, most - before);
    EXPECT_LE(estimated, 30 * (most - before) + 64 * 1024);
    EXPECT_GE(estimate.by(physics::Integrator::automatic), estimated);
  }
}

TEST(WorldBytes, OfAnImplicitWorldHaveItsFactor) {
  const v1::Scene scene = balls(5, v1::Stepping::AUTO, 1);
  WorldEstimates estimates;
  const auto bytes = estimates.of(scene, *scene_io::to_physics(scene));
  ASSERT_TRUE(bytes.ok());
  const auto mesh = *physics::make_icosphere(5, 1.0);
  EXPECT_GT(bytes->as_implicit, bytes->as_explicit + 28 * factor_entries(*mesh, base::factor_entries_max));
  EXPECT_EQ(bytes->vertices, 10'242U);
}

TEST(FactorEntries, AreThoseThatEigenMakes) {
  for (const auto& mesh : {*physics::make_icosphere(3, 1.0), *physics::make_grid(30, 17, 1.0, 1.0),
                           *physics::make_box({1.0, 1.0, 1.0}, 9)}) {
    const auto count = static_cast<Eigen::Index>(mesh->positions_m.size());
    Eigen::SparseMatrix<double> matrix(count, count);
    for (const auto& [a, b] : mesh->edges) {
      matrix.insert(a, b) = -1.0;
      matrix.insert(b, a) = -1.0;
    }
    for (Eigen::Index i = 0; i < count; ++i) matrix.insert(i, i) = 100.0;
    matrix.makeCompressed();
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factored(matrix);
    EXPECT_EQ(factor_entries(*mesh, base::factor_entries_max),
              static_cast<std::size_t>(factored.matrixL().nestedExpression().nonZeros()));
  }
}

TEST(FactorEntries, CountingStopsAtItsLimit) {
  const auto mesh = *physics::make_icosphere(4, 1.0);
  const std::size_t all = factor_entries(*mesh, base::factor_entries_max);
  const std::size_t some = factor_entries(*mesh, all / 4);
  EXPECT_GT(some, all / 4);
  EXPECT_LT(some, all);
}

/// Faces between vertices at random, so that no few vertices part them: a net that the engine takes as it does any.
v1::Scene tangled(std::uint32_t count, Integrator integrator) {
  std::mt19937 random(5);
  const auto any_vertex = [&] { return std::uniform_int_distribution<std::uint32_t>(0, count - 1)(random); };
  const auto coordinate = [&] { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); };
  v1::Scene scene = balls(0, integrator, 1);
  v1::Mesh::Triangles& triangles = *scene.mutable_meshes(0)->mutable_triangles();
  for (std::uint32_t i = 0; i < count; ++i) {
    v1::Vec3& at = *triangles.add_positions();
    at.set_x(coordinate());
    at.set_y(coordinate());
    at.set_z(coordinate());
  }
  std::set<std::array<std::uint32_t, 2>> edges;
  const auto is_new = [&edges](std::uint32_t a, std::uint32_t b) {
    return a != b && edges.insert({std::min(a, b), std::max(a, b)}).second;
  };
  for (std::uint32_t face = 0; face < 2 * count; ++face) {
    const std::uint32_t a = face % count;  // so that each vertex has faces
    const std::uint32_t b = any_vertex();
    const std::uint32_t c = any_vertex();
    if (!is_new(a, b) || !is_new(b, c) || !is_new(c, a)) continue;
    for (const std::uint32_t vertex : {a, b, c}) triangles.add_indices(vertex);
  }
  scene.mutable_soft_bodies(0)->clear_gas();
  return scene;
}

TEST(WorldBytes, CountOnlyTheMatricesThatAreToBeHad) {
  const v1::Scene by_force = balls(4, v1::Stepping::SYMPLECTIC_EULER, 3);
  WorldEstimates estimates;
  const auto bytes = estimates.of(by_force, *scene_io::to_physics(by_force));
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(bytes->as_implicit, bytes->as_explicit);
  const v1::Scene solved = balls(4, v1::Stepping::IMPLICIT_EULER, 3);
  v1::Scene unlike = solved;
  unlike.mutable_soft_bodies(1)->set_mass_kg(2.0);
  const auto alike_bytes = estimates.of(solved, *scene_io::to_physics(solved));
  const auto unlike_bytes = estimates.of(unlike, *scene_io::to_physics(unlike));
  ASSERT_TRUE(alike_bytes.ok() && unlike_bytes.ok());
  EXPECT_GT(unlike_bytes->as_implicit, alike_bytes->as_implicit + 1'000'000);
}

TEST(WorldBytes, AMeshWhoseFactorWouldFillTheMemoryIsRefusedWhereItIsNeeded) {
  WorldEstimates estimates;
  for (const auto integrator : {v1::Stepping::IMPLICIT_EULER, v1::Stepping::TR_BDF2, v1::Stepping::AUTO}) {
    const v1::Scene scene = tangled(16'000, integrator);
    const auto checked = scene_io::to_physics(scene);
    ASSERT_TRUE(checked.ok()) << checked.status().message();
    const auto bytes = estimates.of(scene, *checked);
    EXPECT_EQ(bytes.status().code(), base::StatusCode::limit_exceeded);
    EXPECT_EQ(bytes.status().where(), "soft_bodies[0].mesh");
  }
  const v1::Scene by_force = tangled(16'000, v1::Stepping::SYMPLECTIC_EULER);
  EXPECT_TRUE(estimates.of(by_force, *scene_io::to_physics(by_force)).ok());
}

}  // namespace
}  // namespace pneuma::app
