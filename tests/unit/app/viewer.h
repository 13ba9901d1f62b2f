// A session that takes all that is sent to it, for tests without sockets.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "app/outbox.h"
#include "app/session.h"

namespace pneuma::app {

/// What one session gets of what is sent, in order.
class Viewer {
 public:
  explicit Viewer(net::SessionId id) : session_(std::make_shared<Session>(id)) {}

  [[nodiscard]] const std::shared_ptr<Session>& session() const { return session_; }

  std::vector<std::string> take(const Outbox& outbox) {
    std::vector<std::string> messages;
    for (const auto& item : outbox.items) {
      if (const auto* send = std::get_if<Outbox::Send>(&item); send != nullptr && send->session == session_->id()) {
        messages.push_back(*send->message);
      }
      if (const auto* missing = std::get_if<Outbox::SendTopology>(&item);
          missing != nullptr && missing->session == session_) {
        session_->send_topology(missing->topology.hash, [&] { messages.push_back(*missing->topology.message); });
      }
      const auto* publish = std::get_if<Outbox::Publish>(&item);
      if (publish == nullptr || std::ranges::count(*publish->sessions, session_->id()) == 0) continue;
      const bool delta = publish->frame.delta != nullptr && publish->frame.base_tick == last_tick_;
      EXPECT_TRUE(delta || publish->frame.key != nullptr);
      last_tick_ = publish->frame.tick;
      messages.push_back(delta ? *publish->frame.delta : *publish->frame.key);
    }
    return messages;
  }

 private:
  std::shared_ptr<Session> session_;
  std::optional<std::uint64_t> last_tick_;
};

}  // namespace pneuma::app
