// Worlds of a server.
#include "pneuma_client/client.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "failure.h"
#include "frame_view.h"
#include "pneuma.h"
#include "requests.h"

struct pneuma_client {
  pneuma::client::Client connection;
  pneuma::client::DecodedFrame frame = {};  // whose faces the view shows
  pneuma::c::FrameView view = {};
};

namespace pneuma::c {

namespace {

using base::Status;
using std::chrono::milliseconds;

// A step lasts as long as what it simulates.
constexpr milliseconds request_timeout = std::chrono::minutes(10);
constexpr double timeout_max_s = 86'400.0;

void look_at(const client::DecodedFrame& frame, FrameView& view) {
  view.begin(frame.world, frame.tick, frame.time_s);
  for (const client::SoftBodyFrame& body : frame.bodies) {
    view.add_soft_body(body.name, body.positions_m, body.velocities_m_s, body.topology->indices);
  }
  for (const client::SolidFrame& solid : frame.solids) {
    view.add_solid(solid.name, solid.dynamic, {solid.position.x(), solid.position.y(), solid.position.z()},
                   {solid.orientation.w(), solid.orientation.x(), solid.orientation.y(), solid.orientation.z()});
  }
}

base::Status no_client() {
  return base::invalid("is NULL", "client");
}

}  // namespace

}  // namespace pneuma::c

extern "C" {

pneuma_client* pneuma_client_connect(const char* address, const pneuma_connection* options, pneuma_error* error) {
  pneuma_client* client = nullptr;
  pneuma::c::guarded(error, [&]() -> pneuma::base::Status {
    if (address == nullptr) return pneuma::base::invalid("is NULL", "address");
    pneuma::client::ConnectOptions wanted;
    wanted.client_name = "pneuma C";
    if (options != nullptr) {
      wanted.tls = options->tls != 0;
      if (options->token != nullptr) wanted.token = options->token;
      if (options->ca_file != nullptr) wanted.ca_file = options->ca_file;
    }
    auto connected = pneuma::client::Client::connect(address, wanted);
    if (!connected.ok()) return connected.status();
    client = new pneuma_client{std::move(*connected)};
    return {};
  });
  return client;
}

void pneuma_client_close(pneuma_client* client) {
  delete client;
}

pneuma_code pneuma_client_request(pneuma_client* client, const char* request, char** reply, pneuma_error* error) {
  return pneuma::c::guarded(error, [&]() -> pneuma::base::Status {
    if (client == nullptr) return pneuma::c::no_client();
    auto asked = pneuma::c::parse_request(request);
    if (!asked.ok()) return asked.status();
    if (asked->has_subscribe() || asked->has_hello()) {
      return pneuma::base::invalid("pneuma_client_watch and pneuma_client_connect ask for it", "request");
    }
    auto answer = client->connection.call(std::move(*asked), pneuma::c::request_timeout);
    if (!answer.ok()) return answer.status();
    return pneuma::c::tell_reply(std::move(*answer), reply);
  });
}

pneuma_code pneuma_client_watch(pneuma_client* client, const char* world, const pneuma_stream* options,
                                pneuma_error* error) {
  return pneuma::c::guarded(error, [&]() -> pneuma::base::Status {
    if (client == nullptr) return pneuma::c::no_client();
    if (world == nullptr) return pneuma::base::invalid("is NULL", "world");
    pneuma::client::SubscribeOptions wanted;
    if (options != nullptr) {
      wanted.rate_hz = options->rate_hz;
      wanted.max_error_m = options->max_error_m;
      wanted.level_of_detail = options->level_of_detail;
      wanted.velocities = options->velocities != 0;
    }
    return client->connection.subscribe(world, wanted).status();
  });
}

pneuma_code pneuma_client_next(pneuma_client* client, double timeout_s, const pneuma_frame** frame,
                               pneuma_error* error) {
  return pneuma::c::guarded(error, [&]() -> pneuma::base::Status {
    if (frame == nullptr) return pneuma::base::invalid("is NULL", "frame");
    *frame = nullptr;
    if (client == nullptr) return pneuma::c::no_client();
    if (!(timeout_s >= 0.0)) return pneuma::base::invalid("must be 0 or more", "timeout_s");
    const double waited_ms = 1e3 * std::min(timeout_s, pneuma::c::timeout_max_s);
    auto next = client->connection.next_frame(std::chrono::milliseconds(static_cast<std::int64_t>(waited_ms)));
    if (!next.ok()) return next.status();
    if (!*next) return {};
    client->frame = std::move(**next);
    pneuma::c::look_at(client->frame, client->view);
    *frame = client->view.frame();
    return {};
  });
}

}  // extern "C"
