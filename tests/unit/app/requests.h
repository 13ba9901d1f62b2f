// Requests as the worlds get them.
#pragma once

#include <memory>
#include <utility>

#include "app/inbox.h"

namespace pneuma::app {

inline Request request_of(std::shared_ptr<Session> session, const v1::ClientMessage& message) {
  return {std::move(session), std::make_shared<const v1::ClientMessage>(message), message.SpaceUsedLong()};
}

}  // namespace pneuma::app
