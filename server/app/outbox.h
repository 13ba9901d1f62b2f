// What a world has to say, collected while it works and handed to the network in one go.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "app/layout.h"
#include "app/protocol.h"
#include "app/session.h"
#include "net/server.h"

namespace pneuma::app {

using SessionIds = std::shared_ptr<const std::vector<net::SessionId>>;

struct Outbox {
  struct Send {
    net::SessionId session;
    net::SharedBytes message;
  };
  /// Sent where the client lacks it.
  struct SendTopology {
    std::shared_ptr<Session> session;
    TopologyMessage topology;
  };
  struct Publish {
    SessionIds sessions;
    net::StreamFrame frame;
  };
  struct ReportOn {
    net::SessionId session;
    std::uint32_t stream_id;
  };
  struct EndStream {
    net::SessionId session;
    std::uint32_t stream_id;
  };
  std::vector<std::variant<Send, SendTopology, Publish, ReportOn, EndStream>> items;  // in order
  std::size_t bytes = 0;  // of the messages to single sessions

  void send(net::SessionId session, const v1::ServerMessage& message) { send(session, serialise(message)); }
  void send(net::SessionId session, net::SharedBytes message) {
    bytes += message->size();
    items.emplace_back(Send{session, std::move(message)});
  }
  void send_topology(std::shared_ptr<Session> session, TopologyMessage topology) {
    items.emplace_back(SendTopology{std::move(session), std::move(topology)});
  }
  void publish(SessionIds sessions, net::StreamFrame frame) {
    items.emplace_back(Publish{std::move(sessions), std::move(frame)});
  }
  void report_on(net::SessionId session, std::uint32_t stream_id) { items.emplace_back(ReportOn{session, stream_id}); }
  void end_stream(net::SessionId session, std::uint32_t stream_id) {
    items.emplace_back(EndStream{session, stream_id});
  }

  /// Empties it into the server's queues.
  void deliver(net::Server& server) {
    for (auto& item : items) {
      if (auto* message = std::get_if<Send>(&item)) server.send(message->session, std::move(message->message));
      if (auto* missing = std::get_if<SendTopology>(&item)) {
        missing->session->send_topology(
            missing->topology.hash, [&] { server.send(missing->session->id(), std::move(missing->topology.message)); });
      }
      if (auto* frame = std::get_if<Publish>(&item))
        server.publish(std::move(frame->sessions), std::move(frame->frame));
      if (auto* reader = std::get_if<ReportOn>(&item)) server.report_on(reader->session, reader->stream_id);
      if (auto* end = std::get_if<EndStream>(&item)) server.end_stream(end->session, end->stream_id);
    }
    items.clear();
    bytes = 0;
  }
};

}  // namespace pneuma::app
