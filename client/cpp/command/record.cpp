// `pneuma record`: a world's stream and the changes made to it, as they come, into a file.
#include <array>
#include <chrono>
#include <cstdio>
#include <optional>
#include <variant>

#include "command/commands.h"
#include "command/interrupt.h"
#include "command/json.h"
#include "command/progress.h"
#include "command/telling.h"
#include "pneuma_client/recording.h"

namespace pneuma::client {

namespace {

using Clock = std::chrono::steady_clock;

// What a crash of this program may lose.
constexpr std::chrono::milliseconds flush_interval{200};

double unix_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

class Record {
 public:
  Record(Session& session, const RecordArguments& arguments)
      : session_(session),
        arguments_(arguments),
        start_(Clock::now()),
        progress_(session.output, Progress::form_for(session.json), start_) {}

  base::Status run();

 private:
  [[nodiscard]] double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  [[nodiscard]] base::Result<v1::RecordingHeader> describe();
  [[nodiscard]] bool is_enough() const;
  [[nodiscard]] base::Status take_updates();
  [[nodiscard]] Progress::State state(const char* type) const;

  Session& session_;
  const RecordArguments& arguments_;
  Clock::time_point start_;
  Progress progress_;
  std::optional<RecordingWriter> writer_;
  base::Status written_;  // the first failure
};

/// Subscribes, too: the header says what the stream is.
base::Result<v1::RecordingHeader> Record::describe() {
  const auto stats = session_.client.stats(arguments_.world);
  if (!stats.ok()) return stats.status();
  auto scene = session_.client.scene(arguments_.world);
  if (!scene.ok()) return scene.status();
  const auto subscribed = session_.client.subscribe(arguments_.world, arguments_.stream);
  if (!subscribed.ok()) return subscribed.status();
  note_rounding(session_, arguments_.stream, *subscribed);
  v1::RecordingHeader header;
  header.set_world(arguments_.world);
  *header.mutable_scene() = std::move(*scene->mutable_scene());
  *header.mutable_stream() = *subscribed;
  header.set_world_rate_hz(stats->rate_hz());
  header.set_started_unix_s(unix_time_s());
  header.set_server_version(session_.client.welcome().server_version());
  return header;
}

bool Record::is_enough() const {
  return interrupted() || (arguments_.frames && writer_->index().frames() >= *arguments_.frames) ||
         (arguments_.seconds && elapsed_s() >= *arguments_.seconds);
}

/// What comes goes into the file by the client's tap.
base::Status Record::take_updates() {
  Clock::time_point flushed = start_;
  while (!is_enough()) {
    const auto update = session_.client.next_update(interrupt_patience);
    if (!written_.ok()) return written_;
    if (!update.ok()) return update.status();
    if (*update && std::holds_alternative<v1::Event>(**update) &&
        std::get<v1::Event>(**update).kind() == v1::Event::WORLD_DESTROYED) {
      return base::not_found("the world was destroyed", arguments_.world);
    }
    const auto now = Clock::now();
    if (now - flushed >= flush_interval) {
      flushed = now;
      if (base::Status done = writer_->flush(); !done.ok()) return done;
    }
    if (progress_.due(now)) {
      if (base::Status shown = progress_.show(now, state("progress")); !shown.ok()) return shown;
    }
  }
  return {};
}

Progress::State Record::state(const char* type) const {
  const v1::RecordingIndex& index = writer_->index();
  Progress::State state;
  if (arguments_.frames) {
    state.fraction = static_cast<double>(index.frames()) / static_cast<double>(*arguments_.frames);
  } else if (arguments_.seconds) {
    state.fraction = elapsed_s() / *arguments_.seconds;
  }
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%.1f s, %llu frames, %.3g MB, %llu commands, %llu gaps", index.duration_s(),
                static_cast<unsigned long long>(index.frames()), 1e-6 * static_cast<double>(writer_->bytes()),
                static_cast<unsigned long long>(index.commands()),
                static_cast<unsigned long long>(session_.client.gaps()));
  state.text = text.data();
  state.json.add("type", type)
      .add("file", arguments_.file)
      .add("duration_s", index.duration_s())
      .add("frames", index.frames())
      .add("bytes", writer_->bytes())
      .add("commands", index.commands())
      .add("gaps", session_.client.gaps());
  return state;
}

base::Status Record::run() {
  const auto header = describe();
  if (!header.ok()) return header.status();
  auto writer =
      RecordingWriter::create(arguments_.file, *header,
                              arguments_.force ? RecordingWriter::IfThere::replace : RecordingWriter::IfThere::refuse);
  if (!writer.ok()) return writer.status();
  writer_.emplace(std::move(*writer));
  session_.client.set_tap([this](std::string_view bytes, const v1::ServerMessage& message) {
    if (written_.ok() && !is_enough()) written_ = writer_->append(bytes, message);
  });
  base::Status status = take_updates();
  session_.client.set_tap({});
  // Whatever ended it: what is there is made whole.
  const base::Status finished = writer_->finish();
  if (status.ok()) status = finished;
  progress_.clear();
  const Progress::State end = state("recording");
  const base::Status told = session_.output.line(session_.json ? end.json.text() : arguments_.file + ": " + end.text);
  return status.ok() ? told : status;
}

}  // namespace

base::Status record(Session& session, const RecordArguments& arguments) {
  catch_interrupts();
  return Record(session, arguments).run();
}

}  // namespace pneuma::client
