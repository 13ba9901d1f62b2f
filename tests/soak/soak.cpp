// A server that lives for hours, among clients that come, go, edit and misbehave. Each ten seconds it is noted what the
// server holds and how late its light world is; at the end, whether it held its promises: memory that does not grow,
// descriptors that come back, a light world that is not late, and no good client refused.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <mutex>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>

#include "integration/raw_connection.h"
#include "pneuma_client/client.h"
#include "soak/figures.h"
#include "support/process_memory.h"
#include "support/server_process.h"
#include "support/temporary_folder.h"

namespace pneuma::soak {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr std::chrono::seconds sample_interval{10};
constexpr const char* light_world = "five-balls";
const std::vector<std::string> edited_worlds{"bouncing-ball", "hanging-ball", "wind-cloth"};

/// What all clients know of each other.
struct Shared {
  std::string address;
  std::string http_address;
  std::atomic<bool> is_over = false;
  std::atomic<std::uint64_t> sessions = 0, edits = 0, worlds_made = 0, rudenesses = 0;
  std::mutex mutex;
  std::vector<std::string> faults;  // what a good client was refused

  void check(const base::Status& status, std::string_view what) {
    if (status.ok() || is_over) return;
    const std::lock_guard lock(mutex);
    if (faults.size() < 100) faults.push_back(std::string(what) + ": " + status.message());
  }
};

class Visitor {
 public:
  Visitor(Shared& shared, std::uint64_t seed) : shared_(shared), seed_(seed), random_(seed) {}
  virtual ~Visitor() = default;
  Visitor(const Visitor&) = delete;
  Visitor& operator=(const Visitor&) = delete;

  void live() {
    while (!shared_.is_over) {
      visit();
      ++shared_.sessions;
    }
  }

 protected:
  virtual void visit() = 0;
  [[nodiscard]] std::uint64_t draw(std::uint64_t below) { return random_() % below; }
  [[nodiscard]] const std::string& some_world() { return edited_worlds[draw(edited_worlds.size())]; }
  void rest(std::chrono::milliseconds most) {
    const auto end = Clock::now() + std::chrono::milliseconds(draw(static_cast<std::uint64_t>(most.count())));
    while (!shared_.is_over && Clock::now() < end) std::this_thread::sleep_for(20ms);
  }
  [[nodiscard]] std::optional<client::Client> connect() {
    auto connected = client::Client::connect(shared_.address);
    shared_.check(connected.status(), "connect");
    if (!connected.ok()) return std::nullopt;
    return std::move(*connected);
  }

  Shared& shared_;
  const std::uint64_t seed_;

 private:
  std::mt19937_64 random_;
};

/// Watches a world for a while.
class Watcher final : public Visitor {
  using Visitor::Visitor;
  void visit() override {
    auto client = connect();
    if (!client) return rest(1s);
    client::SubscribeOptions options;
    options.time_layers = draw(2) == 0;
    shared_.check(client->subscribe(draw(2) == 0 ? light_world : some_world(), options).status(), "subscribe");
    for (std::uint64_t frames = 10 + draw(400); frames > 0 && !shared_.is_over; --frames) {
      const auto frame = client->next_frame(5s);
      shared_.check(frame.status(), "frame");
      if (!frame.ok() || !*frame) return;
    }
  }
};

/// Edits, kicks and resets a world that others watch: each its own, or one would resume what another steps.
class Editor final : public Visitor {
  using Visitor::Visitor;
  void visit() override {
    auto client = connect();
    if (!client) return rest(1s);
    for (std::uint64_t edits = 1 + draw(40); edits > 0 && !shared_.is_over; --edits) {
      const std::string& world = edited_worlds[seed_ % edited_worlds.size()];
      v1::SceneEdit edit;
      v1::Impulse kick;
      switch (draw(5)) {
        case 0:
          edit.add_changes()->mutable_set_gravity()->set_y(-1.0 - static_cast<double>(draw(10)));
          shared_.check(client->edit(world, edit).status(), "edit");
          break;
        case 1:
          kick.set_world(world);
          kick.set_body(world == "wind-cloth" ? "cloth" : world == "bouncing-ball" ? "ball" : "low-pressure");
          kick.mutable_impulse()->set_x(0.1 * static_cast<double>(draw(10)));
          shared_.check(client->impulse(kick).status(), "impulse");
          break;
        case 2:
          shared_.check(client->reset(world).status(), "reset");
          break;
        case 3:
          shared_.check(client->pause(world).status(), "pause");
          shared_.check(client->step(world, 1 + static_cast<std::uint32_t>(draw(30))).status(), "step");
          shared_.check(client->resume(world).status(), "resume");
          break;
        default:
          shared_.check(client->snapshot(world).status(), "snapshot");
      }
      ++shared_.edits;
      rest(300ms);
    }
  }
};

/// Makes worlds, some too heavy for their rates, and ends them.
class Maker final : public Visitor {
  using Visitor::Visitor;
  void visit() override {
    auto client = connect();
    if (!client) return rest(1s);
    const std::string name = "made-" + std::to_string(draw(1'000'000));
    const std::array<const char*, 4> scenes{"five-balls", "hand", "ball-pit", "cost-curve"};
    shared_.check(client->create_builtin(scenes[draw(scenes.size())], name).status(), "create");
    ++shared_.worlds_made;
    rest(4s);
    shared_.check(client->destroy_world(name).status(), "destroy");
  }
};

/// Does what no good client does. What it is answered counts for nothing.
class Rude final : public Visitor {
  using Visitor::Visitor;
  void visit() override {
    ++shared_.rudenesses;
    integration::RawConnection raw(draw(8) == 0 ? shared_.http_address : shared_.address, draw(2) == 0 ? 4096 : 0);
    std::string noise(1 + draw(5'000), '\0');
    for (char& byte : noise) byte = static_cast<char>(draw(256));
    switch (draw(5)) {
      case 0:
        (void)raw.send_for(noise, 200ms);
        break;
      case 1:  // half a message, and then nothing
        (void)raw.say_hello();
        (void)raw.send_for(std::string("\0\0\x10\0", 4) + noise.substr(0, 100), 200ms);
        rest(2s);
        break;
      case 2:  // asks and never reads
        (void)raw.say_hello();
        for (std::uint64_t id = 1; id < 300; ++id) {
          v1::ClientMessage message;
          message.set_request_id(id);
          message.mutable_get_scene()->set_world(light_world);
          if (!raw.send_for(integration::RawConnection::envelope(message.SerializeAsString()), 20ms)) break;
        }
        rest(1s);
        break;
      case 3: {  // a stream that it does not read
        (void)raw.say_hello();
        v1::ClientMessage message;
        message.set_request_id(1);
        message.mutable_subscribe()->set_world(light_world);
        (void)raw.send(message);
        rest(5s);
        break;
      }
      default:
        (void)raw.send_for("GET /metrics HTTP/1.1\r\nHost: localhost\r\n" + noise, 200ms);
    }
    rest(300ms);
  }
};

std::size_t descriptors_of(pid_t pid) {
  std::error_code error;
  const std::filesystem::directory_iterator all("/proc/" + std::to_string(pid) + "/fd", error);
  return error ? 0 : static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

int run(std::chrono::minutes length, const std::filesystem::path& csv_file) {
  const support::TemporaryFolder data;
  std::vector<std::string> arguments{"--data-dir", data.path(), "--sync", "second", "--scene", light_world};
  for (const std::string& world : edited_worlds) arguments.insert(arguments.end(), {"--scene", world});
  auto server = support::ServerProcess::start(arguments, 60s, support::ErrorOutput::kept);
  if (!server.ok()) {
    std::fprintf(stderr, "pneuma-soak: %s\n", server.status().message().c_str());
    return 1;
  }
  Shared shared;
  shared.address = server->tcp_address();
  shared.http_address = server->http_address();
  std::vector<std::unique_ptr<Visitor>> visitors;
  for (std::uint64_t i = 0; i < 4; ++i) visitors.push_back(std::make_unique<Watcher>(shared, i));
  for (std::uint64_t i = 0; i < 2; ++i) visitors.push_back(std::make_unique<Editor>(shared, 100 + i));
  visitors.push_back(std::make_unique<Maker>(shared, 200));
  for (std::uint64_t i = 0; i < 3; ++i) visitors.push_back(std::make_unique<Rude>(shared, 300 + i));
  std::vector<std::thread> threads;
  threads.reserve(visitors.size());
  for (const auto& visitor : visitors) threads.emplace_back([&visitor] { visitor->live(); });

  std::vector<Sample> samples;
  std::ofstream csv(csv_file);
  csv << sample_columns << '\n';
  auto watch = client::Client::connect(shared.address);
  const auto start = Clock::now();
  for (auto next = start + sample_interval; next <= start + length; next += sample_interval) {
    std::this_thread::sleep_until(next);
    const auto stats = watch.ok() ? watch->stats(light_world) : base::Result<v1::Stats>(watch.status());
    shared.check(stats.status(), "stats");
    if (!server->is_running() || !stats.ok()) break;
    samples.push_back({.at_s = std::chrono::duration<double>(next - start).count(),
                       .resident_mib = static_cast<double>(support::memory_bytes(server->pid(), "VmRSS:").value_or(0)) /
                                       (1024.0 * 1024.0),
                       .descriptors = static_cast<double>(descriptors_of(server->pid())),
                       .time_ratio = stats->time_ratio(),
                       .late_ms = stats->due_error_ms_p99(),
                       .sessions = static_cast<double>(shared.sessions),
                       .edits = static_cast<double>(shared.edits)});
    csv << csv_line(samples.back()) << std::endl;
  }
  shared.is_over = true;
  for (std::thread& thread : threads) thread.join();
  for (const std::string& fault : shared.faults) std::printf("fault: %s\n", fault.c_str());
  const bool lives = server->is_running();
  const auto status = server->stop();
  std::printf("%llu visits, %llu edits, %llu worlds made, %llu rude ones; exit status %d\n",
              static_cast<unsigned long long>(shared.sessions), static_cast<unsigned long long>(shared.edits),
              static_cast<unsigned long long>(shared.worlds_made), static_cast<unsigned long long>(shared.rudenesses),
              status.ok() ? *status : -1);
  const Verdict verdict = judge(samples);
  std::printf("%s\n", describe(verdict).c_str());
  return lives && status.ok() && *status == 0 && shared.faults.empty() && verdict.holds() ? 0 : 1;
}

}  // namespace
}  // namespace pneuma::soak

int main(int argc, char** argv) {
  CLI::App app{"Keeps a server among good and bad clients for long, and tells whether it held its promises."};
  int minutes = 120;
  std::string csv = "soak.csv";
  app.add_option("--minutes", minutes, "How long")->check(CLI::Range(1, 24 * 60))->capture_default_str();
  app.add_option("--csv", csv, "Where the samples go")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return pneuma::soak::run(std::chrono::minutes(minutes), csv);
}
