// Cases of bad input: numbers that are none, meshes that cannot hold gas.
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>

#include <google/protobuf/util/json_util.h>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "app/request_fields.h"
#include "app/step_goal.h"
#include "app/touch_news.h"
#include "app/world_queries.h"
#include "numerics/extremes/cases.h"
#include "numerics/extremes/run.h"
#include "replay/replayed_world.h"
#include "scene_io/json.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::extremes {
namespace {

using base::Status;
using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

using Names = std::set<std::string>;

bool is_message(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
}

/// The full names of the numbers with a fraction that a message of this kind can hold, however deep.
void collect_numbers(const Descriptor& kind, Names& seen, Names& numbers) {
  if (!seen.insert(std::string(kind.full_name())).second) return;
  for (int i = 0; i < kind.field_count(); ++i) {
    const FieldDescriptor& field = *kind.field(i);
    if (is_message(field)) collect_numbers(*field.message_type(), seen, numbers);
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) numbers.insert(std::string(field.full_name()));
  }
}

/// Puts `value` in the place of each number in turn, calls visit(path, field), and puts the number back.
class Spoiler {
 public:
  using Visit = std::function<void(const std::string& path, const FieldDescriptor& field)>;
  Spoiler(double value, Visit visit) : value_(value), visit_(std::move(visit)) {}

  void spoil(Message& message, const std::string& path) const {
    const Descriptor& kind = *message.GetDescriptor();
    const Reflection& fields = *message.GetReflection();
    for (int i = 0; i < kind.field_count(); ++i) {
      const FieldDescriptor& field = *kind.field(i);
      const std::string name = std::string(path).append(path.empty() ? "" : ".").append(field.name());
      const auto element = [&](int k) { return std::string(name).append("[").append(std::to_string(k)).append("]"); };
      if (is_message(field) && field.is_repeated()) {
        for (int k = 0; k < fields.FieldSize(message, &field); ++k) {
          spoil(*fields.MutableRepeatedMessage(&message, &field, k), element(k));
        }
      } else if (is_message(field)) {
        if (fields.HasField(message, &field)) spoil(*fields.MutableMessage(&message, &field), name);
      } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE && field.is_repeated()) {
        for (int k = 0; k < fields.FieldSize(message, &field); ++k) {
          const double before = fields.GetRepeatedDouble(message, &field, k);
          fields.SetRepeatedDouble(&message, &field, k, value_);
          visit_(element(k), field);
          fields.SetRepeatedDouble(&message, &field, k, before);
        }
      } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
        const bool was_set = fields.HasField(message, &field);
        const double before = fields.GetDouble(message, &field);
        fields.SetDouble(&message, &field, value_);
        visit_(name, field);
        if (was_set) {
          fields.SetDouble(&message, &field, before);
        } else {
          fields.ClearField(&message, &field);
        }
      }
    }
  }

 private:
  double value_;
  Visit visit_;
};

constexpr std::array<double, 3> not_numbers{std::numeric_limits<double>::quiet_NaN(),
                                            std::numeric_limits<double>::infinity(),
                                            -std::numeric_limits<double>::infinity()};

/// By its own path, or by that of the vector that it is a coordinate of.
bool names(const std::string& path, const std::string& field) {
  return path == field || path == field.substr(0, field.rfind('.'));
}

/// What was tried, and the first thing that came out otherwise than it should.
struct Refusals {
  std::size_t count = 0;
  Names visited;
  std::string wrong;

  void expect(const std::string& tried, const Status& status, bool is_named) {
    ++count;
    if (!wrong.empty()) return;
    if (status.ok()) wrong = std::string(tried).append(" is taken");
    if (!status.ok() && !is_named) wrong = std::string(tried).append(" is refused as ").append(status.message());
  }
};

using Take = std::function<Status()>;

void refuse_numbers(Message& message, const std::string& path, const Take& take, Refusals& refusals) {
  for (const double value : not_numbers) {
    const Spoiler spoiler(value, [&](const std::string& where, const FieldDescriptor& field) {
      refusals.visited.insert(std::string(field.full_name()));
      const Status status = take();
      refusals.expect(where, status, names(status.where(), where));
    });
    spoiler.spoil(message, path);
  }
}

std::string json_of(const Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(message, &text, options).ok()) throw std::runtime_error("no JSON");
  return text;
}

/// As protobuf's JSON has it, in quotes; bare, which is no JSON; and as a number past the range.
void refuse_text(Message& message, const std::function<Status(const std::string&)>& parse, Refusals& refusals) {
  const Spoiler spoiler(not_numbers[0], [&](const std::string& where, const FieldDescriptor&) {
    const std::string text = json_of(message);
    const std::string quoted = "\"NaN\"";
    const std::size_t at = text.find(quoted);
    const auto with = [&](const char* word) { return std::string(text).replace(at, quoted.size(), word); };
    for (const char* word : {"\"NaN\"", "\"Infinity\"", "\"-Infinity\"", "1e999", "-1e999"}) {
      const Status status = parse(with(word));
      refusals.expect(std::string(where).append(" as ").append(word), status, names(status.where(), where));
    }
    for (const char* word : {"NaN", "Infinity"}) {
      const Status status = parse(with(word));
      refusals.expect(std::string(where).append(" as ").append(word), status,
                      status.where().starts_with("line 1, column"));
    }
  });
  spoiler.spoil(message, "");
}

v1::SceneEdit load_edit(const std::string& file) {
  std::ifstream stream(scene_path(file));
  std::stringstream text;
  text << stream.rdbuf();
  auto edit = scene_io::parse_edit_json(text.str());
  if (!edit.ok()) throw std::runtime_error(file + ": " + edit.status().message());
  return *edit;
}

/// One message of each kind that carries numbers, but for those that create and subscribe.
std::vector<v1::ClientMessage> changes(const v1::SceneEdit& edit, std::uint64_t grab_id) {
  std::vector<v1::ClientMessage> messages(7);
  *messages[0].mutable_edit()->mutable_edit() = edit;
  v1::Impulse& near = *messages[1].mutable_impulse();
  near.set_body("ball");
  near.mutable_near()->mutable_position()->set_y(2.0);
  near.mutable_near()->set_radius_m(0.1);
  near.mutable_impulse()->set_x(1.0);
  v1::Impulse& ray = *messages[2].mutable_impulse();
  ray.mutable_ray()->mutable_origin()->set_y(2.0);
  ray.mutable_ray()->mutable_origin()->set_x(-2.0);
  ray.mutable_ray()->mutable_direction()->set_x(1.0);
  ray.mutable_ray()->set_radius_m(0.1);
  ray.mutable_impulse()->set_x(1.0);
  v1::Grab& grab = *messages[3].mutable_grab();
  grab.set_body("ball");
  *grab.mutable_near() = near.near();
  grab.mutable_target()->set_y(2.0);
  grab.set_stiffness_n_m(10.0);
  grab.set_damping_n_s_m(0.1);
  v1::Grab& ray_grab = *messages[4].mutable_grab();
  ray_grab.set_body("ball");
  *ray_grab.mutable_ray() = ray.ray();
  ray_grab.mutable_target()->set_y(2.0);
  v1::MoveGrab& move = *messages[5].mutable_move_grab();
  move.set_grab_id(grab_id);
  move.mutable_target()->set_y(2.5);
  v1::SetState::Rigid& placed = *messages[6].mutable_set_state()->add_rigid_bodies();
  placed.set_name("stone");
  placed.mutable_position()->set_y(3.0);
  placed.mutable_orientation()->set_w(1.0);
  placed.mutable_velocity()->set_x(1.0);
  placed.mutable_angular_velocity()->set_z(1.0);
  return messages;
}

std::uint64_t grab_ball(app::LiveWorld& live) {
  v1::ClientMessage message;
  message.mutable_grab()->set_body("ball");
  message.mutable_grab()->set_vertex(0);
  message.mutable_grab()->mutable_target()->set_y(2.5);
  auto effect = live.change(message);
  if (!effect.ok()) throw std::runtime_error(effect.status().message());
  return effect->grabbed->grab_id();
}

app::LiveWorld make_live(const v1::Scene& scene) {
  auto live = app::LiveWorld::create(scene);
  if (!live.ok()) throw std::runtime_error(live.status().message());
  return std::move(*live);
}

void refuse_changes(const v1::Scene& scene, const v1::SceneEdit& edit, Refusals& refusals) {
  app::LiveWorld live = make_live(scene);
  for (v1::ClientMessage& message : changes(edit, grab_ball(live))) {
    const std::uint64_t before = live.physics().state_hash();
    refuse_numbers(message, "", [&] { return live.change(message).status(); }, refusals);
    if (!refusals.wrong.empty()) return;
    if (live.physics().state_hash() != before) refusals.wrong = "a request that was refused changed the world";
    if (const auto good = live.change(message); !good.ok()) refusals.wrong = good.status().message();
  }
}

void refuse_subscriptions(Refusals& refusals) {
  v1::ClientMessage message;
  v1::Subscribe& subscribe = *message.mutable_subscribe();
  app::FrameHub hub([] { return 1U; }, [](std::uint32_t) {});
  const auto session = std::make_shared<app::Session>(1);
  refuse_numbers(message, "", [&] { return hub.subscribe(session, subscribe, 60.0).status(); }, refusals);
}

void refuse_seeks(Refusals& refusals) {
  constexpr double duration_s = 10.0;
  v1::ClientMessage message;
  message.mutable_seek()->set_time_s(1.0);
  if (!replay::check_seek(message.seek(), duration_s).ok()) refusals.wrong = "a seek was refused";
  refuse_numbers(message, "", [&] { return replay::check_seek(message.seek(), duration_s); }, refusals);
}

void refuse_goals(const v1::Scene& scene, Refusals& refusals) {
  const app::LiveWorld live = make_live(scene);
  v1::ClientMessage message;
  v1::StepUntil::Past& past = *message.mutable_step_until()->mutable_past();
  past.set_body("ball");
  past.mutable_normal()->set_y(1.0);
  const auto check = [&] { return app::check_goal(live.physics(), message.step_until()); };
  if (!check().ok()) refusals.wrong = "a goal was refused";
  refuse_numbers(message, "", check, refusals);
}

void refuse_questions(const v1::Scene& scene, Refusals& refusals) {
  const app::LiveWorld live = make_live(scene);
  const physics::World& world = live.physics();
  v1::ClientMessage message;
  const auto refuse = [&](const auto& ask) {
    if (!ask().ok()) refusals.wrong = "a question was refused";
    refuse_numbers(message, "", ask, refusals);
  };
  v1::Raycast::Ray& ray = *message.mutable_raycast()->add_rays();
  ray.mutable_origin()->set_y(1.0);
  ray.mutable_direction()->set_y(-1.0);
  refuse([&] { return app::cast_rays(world, message.raycast()).status(); });
  message.mutable_nearest_point()->add_points()->set_x(1.0);
  refuse([&] { return app::find_nearest(world, message.nearest_point()).status(); });
  message.mutable_bodies_in_box()->mutable_low()->set_x(-1.0);
  message.mutable_bodies_in_box()->mutable_high()->set_x(1.0);
  refuse([&] { return app::find_bodies(world, message.bodies_in_box()).status(); });
  v1::TouchWish& wish = *message.mutable_subscribe()->mutable_touches();
  wish.set_impulse_min_n_s(1.0);
  const auto check = [&] { return app::check_touch_wish(world, wish); };
  if (!check().ok()) refusals.wrong = "a wish was refused";
  refuse_numbers(wish, "subscribe.touches", check, refusals);
}

void refuse_time_scales(Refusals& refusals) {
  v1::ClientMessage message;
  message.mutable_resume()->set_time_scale(1.0);
  if (!app::check_time_scale(message.resume()).ok()) refusals.wrong = "a time scale was refused";
  refuse_numbers(message, "", [&] { return app::check_time_scale(message.resume()); }, refusals);
}

Result run_not_a_number(bool) {
  auto scene = scene_io::load_scene(scene_path("10-not-a-number.json"));
  if (!scene.ok()) throw std::runtime_error(scene.status().message());
  v1::SceneEdit edit = load_edit("10-not-a-number.edit.json");
  Refusals refusals;
  if (const auto good = scene_io::to_physics(*scene); !good.ok()) refusals.wrong = good.status().message();
  refuse_numbers(*scene, "", [&] { return scene_io::to_physics(*scene).status(); }, refusals);
  refuse_text(*scene, [](const std::string& text) { return scene_io::parse_scene_json(text).status(); }, refusals);
  refuse_text(edit, [](const std::string& text) { return scene_io::parse_edit_json(text).status(); }, refusals);
  refuse_changes(*scene, edit, refusals);
  refuse_subscriptions(refusals);
  refuse_seeks(refusals);
  refuse_goals(*scene, refusals);
  refuse_questions(*scene, refusals);
  refuse_time_scales(refusals);

  Names seen;
  Names numbers;
  collect_numbers(*v1::ClientMessage::descriptor(), seen, numbers);
  for (const std::string& name : numbers) {
    if (refusals.wrong.empty() && !refusals.visited.contains(name)) refusals.wrong = name + " was not tried";
  }
  if (!refusals.wrong.empty()) return {false, refusals.wrong};
  return {true, std::to_string(numbers.size())
                    .append(" kinds of number fields, ")
                    .append(std::to_string(refusals.count))
                    .append(" refusals, each by its path")};
}

/// What may be wrong with a mesh, where that is said, and what it takes to mend it.
struct Fault {
  std::string name;
  std::function<void(v1::Mesh::Triangles&)> make;
  std::string where;
  physics::MendReport mended;
};

std::vector<Fault> faults() {
  return {{"a face is missing",
           [](auto& mesh) { mesh.mutable_indices()->Truncate(mesh.indices_size() - 3); },
           "soft_bodies[0].mesh",
           {.holes_closed = 1, .faces_added = 1}},
          {"a face is flipped",
           [](auto& mesh) { mesh.mutable_indices()->SwapElements(0, 1); },
           "meshes[0].triangles",
           {.faces_turned = 1}},
          {"it is inside out",
           [](auto& mesh) {
             for (int i = 0; i < mesh.indices_size(); i += 3) mesh.mutable_indices()->SwapElements(i, i + 1);
           },
           "soft_bodies[0].mesh",
           {.faces_turned = 8}},
          {"faces meet at two vertices of one place",
           [](auto& mesh) {
             *mesh.add_positions() = v1::Vec3(mesh.positions(0));
             mesh.set_indices(0, static_cast<std::uint32_t>(mesh.positions_size() - 1));
           },
           "soft_bodies[0].mesh",
           {.vertices_welded = 1}}};
}

/// What is wrong with the scene mended; empty where it is the octahedron that it was.
std::string wrong_when_mended(const v1::Scene& scene, const physics::MendReport& expected) {
  auto meshes = scene_io::MeshLibrary::build(scene);
  if (!meshes.ok()) return meshes.status().message();
  const auto taken = scene_io::to_physics(scene, *meshes);
  if (!taken.ok()) return taken.status().message();
  if (meshes->mended().size() != 1 || meshes->mended()[0].report != expected) return "another report";
  const physics::Mesh& mesh = *taken->soft_bodies[0].mesh;
  const double volume_m3 = physics::signed_volume_m3(mesh.positions_m, mesh.faces);
  return std::abs(volume_m3 - 4.0 / 3.0) < 1e-12 ? "" : "of another volume";
}

Result run_open_or_flipped(bool) {
  auto good = scene_io::load_scene(scene_path("12-open-or-flipped.json"));
  if (!good.ok()) throw std::runtime_error(good.status().message());
  if (const auto taken = scene_io::to_physics(*good); !taken.ok()) return {false, taken.status().message()};
  int count = 0;
  for (const Fault& fault : faults()) {
    v1::Scene bad = *good;
    fault.make(*bad.mutable_meshes(0)->mutable_triangles());
    const Status status = scene_io::to_physics(bad).status();
    if (status.ok()) return {false, fault.name + ", and it is taken"};
    if (!status.where().starts_with(fault.where)) return {false, fault.name + ", refused as " + status.message()};
    bad.mutable_meshes(0)->mutable_mend();
    const std::string wrong = wrong_when_mended(bad, fault.mended);
    if (!wrong.empty()) return {false, fault.name + ", mended: " + wrong};
    ++count;
  }
  return {true, std::to_string(count).append(" faults refused, and mended to the volume before")};
}

}  // namespace

std::vector<ExtremeCase> input_cases() {
  return {{.number = 10,
           .name = "NaN or infinity anywhere in a scene, an edit or a request",
           .scene = "10-not-a-number.json",
           .criterion = "each refused, by the path of the field or its vector; the world as before",
           .run = run_not_a_number,
           .bullet = nullptr},
          {.number = 12,
           .name = "an open, flipped or unwelded mesh with gas",
           .scene = "12-open-or-flipped.json",
           .criterion = "refused, with the mesh named; mended where that is asked for, with a report",
           .run = run_open_or_flipped,
           .bullet = nullptr}};
}

}  // namespace pneuma::extremes
