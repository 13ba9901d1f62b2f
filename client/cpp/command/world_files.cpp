// Worlds as files, and as they were: `pneuma snapshot`, `restore`, `branch`, `rewind` and `verify`.
#include <cerrno>
#include <cstdio>
#include <cstring>

#include <unistd.h>

#include "command/commands.h"
#include "command/json.h"
#include "command/telling.h"
#include "replay/verification.h"

namespace pneuma::client {

namespace {

/// Under another name first: the file is whole, or it is not there.
base::Status write_whole(const std::string& path, const std::string& bytes) {
  const std::string unfinished = path + ".unfinished";
  const auto failure = [&] {
    base::Status status(base::StatusCode::unavailable, std::string("cannot write: ") + std::strerror(errno), path);
    ::unlink(unfinished.c_str());
    return status;
  };
  std::FILE* file = std::fopen(unfinished.c_str(), "wb");
  if (file == nullptr) return failure();
  const bool is_written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size() && std::fflush(file) == 0 &&
                          ::fsync(::fileno(file)) == 0;
  if (std::fclose(file) != 0 || !is_written) return failure();
  if (std::rename(unfinished.c_str(), path.c_str()) != 0) return failure();
  return {};
}

}  // namespace

base::Status snapshot(Session& session, const SnapshotArguments& arguments) {
  if (!arguments.force && ::access(arguments.file.c_str(), F_OK) == 0) {
    return {base::StatusCode::already_exists, "is there already; --force replaces it", arguments.file};
  }
  const auto taken = session.client.snapshot(arguments.world);
  if (!taken.ok()) return taken.status();
  if (base::Status failed = write_whole(arguments.file, taken->data()); !failed.ok()) return failed;
  if (session.json) {
    JsonObject json;
    json.add("world", arguments.world)
        .add("file", arguments.file)
        .add("tick", taken->tick())
        .add("state_hash", hash_text(taken->state_hash()))
        .add("bytes", taken->bytes_total());
    if (taken->has_history_from_tick()) json.add("history_from_tick", taken->history_from_tick());
    return session.output.line(json.text());
  }
  std::string text = arguments.file + ": " + arguments.world + " at tick " + std::to_string(taken->tick()) + ", " +
                     std::to_string(taken->bytes_total()) + " bytes, ";
  text +=
      taken->has_history_from_tick() ? "history from tick " + std::to_string(taken->history_from_tick()) : "no history";
  return session.output.line(text);
}

base::Status restore(Session& session, const RestoreArguments& arguments) {
  v1::RestoreWorld request;
  auto bytes = replay::read_world_bytes(arguments.file);
  if (!bytes.ok()) return bytes.status();
  request.set_snapshot(std::move(*bytes));
  request.set_name(arguments.name);
  request.set_paused(arguments.paused);
  const auto restored = session.client.restore_world(request);
  if (!restored.ok() && !session.json) {
    return in_users_file(restored.status(), "restore_world.snapshot", arguments.file);
  }
  if (restored.ok() && arguments.name.empty()) note_new_name(session, restored->world());
  return report(session, "restored", restored);
}

base::Status verify(FileSession& session, const std::string& file) {
  const auto verified = replay::verify_world_file(file);
  if (!verified.ok()) return verified.status();
  if (session.json) {
    JsonObject json;
    json.add("file", file)
        .add("world", verified->world)
        .add("tick", verified->tick)
        .add("state_hash", hash_text(verified->state_hash))
        .add("has_history", verified->has_history)
        .add("ticks_replayed", verified->ticks_replayed)
        .add("commands_replayed", verified->commands_replayed);
    return session.output.line(json.text());
  }
  std::string text = file + ": " + verified->world + " at tick " + std::to_string(verified->tick) + " has the hash " +
                     hash_text(verified->state_hash);
  if (verified->has_history) {
    text += ", and so has the replay of its " + std::to_string(verified->ticks_replayed) + " ticks and " +
            std::to_string(verified->commands_replayed) + " commands";
  } else {
    text += "; it holds no history to replay";
  }
  return session.output.line(text);
}

}  // namespace pneuma::client
