// Shows what signals do to a server that runs: one asks it to end, a second one does not wait, and those that mean
// something else elsewhere end nothing.
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <string>
#include <thread>

#include "raw_connection.h"
#include "served.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace pneuma::integration {
namespace {

class Signals : public Served {
 protected:
  /// Waits until the sockets take no more of what is to be sent.
  [[nodiscard]] bool replies_come_to_wait() const {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < deadline) {
      RawConnection connection(server_->http_address());
      if (!connection.send("GET /metrics HTTP/1.0\r\nHost: localhost\r\n\r\n")) return false;
      const std::string metrics = connection.receive_to_end();
      const std::string name = "\npneuma_queue_bytes ";
      const std::size_t at = metrics.find(name);
      if (at != std::string::npos && std::stod(metrics.substr(at + name.size())) > 100'000.0) return true;
    }
    return false;
  }
};

// B8 of the list of attacks: each of these killed the server, and no checkpoint was written. All are sent before
// SIGTERM, and the kernel hands out the lowest number first, so they were seen when the server ends in good order.
TEST_F(Signals, WhatDoesNotAskForTheEndDoesNotBringIt) {
  const support::TemporaryFolder folder;
  start({"--data-dir", folder / "data", "--checkpoint-interval-s", "1000"});
  {
    client::Client client = connect();
    create(client, two_balls(), "w", true);
    ASSERT_TRUE(client.step("w", 3).ok());
    for (const int number : {SIGHUP, SIGUSR1, SIGUSR2}) server_->send_signal(number);
    EXPECT_TRUE(client.ping().ok());
  }
  const auto status = server_->stop();
  ASSERT_TRUE(status.ok()) << status.status().message();
  EXPECT_EQ(*status, 0) << server_->error_output();
  for (const char* line : {"signal=1 reads its files again", "signal=10 log_level=debug", "signal=12 changes nothing",
                           "signal=15 shutting down"}) {
    EXPECT_NE(server_->error_output().find(line), std::string::npos) << line;
  }
  start({"--data-dir", folder / "data"});
  EXPECT_EQ(connect().stats("w")->tick(), 3U);
}

// B8: the second one was ignored. A client that reads nothing holds the end up for ten minutes; the goodbye to the
// other one shows that the first signal was taken.
TEST_F(Signals, ASecondRequestToEndIsNotWaitedFor) {
  if (support::is_thread_sanitized) {  // it ends at once: a thread that is done by then is not joined
    const char* options = std::getenv("TSAN_OPTIONS");
    setenv("TSAN_OPTIONS", (std::string(options == nullptr ? "" : options) + " report_thread_leaks=0").c_str(), 1);
  }
  start({"--drain-timeout-ms", "600000", "--commands-per-s", "1e6", "--commands-burst", "1e6"});
  client::Client client = connect();
  create(client, two_balls(), "w", true);
  RawConnection reader(server_->tcp_address());
  ASSERT_TRUE(reader.say_hello());
  RawConnection silent(server_->tcp_address(), 4096);
  ASSERT_TRUE(silent.say_hello());
  v1::ClientMessage get_scene;
  get_scene.mutable_get_scene()->set_world("w");
  std::string requests;
  for (std::uint64_t id = 2; id < 20'000; ++id) {
    get_scene.set_request_id(id);
    requests += RawConnection::envelope(get_scene.SerializeAsString());
  }
  ASSERT_TRUE(silent.send(requests));
  ASSERT_TRUE(replies_come_to_wait());
  server_->send_signal(SIGTERM);
  ASSERT_TRUE(reader.ends());
  ASSERT_EQ(reader.goodbye(), v1::Error::UNAVAILABLE);
  ASSERT_TRUE(server_->is_running()) << "nothing waits for the silent one";
  server_->send_signal(SIGTERM);
  const auto status = server_->wait(patience);
  ASSERT_TRUE(status.ok()) << status.status().message();
  EXPECT_EQ(*status, 1);
}

// As a debugger, a laptop's lid or a host out of memory does. What passed meanwhile is slipped, and not made up for.
TEST_F(Signals, AServerThatStoodStillGoesOnWithItsClients) {
  start();
  client::Client client = connect();
  create(client, two_balls(), "w");
  ASSERT_TRUE(client.subscribe("w").ok());
  ASSERT_TRUE(await_frame(client, [](const auto& frame) { return frame.tick >= 30; }));
  const auto before = client.stats("w");
  ASSERT_TRUE(before.ok());
  constexpr std::chrono::seconds stood{2};
  server_->send_signal(SIGSTOP);
  std::this_thread::sleep_for(stood);  // it is the time itself that is waited for
  server_->send_signal(SIGCONT);
  // Frames of before it stood are on their way, and a tick or two were under way.
  const auto slipped = [&] { return client.stats("w")->slipped_s() - before->slipped_s(); };
  ASSERT_TRUE(await_frame(client, [&](const auto&) { return slipped() > 1.0; }));
  const auto after = client.stats("w");
  EXPECT_LT(after->time_s(), before->time_s() + 1.0);
  EXPECT_TRUE(await_frame(client, [&](const auto& frame) { return frame.tick >= after->tick() + 30; }));
}

}  // namespace
}  // namespace pneuma::integration
