#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#include "base/limits.h"
#include "pneuma_client/recording.h"
#include "recording_format.h"

namespace pneuma::client {

namespace {

// What seeks and casts count on, whoever wrote the file.
bool is_sound(const v1::RecordingIndex& index, std::uint64_t end) {
  const double duration_s = index.duration_s();
  if (!std::isfinite(duration_s) || duration_s < 0.0) return false;
  double at_s = 0.0;
  std::uint64_t offset = 0;
  for (const v1::RecordingIndex::Key& key : index.keys()) {
    const bool in_order = key.at_s() >= at_s && key.at_s() <= duration_s && key.offset() > offset;
    if (!in_order || key.layout_offset() >= key.offset()) return false;
    at_s = key.at_s();
    offset = key.offset();
  }
  const auto& topologies = index.topology_offsets();
  return offset < end && std::ranges::adjacent_find(topologies, std::greater_equal<>()) == topologies.end();
}

}  // namespace

struct RecordingReader::Raw {
  RecordKind kind;
  std::string bytes;
  std::uint64_t end;  // offset behind it
};

base::Result<RecordingReader> RecordingReader::open(const std::string& path) {
  RecordingReader reader;
  reader.path_ = path;
  reader.file_.reset(std::fopen(path.c_str(), "rbe"));
  if (reader.file_ == nullptr) return base::not_found(std::strerror(errno), path);
  if (::fseeko(reader.file_.get(), 0, SEEK_END) != 0) {
    return base::Status(base::StatusCode::unavailable, std::strerror(errno), path);
  }
  reader.size_ = static_cast<std::uint64_t>(::ftello(reader.file_.get()));
  reader.file_position_ = reader.size_;
  reader.end_ = reader.size_;
  if (base::Status read = reader.read_header(); !read.ok()) return read;
  if (!reader.read_index()) reader.scan();
  reader.rewind();
  return reader;
}

base::Status RecordingReader::damaged(std::uint64_t offset, const std::string& what) const {
  return {base::StatusCode::malformed, what + " at byte " + std::to_string(offset), path_};
}

base::Result<std::string> RecordingReader::read(std::uint64_t offset, std::size_t count) {
  if (offset > end_ || count > end_ - offset) return damaged(offset, "is cut off");
  // Reading on needs no seek, which would throw away what is buffered.
  if (offset != file_position_ && ::fseeko(file_.get(), static_cast<off_t>(offset), SEEK_SET) != 0) {
    return base::Status(base::StatusCode::unavailable, std::strerror(errno), path_);
  }
  std::string bytes(count, '\0');
  if (std::fread(bytes.data(), 1, count, file_.get()) != count) {
    return base::Status(base::StatusCode::unavailable, "cannot be read", path_);
  }
  file_position_ = offset + count;
  return bytes;
}

base::Result<RecordingReader::Raw> RecordingReader::read_record(std::uint64_t offset) {
  const auto prefix = read(offset, record_prefix_bytes);
  if (!prefix.ok()) return prefix.status();
  const auto length = base::number_at<std::uint32_t>(*prefix, 0);
  if (length > record_bytes_max) return damaged(offset, "a record is damaged");
  auto bytes = read(offset + record_prefix_bytes, length);
  if (!bytes.ok()) return damaged(offset, "a record is cut off");
  const std::string_view kind = std::string_view(*prefix).substr(record_prefix_bytes - 1);
  if (base::crc32c(*bytes, base::crc32c(kind)) != base::number_at<std::uint32_t>(*prefix, sizeof(std::uint32_t))) {
    return damaged(offset, "a record is damaged");
  }
  return Raw{static_cast<RecordKind>(kind[0]), std::move(*bytes), offset + record_prefix_bytes + length};
}

base::Status RecordingReader::read_header() {
  const auto preamble = read(0, recording_preamble_bytes);
  if (!preamble.ok() || !preamble->starts_with(recording_magic)) return base::invalid("is no recording", path_);
  const auto version = base::number_at<std::uint32_t>(*preamble, recording_magic.size());
  if (version != recording_version) {
    return {base::StatusCode::unsupported, "is a recording of version " + std::to_string(version), path_};
  }
  const auto raw = read_record(recording_preamble_bytes);
  if (!raw.ok()) return raw.status();
  const bool is_header = raw->kind == RecordKind::header && header_.ParseFromString(raw->bytes);
  const double rate_hz = header_.world_rate_hz();
  if (!is_header || !(rate_hz >= base::rate_hz_min && rate_hz <= base::rate_hz_max) ||
      !(header_.stream().rate_hz() > 0.0 && header_.stream().rate_hz() <= base::rate_hz_max) ||
      !(header_.stream().grid_step_m() > 0.0 && header_.stream().grid_step_m() <= 2.0 * base::max_error_max_m) ||
      !(header_.stream().max_error_m() >= 0.0 && header_.stream().max_error_m() <= base::max_error_max_m)) {
    return damaged(recording_preamble_bytes, "no header that a server would write");
  }
  first_ = raw->end;
  return {};
}

/// False where there is none that can be trusted.
bool RecordingReader::read_index() {
  if (size_ < first_ + recording_trailer_bytes) return false;
  const auto trailer = read(size_ - recording_trailer_bytes, recording_trailer_bytes);
  if (!trailer.ok() || !trailer->ends_with(recording_index_magic)) return false;
  const auto offset = base::number_at<std::uint64_t>(*trailer, 0);
  if (offset < first_ || offset > size_) return false;
  const auto raw = read_record(offset);
  if (!raw.ok() || raw->kind != RecordKind::index || raw->end != size_ - recording_trailer_bytes ||
      !index_.ParseFromString(raw->bytes) || !is_sound(index_, offset)) {
    index_.Clear();
    return false;
  }
  end_ = offset;
  return true;
}

/// Reads all messages for what an index would say.
void RecordingReader::scan() {
  damage_ = damaged(size_, "has no index");
  RecordingIndexer indexer(header_);
  rewind();
  while (true) {
    const auto record = next();
    if (!record.ok()) damage_ = record.status();
    if (!record.ok() || !*record) break;
    indexer.take((*record)->offset, (*record)->message);
  }
  end_ = position_;
  index_ = indexer.index();
}

base::Result<std::optional<RecordingReader::Record>> RecordingReader::next() {
  if (position_ == end_) return std::optional<Record>();
  auto raw = read_record(position_);
  if (!raw.ok()) return raw.status();
  if (raw->kind == RecordKind::index) return std::optional<Record>();  // of a file whose trailer is missing
  Record record{position_, raw->bytes.size(), {}};
  if (raw->kind != RecordKind::message || !record.message.ParseFromString(raw->bytes)) {
    return damaged(position_, "a record is damaged");
  }
  position_ = raw->end;
  return std::optional(std::move(record));
}

}  // namespace pneuma::client
