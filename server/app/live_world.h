// A scene in motion, and the requests that change it. The same scene and the same requests at the same ticks give the
// same bits: there is no clock, no network and no file in here.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "physics/world.h"
#include "pneuma/v1/session.pb.h"
#include "scene_io/mesh_library.h"

namespace pneuma::app {

class LiveWorld {
 public:
  using Grabs = std::map<std::uint64_t, std::string>;  // by id: the body that is held
  /// Asked before a scene is set up, when its meshes are built: whether there is room for it.
  using Admit = std::function<base::Status(const v1::Scene& source, const physics::Scene& scene)>;

  /// What a change did.
  struct Effect {
    bool edited = false;                 // what the frames speak of, or where it is, may have changed without a step
    std::optional<v1::Grabbed> grabbed;  // its tick left open
    std::string detail;                  // for the reply: what was hit
    std::vector<v1::MendedMesh> mended;  // for the reply: meshes that an edit brought
  };

  /// What it takes to go on somewhere else.
  struct Saved {
    std::shared_ptr<const v1::Scene> created;
    std::shared_ptr<const v1::Scene> edited;
    std::string snapshot;  // physics::World::snapshot
    std::uint64_t tick = 0;
    std::uint64_t next_grab_id = 1;
    Grabs grabs;
  };

  /// Builds the scene. Slow for large meshes.
  [[nodiscard]] static base::Result<LiveWorld> create(v1::Scene scene, const Admit& admit = anything);
  [[nodiscard]] static base::Result<LiveWorld> restore(const Saved& saved, const Admit& admit = anything);
  /// Between two ticks.
  [[nodiscard]] Saved save() const;

  /// True for the requests that change() takes.
  [[nodiscard]] static bool is_change(const v1::ClientMessage& request);
  /// Carries out an edit, impulse, grab, move, release, reset, rewind (whose state is given) or set state, between two
  /// ticks.
  /// Errors name the field from the request's kind on (`edit.edit.changes[2].add_soft_body.mesh`), and nothing has
  /// changed then.
  [[nodiscard]] base::Result<Effect> change(const v1::ClientMessage& request, const Admit& admit = anything);

  [[nodiscard]] physics::World& physics() { return world_; }
  [[nodiscard]] const physics::World& physics() const { return world_; }
  /// Ticks done since the world was created; a reset does not set it back.
  [[nodiscard]] std::uint64_t tick() const { return tick_offset_ + world_.tick(); }
  /// The name of the scene that the world was created from.
  [[nodiscard]] const std::string& scene_name() const { return created_->name(); }
  /// The scene as it is now: edits applied, gas live.
  [[nodiscard]] v1::Scene scene() const;
  [[nodiscard]] const Grabs& grabs() const { return grabs_; }
  /// The meshes that the last scene or edit brought and that asked to be mended.
  [[nodiscard]] std::vector<v1::MendedMesh> mended() const;

 private:
  using SharedScene = std::shared_ptr<const v1::Scene>;
  struct Built {
    scene_io::MeshLibrary meshes;
    physics::World world;
  };
  [[nodiscard]] static base::Status anything(const v1::Scene& /*source*/, const physics::Scene& /*scene*/) {
    return {};
  }
  [[nodiscard]] static base::Result<Built> build(const v1::Scene& scene, const Admit& admit,
                                                 const scene_io::MeshLibrary& before = {});
  LiveWorld(SharedScene created, SharedScene edited, Built built);

  [[nodiscard]] base::Result<Effect> edit(const v1::Edit& request, const Admit& admit);
  [[nodiscard]] base::Result<Effect> edit(const v1::SceneEdit& edit, const Admit& admit);
  [[nodiscard]] base::Result<Effect> impulse(const v1::Impulse& request);
  [[nodiscard]] base::Result<Effect> set_state(const v1::SetState& request);
  [[nodiscard]] base::Result<Effect> grab(const v1::Grab& request);
  [[nodiscard]] base::Result<Effect> move_grab(const v1::MoveGrab& request);
  [[nodiscard]] base::Result<Effect> release_grab(const v1::ReleaseGrab& request);
  [[nodiscard]] base::Result<Effect> reset(const Admit& admit);
  [[nodiscard]] base::Result<Effect> rewind(const v1::RewindWorld& request, const Admit& admit);

  SharedScene created_;
  SharedScene edited_;
  scene_io::MeshLibrary meshes_;  // of the edited scene: an edit builds only what it changes
  physics::World world_;
  std::uint64_t tick_offset_ = 0;  // ticks done before the last reset
  std::uint64_t next_grab_id_ = 1;
  Grabs grabs_;
};

}  // namespace pneuma::app
