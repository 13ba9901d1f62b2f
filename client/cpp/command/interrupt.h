// Ctrl-C and SIGTERM as a wish to end, for commands that go on until then.
#pragma once

#include <chrono>

namespace pneuma::client {

/// From now on the two end nothing by themselves.
void catch_interrupts();
/// One of them came.
[[nodiscard]] bool interrupted();
/// Who waits looks for one as often as this.
inline constexpr std::chrono::milliseconds interrupt_patience{100};

}  // namespace pneuma::client
