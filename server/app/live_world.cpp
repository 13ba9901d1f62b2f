#include "app/live_world.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "app/request_fields.h"
#include "app/saved_world.h"
#include "app/world_state.h"
#include "base/limits.h"
#include "scene_io/edit.h"
#include "scene_io/edit_path.h"
#include "scene_io/json.h"
#include "scene_io/translate.h"

namespace pneuma::app {

using base::Result;
using base::Status;

namespace {

// A text that is parsed takes some fifteen times its bytes, which are in no budget: so large ones go one at a time.
Result<v1::SceneEdit> parse_one_at_a_time(const std::string& json) {
  constexpr std::size_t small_bytes = 64 * 1024;
  static std::mutex parsing;
  std::unique_lock lock(parsing, std::defer_lock);
  if (json.size() > small_bytes) lock.lock();
  return scene_io::parse_edit_json(json);
}

Result<LiveWorld::Effect> inside(Result<LiveWorld::Effect> effect, const char* field) {
  if (effect.ok()) return effect;
  return effect.status().inside(field);
}

}  // namespace

Result<LiveWorld::Built> LiveWorld::build(const v1::Scene& scene, const Admit& admit,
                                          const scene_io::MeshLibrary& before) {
  auto meshes = scene_io::MeshLibrary::build(scene, before);
  if (!meshes.ok()) return meshes.status();
  auto checked = scene_io::to_physics(scene, *meshes);
  if (!checked.ok()) return checked.status();
  if (Status no_room = admit(scene, *checked); !no_room.ok()) return no_room;
  auto world = physics::World::create(std::move(*checked));
  if (!world.ok()) return world.status();
  return Built{std::move(*meshes), std::move(*world)};
}

LiveWorld::LiveWorld(SharedScene created, SharedScene edited, Built built)
    : created_(std::move(created)),
      edited_(std::move(edited)),
      meshes_(std::move(built.meshes)),
      world_(std::move(built.world)) {
  world_.set_profiling(true);
}

Result<LiveWorld> LiveWorld::create(v1::Scene scene, const Admit& admit) {
  auto built = build(scene, admit);
  if (!built.ok()) return built.status();
  const auto created = std::make_shared<const v1::Scene>(std::move(scene));
  return LiveWorld(created, created, std::move(*built));
}

Result<LiveWorld> LiveWorld::restore(const Saved& saved, const Admit& admit) {
  auto built = build(*saved.edited, admit);
  if (!built.ok()) return built.status().inside("saved scene");
  if (auto status = built->world.restore(saved.snapshot); !status.ok()) return status.inside("saved state");
  if (saved.tick < built->world.tick()) return base::invalid("is before its state's", "saved tick");
  LiveWorld live(saved.created, saved.edited, std::move(*built));
  live.tick_offset_ = saved.tick - live.world_.tick();
  live.next_grab_id_ = saved.next_grab_id;
  live.grabs_ = saved.grabs;
  return live;
}

LiveWorld::Saved LiveWorld::save() const {
  return {created_, edited_, world_.snapshot(), tick(), next_grab_id_, grabs_};
}

v1::Scene LiveWorld::scene() const {
  return scene_io::to_proto(world_.scene(), *edited_);
}

std::vector<v1::MendedMesh> LiveWorld::mended() const {
  std::vector<v1::MendedMesh> all;
  for (const auto& [mesh, report] : meshes_.mended()) {
    v1::MendedMesh& mended = all.emplace_back();
    mended.set_mesh(mesh);
    mended.set_vertices_welded(static_cast<std::uint32_t>(report.vertices_welded));
    mended.set_vertices_dropped(static_cast<std::uint32_t>(report.vertices_dropped));
    mended.set_faces_dropped(static_cast<std::uint32_t>(report.faces_dropped));
    mended.set_faces_turned(static_cast<std::uint32_t>(report.faces_turned));
    mended.set_holes_closed(static_cast<std::uint32_t>(report.holes_closed));
    mended.set_faces_added(static_cast<std::uint32_t>(report.faces_added));
    mended.set_detail(physics::describe(report));
  }
  return all;
}

bool LiveWorld::is_change(const v1::ClientMessage& request) {
  switch (request.request_case()) {
    case v1::ClientMessage::kEdit:
    case v1::ClientMessage::kImpulse:
    case v1::ClientMessage::kGrab:
    case v1::ClientMessage::kMoveGrab:
    case v1::ClientMessage::kReleaseGrab:
    case v1::ClientMessage::kReset:
    case v1::ClientMessage::kRewindWorld:
    case v1::ClientMessage::kSetState:
      return true;
    default:
      return false;
  }
}

Result<LiveWorld::Effect> LiveWorld::change(const v1::ClientMessage& request, const Admit& admit) {
  switch (request.request_case()) {
    case v1::ClientMessage::kEdit:
      return edit(request.edit(), admit);
    case v1::ClientMessage::kImpulse:
      return impulse(request.impulse());
    case v1::ClientMessage::kGrab:
      return grab(request.grab());
    case v1::ClientMessage::kMoveGrab:
      return move_grab(request.move_grab());
    case v1::ClientMessage::kReleaseGrab:
      return release_grab(request.release_grab());
    case v1::ClientMessage::kReset:
      return reset(admit);
    case v1::ClientMessage::kRewindWorld:
      return rewind(request.rewind_world(), admit);
    case v1::ClientMessage::kSetState:
      return set_state(request.set_state());
    default:
      return Status(base::StatusCode::internal, "not a change");
  }
}

Result<LiveWorld::Effect> LiveWorld::edit(const v1::Edit& request, const Admit& admit) {
  switch (request.source_case()) {
    case v1::Edit::kEditJson: {
      const auto parsed = parse_one_at_a_time(request.edit_json());
      return inside(parsed.ok() ? edit(*parsed, admit) : parsed.status(), "edit.edit_json");
    }
    case v1::Edit::kEdit:
      return inside(edit(request.edit(), admit), "edit.edit");
    case v1::Edit::SOURCE_NOT_SET:
      break;
  }
  return base::invalid("holds no edit", "edit.source");
}

Result<LiveWorld::Effect> LiveWorld::edit(const v1::SceneEdit& edit, const Admit& admit) {
  if (edit.changes().empty()) return base::invalid("holds no change", "changes");
  // An edit starts from the scene as it is now: what it does not name, gas and solids in motion too, goes on.
  auto edited = scene_io::apply_edit(scene(), edit);
  if (!edited.ok()) return edited.status();
  const auto refused = [&](const Status& status) { return scene_io::by_change(status, *edited, edit); };
  auto meshes = scene_io::MeshLibrary::build(*edited, meshes_);
  if (!meshes.ok()) return refused(meshes.status());
  auto built = scene_io::to_physics(*edited, *meshes);
  if (!built.ok()) return refused(built.status());
  if (Status no_room = admit(*edited, *built); !no_room.ok()) return refused(no_room);
  const std::vector<std::string> renewed = scene_io::renewed_bodies(edit);
  if (auto status = world_.apply(std::move(*built), renewed); !status.ok()) return refused(status);
  const auto& bodies = edited->soft_bodies();
  std::erase_if(grabs_, [&](const auto& grab) {
    return std::ranges::find(renewed, grab.second) != renewed.end() ||
           std::ranges::none_of(bodies, [&](const v1::SoftBody& body) { return body.name() == grab.second; });
  });
  edited_ = std::make_shared<const v1::Scene>(std::move(*edited));
  meshes_ = std::move(*meshes);
  Effect effect;
  effect.edited = true;
  effect.mended = mended();
  return effect;
}

Result<LiveWorld::Effect> LiveWorld::impulse(const v1::Impulse& request) {
  const auto at = read_at(request);
  if (!at.ok()) return at.status();
  const auto impulse_n_s = read_vector(request.impulse(), base::impulse_max_n_s, "impulse.impulse");
  if (!impulse_n_s.ok()) return impulse_n_s.status();
  const auto hit = world_.apply_impulse(request.body(), *at, *impulse_n_s);
  if (!hit.ok()) return hit.status().inside("impulse");
  Effect effect;
  effect.detail = hit->body;
  if (hit->vertex) effect.detail += " vertex " + std::to_string(*hit->vertex);
  return effect;
}

Result<LiveWorld::Effect> LiveWorld::set_state(const v1::SetState& request) {
  if (Status wrong = app::set_state(world_, request); !wrong.ok()) return wrong;
  Effect effect;
  effect.edited = true;
  return effect;
}

Result<LiveWorld::Effect> LiveWorld::grab(const v1::Grab& request) {
  if (grabs_.size() >= base::world_grabs_max) {
    return Status(base::StatusCode::limit_exceeded,
                  "the world has its " + std::to_string(base::world_grabs_max) + " grabs already", "grab");
  }
  const auto at = read_at(request);
  if (!at.ok()) return at.status();
  const auto target = read_vector(request.target(), base::coordinate_max_m, "grab.target");
  if (!target.ok()) return target.status();
  if (auto status = check_amount(request.stiffness_n_m(), base::stiffness_max_n_m, "grab.stiffness_n_m");
      !status.ok()) {
    return status;
  }
  if (auto status = check_amount(request.damping_n_s_m(), base::stiffness_max_n_m, "grab.damping_n_s_m");
      !status.ok()) {
    return status;
  }
  if (auto status = check_amount(request.radius_m(), base::coordinate_max_m, "grab.radius_m"); !status.ok()) {
    return status;
  }
  const auto hit = world_.add_grab(next_grab_id_, request.body(), *at,
                                   {.target = *target,
                                    .stiffness_n_m = request.stiffness_n_m(),
                                    .damping_n_s_m = request.damping_n_s_m(),
                                    .radius_m = request.radius_m()});
  if (!hit.ok()) return hit.status().inside("grab");
  grabs_.emplace(next_grab_id_, hit->body);
  Effect effect;
  effect.grabbed.emplace().set_grab_id(next_grab_id_++);
  effect.grabbed->set_body(hit->body);
  effect.grabbed->set_vertex(*hit->vertex);
  return effect;
}

Result<LiveWorld::Effect> LiveWorld::move_grab(const v1::MoveGrab& request) {
  const auto target = read_vector(request.target(), base::coordinate_max_m, "move_grab.target");
  if (!target.ok()) return target.status();
  if (auto status = world_.move_grab(request.grab_id(), *target); !status.ok()) return status.inside("move_grab");
  return Effect{};
}

Result<LiveWorld::Effect> LiveWorld::release_grab(const v1::ReleaseGrab& request) {
  // The engine lets go of a body whose mesh an edit changed; it is still ours to forget.
  const bool known = grabs_.erase(request.grab_id()) > 0;
  const Status status = world_.release_grab(request.grab_id());
  if (!known && !status.ok()) return status.inside("release_grab");
  return Effect{};
}

Result<LiveWorld::Effect> LiveWorld::reset(const Admit& admit) {
  auto built = build(*created_, admit, meshes_);
  if (!built.ok()) return built.status().inside("reset");
  tick_offset_ = tick();
  meshes_ = std::move(built->meshes);
  world_ = std::move(built->world);
  world_.set_profiling(true);
  edited_ = created_;
  grabs_.clear();
  Effect effect;
  effect.edited = true;
  return effect;
}

Result<LiveWorld::Effect> LiveWorld::rewind(const v1::RewindWorld& request, const Admit& admit) {
  const auto saved = from_bytes(request.state());
  if (!saved.ok()) return saved.status().inside("rewind_world.state");
  auto past = restore(saved->live, admit);
  if (!past.ok()) return past.status().inside("rewind_world");
  if (past->world_.tick() > tick()) return base::invalid("is of a later tick", "rewind_world.state");
  // Those who held a body then may be gone.
  for (const auto& [id, body] : past->grabs_) (void)past->world_.release_grab(id);
  past->grabs_.clear();
  past->tick_offset_ = tick() - past->world_.tick();
  past->next_grab_id_ = std::max(past->next_grab_id_, next_grab_id_);
  *this = std::move(*past);
  Effect effect;
  effect.edited = true;
  effect.detail = "as it was at tick " + std::to_string(request.tick());
  return effect;
}

}  // namespace pneuma::app
