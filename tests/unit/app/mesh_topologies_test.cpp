// Shows when coarser meshes are made: one a job, for as long as someone asks, whoever the thread is that makes them.
#include "app/mesh_topologies.h"

#include <algorithm>
#include <deque>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"

namespace pneuma::app {
namespace {

using MeshPtr = std::shared_ptr<const physics::Mesh>;

class Topologies : public testing::Test {
 protected:
  static MeshPtr ball() { return *physics::make_icosphere(2, 1.0); }

  /// A round of asking, as of a world in which these meshes are seen: what there is of them is held from then on.
  void ask(const std::vector<MeshPtr>& meshes) {
    held_.clear();
    for (const MeshPtr& mesh : meshes) held_.push_back(topologies_.find(mesh, 1));
    topologies_.make_missing();
    held_.clear();
    for (const MeshPtr& mesh : meshes) held_.push_back(topologies_.find(mesh, 1));
    topologies_.drop_unused();
  }
  /// False where no job waits.
  bool work() {
    if (jobs_.empty()) return false;
    const auto job = std::move(jobs_.front());
    jobs_.pop_front();
    job();
    return true;
  }
  [[nodiscard]] std::size_t held() const {
    return held_.size() - static_cast<std::size_t>(std::ranges::count(held_, nullptr));
  }

  std::deque<std::function<void()>> jobs_;
  MeshTopologies topologies_{[this](std::size_t vertices, std::function<void()> make) {
    EXPECT_EQ(vertices, 162U);
    jobs_.push_back(std::move(make));
  }};
  std::vector<TopologyMessagePtr> held_;
};

TEST_F(Topologies, AJobMakesOneMesh) {
  const std::vector<MeshPtr> meshes{ball(), ball(), ball()};
  for (std::size_t made = 0; made < meshes.size(); ++made) {
    ask(meshes);
    EXPECT_EQ(held(), made);
    ask(meshes);
    EXPECT_EQ(jobs_.size(), 1U) << "at most one is under way";
    ASSERT_TRUE(work());
  }
  ask(meshes);
  EXPECT_EQ(held(), 3U);
  EXPECT_FALSE(work());
}

TEST_F(Topologies, WhatNobodyAsksForAnyMoreIsNeitherMadeNorHeld) {
  const MeshPtr stays = ball();
  MeshPtr goes = ball();
  ask({stays, goes});
  EXPECT_EQ(goes.use_count(), 1);
  ask({stays});
  ASSERT_TRUE(work());
  ask({stays});
  EXPECT_EQ(held(), 1U);
  EXPECT_FALSE(work());
}

TEST_F(Topologies, OneThatWasAskedForIsKeptUntilItIsAskedForAgain) {
  const MeshPtr first = ball();
  const MeshPtr second = ball();
  ask({first, second});
  static_cast<void>(topologies_.find(first, 1));
  ASSERT_TRUE(work());
  static_cast<void>(topologies_.find(second, 1));  // another stream, which asks when the first mesh is there
  topologies_.make_missing();
  topologies_.drop_unused();
  EXPECT_NE(topologies_.find(first, 1), nullptr);
}

TEST(TopologiesAtOnce, AreThereWhenTheyAreAskedForAgain) {
  MeshTopologies topologies([](std::size_t /*vertices*/, const auto& make) { make(); });
  const MeshPtr mesh = *physics::make_icosphere(2, 1.0);
  EXPECT_EQ(topologies.find(mesh, 1), nullptr);
  EXPECT_EQ(topologies.find(mesh, 2), nullptr);
  topologies.make_missing();
  ASSERT_NE(topologies.find(mesh, 1), nullptr);
  EXPECT_EQ(topologies.find(mesh, 1)->kept.size(), 41U);
  EXPECT_NE(topologies.find(mesh, 2), nullptr);
}

}  // namespace
}  // namespace pneuma::app
