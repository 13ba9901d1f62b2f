// Shows that a world file is held to its own history: one that was saved is verified, one whose history leads elsewhere
// is not, and both say where.
#include "replay/verification.h"

#include <fstream>

#include <gtest/gtest.h>

#include "app/world_file.h"
#include "support/temporary_folder.h"
#include "unit/app/ball_scene.h"

namespace pneuma::replay {
namespace {

class VerificationTest : public testing::Test {
 protected:
  /// A ball that was hit at tick 3 and is saved at tick 6.
  VerificationTest() {
    auto live = app::LiveWorld::create(app::ball_scene());
    physics::Workers workers(1);
    persist::History history;
    history.begin = {0, 0, app::to_bytes(app::SavedWorld{live->save(), false})};
    while (live->tick() < 3) live->physics().step_tick(workers);
    const v1::ClientMessage hit = app::impulse_up("ball", 2.0);
    history.records.push_back({3, hit.SerializeAsString()});
    EXPECT_TRUE(live->change(hit).ok());
    while (live->tick() < 6) live->physics().step_tick(workers);
    file_ = app::make_world_file("w", {{live->save(), false}, live->physics().state_hash(), {}, 0}, history);
  }
  [[nodiscard]] base::Result<Verification> verify() const {
    std::ofstream(path_, std::ios::binary) << *app::to_bytes(file_);
    return verify_world_file(path_);
  }

  support::TemporaryFolder verified_folder_;
  std::string path_ = verified_folder_ / "w.world";
  v1::WorldFile file_;
};

TEST_F(VerificationTest, AFileThatWasSavedIsVerified) {
  const auto verified = verify();
  ASSERT_TRUE(verified.ok()) << verified.status().message();
  EXPECT_TRUE(verified->has_history);
  EXPECT_EQ(verified->ticks_replayed, 6U);
  EXPECT_EQ(verified->commands_replayed, 1U);
  EXPECT_EQ(verified->state_hash, file_.state_hash());
}

TEST_F(VerificationTest, AHistoryThatLeadsElsewhereIsToldWithBothHashes) {
  file_.mutable_commands(0)->set_request(app::impulse_up("ball", 2.5).SerializeAsString());
  const auto verified = verify();
  ASSERT_FALSE(verified.ok());
  EXPECT_EQ(verified.status().where(), path_);
  EXPECT_NE(verified.status().message().find("leads to another state"), std::string::npos);
  file_.mutable_commands(0)->set_tick(7);
  EXPECT_NE(verify().status().message().find("goes past its tick 6"), std::string::npos);
  file_.mutable_commands(0)->set_request("no request");
  EXPECT_FALSE(verify().ok());
}

TEST_F(VerificationTest, WithoutHistoryTheStateAloneIsChecked) {
  file_.clear_earlier_state();
  file_.clear_commands();
  const auto verified = verify();
  ASSERT_TRUE(verified.ok()) << verified.status().message();
  EXPECT_FALSE(verified->has_history);
  file_.set_state_hash(1);
  EXPECT_FALSE(verify().ok());
}

TEST_F(VerificationTest, AFileThatIsNotThereOrNoWorldIsNamed) {
  EXPECT_EQ(verify_world_file(verified_folder_ / "none").status().code(), base::StatusCode::not_found);
  std::ofstream(path_) << "{}";
  EXPECT_EQ(verify_world_file(path_).status().message(), path_ + ": is no world file");
}

}  // namespace
}  // namespace pneuma::replay
