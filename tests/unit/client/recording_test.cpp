// Shows that a recording gives back what was put in, that one cut off at any byte plays up to the cut, that damage is
// named by its byte, and that a seek decodes no more than what lies between two key frames.
#include "pneuma_client/recording.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <google/protobuf/util/message_differencer.h>
#include <sys/resource.h>

#include "pneuma_client/playback.h"
#include "support/temporary_folder.h"
#include "unit/client/recorded.h"

namespace pneuma::client {
namespace {

using google::protobuf::util::MessageDifferencer;

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Ticks of all frames that can be read, in order; where each says that it is where the test's frames are.
std::vector<std::uint64_t> ticks_of(Playback& playback) {
  std::vector<std::uint64_t> ticks;
  while (true) {
    auto recorded = playback.next();
    if (!recorded.ok() || !*recorded) break;
    const auto* frame = std::get_if<RecordedFrame>(&**recorded);
    if (frame == nullptr) continue;
    ticks.push_back(frame->frame.tick);
    EXPECT_DOUBLE_EQ(frame->frame.bodies[0].positions_m[0], 1e-3 * static_cast<double>(frame->frame.tick));
  }
  return ticks;
}

class Recording : public testing::Test {
 protected:
  support::TemporaryFolder folder_;
  std::string path_ = folder_ / "w.pneuma";
};

TEST_F(Recording, GivesBackEveryMessageAndTheHeader) {
  write_recording(path_, 7, 3);
  auto reader = RecordingReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_TRUE(reader->damage().ok());
  EXPECT_TRUE(MessageDifferencer::Equals(reader->header(), recording_header()));
  std::string kinds;
  while (true) {
    const auto record = reader->next();
    ASSERT_TRUE(record.ok()) << record.status().message();
    if (!*record) break;
    const v1::ServerMessage& message = (*record)->message;
    kinds += message.has_topology() ? 't' : message.has_layout() ? 'l' : message.has_applied() ? 'a' : 'f';
  }
  EXPECT_EQ(kinds, "tlffafffff");
  EXPECT_EQ(reader->index().frames(), 7U);
  EXPECT_EQ(reader->index().commands(), 1U);
  EXPECT_EQ(reader->index().last_tick(), 7U);
  EXPECT_DOUBLE_EQ(reader->index().duration_s(), 6.0 / 60.0);
  ASSERT_EQ(reader->index().keys_size(), 3);
  EXPECT_EQ(reader->index().keys(1).tick(), 4U);
  EXPECT_EQ(reader->index().keys(1).frames_before(), 3U);
}

TEST_F(Recording, CutAtAnyByteItPlaysUpToTheCut) {
  write_recording(path_, 7, 3);
  const std::string whole = contents(path_);
  auto reader = RecordingReader::open(path_);
  ASSERT_TRUE(reader.ok());
  std::vector<std::uint64_t> frame_ends;  // behind each frame's record
  while (true) {
    const auto record = reader->next();
    ASSERT_TRUE(record.ok());
    if (!*record) break;
    if ((*record)->message.has_frame()) frame_ends.push_back(reader->position());
  }
  ASSERT_EQ(frame_ends.size(), 7U);
  const std::string cut_path = folder_ / "cut.pneuma";
  bool header_was_cut = false;
  for (std::size_t bytes = 0; bytes < whole.size(); ++bytes) {
    write(cut_path, whole.substr(0, bytes));
    auto playback = Playback::open(cut_path);
    if (!playback.ok()) {
      EXPECT_TRUE(!header_was_cut || bytes < frame_ends[0]) << bytes;
      header_was_cut = true;
      continue;
    }
    EXPECT_FALSE(playback->damage().ok()) << bytes;
    const auto expected =
        static_cast<std::size_t>(std::ranges::count_if(frame_ends, [&](std::uint64_t end) { return end <= bytes; }));
    EXPECT_EQ(ticks_of(*playback).size(), expected) << bytes;
    EXPECT_EQ(playback->index().frames(), expected) << bytes;
  }
  EXPECT_TRUE(header_was_cut);
}

TEST_F(Recording, TheIndexThatAScanBuildsIsTheOneThatWasWritten) {
  write_recording(path_, 20, 4);
  const auto written = RecordingReader::open(path_);
  ASSERT_TRUE(written.ok());
  const std::string whole = contents(path_);
  write(path_, whole.substr(0, whole.size() - 1));
  const auto scanned = RecordingReader::open(path_);
  ASSERT_TRUE(scanned.ok());
  EXPECT_FALSE(scanned->damage().ok());
  EXPECT_TRUE(MessageDifferencer::Equals(written->index(), scanned->index()));
}

TEST_F(Recording, AChangedByteIsNamedByItsRecordAndEndsThePlay) {
  write_recording(path_, 7, 3);
  auto reader = RecordingReader::open(path_);
  ASSERT_TRUE(reader.ok());
  reader->go_to(reader->index().keys(1).offset());
  ASSERT_TRUE(reader->next().ok());
  const std::uint64_t damaged_at = reader->position();  // the frame of tick 5
  std::string bytes = contents(path_);
  bytes[damaged_at + 20] = static_cast<char>(bytes[damaged_at + 20] ^ 1);
  for (const bool with_index : {true, false}) {
    write(path_, with_index ? bytes : bytes.substr(0, bytes.size() - 1));
    auto playback = Playback::open(path_);
    ASSERT_TRUE(playback.ok());
    std::vector<std::uint64_t> ticks = ticks_of(*playback);
    EXPECT_EQ(ticks, (std::vector<std::uint64_t>{1, 2, 3, 4}));
    const base::Status why = with_index ? playback->next().status() : playback->damage();
    EXPECT_NE(why.message().find("byte " + std::to_string(damaged_at)), std::string::npos) << why.message();
  }
}

TEST_F(Recording, NoByteThatIsChangedGoesUnnoticed) {
  write_recording(path_, 4, 2);
  const std::string whole = contents(path_);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    write(path_, bytes);
    auto playback = Playback::open(path_);
    if (!playback.ok() || !playback->damage().ok()) continue;
    while (true) {
      const auto recorded = playback->next();
      if (!recorded.ok()) break;
      ASSERT_TRUE(*recorded) << "byte " << at;
    }
  }
}

TEST_F(Recording, WhatIsNoRecordingIsRefused) {
  EXPECT_EQ(RecordingReader::open(folder_ / "none").status().code(), base::StatusCode::not_found);
  for (const char* text : {"", "PNEUMARC", "a scene, perhaps, or something else"}) {
    write(path_, text);
    const auto reader = RecordingReader::open(path_);
    ASSERT_FALSE(reader.ok());
    EXPECT_EQ(reader.status().where(), path_);
  }
}

TEST_F(Recording, AFileThatIsThereIsReplacedOnlyWhereThatIsMeant) {
  write(path_, "mine");
  const auto refused = RecordingWriter::create(path_, recording_header(), RecordingWriter::IfThere::refuse);
  EXPECT_EQ(refused.status().code(), base::StatusCode::already_exists);
  EXPECT_EQ(contents(path_), "mine");
  write_recording(path_, 1, 1);
  EXPECT_TRUE(RecordingReader::open(path_).ok());
}

// The system refuses what goes past a size, as a full disk does.
TEST_F(Recording, AFullDiskLeavesWholeRecords) {
  auto writer = RecordingWriter::create(path_, recording_header(), RecordingWriter::IfThere::refuse);
  ASSERT_TRUE(writer.ok());
  write_frames(*writer, 10, 5);
  ASSERT_TRUE(writer->flush().ok());
  const std::uint64_t bytes = writer->bytes();
  append(*writer, key_frame(recorded_stream, 11, 11));
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto signal_before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit full = before;
  full.rlim_cur = bytes + 30;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  const base::Status finished = writer->finish();
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, signal_before);
  EXPECT_FALSE(finished.ok());
  EXPECT_EQ(finished.where(), path_);
  EXPECT_EQ(std::filesystem::file_size(path_), bytes);
  auto playback = Playback::open(path_);
  ASSERT_TRUE(playback.ok());
  EXPECT_EQ(ticks_of(*playback).size(), 10U);
}

TEST_F(Recording, ASeekFindsTheLastFrameNotLaterAndDecodesFromOneKeyOn) {
  write_recording(path_, 100, 10);
  auto playback = Playback::open(path_);
  ASSERT_TRUE(playback.ok());
  for (const std::uint64_t tick : {1U, 57U, 60U, 61U, 12U, 100U, 2U}) {
    for (const double later_s : {0.0, 0.01}) {
      const std::uint64_t decoded_before = playback->frames_decoded();
      const double at_s = static_cast<double>(tick - 1) / 60.0 + later_s + 1e-12;
      ASSERT_TRUE(playback->seek(at_s).ok());
      EXPECT_LE(playback->frames_decoded() - decoded_before, 10U);
      auto found = playback->next();
      ASSERT_TRUE(found.ok() && *found);
      const auto& frame = std::get<RecordedFrame>(**found);
      EXPECT_EQ(frame.frame.tick, tick);
      EXPECT_NEAR(frame.at_s, static_cast<double>(tick - 1) / 60.0, 1e-9);
      EXPECT_DOUBLE_EQ(frame.frame.bodies[0].positions_m[0], 1e-3 * static_cast<double>(tick));
      EXPECT_EQ(ticks_of(*playback).size(), 100 - tick) << "it goes on from there";
    }
  }
  ASSERT_TRUE(playback->seek(-1.0).ok());
  EXPECT_EQ(ticks_of(*playback).size(), 100U);
  ASSERT_TRUE(playback->seek(1e9).ok());
  EXPECT_EQ(ticks_of(*playback), std::vector<std::uint64_t>{100});
}

// A reset takes the world's time back to 0, and its ticks on.
TEST_F(Recording, PlayTimeGoesOnOverAReset) {
  auto writer = RecordingWriter::create(path_, recording_header(), RecordingWriter::IfThere::refuse);
  ASSERT_TRUE(writer.ok());
  write_frames(*writer, 30, 10);
  for (std::uint64_t tick = 31; tick <= 40; ++tick) {
    v1::ServerMessage message = key_frame(recorded_stream, tick, static_cast<std::int64_t>(tick));
    message.mutable_frame()->set_time_s(static_cast<double>(tick - 30) / 60.0);
    append(*writer, message);
  }
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_NEAR(writer->index().duration_s(), 39.0 / 60.0, 1e-9);
  auto playback = Playback::open(path_);
  ASSERT_TRUE(playback.ok());
  ASSERT_TRUE(playback->seek(35.0 / 60.0 + 1e-9).ok());
  EXPECT_EQ(ticks_of(*playback).front(), 36U);
}

TEST_F(Recording, ATimeThatIsNoneCountsByItsTicks) {
  PlayTime play_time(recording_header());
  v1::Frame frame;
  for (const double time_s : {5.0, std::nan(""), 1e300, -1e300}) {
    frame.set_tick(frame.tick() + 6);
    frame.set_time_s(time_s);
    const double at_s = play_time.take(frame);
    EXPECT_NEAR(at_s, static_cast<double>(frame.tick() - 6) / 60.0, 1e-9) << time_s;
  }
  frame.set_tick(frame.tick() + 6);
  frame.set_time_s(1e300);
  EXPECT_LT(play_time.take(frame), 1e6) << "nobody waits for it";
}

}  // namespace
}  // namespace pneuma::client
