// `pneuma watch`: frames as they come, a line each, until there are enough or the user interrupts.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <variant>

#include "command/commands.h"
#include "command/event_lines.h"
#include "command/interrupt.h"
#include "command/json.h"
#include "command/telling.h"
#include "formats/exporter.h"

namespace pneuma::client {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds stats_interval{1};

struct Extent {
  std::array<double, 3> centre{};
  std::array<double, 3> min{};
  std::array<double, 3> max{};
};

/// The mean of the vertices and the box around them.
Extent extent_of(const SoftBodyFrame& body) {
  Extent extent;
  extent.min.fill(std::numeric_limits<double>::infinity());
  extent.max.fill(-std::numeric_limits<double>::infinity());
  const std::size_t vertices = body.positions_m.size() / 3;
  for (std::size_t i = 0; i < body.positions_m.size(); ++i) {
    const std::size_t axis = i % 3;
    const double value = body.positions_m[i];
    extent.centre[axis] += value / static_cast<double>(vertices);
    extent.min[axis] = std::min(extent.min[axis], value);
    extent.max[axis] = std::max(extent.max[axis], value);
  }
  return extent;
}

struct Motion {
  std::array<double, 3> mean_m_s{};
  double fastest_m_s = 0.0;
};

/// Of the vertices.
Motion motion_of(const SoftBodyFrame& body) {
  Motion motion;
  const std::vector<double>& v_m_s = body.velocities_m_s;
  const std::size_t vertices = v_m_s.size() / 3;
  for (std::size_t i = 0; i < v_m_s.size(); i += 3) {
    motion.fastest_m_s = std::max(motion.fastest_m_s, std::hypot(v_m_s[i], v_m_s[i + 1], v_m_s[i + 2]));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      motion.mean_m_s[axis] += v_m_s[i + axis] / static_cast<double>(vertices);
    }
  }
  return motion;
}

std::size_t vertex_count(const DecodedFrame& frame) {
  std::size_t count = 0;
  for (const SoftBodyFrame& body : frame.bodies) count += body.positions_m.size() / 3;
  return count;
}

/// As in "1 frame", "2 frames".
std::string counted(std::uint64_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

std::string frame_text(const DecodedFrame& frame) {
  std::array<char, 96> head{};
  std::snprintf(head.data(), head.size(), "tick %-7llu %9.3f s  %-5s %7zu B",
                static_cast<unsigned long long>(frame.tick), frame.time_s, frame.key ? "key" : "delta", frame.bytes);
  std::string text = head.data();
  for (const SoftBodyFrame& body : frame.bodies) {
    const Extent extent = extent_of(body);
    std::array<char, 96> centre{};
    std::snprintf(centre.data(), centre.size(), " (%.3f, %.3f, %.3f)", extent.centre[0], extent.centre[1],
                  extent.centre[2]);
    text += "  " + body.name + centre.data();
    if (frame.has_velocities) {
      std::array<char, 48> speed{};
      std::snprintf(speed.data(), speed.size(), " up to %.3g m/s", motion_of(body).fastest_m_s);
      text += speed.data();
    }
    if (frame.has_scalars) {
      const BodyScalars& scalars = body.scalars;
      std::array<char, 128> measured{};
      std::snprintf(measured.data(), measured.size(), " %.4g m3 %.4g Pa %.3g J moving %.3g J elastic%s",
                    scalars.volume_m3, scalars.pressure_pa, scalars.kinetic_j, scalars.elastic_j,
                    scalars.asleep ? " asleep" : "");
      text += measured.data();
    }
  }
  if (!frame.contacts.empty()) text += "  " + counted(frame.contacts.size(), "contact");
  return text;
}

std::vector<JsonObject> contacts_json(const DecodedFrame& frame) {
  std::vector<JsonObject> contacts;
  for (const ContactFrame& contact : frame.contacts) {
    JsonObject& object = contacts.emplace_back();
    object.add("body", frame.bodies[contact.body].name).add("vertex", std::uint64_t{contact.vertex});
    if (contact.other_body) object.add("other_body", frame.bodies[*contact.other_body].name);
    if (contact.other_solid) object.add("other_solid", frame.solids[*contact.other_solid].name);
    object.add("normal", contact.normal);
  }
  return contacts;
}

std::string frame_json(const DecodedFrame& frame, bool with_contacts) {
  std::vector<JsonObject> bodies;
  for (const SoftBodyFrame& body : frame.bodies) {
    const Extent extent = extent_of(body);
    JsonObject& object = bodies.emplace_back();
    object.add("name", body.name)
        .add("vertices", std::uint64_t{body.positions_m.size() / 3})
        .add("centre", extent.centre)
        .add("min", extent.min)
        .add("max", extent.max);
    if (frame.has_velocities) {
      const Motion motion = motion_of(body);
      object.add("mean_velocity_m_s", motion.mean_m_s).add("max_speed_m_s", motion.fastest_m_s);
    }
    if (frame.has_scalars) {
      object.add("volume_m3", body.scalars.volume_m3)
          .add("pressure_pa", body.scalars.pressure_pa)
          .add("kinetic_j", body.scalars.kinetic_j)
          .add("elastic_j", body.scalars.elastic_j)
          .add("asleep", body.scalars.asleep);
    }
  }
  std::vector<JsonObject> solids;
  for (const SolidFrame& solid : frame.solids) {
    const std::array<double, 3> position{solid.position.x(), solid.position.y(), solid.position.z()};
    const auto& turn = solid.orientation;
    const std::array<double, 4> orientation{turn.w(), turn.x(), turn.y(), turn.z()};
    solids.emplace_back().add("name", solid.name).add("position", position).add("orientation", orientation);
  }
  JsonObject object;
  object.add("type", "frame")
      .add("tick", frame.tick)
      .add("time_s", frame.time_s)
      .add("key", frame.key)
      .add("bytes", std::uint64_t{frame.bytes})
      .add("bodies", std::span<const JsonObject>(bodies))
      .add("solids", std::span<const JsonObject>(solids));
  if (with_contacts) object.add("contacts", std::span<const JsonObject>(contacts_json(frame)));
  return object.text();
}

base::Status write_objs(const DecodedFrame& frame, const std::string& folder) {
  std::array<char, 40> name{};
  std::snprintf(name.data(), name.size(), "/frame-%09llu.obj", static_cast<unsigned long long>(frame.tick));
  return write_obj(frame.bodies, folder + name.data());
}

class Watch {
 public:
  Watch(Session& session, const WatchArguments& arguments)
      : session_(session), arguments_(arguments), start_(Clock::now()) {}

  base::Status run();

 private:
  [[nodiscard]] double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  [[nodiscard]] bool is_enough() const;
  [[nodiscard]] std::chrono::milliseconds patience() const;
  base::Status take(const DecodedFrame& frame);
  base::Status take(const v1::Gap& gap);
  base::Status take(const v1::Event& event);
  base::Status take(const v1::Applied&) { return {}; }  // not asked for
  base::Status take(const StreamFault& fault);
  base::Status tell_stream(const v1::Subscribed& stream);
  base::Status tell_stats();
  base::Status summarise();

  Session& session_;
  const WatchArguments& arguments_;
  Clock::time_point start_;
  Clock::time_point stats_due_ = start_ + stats_interval;
  std::uint32_t stream_id_ = 0;  // as the server knows it
  std::uint64_t frames_ = 0;
  std::uint64_t gaps_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t vertices_ = 0;  // of all frames together
};

base::Status Watch::run() {
  auto subscribed = session_.client.subscribe(arguments_.world, arguments_.stream);
  if (!subscribed.ok()) return subscribed.status();
  stream_id_ = subscribed->stream_id();
  note_rounding(session_, arguments_.stream, *subscribed);
  base::Status status = tell_stream(*subscribed);
  while (status.ok() && !is_enough()) {
    auto update = session_.client.next_update(patience());
    if (!update.ok()) {
      status = update.status();
    } else if (*update) {
      status = std::visit([this](const auto& one) { return take(one); }, **update);
    }
    if (status.ok() && arguments_.stats && (Clock::now() >= stats_due_ || is_enough())) status = tell_stats();
  }
  if (session_.output.is_closed()) return {};
  const base::Status summarised = summarise();
  return status.ok() ? summarised : status;
}

bool Watch::is_enough() const {
  return interrupted() || (arguments_.frames && frames_ >= *arguments_.frames) ||
         (arguments_.seconds && elapsed_s() >= *arguments_.seconds);
}

/// Short enough to notice an interrupt soon, and the end of the time asked for.
std::chrono::milliseconds Watch::patience() const {
  constexpr double interrupt_s = 0.1;
  const double left_s = arguments_.seconds ? *arguments_.seconds - elapsed_s() : interrupt_s;
  return std::chrono::milliseconds(static_cast<int>(1e3 * std::clamp(left_s, 0.0, interrupt_s)) + 1);
}

base::Status Watch::take(const DecodedFrame& frame) {
  ++frames_;
  bytes_ += frame.bytes;
  vertices_ += vertex_count(frame);
  if (!arguments_.obj_folder.empty()) {
    if (base::Status written = write_objs(frame, arguments_.obj_folder); !written.ok()) return written;
  }
  return session_.output.line(session_.json ? frame_json(frame, arguments_.stream.contacts) : frame_text(frame));
}

base::Status Watch::take(const v1::Gap& gap) {
  ++gaps_;
  if (session_.json) {
    return session_.output.line(
        JsonObject().add("type", "gap").add("from_tick", gap.from_tick()).add("to_tick", gap.to_tick()).text());
  }
  return session_.output.line("gap: ticks " + std::to_string(gap.from_tick()) + " to " + std::to_string(gap.to_tick()) +
                              " were not sent, this reader is too slow");
}

base::Status Watch::take(const v1::Event& event) {
  if (event.kind() == v1::Event::STREAM_REPLACED && event.stream_id() == stream_id_) {
    stream_id_ = event.successor().stream_id();
  }
  const std::string line = session_.json ? event_json(event).text() : "event: " + event_text(event);
  if (base::Status written = session_.output.line(line); !written.ok()) return written;
  if (event.kind() == v1::Event::WORLD_DESTROYED && event.world() == arguments_.world) {
    return base::not_found("the world was destroyed", event.world());
  }
  return {};
}

base::Status Watch::take(const StreamFault& fault) {
  if (session_.json) {
    return session_.output.line(
        JsonObject().add("type", "fault").add("tick", fault.tick).add("what", fault.status.message()).text());
  }
  return session_.output.line("fault: " + fault.status.message() + "; a key frame was asked for");
}

base::Status Watch::tell_stream(const v1::Subscribed& stream) {
  if (session_.json) {
    return session_.output.line(JsonObject().add("type", "subscribed").add("stream", reply_json(stream)).text());
  }
  return session_.output.line(number_text(stream.rate_hz()) + " frames a second, within " +
                              number_text(stream.max_error_m()) + " m");
}

/// The names of those that are stopped for good.
std::vector<std::string> frozen_bodies(const v1::Stats& stats) {
  std::vector<std::string> names;
  for (const auto& body : stats.soft_bodies()) {
    if (body.frozen()) names.push_back(body.name());
  }
  for (const auto& body : stats.rigid_bodies()) {
    if (body.frozen()) names.push_back(body.name());
  }
  return names;
}

base::Status Watch::tell_stats() {
  stats_due_ = Clock::now() + stats_interval;
  const auto stats = session_.client.stats(arguments_.world);
  if (!stats.ok()) return stats.status();
  for (const v1::Stats::Stream& stream : stats->streams()) {
    if (stream.stream_id() != stream_id_) continue;
    const std::vector<std::string> frozen = frozen_bodies(*stats);
    if (session_.json) {
      return session_.output.line(JsonObject()
                                      .add("type", "stats")
                                      .add("stream", reply_json(stream))
                                      .add("frozen", std::span<const std::string>(frozen))
                                      .text());
    }
    std::array<char, 192> text{};
    std::snprintf(text.data(), text.size(),
                  "stats: %llu frames sent, %llu dropped, %.2f bits a vertex, encoded in %.0f us, queued for %.1f ms, "
                  "drains %.0f B/s",
                  static_cast<unsigned long long>(stream.frames_sent()),
                  static_cast<unsigned long long>(stream.frames_dropped()), stream.bits_per_vertex(),
                  stream.encode_time_us(), stream.queue_age_ms(), stream.drain_bytes_s());
    std::string line = text.data();
    for (const std::string& body : frozen) line.append(&body == &frozen.front() ? "; frozen: " : ", ").append(body);
    return session_.output.line(line);
  }
  return {};
}

base::Status Watch::summarise() {
  const double bits = vertices_ == 0 ? 0.0 : 8.0 * static_cast<double>(bytes_) / static_cast<double>(vertices_);
  if (session_.json) {
    return session_.output.line(JsonObject()
                                    .add("type", "summary")
                                    .add("frames", frames_)
                                    .add("gaps", gaps_)
                                    .add("seconds", elapsed_s())
                                    .add("bytes", bytes_)
                                    .add("bits_per_vertex", bits)
                                    .text());
  }
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), ", %.2f s, %.2f bits a vertex", elapsed_s(), bits);
  return session_.output.line(counted(frames_, "frame") + ", " + counted(gaps_, "gap") + text.data());
}

}  // namespace

base::Status watch(Session& session, const WatchArguments& arguments) {
  if (!arguments.obj_folder.empty()) {
    if (base::Status made = make_folder(arguments.obj_folder); !made.ok()) return made;
  }
  catch_interrupts();
  return Watch(session, arguments).run();
}

}  // namespace pneuma::client
