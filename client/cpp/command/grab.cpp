// `pneuma grab`: takes hold of a vertex, moves it along straight lines, and lets go.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "command/arguments.h"
#include "command/commands.h"
#include "command/interrupt.h"
#include "command/json.h"

namespace pneuma::client {

namespace {

using Clock = std::chrono::steady_clock;

// Half of the requests a second that a server takes by default; a hand's motion is smooth at this.
constexpr double moves_hz = 30.0;
constexpr std::chrono::milliseconds frame_patience{10'000};

v1::Vec3 between(const v1::Vec3& from, const v1::Vec3& to, double share) {
  return to_vec3(from.x() + share * (to.x() - from.x()), from.y() + share * (to.y() - from.y()),
                 from.z() + share * (to.z() - from.z()));
}

/// Where the vertex is, by the next frame of its body; nothing where the body has no such vertex.
base::Result<std::optional<v1::Vec3>> position_of(Client& client, const v1::Grab& request) {
  const auto stream = client.subscribe(request.world(), {.bodies = {request.body()}});
  if (!stream.ok()) return stream.status();
  const auto frame = client.next_frame(frame_patience);
  if (!frame.ok()) return frame.status();
  if (!*frame) return base::Status(base::StatusCode::unavailable, "no frame came", request.world());
  if (const auto ended = client.unsubscribe(stream->stream_id()); !ended.ok()) return ended.status();
  const std::size_t first = std::size_t{3} * request.vertex();
  if ((*frame)->bodies.empty()) return std::optional<v1::Vec3>();
  const std::vector<double>& positions_m = (*frame)->bodies.front().positions_m;
  if (first + 2 >= positions_m.size()) return std::optional<v1::Vec3>();
  return std::optional<v1::Vec3>(to_vec3(positions_m[first], positions_m[first + 1], positions_m[first + 2]));
}

/// Whether nobody interrupted before the moment came. Pings are answered meanwhile.
base::Result<bool> wait_until(Client& client, Clock::time_point moment) {
  for (auto now = Clock::now(); now < moment; now = Clock::now()) {
    if (interrupted()) return false;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(moment - now);
    if (const auto update = client.next_update(std::min(left, interrupt_patience)); !update.ok()) {
      return update.status();
    }
  }
  return !interrupted();
}

/// Along all points, each leg in the same time.
base::Status move_along(Client& client, const v1::Grabbed& grabbed, const std::string& world,
                        const std::vector<v1::Vec3>& path, const GrabArguments& arguments) {
  const auto legs = static_cast<double>(path.size() - 1);
  const auto moves = static_cast<std::size_t>(std::max(1.0, std::ceil(arguments.seconds * moves_hz)));
  const auto start = Clock::now();
  const auto at = [&](double seconds) {
    return start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  };
  for (std::size_t i = 1; i <= moves; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(moves);
    const auto goes_on = wait_until(client, at(share * arguments.seconds));
    if (!goes_on.ok()) return goes_on.status();
    if (!*goes_on) return {};
    const auto leg = std::min(static_cast<std::size_t>(share * legs), path.size() - 2);
    const v1::Vec3 target = between(path[leg], path[leg + 1], share * legs - static_cast<double>(leg));
    if (const auto moved = client.move_grab(world, grabbed.grab_id(), target); !moved.ok()) return moved.status();
  }
  const auto held = wait_until(client, at(arguments.seconds + arguments.hold_s));
  return held.ok() ? base::Status() : held.status();
}

}  // namespace

base::Status grab(Session& session, const GrabArguments& arguments) {
  catch_interrupts();
  v1::Grab request = arguments.request;
  std::vector<v1::Vec3> path(1);
  if (request.has_near()) {
    path.front() = request.near().position();
  } else {
    auto position = position_of(session.client, request);
    if (!position.ok()) return position.status();
    if (*position) path.front() = **position;  // otherwise the server says what is wrong with the vertex
  }
  *request.mutable_target() = path.front();
  path.insert(path.end(), arguments.to.begin(), arguments.to.end());
  const auto grabbed = session.client.grab(request);
  if (!grabbed.ok()) return grabbed.status();
  base::Status status =
      session.output.line(session.json ? reply_json(*grabbed).text()
                                       : "holding " + request.world() + " at tick " + std::to_string(grabbed->tick()) +
                                             ": " + grabbed->body() + " vertex " + std::to_string(grabbed->vertex()));
  if (status.ok()) status = move_along(session.client, *grabbed, request.world(), path, arguments);
  if (!status.ok()) return status;
  return report(session, "let go of", session.client.release_grab(request.world(), grabbed->grab_id()));
}

}  // namespace pneuma::client
