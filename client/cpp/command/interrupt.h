// Ctrl-C and SIGTERM as a wish to end, for commands that go on until then.
#pragma once

namespace pneuma::client {

/// From now on the two end nothing by themselves.
void catch_interrupts();
/// One of them came.
[[nodiscard]] bool interrupted();

}  // namespace pneuma::client
