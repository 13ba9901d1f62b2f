#include "replay/verification.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "app/replay_log.h"
#include "app/world_file.h"
#include "base/limits.h"

namespace pneuma::replay {

using base::Result;
using base::Status;
using base::StatusCode;

namespace {

Status anything(const v1::Scene& /*source*/, const physics::Scene& /*scene*/) {
  return {};
}

std::string hexadecimal(std::uint64_t hash) {
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "0x%016llx", static_cast<unsigned long long>(hash));
  return text.data();
}

Status replay_history(const v1::WorldFile& file, Verification& verified) {
  auto past = app::open_history(file);
  if (!past.ok()) return past.status();
  std::vector<persist::LogRecord> records;
  for (const v1::WorldFile::Command& command : file.commands()) records.push_back({command.tick(), command.request()});
  app::LiveWorld& live = past->live;
  verified.has_history = true;
  verified.ticks_replayed = file.tick() - std::min(file.tick(), live.tick());
  verified.commands_replayed = records.size();
  if (!records.empty() && records.back().tick > file.tick()) {
    return {StatusCode::malformed, "its history goes past its tick " + std::to_string(file.tick())};
  }
  if (Status failed = app::replay_log(file.world(), records, live, past->paused, anything); !failed.ok()) return failed;
  physics::Workers workers(1);
  while (live.tick() < file.tick()) live.physics().step_tick(workers);
  const std::uint64_t hash = live.physics().state_hash();
  if (live.tick() == file.tick() && hash == file.state_hash()) return {};
  return {StatusCode::failed_precondition,
          "its history leads to another state: replayed from tick " + std::to_string(file.earlier_tick()) +
              " the hash at tick " + std::to_string(live.tick()) + " is " + hexadecimal(hash) + ", saved was " +
              hexadecimal(file.state_hash()) + " (by version " + file.server_version() + ")"};
}

}  // namespace

Result<std::string> read_world_bytes(const std::string& path) {
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  const std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "rb"));
  if (!file) return base::not_found(std::strerror(errno), path);
  std::string bytes;
  std::array<char, 65536> buffer{};
  std::size_t count = 0;
  while ((count = std::fread(buffer.data(), 1, buffer.size(), file.get())) > 0) {
    bytes.append(buffer.data(), count);
    if (bytes.size() > base::world_file_bytes_max) {
      return Status(StatusCode::limit_exceeded,
                    "has more than the " + std::to_string(base::world_file_bytes_max) + " bytes of a world file", path);
    }
  }
  if (std::ferror(file.get()) != 0) return Status(StatusCode::unavailable, std::strerror(errno), path);
  return bytes;
}

Result<Verification> verify_world_file(const std::string& path) {
  const auto bytes = read_world_bytes(path);
  if (!bytes.ok()) return bytes.status();
  const auto file = app::read_world_file(*bytes);
  if (!file.ok()) return file.status().inside(path);
  const auto opened = app::open_world(*file, anything);
  if (!opened.ok()) return opened.status().inside(path);
  Verification verified;
  verified.world = file->world();
  verified.tick = file->tick();
  verified.state_hash = file->state_hash();
  if (file->earlier_state().empty()) return verified;
  if (Status failed = replay_history(*file, verified); !failed.ok()) return failed.inside(path);
  return verified;
}

}  // namespace pneuma::replay
