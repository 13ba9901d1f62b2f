// Shows what a server makes of a disk that failed it: a damaged checkpoint is passed over for the one before and the
// log, a torn log is replayed up to the tear, a world that is damaged in the middle is not served and keeps its name
// and files, and a disk that is full or fails under way stops no world and loses nothing that was acknowledged. The
// server is real; the damage is done to its files, and a disk is full when no file of the server may grow.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/ip/tcp.hpp>
#include <gtest/gtest.h>
#include <sys/resource.h>

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

  static std::string bytes_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
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

  /// No file of the server may grow past so many bytes.
  void limit_files(rlim_t bytes) {
    const rlimit limit{bytes, RLIM_INFINITY};
    ASSERT_EQ(::prlimit(server_->pid(), RLIMIT_FSIZE, &limit, nullptr), 0);
  }

  /// Waits for a page that says so; false where none does within a minute.
  [[nodiscard]] bool page_comes_to_say(const std::string& path, const std::string& words) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (page(path).find(words) == std::string::npos) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return true;
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

// B9 of the list of attacks: a folder's name takes three bytes for a '.', and the world was announced and not kept.
TEST_F(ServerDisk, AWorldWhoseNameNoFolderCanHaveIsRefused) {
  start();
  client::Client client = connect();
  const std::string dots = "w" + std::string(100, '.');
  const auto refused = client.create_builtin("bouncing-ball", dots);
  EXPECT_EQ(refused.status().code(), base::StatusCode::limit_exceeded) << refused.status().message();
  EXPECT_EQ(refused.status().where(), "create_world.name");
  EXPECT_EQ(client.list_worlds()->worlds_size(), 0);
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

// B4 of the list of attacks: 84 of 200 acknowledged edits were gone.
TEST_F(ServerDisk, WhileTheDiskIsFullNothingIsAcknowledgedThatIsNotWritten) {
  start();
  std::uint64_t hash = 0;
  {
    client::Client client = connect();
    make_world(client, "w");
    ASSERT_TRUE(client.create_builtin("hanging-ball", "runs").ok());
    limit_files(fs::file_size(files("w", "log-").back()) + 200);
    std::optional<base::Status> refused;
    for (int i = 0; i < 50 && !refused; ++i) {
      hash = client.stats("w")->state_hash();
      if (const auto done = push(client, "w"); !done.ok()) refused = done.status();
    }
    ASSERT_TRUE(refused) << "200 bytes were enough for 50 pushes";
    EXPECT_EQ(refused->code(), base::StatusCode::unavailable);
    EXPECT_EQ(refused->where(), "impulse");
    EXPECT_NE(refused->what().find("it was not done"), std::string::npos) << refused->message();
    limit_files(0);  // a new log would find room otherwise
    EXPECT_EQ(client.stats("w")->state_hash(), hash) << "it was not done";
    EXPECT_EQ(client.resume("w").status().code(), base::StatusCode::unavailable);
    EXPECT_EQ(client.step("w", 2).status().code(), base::StatusCode::unavailable) << "done, and not kept";
    EXPECT_EQ(client.create_builtin("bouncing-ball", "new").status().code(), base::StatusCode::unavailable);
    EXPECT_EQ(client.stats("new").status().code(), base::StatusCode::not_found);
    const auto before = std::chrono::steady_clock::now();
    for (int i = 0; i < 10; ++i) EXPECT_FALSE(push(client, "w").ok());
    EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(5))
        << "refused at once, not once a second";
    EXPECT_TRUE(page_comes_to_say("/healthz", "503"));
    EXPECT_TRUE(page_comes_to_say("/healthz", "world w cannot be kept: "));
    const auto tick = client.stats("runs")->tick();
    ASSERT_TRUE(client.subscribe("runs").ok());
    while (client.stats("runs")->tick() < tick + 10) ASSERT_TRUE(client.next_frame(std::chrono::seconds(5)).ok());
  }
  server_->kill();
  start();
  client::Client client = connect();
  EXPECT_EQ(client.stats("w")->state_hash(), hash) << "every acknowledged push, and no other";
  EXPECT_FALSE(client.stats("new").ok());
}

TEST_F(ServerDisk, WhenTheDiskHasRoomAgainSoHasTheServer) {
  start({"--checkpoint-interval-s", "0.2"});
  client::Client client = connect();
  make_world(client, "w");
  limit_files(0);
  EXPECT_EQ(push(client, "w").status().code(), base::StatusCode::unavailable);
  EXPECT_EQ(client.create_builtin("bouncing-ball", "new").status().code(), base::StatusCode::unavailable);
  EXPECT_TRUE(page_comes_to_say("/healthz", "cannot be kept"));
  limit_files(RLIM_INFINITY);
  EXPECT_TRUE(page_comes_to_say("/healthz", "200 OK")) << "of itself: nobody asks anything of the world";
  EXPECT_TRUE(push(client, "w").ok());
  EXPECT_TRUE(client.create_builtin("bouncing-ball", "new", true).ok());
  const std::uint64_t hash = client.stats("w")->state_hash();
  server_->kill();
  start();
  EXPECT_EQ(connect().stats("w")->state_hash(), hash);
}

TEST_F(ServerDisk, AnEndThatCouldNotBeKeptIsNoSuccess) {
  start();
  client::Client client = connect();
  make_world(client, "w");
  limit_files(4'096);  // less than a checkpoint, and more than the server has to say on its standard error
  const auto exit_status = server_->stop();
  ASSERT_TRUE(exit_status.ok());
  EXPECT_EQ(*exit_status, 1);
  EXPECT_NE(server_->error_output().find("pneuma-server: world w"), std::string::npos) << server_->error_output();
}

// B5 of the list of attacks: a flipped bit dropped 15 of 144 edits, a deleted log all, without a word.
TEST_F(ServerDisk, ALogThatIsDamagedInTheMiddleIsToldAndComesBackOnRequestAlone) {
  start();
  {
    client::Client client = connect();
    make_world(client, "w");  // a push at tick 5, a note of tick 10
  }
  server_->kill();
  const fs::path log = files("w", "log-").back();
  damage(log);
  const std::string damaged_bytes = bytes_of(log);
  start();
  EXPECT_NE(server_->error_output().find("world=w damaged"), std::string::npos);
  EXPECT_NE(page("/metrics").find("pneuma_damaged_files_total 1"), std::string::npos);
  {
    client::Client client = connect();
    EXPECT_EQ(client.stats("w").status().code(), base::StatusCode::failed_precondition);
    EXPECT_TRUE(client.list_worlds()->worlds(0).damaged());
  }
  EXPECT_EQ(server_->stop().ok(), true);
  EXPECT_EQ(bytes_of(log), damaged_bytes) << "and its files stay as they are";

  start({"--checkpoint-interval-s", "0.05", "--recover", "w", "--commands-per-s", "1e6", "--commands-burst", "1e6"});
  {
    client::Client client = connect();
    const auto stats = client.stats("w");
    ASSERT_TRUE(stats.ok()) << stats.status().message();
    EXPECT_LE(stats->tick(), 5U) << "up to the damage";
    ASSERT_TRUE(push(client, "w").ok());
    // Many checkpoints later the old ones are gone, and what was damaged is not.
    const std::string first = files("w", "checkpoint-").front().filename();
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!files("w", "checkpoint-").empty() && files("w", "checkpoint-").front().filename() == first) {
      ASSERT_LT(std::chrono::steady_clock::now(), deadline);
      const auto stepped = client.step("w", 1);
      ASSERT_TRUE(stepped.ok()) << stepped.status().message();
    }
  }
  const auto aside = files("w", "damaged-log-");
  ASSERT_EQ(aside.size(), 1U);
  EXPECT_EQ(bytes_of(aside.front()), damaged_bytes);
  const std::uint64_t hash = connect().stats("w")->state_hash();
  server_->kill();
  start();
  EXPECT_EQ(connect().stats("w")->state_hash(), hash) << "recovered, it is a world like others";
}

TEST_F(ServerDisk, AMissingLogIsDamage) {
  start();
  {
    client::Client client = connect();
    make_world(client, "w");
  }
  server_->kill();
  fs::remove(files("w", "log-").back());
  start();
  client::Client client = connect();
  EXPECT_EQ(client.stats("w").status().code(), base::StatusCode::failed_precondition);
  EXPECT_NE(server_->error_output().find("is missing"), std::string::npos) << server_->error_output();
  start({"--recover", "w"});
  EXPECT_EQ(connect().stats("w")->tick(), 0U) << "as its checkpoint has it";
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
