#include "app/saved_world.h"

#include <cstdint>
#include <memory>
#include <utility>

#include "app/message_memory.h"
#include "base/limits.h"

namespace pneuma::app {

namespace {

// Little-endian: u64 version, tick, next grab id, paused, grab count, each grab's id and body; then the scene as
// created, the scene as edited, the physics snapshot. A body or scene or snapshot is a u64 length and that many bytes.
constexpr std::uint64_t version = 3;

void put(std::uint64_t value, std::string& out) {
  for (int shift = 0; shift < 64; shift += 8) out.push_back(static_cast<char>(value >> shift & 0xffU));
}

void put(std::string_view bytes, std::string& out) {
  put(bytes.size(), out);
  out.append(bytes);
}

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  std::uint64_t number() {
    if (rest_.size() < 8) return fail();
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 8; ++i) value |= std::uint64_t{static_cast<unsigned char>(rest_[i])} << (8 * i);
    rest_.remove_prefix(8);
    return value;
  }
  std::string_view bytes() {
    const std::uint64_t size = number();
    if (size > rest_.size()) return fail(), std::string_view();
    const std::string_view out = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return out;
  }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] bool ended() const { return good_ && rest_.empty(); }

 private:
  std::uint64_t fail() {
    good_ = false;
    rest_ = {};
    return 0;
  }

  std::string_view rest_;
  bool good_ = true;
};

std::shared_ptr<const v1::Scene> parse_scene(std::string_view bytes, std::size_t bytes_max) {
  const bool is_limited = bytes_max < std::numeric_limits<std::size_t>::max();
  if (is_limited && !measure_message(bytes, *v1::Scene::descriptor(), {bytes_max, base::message_fields_max}).ok()) {
    return nullptr;
  }
  auto scene = std::make_shared<v1::Scene>();
  if (!scene->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return nullptr;
  return scene;
}

}  // namespace

std::string to_bytes(const SavedWorld& world) {
  std::string out;
  put(version, out);
  put(world.live.tick, out);
  put(world.live.next_grab_id, out);
  put(world.paused ? 1 : 0, out);
  put(world.live.grabs.size(), out);
  for (const auto& [id, body] : world.live.grabs) {
    put(id, out);
    put(body, out);
  }
  put(world.live.created->SerializeAsString(), out);
  put(world.live.edited->SerializeAsString(), out);
  put(world.live.snapshot, out);
  return out;
}

base::Result<SavedWorld> from_bytes(std::string_view bytes, std::size_t scene_bytes_max) {
  Reader reader(bytes);
  if (const auto found = reader.number(); found != version) {
    return base::Status(base::StatusCode::unsupported, "saved by another version of the server");
  }
  SavedWorld world;
  world.live.tick = reader.number();
  world.live.next_grab_id = reader.number();
  world.paused = reader.number() != 0;
  const std::uint64_t grabs = reader.number();
  for (std::uint64_t i = 0; i < grabs && reader.good(); ++i) {
    const std::uint64_t id = reader.number();
    world.live.grabs.emplace(id, reader.bytes());
  }
  world.live.created = parse_scene(reader.bytes(), scene_bytes_max);
  world.live.edited = parse_scene(reader.bytes(), scene_bytes_max);
  world.live.snapshot = reader.bytes();
  if (!reader.ended() || world.live.created == nullptr || world.live.edited == nullptr) {
    return base::Status(base::StatusCode::malformed, "not a saved world, or cut off");
  }
  return world;
}

}  // namespace pneuma::app
