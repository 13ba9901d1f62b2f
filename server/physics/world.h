// A world: a scene in motion. Not thread-safe; whoever steps it owns it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "physics/choice/stability.h"
#include "physics/contact/contact_note.h"
#include "physics/contact/joint.h"
#include "physics/contact/row.h"
#include "physics/forces/measures.h"
#include "physics/machine/profile.h"
#include "physics/machine/workers.h"
#include "physics/scene/scene.h"
#include "physics/state/state.h"

namespace pneuma::physics {

struct Pose {
  Vec3d position = Vec3d::Zero();
  Quatd orientation = Quatd::Identity();
};

/// A body that ran away (NaN, past the speed limit or the coordinate limit) and was stopped where it last was well.
struct FrozenBody {
  std::string name;
  std::string reason;
};

/// A gas that burst its body, or a body whose volume was lost.
struct BodyGasEvent {
  std::string name;
  GasEvent event;
};
/// A joint that took more than it can.
struct BrokenJoint {
  std::string name;
  double break_force_n = 0.0;
};
/// In words: the pressure over the outside and the volume when it happened.
[[nodiscard]] std::string describe(const GasEvent& event);

/// How a request names a point of a body.
struct NearPoint {
  Vec3d position = Vec3d::Zero();
  double radius_m = 0.0;
};
struct RayPoint {
  Vec3d origin = Vec3d::Zero();
  Vec3d direction = Vec3d::UnitX();
  double radius_m = 0.0;
};
struct WholeBody {};
using At = std::variant<WholeBody, std::uint32_t, NearPoint, RayPoint>;  // uint32: a vertex

/// Where a soft body is put: three numbers a vertex, x, y, z in order. What is empty stays.
struct SoftPlacement {
  std::string body;
  std::vector<double> positions_m;
  std::vector<double> velocities_m_s;
};
/// Where a rigid body is put. What is unset stays.
struct RigidPlacement {
  std::string body;
  std::optional<Vec3d> position;
  std::optional<Quatd> orientation;
  std::optional<Vec3d> velocity;
  std::optional<Vec3d> angular_velocity;
};

struct Hit {
  std::string body;
  std::optional<std::uint32_t> vertex;  // the nearest one; none of a rigid body, or where a whole body is meant
};

/// How a hand holds a vertex, or the patch of skin around it: by damped springs that share the stiffness.
struct Hold {
  Vec3d target = Vec3d::Zero();  // of the vertex; what else is held keeps its place beside it
  double stiffness_n_m = 0.0;    // 0: the body's own
  double damping_n_s_m = 0.0;    // 0: critical for the mass of each vertex
  double radius_m = 0.0;         // of the patch, along the skin: the further off, the less is held. 0: the vertex alone
};

class Simulation;

class World {
 public:
  /// Checks the scene (admission.h) and sets its bodies up at tick 0.
  [[nodiscard]] static base::Result<World> create(Scene scene);
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;
  ~World();

  /// Takes over an edited scene: bodies and solids of the same name (and mesh, or shape) go on from their live state,
  /// and what differs between the scene so far and the new one is applied to them. Those named in `renewed` do not go
  /// on: they begin anew as the scene has them, neither frozen nor grabbed. Refuses a bad scene, or another precision,
  /// and changes nothing then.
  [[nodiscard]] base::Status apply(Scene scene, const std::vector<std::string>& renewed = {});
  /// The scene as it is now: edits applied, gas amounts and temperatures, and the solids' motion live.
  [[nodiscard]] Scene scene() const;

  /// Runs a part of the tick under way (the first one begins it): one substep, or about a millisecond of one whose
  /// bodies are solved for, or of the tick where nothing can touch anything. Until it has ended, some bodies may be
  /// ahead of others. True when it ended the tick.
  bool substep(Workers& workers);
  /// Runs a whole tick.
  void step_tick(Workers& workers);

  [[nodiscard]] std::uint64_t tick() const;  // ticks done
  [[nodiscard]] double time_s() const;       // simulated; tick / rate unless the rate was changed
  [[nodiscard]] double tick_period_s() const;
  [[nodiscard]] std::uint32_t substeps() const;              // a tick, as chosen
  [[nodiscard]] Integrator integrator() const;               // the one chosen where the scene leaves it open
  [[nodiscard]] const std::string& substeps_reason() const;  // why these

  [[nodiscard]] const Vec3d& gravity_m_s2() const;
  [[nodiscard]] const Atmosphere& atmosphere() const;
  /// The fastest motions of a soft body at rest, without a gas that it lost; kept, so that they are found once.
  [[nodiscard]] Frequencies frequencies(std::size_t soft_index) const;
  [[nodiscard]] std::size_t soft_body_count() const;
  [[nodiscard]] const SoftBody& soft_body(std::size_t index) const;
  /// What is inside now.
  [[nodiscard]] const std::optional<GasState>& gas(std::size_t soft_index) const;
  [[nodiscard]] bool is_frozen(std::size_t soft_index) const;
  [[nodiscard]] bool is_asleep(std::size_t soft_index) const;  // sleep.h
  /// Whether readers of a stream know all that acts on it beside contact and joints (is_predictable in force_terms.h).
  [[nodiscard]] bool is_predictable(std::size_t soft_index) const;
  /// Writes x, y, z of each vertex in order; `out` has 3 * vertex count elements.
  void copy_positions(std::size_t soft_index, std::span<double> out_m) const;
  /// Likewise, of each vertex at the end of the last substep.
  void copy_velocities(std::size_t soft_index, std::span<double> out_m_s) const;
  [[nodiscard]] BodyMeasures measure(std::size_t soft_index) const;
  /// The same without the area and the potential energies, which are 0 in it.
  [[nodiscard]] BodyMeasures measure_motion(std::size_t soft_index) const;
  [[nodiscard]] const std::vector<RigidState>& rigid_bodies() const;
  [[nodiscard]] const std::vector<ColliderState>& colliders() const;
  /// Those that hold.
  [[nodiscard]] const std::vector<JointState>& joints() const;

  /// Adds momentum `impulse_n_s` at `at`. With an empty name, `at` must be a ray, and the first body hit is meant.
  [[nodiscard]] base::Result<Hit> apply_impulse(const std::string& body, const At& at, const Vec3d& impulse_n_s);
  /// Holds what is at `at`, of a soft body.
  [[nodiscard]] base::Result<Hit> add_grab(std::uint64_t id, const std::string& body, const At& at, const Hold& hold);
  [[nodiscard]] base::Status move_grab(std::uint64_t id, const Vec3d& target);
  [[nodiscard]] base::Status release_grab(std::uint64_t id);

  /// Puts bodies elsewhere, between two ticks; they wake. Pinned vertices get no velocity, nor do locked axes. Refuses
  /// unknown, repeated and frozen bodies, lists of another length, and what is not finite or past the limits of
  /// coordinates and speed; nothing has changed then. Errors name `soft_bodies[i].positions` and the like.
  [[nodiscard]] base::Status place(const std::vector<SoftPlacement>& soft, const std::vector<RigidPlacement>& rigid);

  /// Bodies frozen since the last call.
  [[nodiscard]] std::vector<FrozenBody> take_frozen();
  /// What gases did since the last call.
  [[nodiscard]] std::vector<BodyGasEvent> take_gas_events();
  /// Joints that broke since the last call.
  [[nodiscard]] std::vector<BrokenJoint> take_broken_joints();

  /// FNV-1a over the bits of the whole state in a fixed order (positions, velocities, gas, solids, time).
  [[nodiscard]] std::uint64_t state_hash() const;
  /// The state as bytes, to be restored into a world created from the same scene (the one scene() gave then).
  [[nodiscard]] std::string snapshot() const;
  [[nodiscard]] base::Status restore(std::string_view snapshot);
  /// A second world, between two ticks, that goes on as one restored from this one's snapshot would.
  [[nodiscard]] World copy() const;

  /// While on, steps note what contact answers. Off at first.
  void note_contacts(bool on);
  /// What was answered in the last substep that the body was awake in, by vertex, once for each that it was held off
  /// (and each wall of a room); nothing while it is not noted. Rigid bodies and colliders among each other are not in
  /// it.
  [[nodiscard]] ContactNotes contacts(std::size_t soft_index) const;
  /// What pressed what in the last tick, by pair, rigid bodies and colliders too; nothing while it is not noted. What
  /// sleeps is not answered, nor in it.
  [[nodiscard]] std::vector<BodyTouch> touches() const;

  /// What the contacts of soft bodies came to since the world was made or edited.
  [[nodiscard]] RowCounts row_counts() const;

  /// While on, steps add to profile(). Off at first.
  void set_profiling(bool on);
  [[nodiscard]] Profile profile() const;

 private:
  friend class WorldBatch;
  explicit World(std::unique_ptr<Simulation> simulation);
  std::unique_ptr<Simulation> simulation_;
};

}  // namespace pneuma::physics
