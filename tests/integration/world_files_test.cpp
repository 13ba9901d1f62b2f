// Shows that a user can hold a world in hand: snapshot, verify, restore, branch and rewind give the same bits as a
// world that the same was asked of, and outlive the server.
#include <filesystem>
#include <fstream>
#include <iterator>

#include "base/limits.h"
#include "raw_connection.h"
#include "served.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

using support::Finished;

class WorldFiles : public Served {
 protected:
  void start_kept() { start({"--data-dir", folder_ / "data"}); }
  [[nodiscard]] Finished pneuma(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"--server", server_->tcp_address()});
    return support::run_program("pneuma", arguments);
  }
  static v1::Impulse hit(const std::string& world, double x) {
    v1::Impulse impulse;
    impulse.set_world(world);
    impulse.set_body("left");
    *impulse.mutable_impulse() = vec(x, 0.0, 0.0);
    return impulse;
  }
  /// Hit at tick 10, its gravity changed at tick 20, and now at tick 30.
  static void play(client::Client& client, const std::string& world) {
    ASSERT_TRUE(client.step(world, 10).ok());
    ASSERT_TRUE(client.impulse(hit(world, 0.5)).ok());
    ASSERT_TRUE(client.step(world, 10).ok());
    v1::SceneEdit edit;
    *edit.add_changes()->mutable_set_gravity() = vec(0.0, -3.7, 0.0);
    ASSERT_TRUE(client.edit(world, edit).ok());
    ASSERT_TRUE(client.step(world, 10).ok());
  }
  static std::uint64_t hash(client::Client& client, const std::string& world) {
    const auto stats = client.stats(world);
    EXPECT_TRUE(stats.ok()) << stats.status().message();
    return stats.ok() ? stats->state_hash() : 0;
  }
  /// Of a world that was asked for nothing but its first ticks, as play() has it.
  static std::uint64_t hash_at(client::Client& client, std::uint32_t ticks, bool with_hit) {
    create(client, two_balls(), "reference", true);
    EXPECT_TRUE(client.step("reference", 10).ok());
    if (with_hit) {
      EXPECT_TRUE(client.impulse(hit("reference", 0.5)).ok());
    }
    if (ticks > 10) {
      EXPECT_TRUE(client.step("reference", ticks - 10).ok());
    }
    const std::uint64_t found = hash(client, "reference");
    EXPECT_TRUE(client.destroy_world("reference").ok());
    return found;
  }

  support::TemporaryFolder folder_;
};

TEST_F(WorldFiles, ASnapshotIsVerifiedAndComesBackOnAnotherServerWithTheSameBits) {
  start_kept();
  const std::string file = folder_ / "w.world";
  std::uint64_t now = 0;
  std::uint64_t later = 0;
  {
    client::Client client = connect();
    create(client, two_balls(), "w", true);
    play(client, "w");
    now = hash(client, "w");
    const Finished taken = pneuma({"snapshot", "w", file});
    ASSERT_EQ(taken.exit_status, 0) << taken.error_output;
    EXPECT_NE(taken.output.find("w at tick 30"), std::string::npos) << taken.output;
    EXPECT_NE(taken.output.find("history from tick 0"), std::string::npos) << taken.output;
    ASSERT_TRUE(client.step("w", 30).ok());
    later = hash(client, "w");
  }
  const Finished verified = support::run_program("pneuma", {"verify", file});
  ASSERT_EQ(verified.exit_status, 0) << verified.error_output;
  EXPECT_NE(verified.output.find("30 ticks and 5 commands"), std::string::npos) << verified.output;

  start();  // another one, which keeps nothing
  client::Client client = connect();
  const Finished restored = pneuma({"restore", file});
  ASSERT_EQ(restored.exit_status, 0) << restored.error_output;
  EXPECT_EQ(restored.output, "restored w at tick 30\n");
  EXPECT_EQ(hash(client, "w"), now);
  EXPECT_TRUE(client.stats("w")->paused());
  ASSERT_TRUE(client.step("w", 30).ok());
  EXPECT_EQ(hash(client, "w"), later) << "and it goes on as the first one did";
  EXPECT_EQ(pneuma({"restore", file}).output, "restored w-2 at tick 30\n");
  ASSERT_TRUE(client.reset("w-2").ok());
  EXPECT_EQ(client.scene("w-2")->scene().gravity().y(), -9.81) << "the scene as it was created is in it, too";
  const Finished unkept = pneuma({"snapshot", "w", folder_ / "unkept.world"});
  EXPECT_NE(unkept.output.find("no history"), std::string::npos) << unkept.output << unkept.error_output;
}

TEST_F(WorldFiles, AChangedFileIsFoundOut) {
  start_kept();
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  play(client, "w");
  const auto taken = client.snapshot("w");
  ASSERT_TRUE(taken.ok()) << taken.status().message();
  const std::string file = folder_ / "changed.world";
  std::string bytes = taken->data();
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  std::ofstream(file, std::ios::binary) << bytes;
  const Finished damaged = support::run_program("pneuma", {"verify", file});
  EXPECT_EQ(damaged.exit_status, 1);
  EXPECT_NE(damaged.error_output.find(file + ": is damaged"), std::string::npos) << damaged.error_output;
  EXPECT_EQ(pneuma({"restore", file}).exit_status, 1);
  EXPECT_EQ(client.list_worlds()->worlds_size(), 1);
}

TEST_F(WorldFiles, ABranchIsTheWorldAsItWasAndBothGoOn) {
  start_kept();
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  play(client, "w");
  const std::uint64_t now = hash(client, "w");
  EXPECT_EQ(pneuma({"branch", "w"}).output, "branched off w-2 at tick 30\n");
  EXPECT_EQ(hash(client, "w-2"), now);
  EXPECT_EQ(pneuma({"branch", "w", "--at", "15", "--name", "before"}).output, "branched off before at tick 15\n");
  EXPECT_EQ(hash(client, "before"), hash_at(client, 15, true));
  EXPECT_EQ(client.scene("before")->scene().gravity().y(), -9.81);
  EXPECT_EQ(pneuma({"branch", "w", "--at", "10", "--name", "unhit"}).exit_status, 0);
  EXPECT_EQ(hash(client, "unhit"), hash_at(client, 10, false)) << "before what was asked for at the tick";
  EXPECT_EQ(hash(client, "w"), now);
  // A branch is kept as any world is.
  const std::uint64_t kept = hash(client, "before");
  server_->kill();
  start_kept();
  client::Client again = connect();
  EXPECT_EQ(hash(again, "before"), kept);
}

// Each takes a copy of the world, and those of one client are replayed one after the other.
TEST_F(WorldFiles, HalfOfTheLooksIntoThePastAreOneClients) {
  start_kept();
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  ASSERT_TRUE(client.step("w", 2'000).ok());
  RawConnection many(server_->tcp_address());
  ASSERT_TRUE(many.say_hello());
  constexpr std::uint64_t asked = base::client_look_backs_max + 4;
  std::string requests;
  for (std::uint64_t i = 1; i <= asked; ++i) {
    v1::ClientMessage branch;
    branch.set_request_id(i);
    branch.mutable_branch_world()->set_world("w");
    branch.mutable_branch_world()->set_tick(1'999);
    requests += RawConnection::envelope(branch.SerializeAsString());
  }
  ASSERT_TRUE(many.send(requests));
  std::size_t done = 0;
  for (std::uint64_t i = 1; i <= asked; ++i) {
    const auto reply = many.receive();
    ASSERT_TRUE(reply.has_value());
    if (reply->has_done()) ++done;
    EXPECT_TRUE(reply->has_done() || reply->error().code() == v1::Error::UNAVAILABLE);
  }
  EXPECT_GE(done, base::client_look_backs_max);
  EXPECT_LT(done, asked);
}

TEST_F(WorldFiles, ARewindIsSeenAndOutlivesTheServer) {
  start_kept();
  std::uint64_t rewound = 0;
  std::uint64_t later = 0;
  {
    client::Client client = connect();
    create(client, two_balls(), "w", true);
    play(client, "w");
    client::Client watcher = connect();
    ASSERT_TRUE(watcher.subscribe("w", {.commands = true}).ok());
    const Finished done = pneuma({"rewind", "w", "15"});
    ASSERT_EQ(done.exit_status, 0) << done.error_output;
    EXPECT_EQ(done.output, "rewound w at tick 30: as it was at tick 15\n");
    const auto event = await_event(watcher, v1::Event::WORLD_RESET);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->detail(), "as it was at tick 15");
    rewound = hash(client, "w");
    EXPECT_EQ(rewound, hash_at(client, 15, true));
    EXPECT_EQ(client.stats("w")->tick(), 30U) << "ticks go on counting";
    EXPECT_DOUBLE_EQ(client.stats("w")->time_s(), 0.25);
    ASSERT_TRUE(client.step("w", 5).ok());
    later = hash(client, "w");
    EXPECT_EQ(later, hash_at(client, 20, true));
    // Also to before the rewind, and through it.
    ASSERT_TRUE(client
                    .branch_world([] {
                      v1::BranchWorld branch;
                      branch.set_world("w");
                      branch.set_tick(33);
                      branch.set_name("after-rewind");
                      return branch;
                    }())
                    .ok());
    EXPECT_EQ(hash(client, "after-rewind"), hash_at(client, 18, true));
    const std::string file = folder_ / "rewound.world";
    ASSERT_EQ(pneuma({"snapshot", "w", file}).exit_status, 0);
    const Finished verified = support::run_program("pneuma", {"verify", file});
    EXPECT_EQ(verified.exit_status, 0) << verified.error_output;
  }
  server_->kill();
  start_kept();
  client::Client client = connect();
  EXPECT_EQ(hash(client, "w"), later);
  EXPECT_EQ(client.stats("w")->tick(), 35U);
}

TEST_F(WorldFiles, ARunningWorldIsRewoundToo) {
  start_kept();
  client::Client client = connect();
  create(client, two_balls(), "w");
  ASSERT_TRUE(client.subscribe("w").ok());
  ASSERT_TRUE(await_frame(client, [](const auto& frame) { return frame.tick > 20; }));
  const auto done = client.rewind_world("w", 5);
  ASSERT_TRUE(done.ok()) << done.status().message();
  const auto shown = await_frame(client, [&](const auto& frame) { return frame.tick >= done->tick(); });
  ASSERT_TRUE(shown);
  EXPECT_NEAR(shown->time_s, (5.0 + static_cast<double>(shown->tick - done->tick() + 1)) / 60.0, 1e-9);
}

TEST_F(WorldFiles, ALargeWorldComesInPiecesAndGoesBack) {
  start();
  client::Client client = connect();
  v1::Scene scene = two_balls();
  scene.mutable_soft_bodies()->DeleteSubrange(1, 1);
  scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(6);
  scene.mutable_stepping()->set_substeps(1);
  scene.mutable_stepping()->set_integrator(v1::Stepping::SYMPLECTIC_EULER);
  scene.mutable_stepping()->set_on_unstable(v1::Stepping::ALLOW);
  create(client, scene, "large", true);
  const auto taken = client.snapshot("large");
  ASSERT_TRUE(taken.ok()) << taken.status().message();
  EXPECT_GT(taken->bytes_total(), 1024U * 1024) << "more than a message holds";
  v1::RestoreWorld restore;
  restore.set_name("again");
  restore.set_snapshot(taken->data());
  const auto done = client.restore_world(restore);
  ASSERT_TRUE(done.ok()) << done.status().message();
  EXPECT_EQ(hash(client, "again"), hash(client, "large"));
}

TEST_F(WorldFiles, WhatCannotBeIsSaidAndChangesNothing) {
  start_kept();
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  play(client, "w");
  const std::uint64_t now = hash(client, "w");
  const auto past = client.rewind_world("w", 31);
  EXPECT_EQ(past.status().code(), base::StatusCode::invalid_argument);
  EXPECT_EQ(past.status().where(), "rewind_world.tick");
  v1::ClientMessage forged;
  forged.mutable_rewind_world()->set_world("w");
  forged.mutable_rewind_world()->set_state("anything");
  EXPECT_EQ(client.call(forged).status().where(), "rewind_world.state");
  v1::BranchWorld branch;
  branch.set_world("w");
  branch.set_name("w");
  EXPECT_EQ(client.branch_world(branch).status().code(), base::StatusCode::already_exists);
  v1::RestoreWorld restore;
  restore.set_snapshot("PNEUMAWF and then nothing");
  EXPECT_EQ(client.restore_world(restore).status().where(), "restore_world.snapshot");
  v1::ClientMessage read;
  read.mutable_read_snapshot()->set_snapshot_id(7);
  EXPECT_EQ(client.call(read).status().code(), base::StatusCode::not_found);
  EXPECT_EQ(hash(client, "w"), now);
  EXPECT_EQ(client.list_worlds()->worlds_size(), 1);

  start();
  client::Client unkept = connect();
  create(unkept, two_balls(), "w", true);
  EXPECT_EQ(unkept.rewind_world("w", 0).status().code(), base::StatusCode::failed_precondition);
}

}  // namespace
}  // namespace pneuma::integration
