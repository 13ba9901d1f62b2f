// What a World holds: the bodies at the scene's precision, the solids, and the step that moves them.
#pragma once

#include <span>
#include <variant>
#include <vector>

#include "physics/choice/stability.h"
#include "physics/choice/step_choice.h"
#include "physics/choice/step_plan.h"
#include "physics/contact/carried_out.h"
#include "physics/contact/contact.h"
#include "physics/contact/gain_watch.h"
#include "physics/machine/room_pool.h"
#include "physics/solve_step.h"
#include "physics/world.h"

namespace pneuma::physics {

/// The soft bodies of a world, in one precision.
template <class Real>
struct SoftBodies {
  std::vector<SoftState<Real>> states;
  StepPlan<Real> plan;                // of these states
  Borrowed<LaneRooms<Real>> scratch;  // held within a tick, and longer where threads share a body
  // Of the methods that solve; empty where the method is explicit.
  std::vector<SolverScratch<Real>> solvers;    // one a thread
  std::vector<ImplicitTables<Real>> tables;    // one a body
  std::shared_ptr<ImplicitMatrices> matrices;  // what the tables point to; copies of the world share it
  // The velocities before the substep, one list a body, of the implicit methods where bodies can touch anything.
  std::vector<std::vector<Vec3<Real>>> start_m_s;
  // Of the substep under way; or of the tick, where bodies run through it by themselves. All tasks do so many substeps,
  // in order.
  std::vector<StepTask> tasks;
  std::size_t next_task = 0;
  std::uint32_t task_substeps = 0;
  std::vector<std::uint8_t> done;  // one a body: its task's substeps are
  // Of the substep under way, where the method solves: who is awake, and the first of them that is not solved for.
  std::vector<std::uint32_t> awake;
  std::size_t next_awake = 0;
  std::vector<Profile> profiles;       // one a body, so that workers share none; empty while not profiling
  std::vector<Extents<Real>> extents;  // one a body, of those that are awake: as last looked at
  Contacts<Real> contacts;
  GainWatch<Real> gains;            // of the substep under way, where the method solves
  CarriedOut<Real> carried_out;     // of the tick under way
  std::vector<ContactNotes> notes;  // one a body, as its last tick awake ended; empty unless asked for
};

/// Plain state and the step; World is the door to it.
class Simulation {
 public:
  explicit Simulation(Scene scene, SubstepChoice choice);

  /// As World::substep. Where contact takes a span back, the tick goes on from an earlier substep; where it takes back
  /// a substep that left more energy than there was, it goes on with more care.
  bool substep(Workers& workers);
  /// Finds how many substeps the tick takes. Once a tick, before its first substep.
  void begin_tick();
  /// Whether the next substep begins a tick in which each body, or group of bodies abreast, does all its substeps by
  /// itself.
  [[nodiscard]] bool begins_free_tick() const;
  /// For the substeps that are left of the tick.
  [[nodiscard]] SubstepContext context_on(Workers& workers);
  /// Steps a body through so many substeps by itself, and looks in each whether it runs away.
  template <class Real>
  void step_closely(SoftBodies<Real>& bodies, std::size_t index, std::uint32_t substeps, const SubstepContext& context);
  /// After so many substeps of all bodies. True when these ended the tick.
  bool end_substeps(std::uint32_t count);
  /// Wakes the body of that name, if it sleeps, and its group.
  void wake(const std::string& body);
  /// After the scene or what it says of the bodies has changed.
  void make_plan();
  /// Makes the scene's joints, once its bodies are there. Those of `before` that are the same go on, unless a body of
  /// theirs is among `renewed`.
  void make_joints(const std::vector<JointState>& before, const std::vector<std::string>& renewed);
  /// Leaves out the joints for which `goes(joint)` holds.
  template <class Goes>
  void remove_joints(const Goes& goes);

  template <class Visitor>
  decltype(auto) visit(Visitor&& visitor) {
    return std::visit(std::forward<Visitor>(visitor), soft);
  }
  template <class Visitor>
  decltype(auto) visit(Visitor&& visitor) const {
    return std::visit(std::forward<Visitor>(visitor), soft);
  }

  [[nodiscard]] double period_s() const { return 1.0 / scene.stepping.rate_hz; }
  [[nodiscard]] double time_s() const { return time_base_s + static_cast<double>(tick - tick_base) * period_s(); }

  Scene scene;  // as last applied; what moves is below
  SubstepChoice choice;
  FrequencyTable frequencies;  // behind the choice
  std::variant<SoftBodies<float>, SoftBodies<double>> soft;
  std::vector<RigidState> rigid;
  std::vector<Pose> rigid_before;  // as the substep found them
  std::vector<ColliderState> colliders;
  std::vector<JointState> joints;  // as the scene's list
  std::vector<WarmImpulse> warm;   // of contact in implicit steps, by key: what the last one ended with

  std::uint64_t tick = 0;
  std::uint32_t substep_index = 0;  // of the tick under way
  // Its substeps: as chosen, or more where a gas is pressed or energy was gained; 0 between ticks.
  std::uint32_t tick_substeps = 0;
  // Time runs at this rate from here on; a product, not a sum, so that it does not drift.
  double time_base_s = 0.0;
  std::uint64_t tick_base = 0;

  std::vector<FrozenBody> frozen;
  std::vector<BodyGasEvent> gas_events;
  std::vector<BrokenJoint> broken_joints;
  bool noting = false;    // contacts
  TouchTally touches;     // of the tick under way, or the last; empty unless asked for
  bool in_batch = false;  // its bodies may go beside those of other worlds (world_batch.h)
  bool profiling = false;
  Profile profile{};

 private:
  // The setting up, simulation.cpp.
  template <class Real>
  void make_tables(SoftBodies<Real>& bodies, std::span<const HeldMatrices> held_before);
  void tie();
  void collect_broken_joints();
  void keep_driven_awake();
  [[nodiscard]] bool is_at_rest() const;
  void end_tick();

  // A substep and its parts, substep.cpp.
  template <class Real>
  [[nodiscard]] Moving<Real> moving(SoftBodies<Real>& bodies);
  template <class Real>
  [[nodiscard]] bool may_be_taken_back(const SoftBodies<Real>& bodies) const;
  void step_with_more_care();
  template <class Real>
  [[nodiscard]] bool move_freely(SoftBodies<Real>& bodies, const SubstepContext& context);
  template <class Real>
  void meet(SoftBodies<Real>& bodies, const SubstepContext& context);
  template <class Real>
  void move(SoftBodies<Real>& bodies, const SubstepContext& context);
  template <class Real>
  void integrate(SoftBodies<Real>& bodies, const SubstepContext& context);
  template <class Real>
  [[nodiscard]] bool solve_part(SoftBodies<Real>& bodies, const SubstepContext& context);
  template <class Real>
  [[nodiscard]] std::uint32_t step_freely(SoftBodies<Real>& bodies, const SubstepContext& context);
  template <class Real>
  void run_task(SoftBodies<Real>& bodies, const StepTask& task, const SubstepContext& context,
                LaneScratch<Real>& scratch);
  template <class Real>
  void begin_notes(SoftBodies<Real>& bodies, const SubstepContext& context) const;
  template <class Real>
  [[nodiscard]] static std::span<const std::vector<Vec3<Real>>> coupled_start_m_s(const SoftBodies<Real>& bodies);
  [[nodiscard]] std::optional<StageAccuracy> first_order() const;
  template <class Real>
  [[nodiscard]] static LaneTables<Real> lanes_of(const SoftBodies<Real>& bodies, std::size_t index);
  template <class Real>
  [[nodiscard]] Profile* profile_of(SoftBodies<Real>& bodies, std::size_t index) const;
  template <class Real>
  void freeze_runaways(SoftBodies<Real>& bodies, const SubstepContext& context);
  template <class Real>
  void collect_gas_events(SoftBodies<Real>& bodies);
  template <class Real>
  void report_gas(SoftState<Real>& body);

  bool repairs_ = true;         // in the tick under way
  bool plan_is_stale_ = false;  // a body has lost the gas that it was planned with
};

template <class Goes>
void Simulation::remove_joints(const Goes& goes) {
  for (std::size_t i = joints.size(); i-- > 0;) {
    if (!goes(joints[i])) continue;
    joints.erase(joints.begin() + static_cast<std::ptrdiff_t>(i));
    scene.joints.erase(scene.joints.begin() + static_cast<std::ptrdiff_t>(i));
    plan_is_stale_ = true;
  }
  tie();
}

[[nodiscard]] RigidState make_rigid_state(const RigidBody& body);
[[nodiscard]] ColliderState make_collider_state(const Collider& collider);

}  // namespace pneuma::physics
