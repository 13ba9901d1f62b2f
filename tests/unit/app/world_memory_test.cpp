// Shows that a world is let into its room, its client's and the server's or refused with the numbers, that streams and
// edits take more of it, and that what they do not need any more is given back. The memory limit of a machine is read
// from made-up files of control groups.
#include "app/world_memory.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "app/machine_memory.h"
#include "ball_scene.h"
#include "scene_io/translate.h"
#include "support/temporary_folder.h"

namespace pneuma::app {
namespace {

constexpr std::size_t mebibyte = 1024 * 1024;

base::Status admit(WorldMemory& memory, const v1::Scene& scene) {
  return memory.admit(scene, *scene_io::to_physics(scene));
}

v1::Scene balls(int count) {
  v1::Scene scene = ball_scene();
  for (int i = 1; i < count; ++i) {
    v1::SoftBody& another = *scene.add_soft_bodies();
    another = scene.soft_bodies(0);
    another.set_name("ball-" + std::to_string(i));
  }
  return scene;
}

TEST(WorldMemory, AWorldThatIsTooLargeIsRefusedWithTheNumbers) {
  WorldMemory memory({base::MemoryBudget(1024 * mebibyte), 1 * mebibyte});
  const base::Status refused = admit(memory, balls(200));
  EXPECT_EQ(refused.code(), base::StatusCode::limit_exceeded);
  EXPECT_NE(refused.what().find("a world may take 1 MiB"), std::string::npos) << refused.what();
  EXPECT_EQ(memory.bytes(), 0U);
}

TEST(WorldMemory, WhoseRoomItIsThatLacksIsTold) {
  const base::MemoryBudget server(64 * mebibyte);
  const base::MemoryBudget client(48 * mebibyte, server);
  const auto taken = client.take(48 * mebibyte - 1000);
  WorldMemory own({client, 64 * mebibyte});
  const base::Status own_refusal = admit(own, balls(20));
  EXPECT_EQ(own_refusal.code(), base::StatusCode::limit_exceeded);
  EXPECT_NE(own_refusal.what().find("of what you may take"), std::string::npos) << own_refusal.what();

  const auto more = server.take(16 * mebibyte);
  WorldMemory other({base::MemoryBudget(48 * mebibyte, server), 64 * mebibyte});
  const base::Status refusal = admit(other, balls(20));
  EXPECT_EQ(refusal.code(), base::StatusCode::unavailable);
  EXPECT_NE(refusal.what().find("of the server's"), std::string::npos) << refusal.what();
}

TEST(WorldMemory, GivesBackWhatItDoesNotNeed) {
  const base::MemoryBudget budget(256 * mebibyte);
  {
    WorldMemory memory({budget, 256 * mebibyte});
    ASSERT_TRUE(admit(memory, balls(1)).ok());
    memory.settle(true, physics::Integrator::midpoint, 0.0);
    const std::size_t one = budget.bytes();
    EXPECT_GT(one, 0U);

    ASSERT_TRUE(memory.admit_stream(500.0).ok());
    memory.settle(false, physics::Integrator::midpoint, 500.0);
    EXPECT_GT(budget.bytes(), one);

    ASSERT_TRUE(admit(memory, balls(50)).ok());
    memory.settle(false, physics::Integrator::midpoint, 0.0);
    EXPECT_EQ(budget.bytes(), one) << "the edit was refused after all, and the stream has ended";

    ASSERT_TRUE(admit(memory, balls(50)).ok());
    memory.settle(true, physics::Integrator::midpoint, 0.0);
    EXPECT_GT(budget.bytes(), 4 * one);
    ASSERT_TRUE(admit(memory, balls(1)).ok());
    memory.settle(true, physics::Integrator::midpoint, 0.0);
    EXPECT_EQ(budget.bytes(), one);
  }
  EXPECT_EQ(budget.bytes(), 0U);
}

TEST(WorldMemory, ARestoredWorldIsThereAlready) {
  const base::MemoryBudget budget(1000);
  WorldMemory memory({budget, 1000});
  const v1::Scene scene = balls(3);
  memory.take_over(scene, *scene_io::to_physics(scene));
  memory.settle(true, physics::Integrator::midpoint, 0.0);
  EXPECT_GT(budget.bytes(), budget.bytes_max());
  EXPECT_FALSE(memory.admit_stream(500.0).ok());
}

class MachineMemory : public testing::Test {
 protected:
  void write(const std::string& path, const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(folder_ / path).parent_path());
    std::ofstream(folder_ / path) << text;
  }
  const support::TemporaryFolder folder_;
  const std::size_t machine_ = machine_memory_bytes(folder_.path());  // no groups
};

TEST_F(MachineMemory, IsThatOfTheGroupOrOfOneAroundIt) {
  write("proc/self/cgroup", "0::/outer/inner\n");
  write("sys/fs/cgroup/outer/inner/memory.max", "max\n");
  EXPECT_EQ(machine_memory_bytes(folder_.path()), machine_);
  write("sys/fs/cgroup/outer/memory.max", "268435456\n");
  EXPECT_EQ(machine_memory_bytes(folder_.path()), 256 * mebibyte);
  write("sys/fs/cgroup/outer/inner/memory.max", "134217728\n");
  EXPECT_EQ(machine_memory_bytes(folder_.path()), 128 * mebibyte);
}

TEST_F(MachineMemory, InAContainerTheRootIsItsOwnGroup) {
  write("proc/self/cgroup", "0::/\n");
  write("sys/fs/cgroup/memory.max", "268435456\n");
  EXPECT_EQ(machine_memory_bytes(folder_.path()), 256 * mebibyte);
}

TEST_F(MachineMemory, OfTheFirstVersionIsTheMemoryControllers) {
  write("proc/self/cgroup", "4:cpu,cpuacct:/x\n3:memory:/docker/abc\n");
  write("sys/fs/cgroup/memory/docker/abc/memory.limit_in_bytes", "134217728\n");
  EXPECT_EQ(machine_memory_bytes(folder_.path()), 128 * mebibyte);
  write("sys/fs/cgroup/memory/docker/abc/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_EQ(machine_memory_bytes(folder_.path()), machine_);
}

}  // namespace
}  // namespace pneuma::app
