// Shows that a server killed at any moment, between and within requests and checkpoints, comes back with all that it
// had acknowledged: the same bits as a world that was never killed. PNEUMA_KILLS says how many times, PNEUMA_SEED from
// which seed.
#include <chrono>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "app/live_world.h"
#include "app/plain_numbers.h"
#include "served.h"
#include "support/environment.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

class Kills : public Served {
 protected:
  struct Steps {
    std::uint32_t ticks = 0;
  };
  using Command = std::variant<v1::ClientMessage, Steps>;

  void SetUp() override {
    auto reference = app::LiveWorld::create(two_balls());
    ASSERT_TRUE(reference.ok()) << reference.status().message();
    reference_.emplace(std::move(*reference));
  }
  void start_again() { start({"--data-dir", folder_ / "data", "--checkpoint-interval-s", "0.02"}); }

  Command draw() {
    if (random_() % 3 == 0) return Steps{1 + static_cast<std::uint32_t>(random_() % 4)};
    const char* body = random_() % 2 == 0 ? "left" : "right";
    v1::ClientMessage message;
    if (random_() % 4 == 0) {
      std::string velocities;
      const double speed_m_s = 0.01 * static_cast<double>(random_() % 100);
      app::append_numbers(std::vector<double>(std::size_t{3} * 162, speed_m_s), false, velocities);
      message.mutable_set_state()->set_world("w");
      message.mutable_set_state()->add_soft_bodies()->set_name(body);
      message.mutable_set_state()->mutable_soft_bodies(0)->set_velocities(velocities);
      return message;
    }
    v1::Impulse& impulse = *message.mutable_impulse();
    impulse.set_world("w");
    impulse.set_body(body);
    impulse.set_vertex(static_cast<std::uint32_t>(random_() % 162));
    *impulse.mutable_impulse() = vec(1e-3 * static_cast<double>(random_() % 100), 0.01, 0.0);
    return message;
  }
  static bool ask(client::Client& client, const Command& command) {
    if (const auto* steps = std::get_if<Steps>(&command)) return client.step("w", steps->ticks).ok();
    return client.call(std::get<v1::ClientMessage>(command)).ok();
  }
  void carry_out(const Command& command) {
    if (const auto* steps = std::get_if<Steps>(&command)) {
      for (std::uint32_t i = 0; i < steps->ticks; ++i) reference_->physics().step_tick(workers_);
      return;
    }
    ASSERT_TRUE(reference_->change(std::get<v1::ClientMessage>(command)).ok());
  }

  /// Asks one request after the other until the server is killed, after so long. All that was acknowledged is carried
  /// out on the reference; the one under way is left.
  void ask_until_killed(std::chrono::microseconds life) {
    client::Client client = connect();
    std::thread killer([&] {
      std::this_thread::sleep_for(life);
      server_->kill();
    });
    do {
      under_way_ = draw();
      if (!ask(client, under_way_)) break;
      ++acknowledged_;
      carry_out(under_way_);
    } while (!HasFatalFailure());
    killer.join();
  }

  /// Of steps that were not acknowledged, some may have been done.
  bool is_as_the_reference(const v1::Stats& stats) {
    if (is_now(stats)) return true;
    if (const auto* steps = std::get_if<Steps>(&under_way_)) {
      for (std::uint32_t i = 0; i < steps->ticks; ++i) {
        carry_out(Steps{1});
        if (is_now(stats)) return true;
      }
      return false;
    }
    carry_out(under_way_);
    return is_now(stats);
  }
  bool is_now(const v1::Stats& stats) {
    return stats.tick() == reference_->tick() && stats.state_hash() == reference_->physics().state_hash();
  }

  std::mt19937_64 random_{support::number_from_environment("PNEUMA_SEED", 18)};
  const support::TemporaryFolder folder_;
  std::optional<app::LiveWorld> reference_;
  physics::Workers workers_{1};
  Command under_way_;
  std::uint64_t acknowledged_ = 0;
};

TEST_F(Kills, AtAnyMomentLoseNothingThatWasAcknowledged) {
  const std::uint64_t kills = support::number_from_environment("PNEUMA_KILLS", support::is_sanitized ? 5 : 20);
  ASSERT_NO_FATAL_FAILURE(start_again());
  {
    client::Client client = connect();
    create(client, two_balls(), "w", true);
  }
  for (std::uint64_t kill = 0; kill < kills; ++kill) {
    ask_until_killed(std::chrono::microseconds(random_() % 80'000));
    start_again();
    client::Client client = connect();
    const auto stats = client.stats("w");
    ASSERT_TRUE(stats.ok()) << "kill " << kill << ": " << stats.status().message() << server_->error_output();
    ASSERT_TRUE(is_as_the_reference(*stats))
        << "kill " << kill << ": at tick " << stats->tick() << ", the reference at " << reference_->tick();
  }
  EXPECT_GT(acknowledged_, kills);
  RecordProperty("acknowledged", static_cast<int>(acknowledged_));
}

}  // namespace
}  // namespace pneuma::integration
