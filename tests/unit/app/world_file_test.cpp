// Shows that a world comes out of a file with the same bits, that a file cut off or changed anywhere is refused, that
// whoever made it cannot bring in what no server saves, and that files of every earlier version still load.
#include "app/world_file.h"

#include <array>
#include <bit>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include "app/replay_log.h"
#include "ball_scene.h"
#include "base/limits.h"
#include "support/golden.h"

namespace pneuma::app {
namespace {

base::Status admit_any(const v1::Scene& /*source*/, const physics::Scene& /*scene*/) {
  return {};
}

/// A ball that fell for 20 ticks and was hit at tick 12, with its history from tick 5 on.
struct Saved {
  LiveWorld live = std::move(*LiveWorld::create(ball_scene()));
  persist::History history;
  v1::WorldFile file;

  Saved() {
    step_to(5);
    history.begin = {3, 5, to_bytes(SavedWorld{live.save(), false})};
    step_to(12);
    const v1::ClientMessage hit = impulse_up("ball", 2.0);
    history.records.push_back({12, hit.SerializeAsString()});
    EXPECT_TRUE(live.change(hit).ok());
    step_to(20);
    file = make_world_file("w", moment(), history);
  }
  void step_to(std::uint64_t tick) {
    physics::Workers workers(1);
    while (live.tick() < tick) live.physics().step_tick(workers);
  }
  [[nodiscard]] WorldMoment moment() const { return {{live.save(), true}, live.physics().state_hash(), {}, 0}; }
};

TEST(WorldFile, GivesTheSameWorldBack) {
  const Saved saved;
  const auto bytes = to_bytes(saved.file);
  ASSERT_TRUE(bytes.ok());
  const auto file = read_world_file(*bytes);
  ASSERT_TRUE(file.ok()) << file.status().message();
  auto opened = open_world(*file, admit_any);
  ASSERT_TRUE(opened.ok()) << opened.status().message();
  EXPECT_TRUE(opened->paused);
  EXPECT_EQ(opened->live.tick(), 20U);
  EXPECT_EQ(opened->live.physics().state_hash(), saved.live.physics().state_hash());
}

TEST(WorldFile, ItsHistoryLeadsToItsState) {
  const Saved saved;
  auto past = open_history(saved.file);
  ASSERT_TRUE(past.ok()) << past.status().message();
  EXPECT_EQ(past->live.tick(), 5U);
  ASSERT_TRUE(replay_log("w", saved.history.records, past->live, past->paused, admit_any).ok());
  physics::Workers workers(1);
  while (past->live.tick() < 20) past->live.physics().step_tick(workers);
  EXPECT_EQ(past->live.physics().state_hash(), saved.file.state_hash());
}

TEST(WorldFile, CutOffOrChangedAnywhereItIsRefused) {
  const std::string bytes = *to_bytes(Saved().file);
  for (std::size_t length = 0; length < bytes.size(); length += 1 + length / 64) {
    EXPECT_FALSE(read_world_file(std::string_view(bytes).substr(0, length)).ok()) << length;
  }
  for (std::size_t at = 0; at < bytes.size(); at += 1 + at / 64) {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ 0x10);
    EXPECT_FALSE(read_world_file(changed).ok()) << at;
  }
  EXPECT_FALSE(read_world_file(bytes + "x").ok());
}

TEST(WorldFile, OfAVersionToComeItIsRefusedByItsNumber) {
  std::string bytes = *to_bytes(Saved().file);
  bytes[8] = 2;
  const auto file = read_world_file(bytes);
  EXPECT_EQ(file.status().code(), base::StatusCode::unsupported);
  EXPECT_NE(file.status().message().find("version 2"), std::string::npos) << file.status().message();
}

TEST(WorldFile, TooLargeWithItsHistoryItGoesWithout) {
  Saved saved;
  saved.history.records.push_back({20, std::string(base::world_file_bytes_max, 'x')});
  const v1::WorldFile file = make_world_file("w", saved.moment(), saved.history);
  EXPECT_TRUE(file.earlier_state().empty());
  EXPECT_EQ(file.commands_size(), 0);
  EXPECT_TRUE(to_bytes(file).ok());
  v1::WorldFile larger = file;
  larger.set_state(std::string(base::world_file_bytes_max, 'x'));
  EXPECT_EQ(to_bytes(larger).status().code(), base::StatusCode::limit_exceeded);
}

TEST(WorldFile, AStateThatIsNotTheOneItTellsIsRefused) {
  Saved saved;
  saved.file.set_state_hash(saved.file.state_hash() ^ 1U);
  EXPECT_EQ(open_world(saved.file, admit_any).status().code(), base::StatusCode::invalid_argument);
}

/// The state with the double `before`, wherever it stands in it, as `after`; and the hash that belongs to it.
v1::WorldFile with_number(const Saved& saved, double before, double after) {
  v1::WorldFile file = saved.file;
  SavedWorld world{saved.live.save(), false};
  const auto bytes_of = [](double number) {
    const auto bits = std::bit_cast<std::array<char, sizeof(double)>>(number);
    return std::string(bits.data(), bits.size());
  };
  const auto at = world.live.snapshot.find(bytes_of(before));
  EXPECT_NE(at, std::string::npos);
  world.live.snapshot.replace(at, sizeof(double), bytes_of(after));
  file.set_state(to_bytes(world));
  const auto restored = LiveWorld::restore(world.live);
  EXPECT_TRUE(restored.ok());
  if (restored.ok()) file.set_state_hash(restored->physics().state_hash());
  return file;
}

TEST(WorldFile, AStateThatNoWorldCanBeInIsRefused) {
  const Saved saved;
  std::vector<double> positions_m(3 * saved.live.physics().soft_body(0).mesh->positions_m.size());
  saved.live.physics().copy_positions(0, positions_m);
  ASSERT_TRUE(open_world(with_number(saved, positions_m[4], positions_m[4] + 1e-3), admit_any).ok()) << "the method";
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1e300}) {
    const auto opened = open_world(with_number(saved, positions_m[4], bad), admit_any);
    EXPECT_EQ(opened.status().code(), base::StatusCode::invalid_argument) << bad;
  }
}

TEST(WorldFile, AScenePastTheMemoryOfAMessageIsRefused) {
  const Saved saved;
  v1::Scene crowded = ball_scene();
  for (int i = 0; i < 520'000; ++i) crowded.add_soft_bodies();
  SavedWorld world{saved.live.save(), false};
  world.live.created = std::make_shared<const v1::Scene>(crowded);
  v1::WorldFile file = saved.file;
  file.set_state(to_bytes(world));
  EXPECT_EQ(open_world(file, admit_any).status().code(), base::StatusCode::invalid_argument);
}

TEST(WorldFile, FilesOfEarlierVersionsLoad) {
  for (const char* name : {"ball-1.world"}) {
    SCOPED_TRACE(name);
    std::ifstream in(support::golden_path(name), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const auto file = read_world_file(bytes);
    ASSERT_TRUE(file.ok()) << file.status().message();
    const auto opened = open_world(*file, admit_any);
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    EXPECT_EQ(opened->live.tick(), 40U);
    EXPECT_EQ(opened->live.scene().soft_bodies_size(), 2);
    const auto past = open_history(*file);
    ASSERT_TRUE(past.ok()) << past.status().message();
    EXPECT_EQ(past->live.tick(), 0U);
    EXPECT_EQ(file->commands_size(), 5);  // an impulse, an edit, and the ends of three steps
  }
}

}  // namespace
}  // namespace pneuma::app
