#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "pneuma_client/recording.h"
#include "recording_format.h"

namespace pneuma::client {

namespace {

// What waits in memory before it is handed to the system.
constexpr std::size_t waiting_bytes_max = 256 * 1024;

// The rarest stream has a frame a day; more is no time of ours.
constexpr double frame_interval_max_s = 86'400.0;

base::Status system_failure(const std::string& path) {
  return {base::StatusCode::unavailable, std::strerror(errno), path};
}

}  // namespace

/// Where the frame does not tell it, it follows from any frame before as from its base.
double PlayTime::time_s_of(const v1::Frame& frame) const {
  if (frame.has_time_s() || !tick_ || frame.tick() < *tick_) return frame.time_s();
  return time_s_ + static_cast<double>(frame.tick() - *tick_) * tick_s_;
}

double PlayTime::take(const v1::Frame& frame) {
  const double time_s = time_s_of(frame);
  if (tick_) {
    double step_s = time_s - time_s_;
    if (!(step_s >= 0.0)) {  // back to the start, or no time at all: the ticks go on counting
      step_s = frame.tick() > *tick_ ? static_cast<double>(frame.tick() - *tick_) / world_rate_hz_ : 0.0;
    }
    at_s_ += std::min(step_s, frame_interval_max_s);
  }
  tick_ = frame.tick();
  time_s_ = time_s;
  return at_s_;
}

void PlayTime::start(const v1::Frame& frame, double at_s) {
  tick_ = frame.tick();
  time_s_ = frame.time_s();
  at_s_ = at_s;
}

void RecordingIndexer::take(std::uint64_t offset, const v1::ServerMessage& message) {
  if (message.has_topology()) index_.add_topology_offsets(offset);
  if (message.has_layout()) layout_offset_ = offset;
  if (message.has_applied()) index_.set_commands(index_.commands() + 1);
  if (!message.has_frame()) return;
  const v1::Frame& frame = message.frame();
  const double at_s = play_time_.take(frame);
  if (!frame.has_base_tick()) {
    v1::RecordingIndex::Key& key = *index_.add_keys();
    key.set_offset(offset);
    key.set_layout_offset(layout_offset_);
    key.set_tick(frame.tick());
    key.set_at_s(at_s);
    key.set_frames_before(index_.frames());
  }
  index_.set_frames(index_.frames() + 1);
  index_.set_last_tick(frame.tick());
  index_.set_duration_s(at_s);
}

base::Result<RecordingWriter> RecordingWriter::create(const std::string& path, const v1::RecordingHeader& header,
                                                      IfThere if_there) {
  const int there = if_there == IfThere::refuse ? O_EXCL : O_TRUNC;
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | there, 0644);
  if (file < 0 && errno == EEXIST) {
    return base::Status(base::StatusCode::already_exists, "is there already; --force replaces it", path);
  }
  if (file < 0) return system_failure(path);
  RecordingWriter writer(file, path, header);
  writer.waiting_ = recording_magic;
  base::append_number(writer.waiting_, recording_version);
  append_record(writer.waiting_, RecordKind::header, header.SerializeAsString());
  if (base::Status flushed = writer.flush(); !flushed.ok()) return flushed;
  return writer;
}

RecordingWriter::RecordingWriter(RecordingWriter&& other) noexcept
    : file_(std::exchange(other.file_, -1)),
      path_(std::move(other.path_)),
      indexer_(std::move(other.indexer_)),
      written_(other.written_),
      waiting_(std::move(other.waiting_)) {}

RecordingWriter::~RecordingWriter() {
  if (file_ >= 0) ::close(file_);
}

base::Status RecordingWriter::append(std::string_view bytes, const v1::ServerMessage& message) {
  indexer_.take(this->bytes(), message);
  append_record(waiting_, RecordKind::message, bytes);
  return waiting_.size() < waiting_bytes_max ? base::Status() : flush();
}

base::Status RecordingWriter::flush() {
  std::string_view left = waiting_;
  while (!left.empty()) {
    const std::uint64_t offset = written_ + (waiting_.size() - left.size());
    const ssize_t count = ::pwrite(file_, left.data(), left.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      base::Status failed = system_failure(path_);
      // Without the part of a record that was written; where that fails too, a reader leaves it out.
      [[maybe_unused]] const int ignored = ::ftruncate(file_, static_cast<off_t>(written_));
      return failed;
    }
    left.remove_prefix(static_cast<std::size_t>(count));
  }
  written_ += waiting_.size();
  waiting_.clear();
  return {};
}

base::Status RecordingWriter::finish() {
  if (base::Status flushed = flush(); !flushed.ok()) return flushed;
  append_record(waiting_, RecordKind::index, index().SerializeAsString());
  base::append_number(waiting_, written_);
  waiting_ += recording_index_magic;
  if (base::Status flushed = flush(); !flushed.ok()) return flushed;
  return ::close(std::exchange(file_, -1)) == 0 ? base::Status() : system_failure(path_);
}

}  // namespace pneuma::client
