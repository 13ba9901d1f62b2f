#include "physics/simulation.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

#include "base/limits.h"
#include "physics/contact/touch_groups.h"
#include "physics/forces/gas.h"
#include "physics/forces/soft_setup.h"
#include "physics/rest/sleep.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/state/origin.h"

namespace pneuma::physics {

namespace {

constexpr const char* not_finite = "its motion was no longer finite";
constexpr const char* torn_apart = "it was torn apart: a particle moved past its own body in one step";
constexpr const char* too_fast = "it went past the limit of speed";
constexpr const char* too_far = "it went past the limit of place";
constexpr const char* failed_reason = "its integrator found no finite answer";

std::size_t evaluations_of(Integrator integrator) {
  return integrator == Integrator::rk4 ? 4 : integrator == Integrator::midpoint ? 2 : 1;
}

// Solves of this many vertices take about a millisecond: measured 0.06 (at rest) to 0.2 us a vertex.
constexpr std::size_t solved_vertices_a_part = 8'192;

template <class Real>
std::vector<std::uint32_t> awake_of(const SoftBodies<Real>& bodies) {
  std::vector<std::uint32_t> awake;
  for (std::uint32_t i = 0; i < bodies.states.size(); ++i) {
    if (bodies.states[i].is_awake()) awake.push_back(i);
  }
  return awake;
}

// Calls work(task, scratch) for each task, on as many threads as there are.
template <class Task, class Scratch, class Work>
void run_tasks(Workers& workers, std::span<const Task> tasks, std::vector<Scratch>& scratch, const Work& work) {
  const std::size_t threads = std::min(workers.threads(), tasks.size());
  if (scratch.size() < threads) scratch.resize(threads);
  std::atomic<std::size_t> next{0};
  workers.for_each(threads, [&](std::size_t thread) {
    for (std::size_t i = next.fetch_add(1); i < tasks.size(); i = next.fetch_add(1)) work(tasks[i], scratch[thread]);
  });
}

// Of a body that an implicit step solves for together with its contacts: what a row costs there grows with the
// vertices, and past this many a substep took minutes. Larger bodies answer by the masses of their vertices, after the
// step.
constexpr std::size_t coupled_vertices_max = 4'096;

// Numbers of vectors that lie one after the other, by lanes: two of them are six, which a compiler keeps in registers.
constexpr std::size_t flat_lanes = 6;

// Whether every component is within its axis' limits. A number that is none is not.
template <class Real, class Value>
bool is_within(std::size_t vectors, const Vec3<Real>& low, const Vec3<Real>& high, const Value& value) {
  std::array<Real, flat_lanes> lows;
  std::array<Real, flat_lanes> highs;
  std::array<int, flat_lanes> out{};
  for (std::size_t k = 0; k < flat_lanes; ++k) {
    lows[k] = low[static_cast<Eigen::Index>(k % 3)];
    highs[k] = high[static_cast<Eigen::Index>(k % 3)];
  }
  const auto look = [&](std::size_t i, std::size_t k) {
    const Real number = value(i);
    out[k] |= static_cast<int>(!(number >= lows[k])) | static_cast<int>(!(number <= highs[k]));
  };
  const std::size_t count = 3 * vectors;
  std::size_t i = 0;
  for (; i + flat_lanes <= count; i += flat_lanes) {
    for (std::size_t k = 0; k < flat_lanes; ++k) look(i + k, k);
  }
  for (std::size_t k = 0; i + k < count; ++k) look(i + k, k);
  return std::ranges::all_of(out, [](int is_out) { return is_out == 0; });
}

// What every particle's place, move and velocity are to be within.
template <class Real>
struct WellLimits {
  Vec3<Real> low, high;
  Real speed_max_m_s = 0;
  Real stray_max_m = 0;
  Vec3<Real> mean_move = Vec3<Real>::Zero();

  explicit WellLimits(const SoftState<Real>& body)
      : low((-base::coordinate_max_m - body.origin_m.array()).matrix().template cast<Real>()),
        high((base::coordinate_max_m - body.origin_m.array()).matrix().template cast<Real>()),
        speed_max_m_s(static_cast<Real>(base::speed_max_m_s)),
        stray_max_m(static_cast<Real>(base::runaway_body_lengths) * body.length_m) {
    for (const Vec3<Real>& move : body.dr) mean_move += move;
    mean_move /= static_cast<Real>(body.dr.size());
  }
};

// By components, which is quick, and says no only where a length might be too great.
template <class Real>
bool is_surely_well(const SoftState<Real>& body, const WellLimits<Real>& limits) {
  constexpr Real share = static_cast<Real>(0.57);  // below the root of 1/3
  const Real* x = body.x.front().data();
  const Real* dr = body.dr.front().data();
  const Real* v = body.v.front().data();
  const Vec3<Real> speed = Vec3<Real>::Constant(share * limits.speed_max_m_s);
  const Vec3<Real> stray = Vec3<Real>::Constant(share * limits.stray_max_m);
  const std::size_t count = body.x.size();
  return is_within<Real>(count, -speed, speed, [v](std::size_t i) { return v[i]; }) &&
         is_within<Real>(count, limits.mean_move - stray, limits.mean_move + stray,
                         [dr](std::size_t i) { return dr[i]; }) &&
         is_within<Real>(count, limits.low, limits.high, [x, dr](std::size_t i) { return x[i] + dr[i]; });
}

// A comparison with NaN is false, so a NaN fails it.
template <class Real>
bool is_well(const SoftState<Real>& body) {
  const WellLimits<Real> limits(body);
  if (is_surely_well(body, limits)) return true;
  const Real speed_max = limits.speed_max_m_s;
  bool well = true;
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    const Vec3<Real> end = body.x[i] + body.dr[i];
    well &= body.v[i].squaredNorm() <= speed_max * speed_max;
    well &= (end.array() >= limits.low.array() && end.array() <= limits.high.array()).all();
    well &= (body.dr[i] - limits.mean_move).squaredNorm() <= limits.stray_max_m * limits.stray_max_m;
  }
  return well;
}

// What made the body no longer well; the first that holds, in the order from what says most.
template <class Real>
const char* runaway_reason(const SoftState<Real>& body) {
  const auto speed_max = static_cast<Real>(base::speed_max_m_s);
  const Real stray_max = static_cast<Real>(base::runaway_body_lengths) * body.length_m;
  const auto any = [&body](const auto& holds) {
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      if (holds(i)) return true;
    }
    return false;
  };
  if (any([&](std::size_t i) { return !body.v[i].allFinite() || !body.dr[i].allFinite(); })) return not_finite;
  Vec3<Real> mean_move = Vec3<Real>::Zero();
  for (const Vec3<Real>& move : body.dr) mean_move += move;
  mean_move /= static_cast<Real>(body.dr.size());
  if (any([&](std::size_t i) { return !((body.dr[i] - mean_move).squaredNorm() <= stray_max * stray_max); })) {
    return torn_apart;
  }
  if (any([&](std::size_t i) { return !(body.v[i].squaredNorm() <= speed_max * speed_max); })) return too_fast;
  return too_far;
}

const char* runaway_reason(const RigidState& body) {
  if (!body.velocity.allFinite() || !body.angular_velocity.allFinite() || !body.position.allFinite()) return not_finite;
  const bool fast = body.velocity.norm() > base::speed_max_m_s || body.angular_velocity.norm() > base::speed_max_m_s;
  return fast ? too_fast : too_far;
}

}  // namespace

RigidState make_rigid_state(const RigidBody& body) {
  RigidState state;
  state.body = body;
  state.position = body.position;
  state.orientation = body.orientation;
  state.velocity = free_part(body.locked.translation, body.velocity);
  state.angular_velocity = free_part(body.locked.rotation, body.angular_velocity);
  state.inverse_mass_1_kg = 1.0 / body.mass_kg;
  state.inverse_inertia_1_kg_m2 = principal_inertia_kg_m2(body.shape, body.mass_kg).cwiseInverse();
  return state;
}

ColliderState make_collider_state(const Collider& collider) {
  const auto* mesh = std::get_if<MeshShape>(&collider.shape);
  return {collider, collider.position, collider.orientation, mesh != nullptr ? make_mesh_tree(mesh->mesh) : nullptr};
}

Simulation::Simulation(Scene initial, SubstepChoice substeps) : scene(std::move(initial)), choice(std::move(substeps)) {
  if (scene.stepping.precision == Precision::double_precision) soft.emplace<SoftBodies<double>>();
  visit([&]<class Real>(SoftBodies<Real>& bodies) {
    for (const SoftBody& body : scene.soft_bodies) bodies.states.push_back(make_soft_state<Real>(body));
  });
  for (const RigidBody& body : scene.rigid_bodies) rigid.push_back(make_rigid_state(body));
  for (const Collider& collider : scene.colliders) colliders.push_back(make_collider_state(collider));
  make_joints({}, {});
  make_plan();
}

void Simulation::make_joints(const std::vector<JointState>& before, const std::vector<std::string>& renewed) {
  const auto is_renewed = [&](const Anchor& anchor) {
    return anchor.of != Anchor::Of::world && std::ranges::find(renewed, anchor.body) != renewed.end();
  };
  joints.clear();
  visit([&]<class Real>(const SoftBodies<Real>& bodies) {
    for (const Joint& joint : scene.joints) {
      const auto same = std::ranges::find(before, joint, &JointState::joint);
      if (same != before.end() && !is_renewed(joint.first) && !is_renewed(joint.second)) {
        joints.push_back(*same);
        find_ends<Real>(joints.back(), bodies.states, rigid, colliders);
      } else {
        joints.push_back(make_joint<Real>(joint, bodies.states, rigid, colliders));
      }
    }
  });
  tie();
}

void Simulation::tie() {
  visit([&]<class Real>(SoftBodies<Real>& bodies) { tie_bodies<Real>(joints, bodies.states, rigid); });
}

void Simulation::collect_broken_joints() {
  if (std::ranges::none_of(joints, &JointState::broken)) return;
  for (const JointState& joint : joints) {
    if (joint.broken) broken_joints.push_back({joint.joint.name, joint.joint.break_force_n});
  }
  remove_joints([](const JointState& joint) { return joint.broken; });
}

// What a moving collider drives by a joint does not rest.
void Simulation::keep_driven_awake() {
  for (const JointState& joint : joints) {
    for (std::size_t i = 0; i < 2; ++i) {
      const JointEnd& end = joint.ends[i];
      if (end.of != Anchor::Of::collider || !is_moving(colliders[end.index].collider)) continue;
      wake(i == 0 ? joint.joint.second.body : joint.joint.first.body);
    }
  }
}

void Simulation::make_plan() {
  visit([this]<class Real>(SoftBodies<Real>& bodies) {
    std::vector<HeldMatrices> held_before;  // each once
    for (const ImplicitTables<Real>& tables : bodies.tables) {
      const auto is_it = [&](const HeldMatrices& held) { return held.steps == tables.held.steps; };
      if (std::ranges::none_of(held_before, is_it)) held_before.push_back(tables.held);
    }
    bodies.tables.clear();
    bodies.matrices = nullptr;
    if (choice.integrator != Integrator::xpbd) {
      bodies.plan = make_step_plan<Real>(bodies.states, !rigid.empty() || !colliders.empty() || !joints.empty(),
                                         is_explicit(choice.integrator), bodies.plan);
    } else {
      bodies.plan = {};
    }
    if (!is_explicit(choice.integrator)) make_tables<Real>(bodies, held_before);
    bodies.scratch.clear();
    bodies.solvers.clear();
    const bool is_implicit = !is_explicit(choice.integrator) && choice.integrator != Integrator::xpbd;
    bodies.start_m_s.clear();
    if (is_implicit && bodies.plan.may_touch) bodies.start_m_s.resize(bodies.states.size());
    bodies.next_task = 0;
    bodies.next_awake = 0;
  });
  plan_is_stale_ = false;
}

template <class Real>
void Simulation::make_tables(SoftBodies<Real>& bodies, std::span<const HeldMatrices> held_before) {
  bodies.tables.resize(bodies.states.size());
  if (choice.integrator == Integrator::xpbd) return;
  bodies.matrices = std::make_shared<ImplicitMatrices>();
  const std::vector<std::size_t>& mesh_of_body = bodies.plan.mesh_of_body;
  for (std::size_t i = 0; i < bodies.states.size(); ++i) {
    // Equal meshes become one, so that equal matrices are told at a glance.
    const auto first = std::ranges::find(mesh_of_body, mesh_of_body[i]) - mesh_of_body.begin();
    bodies.states[i].body.mesh = bodies.states[static_cast<std::size_t>(first)].body.mesh;
    bodies.tables[i] = {{&bodies.plan.mesh_of(i), bodies.plan.kernels}, bodies.matrices.get(), {}};
    bodies.matrices->take_over(bodies.tables[i].held, bodies.states[i], {scene.gravity, scene.atmosphere}, held_before);
  }
}

bool Simulation::substep(Workers& workers) {
  const std::uint32_t substeps_done = visit([&](auto& bodies) {
    if (is_at_rest()) return choice.substeps - substep_index;
    if (!is_explicit(choice.integrator)) {
      if (!solve_part(bodies, workers)) return std::uint32_t{0};
    } else if (bodies.plan.may_touch) {
      integrate(bodies, workers);
    } else {
      return step_freely(bodies, workers);
    }
    end_substep(bodies, workers);
    return std::uint32_t{1};
  });
  substep_index += substeps_done;
  if (plan_is_stale_ && substeps_done > 0) make_plan();
  if (substep_index < choice.substeps) return false;
  end_tick();
  return true;
}

void Simulation::end_tick() {
  substep_index = 0;
  ++tick;
  visit([](auto& bodies) {
    for (auto& body : bodies.states) {
      if (!body.is_awake()) continue;
      note_recovery(body);
      recentre(body);
    }
  });
  if (!scene.stepping.sleep || is_at_rest()) return;
  keep_driven_awake();
  const StageTimer timer(profiling ? &profile : nullptr, Stage::sleep);
  visit([&]<class Real>(SoftBodies<Real>& bodies) {
    settle<Real>(bodies.states, rigid, colliders, {scene.gravity, scene.atmosphere}, period_s());
  });
}

// Nobody is awake, and nothing moves that could wake anybody.
bool Simulation::is_at_rest() const {
  const auto is_awake = [](const auto& body) { return body.is_awake(); };
  const auto moves = [](const ColliderState& state) { return is_moving(state.collider); };
  return std::ranges::none_of(rigid, is_awake) && std::ranges::none_of(colliders, moves) &&
         visit([&](const auto& bodies) { return std::ranges::none_of(bodies.states, is_awake); });
}

void Simulation::wake(const std::string& body) {
  visit([&]<class Real>(SoftBodies<Real>& bodies) {
    const auto soft = std::ranges::find(bodies.states, body, [](const auto& state) { return state.body.name; });
    const auto solid = std::ranges::find(rigid, body, [](const RigidState& state) { return state.body.name; });
    auto index = static_cast<std::size_t>(soft - bodies.states.begin());
    if (soft == bodies.states.end()) index += static_cast<std::size_t>(solid - rigid.begin());
    (void)wake_group<Real>(bodies.states, rigid, index);
  });
}

// Nothing can touch anything: each body, or fleet of bodies, runs through its substeps by itself, and stays in cache.
// One call does about a millisecond of that; a body that takes longer for its tick is given fewer substeps at a time.
template <class Real>
std::uint32_t Simulation::step_freely(SoftBodies<Real>& bodies, Workers& workers) {
  if (profiling) bodies.profiles.resize(bodies.states.size());
  const std::size_t slots_max = bodies.plan.kernels->slots_per_ms / evaluations_of(choice.integrator);
  const auto slots_of = [&](const StepTask& task) {
    const std::size_t lanes = task.bodies.size() == 1 ? 1 : bodies.plan.kernels->width;
    return bodies.plan.meshes[task.mesh]->rings.slot_count() * lanes;
  };
  bodies.done.resize(bodies.states.size());
  if (bodies.next_task == 0) {
    bodies.tasks = cut_into_tasks<Real>(bodies.plan, bodies.states, lane_settings());
    bodies.task_substeps = choice.substeps - substep_index;
    const std::size_t threads_a_task = bodies.tasks.size() == 1 ? workers.threads() : 1;
    for (const StepTask& task : bodies.tasks) {
      const auto most =
          static_cast<std::uint32_t>(std::max<std::size_t>(slots_max * threads_a_task / slots_of(task), 1));
      bodies.task_substeps = std::min(bodies.task_substeps, most);
    }
  }
  const std::size_t first = bodies.next_task;
  for (std::size_t slots = 0; bodies.next_task < bodies.tasks.size() && slots < slots_max * workers.threads();) {
    slots += slots_of(bodies.tasks[bodies.next_task++]) * bodies.task_substeps;
  }
  const auto tasks = std::span(std::as_const(bodies.tasks)).subspan(first, bodies.next_task - first);
  if (tasks.size() == 1) {
    bodies.scratch.resize(std::max<std::size_t>(bodies.scratch.size(), 1));
    run_task(bodies, tasks[0], bodies.scratch[0], &workers);
  } else {
    run_tasks(workers, tasks, bodies.scratch,
              [&](const StepTask& task, LaneScratch<Real>& scratch) { run_task(bodies, task, scratch, nullptr); });
  }
  for (const StepTask& task : tasks) {
    for (const std::uint32_t i : task.bodies) {
      if (bodies.done[i] == 0) step_closely(bodies, i);
    }
  }
  if (bodies.next_task < bodies.tasks.size()) return 0;
  bodies.next_task = 0;
  return bodies.task_substeps;
}

template <class Real>
void Simulation::run_task(SoftBodies<Real>& bodies, const StepTask& task, LaneScratch<Real>& scratch,
                          Workers* workers) {
  std::array<SoftState<Real>*, pack_slots> states{};
  std::array<std::uint8_t, pack_slots> done{};
  const std::size_t count = task.bodies.size();
  for (std::size_t i = 0; i < count; ++i) states[i] = &bodies.states[task.bodies[i]];
  physics::step_freely<Real>(std::span(states).first(count), *bodies.plan.meshes[task.mesh], *bodies.plan.kernels,
                             lane_settings(), bodies.task_substeps, scratch, workers,
                             profiling ? &bodies.profiles[task.bodies[0]] : nullptr, done);
  for (std::size_t i = 0; i < count; ++i) bodies.done[task.bodies[i]] = done[i];
}

// A body that may run away in the task's substeps, looked at in each.
template <class Real>
void Simulation::step_closely(SoftBodies<Real>& bodies, std::size_t index) {
  SoftState<Real>& body = bodies.states[index];
  for (std::uint32_t i = 0; i < bodies.task_substeps && !body.frozen; ++i) {
    step_alone(body, bodies.plan.mesh_of(index), *bodies.plan.kernels, lane_settings(), bodies.scratch[0], nullptr,
               profiling ? &bodies.profiles[index] : nullptr);
    if (body.gas_event) report_gas(body);
    if (!is_well(body)) freeze(body);
    for (std::size_t k = 0; k < body.x.size(); ++k) body.x[k] += body.dr[k];
  }
}

// Who sleeps keeps the contacts it fell asleep with.
template <class Real>
void Simulation::begin_notes(SoftBodies<Real>& bodies) const {
  if (!noting) return;
  bodies.notes.resize(bodies.states.size());
  for (std::size_t i = 0; i < bodies.notes.size(); ++i) {
    if (!bodies.states[i].rest.asleep) bodies.notes[i].clear();
  }
}

// Steps 1 to 4 of the paper's algorithm (section 2.4), a body at a time.
template <class Real>
void Simulation::integrate(SoftBodies<Real>& bodies, Workers& workers) {
  if (profiling) bodies.profiles.resize(bodies.states.size());
  begin_notes(bodies);
  const StepPlan<Real>& plan = bodies.plan;
  const LaneSettings settings = lane_settings();
  const std::vector<std::uint32_t> active = awake_of(bodies);
  const auto run = [&](std::uint32_t i, LaneScratch<Real>& scratch, Workers* shared) {
    step_alone(bodies.states[i], plan.mesh_of(i), *plan.kernels, settings, scratch, shared,
               profiling ? &bodies.profiles[i] : nullptr);
  };
  if (active.size() == 1) {
    bodies.scratch.resize(std::max<std::size_t>(bodies.scratch.size(), 1));
    run(active[0], bodies.scratch[0], &workers);
  } else {
    run_tasks(workers, std::span<const std::uint32_t>(active), bodies.scratch,
              [&](std::uint32_t i, LaneScratch<Real>& scratch) { run(i, scratch, nullptr); });
  }
}

// The same by a method that solves for where a substep ends: as many bodies as take about a millisecond, once their
// matrices are factored. True when it was the substep's last part.
template <class Real>
bool Simulation::solve_part(SoftBodies<Real>& bodies, Workers& workers) {
  if (profiling) bodies.profiles.resize(bodies.states.size());
  if (bodies.next_awake == 0) {
    begin_notes(bodies);
    bodies.awake = awake_of(bodies);
    for (std::size_t i = 0; i < bodies.start_m_s.size(); ++i) {
      if (!bodies.states[i].is_awake()) bodies.start_m_s[i].clear();
    }
  }
  const std::size_t first = bodies.next_awake;
  const std::size_t vertices_max = solved_vertices_a_part * workers.threads();
  for (std::size_t vertices = 0; bodies.next_awake < bodies.awake.size() && vertices < vertices_max;) {
    vertices += bodies.states[bodies.awake[bodies.next_awake++]].x.size();
  }
  const auto part = std::span(std::as_const(bodies.awake)).subspan(first, bodies.next_awake - first);
  const Surroundings surroundings{scene.gravity, scene.atmosphere};
  // A stiff body that rolls turns far in a step; one in flight does too, but nothing there feeds on what that adds.
  const FirstGuess guess = bodies.start_m_s.empty() ? FirstGuess::straight : FirstGuess::turned;
  const Method method{choice.integrator, {scene.stepping.newton_iterations, scene.stepping.error_target}, guess};
  run_tasks(workers, part, bodies.solvers, [&](std::uint32_t i, SolverScratch<Real>& scratch) {
    SoftState<Real>& body = bodies.states[i];
    if (!bodies.start_m_s.empty()) bodies.start_m_s[i] = body.v;
    advance_gas(body, scene.atmosphere.pressure_pa, dt_s());
    physics::solve_step(body, bodies.tables[i], method, surroundings, dt_s(), scratch,
                        profiling ? &bodies.profiles[i] : nullptr);
  });
  if (bodies.next_awake < bodies.awake.size()) return false;
  bodies.next_awake = 0;
  return true;
}

std::optional<StageAccuracy> Simulation::first_order() const {
  if (choice.integrator != Integrator::tr_bdf2) return {};
  return StageAccuracy{scene.stepping.newton_iterations, scene.stepping.error_target};
}

// Steps 5 and 6 of the paper's algorithm, with all bodies.
template <class Real>
void Simulation::end_substep(SoftBodies<Real>& bodies, Workers& workers) {
  const double dt_s = this->dt_s();
  const bool coupled = std::ranges::all_of(
      bodies.states, [](const SoftState<Real>& body) { return body.x.size() <= coupled_vertices_max; });

  Profile* shared_profile = profiling ? &profile : nullptr;
  collect_gas_events(bodies);
  freeze_runaways(bodies);  // before they meet others
  rigid_before.clear();
  for (const RigidState& body : rigid) rigid_before.push_back({body.position, body.orientation});
  accelerate_rigid_bodies(rigid, scene.gravity, dt_s);
  bodies.contacts.resolve({.soft = bodies.states,
                           .rigid = rigid,
                           .colliders = colliders,
                           .surroundings = {scene.gravity, scene.atmosphere},
                           .dt_s = dt_s,
                           .is_first_of_tick = substep_index == 0,
                           .tables = bodies.tables,
                           .start_m_s = coupled ? std::span<const std::vector<Vec3<Real>>>(bodies.start_m_s)
                                                : std::span<const std::vector<Vec3<Real>>>(),
                           .first_order = first_order(),
                           .joints = joints,
                           .notes = bodies.notes},
                          workers, shared_profile);
  collect_broken_joints();

  freeze_runaways(bodies);

  const StageTimer timer(shared_profile, Stage::move);
  for (SoftState<Real>& body : bodies.states) {
    if (!body.is_awake()) continue;
    for (std::size_t i = 0; i < body.x.size(); ++i) body.x[i] += body.dr[i];
  }
  move_solids(rigid, colliders, dt_s);
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    RigidState& body = rigid[i];
    if (body.frozen || is_active(body)) continue;
    frozen.push_back({body.body.name, runaway_reason(body)});
    body.position = rigid_before[i].position;
    body.orientation = rigid_before[i].orientation;
    body.velocity.setZero();
    body.angular_velocity.setZero();
    body.frozen = true;
    body.rest = {};
  }
}

template <class Real>
void Simulation::freeze_runaways(SoftBodies<Real>& bodies) {
  for (SoftState<Real>& body : bodies.states) {
    if (body.is_awake() && (body.solve_failed || !is_well(body))) freeze(body);
  }
}

template <class Real>
void Simulation::collect_gas_events(SoftBodies<Real>& bodies) {
  for (SoftState<Real>& body : bodies.states) {
    if (body.gas_event) report_gas(body);
  }
}

template <class Real>
void Simulation::report_gas(SoftState<Real>& body) {
  const GasEvent event = *std::exchange(body.gas_event, std::nullopt);
  plan_is_stale_ |= event.kind == GasEvent::Kind::burst;
  gas_events.push_back({body.body.name, event});
}

// A body that has run away keeps the place where it was last well.
template <class Real>
void Simulation::freeze(SoftState<Real>& body) {
  frozen.push_back({body.body.name, body.solve_failed ? failed_reason : runaway_reason(body)});
  std::ranges::fill(body.v, Vec3<Real>::Zero());
  std::ranges::fill(body.dr, Vec3<Real>::Zero());
  body.frozen = true;
  body.rest = {};
  body.place.clear();
}

}  // namespace pneuma::physics
