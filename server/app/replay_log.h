// Takes a world through its log: the same state and the same changes at the same ticks give the same bits.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/live_world.h"
#include "base/status.h"
#include "persist/command_log.h"

namespace pneuma::app {

struct ReplayOptions {
  /// Where to end: after so many ticks, before what was asked for then. None: after the last record.
  std::optional<std::uint64_t> until_tick;
  /// Where it becomes true, the replay ends early, as UNAVAILABLE.
  const std::atomic<bool>* is_over = nullptr;
};

/// `live` is in the state that the first record was written on; `paused` follows pauses and resumes. Fails where a
/// record does not fit. A change that is refused is logged, since it was refused at first, too.
[[nodiscard]] base::Status replay_log(const std::string& world, const std::vector<persist::LogRecord>& records,
                                      LiveWorld& live, bool& paused, const LiveWorld::Admit& admit,
                                      const ReplayOptions& options = {});

}  // namespace pneuma::app
