#include "command/commands.h"

#include <array>
#include <cstdio>
#include <filesystem>

#include "command/arguments.h"
#include "command/json.h"
#include "command/telling.h"

namespace pneuma::client {

namespace {

std::string vector_text(const v1::Vec3& v) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "(%.6g, %.6g, %.6g)", v.x(), v.y(), v.z());
  return text.data();
}

template <class Body>
std::string state_text(const Body& body) {
  return body.frozen() ? "frozen" : body.asleep() ? "asleep" : "live";
}

base::Status print_head(Session& session, const v1::Stats& stats) {
  Table table({"world", "tick", "time_s", "state", "rate_hz", "substeps", "integrator", "hash"});
  table.add({stats.world(), std::to_string(stats.tick()), number_text(stats.time_s()),
             stats.paused() ? "paused" : "running", number_text(stats.rate_hz()), std::to_string(stats.substeps()),
             stats.integrator(), hash_text(stats.state_hash())});
  base::Status printed = table.print(session.output);
  if (printed.ok() && !stats.substeps_reason().empty()) printed = session.output.line(stats.substeps_reason());
  if (!printed.ok()) return printed;

  Table pace({"time_ratio", "slipped_s", "step_ms", "step_ms_max", "encode_ms", "due_error_ms_p99", "subscribers",
              "quality_classes", "frame_bytes_s"});
  pace.add({number_text(stats.time_ratio()), number_text(stats.slipped_s()), number_text(stats.step_time_ms()),
            number_text(stats.step_time_max_ms()), number_text(stats.encode_time_ms()),
            number_text(stats.due_error_ms_p99()), std::to_string(stats.subscribers()),
            std::to_string(stats.quality_classes()), number_text(stats.frame_bytes_s())});
  if (base::Status done = session.output.line(""); !done.ok()) return done;
  return pace.print(session.output);
}

base::Status print_bodies(Session& session, const v1::Stats& stats) {
  if (stats.soft_bodies_size() > 0) {
    Table table({"soft body", "vertices", "volume_m3", "area_m2", "pressure_pa", "kinetic_j", "elastic_j", "speed_max",
                 "centre_m", "state"});
    for (const auto& body : stats.soft_bodies()) {
      table.add({body.name(), std::to_string(body.vertices()), number_text(body.volume_m3()),
                 number_text(body.area_m2()), number_text(body.pressure_pa()), number_text(body.kinetic_j()),
                 number_text(body.elastic_j()), number_text(body.max_speed_m_s()), vector_text(body.centre_of_mass()),
                 state_text(body)});
    }
    if (base::Status done = session.output.line(""); !done.ok()) return done;
    if (base::Status done = table.print(session.output); !done.ok()) return done;
  }
  if (stats.rigid_bodies_size() > 0) {
    Table table({"rigid body", "position_m", "velocity_m_s", "state"});
    for (const auto& body : stats.rigid_bodies()) {
      table.add({body.name(), vector_text(body.position()), vector_text(body.velocity()), state_text(body)});
    }
    if (base::Status done = session.output.line(""); !done.ok()) return done;
    if (base::Status done = table.print(session.output); !done.ok()) return done;
  }
  return {};
}

base::Status print_stages(Session& session, const v1::Stats& stats) {
  if (stats.stages_size() == 0) return {};
  Table table({"stage", "time_s", "calls", "bytes"});
  for (const auto& stage : stats.stages()) {
    table.add(
        {stage.name(), number_text(stage.time_s()), std::to_string(stage.calls()), std::to_string(stage.bytes())});
  }
  if (base::Status done = session.output.line(""); !done.ok()) return done;
  return table.print(session.output);
}

}  // namespace

base::Status report(Session& session, const std::string& deed, const base::Result<v1::Done>& done) {
  if (!done.ok()) return done.status();
  if (session.json) return session.output.line(reply_json(*done).text());
  std::string text = deed + " " + done->world() + " at tick " + std::to_string(done->tick());
  if (!done->detail().empty()) text += ": " + done->detail();
  base::Status printed = session.output.line(text);
  for (const v1::MendedMesh& mesh : done->mended()) {
    if (!printed.ok()) break;
    printed = session.output.line("mesh \"" + mesh.mesh() + "\" mended: " + mesh.detail());
  }
  return printed;
}

void tell_damage(const Playback& playback) {
  if (playback.damage().ok()) return;
  std::fprintf(stderr, "pneuma: %s; %llu frames can be played\n", shown(playback.damage().message()).c_str(),
               static_cast<unsigned long long>(playback.index().frames()));
}

std::string world_state(const v1::WorldList::World& world) {
  if (world.damaged()) return "damaged";
  if (world.restoring()) return "restoring";
  std::string state = world.paused() ? "paused" : "running";
  // A server of before slow motion tells none.
  if (world.time_scale() > 0.0 && world.time_scale() != 1.0)
    state.append(" at ").append(number_text(world.time_scale()));
  if (world.frozen_bodies() > 0) state.append(", ").append(std::to_string(world.frozen_bodies())).append(" frozen");
  return state;
}

Style world_style(const v1::WorldList::World& world) {
  return world.damaged() || world.frozen_bodies() > 0 ? Style::red : Style::plain;
}

base::Status list_worlds(Session& session) {
  const auto worlds = session.client.list_worlds();
  if (!worlds.ok()) return worlds.status();
  Table table({"world", "scene", "tick", "time_s", "state", "rate_hz", "soft", "rigid", "vertices", "subscribers"});
  for (const auto& world : worlds->worlds()) {
    if (session.json) {
      if (base::Status done = session.output.line(reply_json(world).text()); !done.ok()) return done;
      continue;
    }
    table.add(
        {world.name(), world.scene_name(), std::to_string(world.tick()), number_text(world.time_s()),
         world_state(world), number_text(world.rate_hz()), std::to_string(world.soft_bodies()),
         std::to_string(world.rigid_bodies()), std::to_string(world.vertices()), std::to_string(world.subscribers())},
        world_style(world));
  }
  return session.json ? base::Status() : table.print(session.output);
}

base::Status create(Session& session, const CreateArguments& arguments) {
  const std::string& source = arguments.source;
  v1::CreateWorld request;
  request.set_name(arguments.name);
  request.set_paused(arguments.paused);
  std::error_code ignored;  // a path that cannot be looked at is no file
  const bool is_path = source.find('/') != std::string::npos || source.ends_with(".json");
  if (source == "-" || is_path || std::filesystem::is_regular_file(source, ignored)) {
    auto text = read_text(source, request_bytes_max(session.client.welcome()));
    if (!text.ok()) return text.status();
    request.set_scene_json(std::move(*text));
  } else {
    request.set_builtin(source);
  }
  const auto created = session.client.create_world(request);
  if (!created.ok() && !session.json && request.has_scene_json()) {
    return in_users_file(created.status(), "create_world.scene_json", shown_name(source));
  }
  if (created.ok() && arguments.name.empty()) note_new_name(session, created->world());
  return report(session, "created", created);
}

base::Status edit(Session& session, const std::string& world, const std::string& file) {
  const auto text = read_text(file, request_bytes_max(session.client.welcome()));
  if (!text.ok()) return text.status();
  const auto edited = session.client.edit_json(world, *text);
  if (!edited.ok() && !session.json) return in_users_file(edited.status(), "edit.edit_json", shown_name(file));
  return report(session, "edited", edited);
}

base::Status stats(Session& session, const std::string& world) {
  const auto stats = session.client.stats(world);
  if (!stats.ok()) return stats.status();
  if (session.json) return session.output.line(reply_json(*stats).text());
  if (base::Status done = print_head(session, *stats); !done.ok()) return done;
  if (base::Status done = print_bodies(session, *stats); !done.ok()) return done;
  return print_stages(session, *stats);
}

base::Status scene(Session& session, const std::string& world) {
  const auto reply = session.client.scene(world);
  if (!reply.ok()) return reply.status();
  const SceneForm form = session.json ? SceneForm::one_line : SceneForm::for_people;
  return session.output.line(scene_json(reply->scene(), form), LineEnds::kept);
}

}  // namespace pneuma::client
