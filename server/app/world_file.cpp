#include "app/world_file.h"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <utility>

#include "app/message_memory.h"
#include "app/saved_world.h"
#include "base/byte_order.h"
#include "base/crc32c.h"
#include "base/limits.h"
#include "base/version.h"

namespace pneuma::app {

using base::Result;
using base::Status;
using base::StatusCode;

namespace {

constexpr std::string_view magic = "PNEUMAWF";
constexpr std::uint32_t file_version = 1;
constexpr std::size_t preamble_bytes = magic.size() + 2 * sizeof(std::uint32_t);
// Ten thousand years at the highest rate: no sum of ticks wraps.
constexpr std::uint64_t ticks_max = 1ULL << 48;

/// Of all three: finite, and at most `limit` in size.
bool is_within(const physics::Vec3d& vector, double limit) {
  return vector.allFinite() && vector.cwiseAbs().maxCoeff() <= limit;
}

bool is_turn(const physics::Quatd& turn) {
  return turn.coeffs().allFinite() && std::abs(turn.norm() - 1.0) < 1e-3;
}

bool are_within(const std::vector<double>& numbers, double limit) {
  for (const double number : numbers) {
    if (!(std::abs(number) <= limit)) return false;  // nor one that is none
  }
  return true;
}

bool is_sound_gas(const std::optional<physics::GasState>& gas) {
  if (!gas) return true;
  const auto is_amount = [](double number) { return number >= 0.0 && std::isfinite(number); };
  return is_amount(gas->moles) && is_amount(gas->temperature_ref_k) && is_amount(gas->volume_ref_m3);
}

bool are_soft_bodies_sound(const physics::World& world) {
  // A body past these limits is frozen where it was last within them.
  constexpr double slack = 1.0 + 1e-6;
  std::vector<double> numbers;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    numbers.resize(3 * world.soft_body(i).mesh->positions_m.size());
    world.copy_positions(i, numbers);
    if (!are_within(numbers, base::coordinate_max_m * slack)) return false;
    world.copy_velocities(i, numbers);
    if (!are_within(numbers, base::speed_max_m_s * slack)) return false;
    if (!is_sound_gas(world.gas(i))) return false;
  }
  return true;
}

bool are_solids_sound(const physics::World& world) {
  for (const physics::RigidState& body : world.rigid_bodies()) {
    if (!is_within(body.position, 2.0 * base::coordinate_max_m) || !is_turn(body.orientation)) return false;
    if (!is_within(body.velocity, base::scene_number_max) ||
        !is_within(body.angular_velocity, base::scene_number_max)) {
      return false;
    }
  }
  for (const physics::ColliderState& collider : world.colliders()) {
    if (!is_within(collider.position, base::scene_number_max) || !is_turn(collider.orientation)) return false;
  }
  for (const physics::JointState& joint : world.joints()) {
    for (const physics::Vec3d& point : joint.points_m) {
      if (!is_within(point, base::scene_number_max)) return false;
    }
    if (!is_turn(joint.turn)) return false;
  }
  return true;
}

/// The checkpoint that is damaged is a file of the server's; here it is what somebody handed in.
Status as_argument(const Status& status) {
  if (status.code() != StatusCode::malformed) return status;
  return base::invalid(status.what(), status.where());
}

Result<OpenedWorld> open(const std::string& state, const LiveWorld::Admit& admit) {
  const auto saved = from_bytes(state, base::message_memory_bytes_max);
  if (!saved.ok()) return as_argument(saved.status());
  if (saved->live.tick > ticks_max) return Status(StatusCode::limit_exceeded, "has done more ticks than any world can");
  auto live = LiveWorld::restore(saved->live, admit);
  if (!live.ok()) return as_argument(live.status());
  if (!std::isfinite(live->physics().time_s()) || !are_soft_bodies_sound(live->physics()) ||
      !are_solids_sound(live->physics())) {
    return base::invalid("holds a state that no world can be in");
  }
  return OpenedWorld{std::move(*live), saved->paused};
}

}  // namespace

v1::WorldFile make_world_file(const std::string& world, const WorldMoment& moment,
                              const std::optional<persist::History>& history) {
  v1::WorldFile file;
  file.set_world(world);
  file.set_server_version(std::string(base::version));
  file.set_saved_unix_s(std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
  file.set_tick(moment.world.live.tick);
  file.set_state_hash(moment.state_hash);
  file.set_state(to_bytes(moment.world));
  if (!history) return file;
  v1::WorldFile whole = file;
  whole.set_earlier_tick(history->begin.tick);
  whole.set_earlier_state(history->begin.bytes);
  for (const persist::LogRecord& record : history->records) {
    v1::WorldFile::Command& command = *whole.add_commands();
    command.set_tick(record.tick);
    command.set_request(record.bytes);
  }
  return preamble_bytes + whole.ByteSizeLong() <= base::world_file_bytes_max ? whole : file;
}

Result<std::string> to_bytes(const v1::WorldFile& file) {
  const std::size_t size = preamble_bytes + file.ByteSizeLong();
  if (size > base::world_file_bytes_max) {
    return Status(StatusCode::limit_exceeded, "the world takes " + std::to_string(size) + " bytes as a file; at most " +
                                                  std::to_string(base::world_file_bytes_max));
  }
  const std::string content = file.SerializeAsString();
  std::string bytes(magic);
  base::append_number(bytes, file_version);
  base::append_number(bytes, base::crc32c(content));
  return bytes + content;
}

Result<v1::WorldFile> read_world_file(std::string_view bytes) {
  if (bytes.size() > base::world_file_bytes_max) {
    return Status(StatusCode::limit_exceeded, "has " + std::to_string(bytes.size()) + " bytes; at most " +
                                                  std::to_string(base::world_file_bytes_max));
  }
  if (!bytes.starts_with(magic) || bytes.size() < preamble_bytes) return base::invalid("is no world file");
  if (const auto its = base::number_at<std::uint32_t>(bytes, magic.size()); its != file_version) {
    return Status(StatusCode::unsupported, "is a world file of version " + std::to_string(its) +
                                               "; this program reads version " + std::to_string(file_version));
  }
  const std::string_view content = bytes.substr(preamble_bytes);
  if (base::crc32c(content) != base::number_at<std::uint32_t>(bytes, preamble_bytes - sizeof(std::uint32_t))) {
    return base::invalid("is damaged, or cut off: it does not match its checksum");
  }
  const MessageSize most{base::message_memory_bytes_max, base::message_fields_max};
  if (const auto size = measure_message(content, *v1::WorldFile::descriptor(), most); !size.ok()) return size.status();
  v1::WorldFile file;
  if (!file.ParseFromArray(content.data(), static_cast<int>(content.size()))) {
    return base::invalid("holds no WorldFile");
  }
  return file;
}

Result<OpenedWorld> open_world(const v1::WorldFile& file, const LiveWorld::Admit& admit) {
  auto opened = open(file.state(), admit);
  if (!opened.ok()) return opened;
  if (opened->live.tick() != file.tick() || opened->live.physics().state_hash() != file.state_hash()) {
    return base::invalid("holds another state than it says: the hash differs");
  }
  return opened;
}

Result<OpenedWorld> open_history(const v1::WorldFile& file) {
  auto opened = open(file.earlier_state(), [](const auto&, const auto&) { return Status(); });
  if (opened.ok() && opened->live.tick() != file.earlier_tick()) {
    return base::invalid("its history begins at another tick than it says");
  }
  return opened;
}

}  // namespace pneuma::app
