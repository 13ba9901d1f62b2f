#include "app/config.h"

#include <algorithm>

#include "app/machine_memory.h"

namespace pneuma::app {

// Half for the worlds, seven sixteenths for messages on their way (base/limits.h), and what is left for the server
// itself. The shares of messages are limits, far from what they take at any time.
void fit_to_memory(Config& config) {
  Config::Memory& memory = config.memory;
  if (memory.bytes_max == 0) memory.bytes_max = machine_memory_bytes();
  memory.worlds_bytes_max = memory.bytes_max / 2;
  if (memory.client_bytes_max == 0) memory.client_bytes_max = memory.worlds_bytes_max / 2;
  if (memory.world_bytes_max == 0) memory.world_bytes_max = memory.worlds_bytes_max / 4;
  base::Limits& limits = config.limits;
  limits.queued_bytes_max = std::min(limits.queued_bytes_max, memory.bytes_max / 8);
  limits.received_bytes_max = std::min(limits.received_bytes_max, memory.bytes_max / 16);
  limits.parts_waiting_bytes_max = std::min(limits.parts_waiting_bytes_max, memory.bytes_max / 8);
  limits.requests_memory_bytes_max = std::min(limits.requests_memory_bytes_max, memory.bytes_max / 8);
}

}  // namespace pneuma::app
