// Recordings: the messages of one stream in a file, with an index (WIRE.md, "Recordings"). No sockets here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/status.h"
#include "pneuma/v1/recording.pb.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::client {

/// Where a frame is in a recording's play time: seconds since the first frame. The world's own time goes back with each
/// reset; play time does not.
class PlayTime {
 public:
  explicit PlayTime(const v1::RecordingHeader& header)
      : world_rate_hz_(header.world_rate_hz()), tick_s_(header.stream().tick_s()) {}
  /// Of the stream's next frame.
  double take(const v1::Frame& frame);
  /// Goes on behind a frame of which it is known.
  void start(const v1::Frame& frame, double at_s);

 private:
  [[nodiscard]] double time_s_of(const v1::Frame& frame) const;

  double world_rate_hz_;  // measures a step back to the start
  double tick_s_;
  std::optional<std::uint64_t> tick_;  // of the last frame
  double time_s_ = 0.0;
  double at_s_ = 0.0;
};

/// What the index says of a recording, gathered from its messages in order.
class RecordingIndexer {
 public:
  explicit RecordingIndexer(const v1::RecordingHeader& header) : play_time_(header) {}
  void take(std::uint64_t offset, const v1::ServerMessage& message);
  [[nodiscard]] const v1::RecordingIndex& index() const { return index_; }

 private:
  PlayTime play_time_;
  std::uint64_t layout_offset_ = 0;
  v1::RecordingIndex index_;
};

/// Writes a file. Whatever fails, the file then ends with a whole record, and plays up to there.
class RecordingWriter {
 public:
  enum class IfThere { refuse, replace };
  [[nodiscard]] static base::Result<RecordingWriter> create(const std::string& path, const v1::RecordingHeader& header,
                                                            IfThere if_there);
  RecordingWriter(RecordingWriter&& other) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) = delete;
  ~RecordingWriter();  // without finish(), what was not flushed is lost, and there is no index

  /// `bytes` is the message as it was received.
  [[nodiscard]] base::Status append(std::string_view bytes, const v1::ServerMessage& message);
  /// Hands what was appended to the system.
  [[nodiscard]] base::Status flush();
  /// Flushes, writes the index and closes the file.
  [[nodiscard]] base::Status finish();

  [[nodiscard]] const v1::RecordingIndex& index() const { return indexer_.index(); }
  [[nodiscard]] std::uint64_t bytes() const { return written_ + waiting_.size(); }

 private:
  RecordingWriter(int file, std::string path, const v1::RecordingHeader& header)
      : file_(file), path_(std::move(path)), indexer_(header) {}

  int file_;
  std::string path_;
  RecordingIndexer indexer_;
  std::uint64_t written_ = 0;
  std::string waiting_;  // whole records
};

/// Reads a file's messages from any record on. A file without an index is read through once when it is opened.
class RecordingReader {
 public:
  struct Record {
    std::uint64_t offset = 0;  // of the record, from the file's start
    std::size_t bytes = 0;     // of the message
    v1::ServerMessage message;
  };

  /// Errors name the file, and the byte where it is no recording.
  [[nodiscard]] static base::Result<RecordingReader> open(const std::string& path);

  [[nodiscard]] const v1::RecordingHeader& header() const { return header_; }
  [[nodiscard]] const v1::RecordingIndex& index() const { return index_; }
  /// Where and why the file ends before its end: it was cut off, or is damaged. OK where it is whole.
  [[nodiscard]] const base::Status& damage() const { return damage_; }

  /// The next message; nothing at the end. A damaged record is an error that names its byte.
  [[nodiscard]] base::Result<std::optional<Record>> next();
  /// The record at `offset` is the next one.
  void go_to(std::uint64_t offset) { position_ = offset; }
  /// Where the next one is.
  [[nodiscard]] std::uint64_t position() const { return position_; }
  /// The first message is the next one.
  void rewind() { position_ = first_; }

 private:
  RecordingReader() = default;
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  struct Raw;

  [[nodiscard]] base::Status damaged(std::uint64_t offset, const std::string& what) const;
  [[nodiscard]] base::Result<std::string> read(std::uint64_t offset, std::size_t count);
  [[nodiscard]] base::Result<Raw> read_record(std::uint64_t offset);
  [[nodiscard]] base::Status read_header();
  [[nodiscard]] bool read_index();
  void scan();

  std::unique_ptr<std::FILE, Close> file_;
  std::string path_;
  std::uint64_t size_ = 0;      // of the file
  std::uint64_t end_ = 0;       // of its messages
  std::uint64_t first_ = 0;     // offset of the first message
  std::uint64_t position_ = 0;  // of the next one
  std::uint64_t file_position_ = 0;
  v1::RecordingHeader header_;
  v1::RecordingIndex index_;
  base::Status damage_;
};

}  // namespace pneuma::client
