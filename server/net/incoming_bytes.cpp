#include <utility>

#include "net/transport.h"

namespace pneuma::net {

base::Status IncomingBytes::hold(std::size_t bytes) {
  if (share_.bytes() == 0) share_ = budget_.take_anyway(0);
  if (share_.grow_to(bytes)) return {};
  return {base::StatusCode::limit_exceeded, "the server has no room for more messages now"};
}

ReceivedMessage IncomingBytes::whole(std::string bytes) {
  return {std::move(bytes), std::exchange(share_, base::MemoryBudget::Share())};
}

}  // namespace pneuma::net
