// Shows what a server makes of a disk that failed it: a damaged checkpoint is passed over for the one before and the
// log, a torn log is replayed up to the tear, a world with nothing whole left keeps its name and files, and a disk that
// fails under way stops no world. The server is real; the damage is done to its files.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <boost/asio/ip/tcp.hpp>
#include <gtest/gtest.h>

#include "pneuma_client/client.h"
#include "support/program.h"
#include "support/server_process.h"

namespace pneuma {
namespace {

namespace fs = std::filesystem;

class ServerDisk : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "pneuma-disk-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override {
    server_.reset();
    fs::remove_all(folder_);
  }

  void start(const std::vector<std::string>& arguments = {"--checkpoint-interval-s", "1000"}) {
    server_.reset();
    std::vector<std::string> all{"--data-dir", folder_.string()};
    all.insert(all.end(), arguments.begin(), arguments.end());
    auto server = support::ServerProcess::start(all);
    if (!server.ok()) throw std::runtime_error(server.status().message());
    server_.emplace(std::move(*server));
  }

  [[nodiscard]] client::Client connect() const {
    client::ConnectOptions patient;
    patient.connect_timeout = patient.reply_timeout = std::chrono::seconds(60);
    auto connected = client::Client::connect(server_->tcp_address(), patient);
    if (!connected.ok()) throw std::runtime_error(connected.status().message());
    return std::move(*connected);
  }

  /// The world's files whose names begin so, oldest first.
  [[nodiscard]] std::vector<fs::path> files(const std::string& world, const std::string& prefix) const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      const bool of_world = entry.path().parent_path().filename() == world;
      if (of_world && entry.path().filename().string().starts_with(prefix)) found.push_back(entry.path());
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  static void damage(const fs::path& file) {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(static_cast<std::streamoff>(fs::file_size(file) / 2));
    stream.write("damage", 6);
    ASSERT_TRUE(stream.good());
  }

  /// A paused world with a command at tick 5 and ten ticks done; its hash.
  static std::uint64_t make_world(client::Client& client, const std::string& name) {
    EXPECT_TRUE(client.create_builtin("bouncing-ball", name, true).ok());
    EXPECT_TRUE(client.step(name, 5).ok());
    EXPECT_TRUE(push(client, name).ok());
    EXPECT_TRUE(client.step(name, 5).ok());
    return client.stats(name)->state_hash();
  }

  static base::Result<v1::Done> push(client::Client& client, const std::string& world) {
    v1::Impulse impulse;
    impulse.set_world(world);
    impulse.set_body(client.stats(world)->soft_bodies(0).name());
    impulse.mutable_impulse()->set_x(1.0);
    return client.impulse(impulse);
  }

  /// What the HTTP address answers, head and body.
  [[nodiscard]] std::string page(const std::string& path) const {
    boost::asio::ip::tcp::iostream connection;
    const std::string address = server_->http_address();
    const std::size_t colon = address.rfind(':');
    connection.connect(address.substr(0, colon), address.substr(colon + 1));
    connection << "GET " << path << " HTTP/1.0\r\nHost: localhost\r\n\r\n" << std::flush;
    return {std::istreambuf_iterator<char>(connection), {}};
  }

  fs::path folder_;
  std::optional<support::ServerProcess> server_;
};

TEST_F(ServerDisk, ADamagedCheckpointIsPassedOver) {
  start();
  std::uint64_t hash = 0;
  {
    client::Client client = connect();
    make_world(client, "w");
    ASSERT_EQ(server_->stop().ok(), true);
  }
  start();
  {
    client::Client client = connect();
    ASSERT_TRUE(client.step("w", 3).ok());
    ASSERT_TRUE(push(client, "w").ok());
    ASSERT_TRUE(client.step("w", 3).ok());
    hash = client.stats("w")->state_hash();
  }
  server_->kill();
  const auto checkpoints = files("w", "checkpoint-");
  ASSERT_GE(checkpoints.size(), 2U);
  damage(checkpoints.back());
  start();
  client::Client client = connect();
  EXPECT_EQ(client.stats("w")->state_hash(), hash) << "the older checkpoint and both logs";
  EXPECT_NE(server_->error_output().find("passed over"), std::string::npos);
}

TEST_F(ServerDisk, ATornLogIsReplayedUpToTheTear) {
  start();
  {
    client::Client client = connect();
    make_world(client, "w");
  }
  server_->kill();
  const auto logs = files("w", "log-");
  ASSERT_FALSE(logs.empty());
  fs::resize_file(logs.back(), fs::file_size(logs.back()) - 1);
  start();
  client::Client client = connect();
  const auto stats = client.stats("w");
  ASSERT_TRUE(stats.ok());
  EXPECT_EQ(stats->tick(), 5U) << "the note of tick 10 was torn";
  EXPECT_NE(server_->error_output().find("log cut"), std::string::npos);
}

TEST_F(ServerDisk, AWorldWithNothingWholeKeepsItsNameAndTheOthersComeBack) {
  start();
  std::uint64_t hash = 0;
  {
    client::Client client = connect();
    make_world(client, "broken");
    hash = make_world(client, "whole");
  }
  server_->kill();
  for (const fs::path& checkpoint : files("broken", "checkpoint-")) damage(checkpoint);
  start();
  client::Client client = connect();
  const auto list = client.list_worlds();
  ASSERT_EQ(list->worlds_size(), 2);
  EXPECT_EQ(list->worlds(0).name(), "broken");
  EXPECT_TRUE(list->worlds(0).damaged());
  EXPECT_FALSE(list->worlds(1).damaged());
  EXPECT_EQ(client.stats("whole")->state_hash(), hash);
  const auto stats = client.stats("broken");
  EXPECT_EQ(stats.status().code(), base::StatusCode::failed_precondition) << stats.status().message();
  EXPECT_EQ(stats.status().where(), "get_stats.world");
  EXPECT_EQ(client.create_builtin("bouncing-ball", "broken").status().code(), base::StatusCode::already_exists);
  EXPECT_FALSE(files("broken", "checkpoint-").empty());
  EXPECT_NE(server_->error_output().find("world=broken damaged"), std::string::npos);
}

TEST_F(ServerDisk, ADamagedWorldIsToldOnThePagesUntilItIsDestroyed) {
  start();
  {
    client::Client client = connect();
    make_world(client, "broken");
  }
  server_->kill();
  for (const fs::path& checkpoint : files("broken", "checkpoint-")) damage(checkpoint);
  start();
  EXPECT_NE(page("/metrics").find("pneuma_worlds_damaged 1"), std::string::npos);
  EXPECT_NE(page("/healthz").find("ok\nworld broken is damaged and not served\n"), std::string::npos);
  EXPECT_NE(page("/worlds").find("broken  damaged\n"), std::string::npos);
  const auto listed = support::run_program("pneuma", {"--server", server_->tcp_address(), "worlds"});
  EXPECT_NE(listed.output.find("damaged"), std::string::npos) << listed.output;

  client::Client client = connect();
  ASSERT_TRUE(client.destroy_world("broken").ok());
  EXPECT_TRUE(files("broken", "").empty());
  EXPECT_EQ(client.destroy_world("broken").status().code(), base::StatusCode::not_found);
  EXPECT_NE(page("/metrics").find("pneuma_worlds_damaged 0"), std::string::npos);
  EXPECT_TRUE(client.create_builtin("bouncing-ball", "broken", true).ok());
}

TEST_F(ServerDisk, ASceneDoesNotReplaceTheWorldOfItsNameThatCannotBeRead) {
  start();
  {
    client::Client client = connect();
    make_world(client, "bouncing-ball");
  }
  server_->kill();
  const auto checkpoints = files("bouncing-ball", "checkpoint-");
  for (const fs::path& checkpoint : checkpoints) damage(checkpoint);
  start({"--scene", "bouncing-ball", "--scene", "five-balls"});
  client::Client client = connect();
  const auto worlds = client.list_worlds();
  ASSERT_TRUE(worlds.ok());
  ASSERT_EQ(worlds->worlds_size(), 2);
  EXPECT_TRUE(worlds->worlds(0).damaged());
  EXPECT_EQ(worlds->worlds(1).name(), "five-balls");
  EXPECT_EQ(files("bouncing-ball", "checkpoint-"), checkpoints);
}

// The world's folder is swapped for a file: every write to it fails from then on, as on a disk that is gone.
TEST_F(ServerDisk, AFailingDiskIsReportedAndTheWorldGoesOn) {
  start({"--checkpoint-interval-s", "0.05"});
  client::Client client = connect();
  ASSERT_TRUE(client.create_builtin("bouncing-ball", "w").ok());
  ASSERT_TRUE(client.subscribe("w").ok());
  const auto world = std::find_if(fs::recursive_directory_iterator(folder_), fs::recursive_directory_iterator(),
                                  [](const auto& entry) { return entry.path().filename() == "w"; });
  ASSERT_NE(world, fs::recursive_directory_iterator());
  const fs::path place = world->path();
  std::ofstream file;
  for (int i = 0; i < 1'000 && !file.is_open(); ++i) {  // the server may make its folder anew in between
    fs::rename(place, folder_ / std::string("moved-away-").append(std::to_string(i)));
    file.open(place);
  }
  ASSERT_TRUE(file.is_open());

  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (server_->error_output().find("world=w disk:") == std::string::npos) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline) << server_->error_output();
    ASSERT_TRUE(client.next_frame(std::chrono::seconds(1)).ok());
  }
  const auto before = client.stats("w");
  ASSERT_TRUE(before.ok());
  EXPECT_TRUE(push(client, "w").ok());
  for (int frames = 0; frames < 30; ++frames) ASSERT_TRUE(client.next_frame(std::chrono::seconds(5)).ok());
  EXPECT_GT(client.stats("w")->tick(), before->tick());
}

}  // namespace
}  // namespace pneuma
