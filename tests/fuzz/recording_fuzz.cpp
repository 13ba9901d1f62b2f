// No recording may crash who plays it, and it plays the same a second time, from the start and from any time on.
// Input: a byte of flags (the bodies' number; whether the last message is an index), a byte of size a body, then
// messages of class ServerMessage, each behind two bytes of length. They come behind the layout, and have the right
// checksums. Where it begins: the golden vectors (make_seeds.py).
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/byte_order.h"
#include "codec/topology_hash.h"
#include "fuzz/strip.h"
#include "pneuma_client/playback.h"
#include "recording_format.h"

using namespace pneuma;

namespace {

constexpr std::uint32_t stream_id = 1;
constexpr std::size_t messages_max = 64;

/// The file up to where the frames begin.
std::string beginning(const std::vector<std::uint32_t>& sizes) {
  v1::RecordingHeader header;
  header.set_world("w");
  header.set_world_rate_hz(60.0);
  header.mutable_stream()->set_stream_id(stream_id);
  header.mutable_stream()->set_grid_step_m(0.001);
  header.mutable_stream()->set_tick_s(1.0 / 60.0);
  std::string file(client::recording_magic);
  base::append_number(file, client::recording_version);
  client::append_record(file, client::RecordKind::header, header.SerializeAsString());
  v1::ServerMessage layout;
  layout.mutable_layout()->set_stream_id(stream_id);
  layout.mutable_layout()->set_layout_id(1);
  for (const std::uint32_t size : sizes) {
    v1::ServerMessage topology;
    const auto indices = fuzz::strip(size);
    topology.mutable_topology()->set_vertex_count(size);
    topology.mutable_topology()->mutable_indices()->Add(indices.begin(), indices.end());
    topology.mutable_topology()->set_hash(codec::topology_hash(size, indices));
    client::append_record(file, client::RecordKind::message, topology.SerializeAsString());
    layout.mutable_layout()->add_soft_bodies()->set_topology_hash(topology.topology().hash());
  }
  client::append_record(file, client::RecordKind::message, layout.SerializeAsString());
  return file;
}

/// How many of what it holds can be played.
std::size_t play(client::Playback& playback) {
  std::size_t played = 0;
  while (true) {
    const auto next = playback.next();
    if (!next.ok() || !*next) return played;
    ++played;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(bytes), size);
  if (rest.empty()) return 0;
  const auto flags = static_cast<std::uint8_t>(rest[0]);
  const std::size_t count = (flags >> 1U) % 4U;
  if (rest.size() < 1 + count) return 0;
  std::vector<std::uint32_t> sizes;
  for (std::size_t i = 0; i < count; ++i) sizes.push_back(static_cast<std::uint8_t>(rest[1 + i]));
  rest.remove_prefix(1 + count);

  std::string file = beginning(sizes);
  std::vector<std::string_view> messages;
  while (rest.size() >= 2 && messages.size() < messages_max) messages.push_back(fuzz::take_message(rest));
  const bool has_index = (flags & 16U) != 0 && !messages.empty();
  for (std::size_t i = 0; i + (has_index ? 1 : 0) < messages.size(); ++i) {
    client::append_record(file, client::RecordKind::message, messages[i]);
  }
  if (has_index) {
    const std::uint64_t index_at = file.size();
    client::append_record(file, client::RecordKind::index, messages.back());
    base::append_number(file, index_at);
    file += client::recording_index_magic;
  }
  file += rest;

  static const int memory = ::memfd_create("recording", MFD_CLOEXEC);
  static const std::string path = "/proc/self/fd/" + std::to_string(memory);
  if (::ftruncate(memory, 0) != 0 ||
      ::pwrite(memory, file.data(), file.size(), 0) != static_cast<ssize_t>(file.size())) {
    std::abort();
  }
  auto playback = client::Playback::open(path);
  if (!playback.ok()) return 0;
  const std::size_t played = play(*playback);
  for (const double share : {0.0, 0.3, 0.7, 1.0}) {
    if (playback->seek(share * playback->index().duration_s()).ok() && play(*playback) > played) std::abort();
  }
  if (playback->rewind().ok() && play(*playback) != played) std::abort();
  return 0;
}
