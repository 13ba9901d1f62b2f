// A substep: free motion, contact, the move. Where nothing can touch anything, bodies run through it by themselves.

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

#include "base/limits.h"
#include "physics/choice/longest_step.h"
#include "physics/forces/gas.h"
#include "physics/lanes/body_extents.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/simulation.h"
#include "physics/state/runaway.h"

namespace pneuma::physics {

namespace {

std::size_t evaluations_of(Integrator integrator) {
  return integrator == Integrator::rk4 ? 4 : integrator == Integrator::midpoint ? 2 : 1;
}

// Solves of this many vertices take about a millisecond: measured 0.06 (at rest) to 0.2 us a vertex.
constexpr std::size_t solved_vertices_a_part = 8'192;

// Waking other threads takes some 10 us, in which one thread looks at about this many vertices.
constexpr std::size_t shared_vertices_min = 16'384;

template <class Real>
std::vector<std::uint32_t> awake_of(const SoftBodies<Real>& bodies) {
  std::vector<std::uint32_t> awake;
  for (std::uint32_t i = 0; i < bodies.states.size(); ++i) {
    if (bodies.states[i].is_awake()) awake.push_back(i);
  }
  return awake;
}

template <class Real>
using TaskStates = std::array<SoftState<Real>*, pack_slots>;

/// Of the task's bodies, in `room`.
template <class Real>
std::span<SoftState<Real>* const> states_of(SoftBodies<Real>& bodies, const StepTask& task, TaskStates<Real>& room) {
  for (std::size_t i = 0; i < task.bodies.size(); ++i) room[i] = &bodies.states[task.bodies[i]];
  return std::span(room).first(task.bodies.size());
}

// Times the substeps that were chosen: so many at most while a gas is pressed.
constexpr std::uint32_t pressed_substeps_max = 64;

// Each substep becomes so many where it gained energy, and so many at most.
constexpr std::uint32_t finer_substeps = 4;
constexpr std::uint32_t finer_substeps_max = 16;

// Cheaper than to ask how fast the volume changes: whether it is much less than the mesh's, or a vertex goes so far in
// the tick that it may become so.
template <class Real>
bool may_be_pressed(const SoftState<Real>& body, double period_s) {
  constexpr double pressed_share = 0.75;
  constexpr double way_share = 0.1;
  if (body.volume_m3 < pressed_share * body.gas->volume_ref_m3) return true;
  Real fastest = 0;
  for (const Vec3<Real>& v : body.v) fastest = std::max(fastest, v.squaredNorm());
  return period_s * std::sqrt(static_cast<double>(fastest)) > way_share * static_cast<double>(body.length_m);
}

// dV/dt of a closed skin, wherever it is.
template <class Real>
double volume_rate_m3_s(const SoftState<Real>& body) {
  double sum = 0.0;
  for (const auto& [a, b, c] : body.body.mesh->faces) {
    const auto at = [&](std::uint32_t i) { return Vec3d((body.x[i] - body.x[0]).template cast<double>()); };
    const auto moves = [&](std::uint32_t i) { return Vec3d(body.v[i].template cast<double>()); };
    sum += moves(a).dot(at(b).cross(at(c))) + moves(b).dot(at(c).cross(at(a))) + moves(c).dot(at(a).cross(at(b)));
  }
  return sum / 6.0;
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

}  // namespace

bool Simulation::substep(Workers& workers) {
  if (tick_substeps == 0) begin_tick();
  const SubstepContext context = context_on(workers);
  const std::uint32_t substeps_done = visit([&](auto& bodies) {
    if (is_at_rest()) return tick_substeps - substep_index;
    if (is_explicit(choice.integrator) && !bodies.plan.may_touch) return step_freely(bodies, context);
    const bool is_watched = may_be_taken_back(bodies);
    if (is_explicit(choice.integrator)) bodies.contacts.keep_start(context, moving(bodies));
    if (is_watched && bodies.next_awake == 0) bodies.gains.begin(context, moving(bodies), joints, warm);
    if (!move_freely(bodies, context)) return std::uint32_t{0};
    meet(bodies, context);
    if (const std::uint32_t left = bodies.contacts.take_back(moving(bodies)); left > 0) {
      substep_index = tick_substeps - left;
      return std::uint32_t{0};
    }
    move(bodies, context);
    if (is_watched && !bodies.contacts.had_ways_out() && bodies.gains.take_back(context, moving(bodies), warm)) {
      step_with_more_care();
      return std::uint32_t{0};
    }
    return std::uint32_t{1};
  });
  return end_substeps(substeps_done);
}

template <class Real>
Moving<Real> Simulation::moving(SoftBodies<Real>& bodies) {
  return {bodies.states,
          rigid,
          colliders,
          noting ? &touches : nullptr,
          frozen.size() + gas_events.size() + broken_joints.size(),
          bodies.carried_out.velocities_m_s()};
}

// Of steps that are solved with their contacts. A free step looks by itself whether it gained (solve_step.cpp).
template <class Real>
bool Simulation::may_be_taken_back(const SoftBodies<Real>& bodies) const {
  if (bodies.states.empty() || coupled_start_m_s(bodies).empty()) return false;
  const std::uint32_t most = std::min(finer_substeps_max * choice.substeps, base::substeps_max);
  return repairs_ || finer_substeps * tick_substeps <= most;
}

// What overlaps, or has come apart, is what most gains come from: it is left so for the rest of the tick. Shorter
// substeps alone would close it the faster.
void Simulation::step_with_more_care() {
  if (std::exchange(repairs_, false)) return;
  tick_substeps *= finer_substeps;
  substep_index *= finer_substeps;
}

void Simulation::begin_tick() {
  touches.clear();
  tick_substeps = choice.substeps;
  repairs_ = true;
  if (!(rigid.empty() && colliders.empty()) && !is_at_rest()) {
    const StageTimer timer(profiling ? &profile : nullptr, Stage::solid_contact);
    visit([&](auto& bodies) { bodies.carried_out.begin(bodies.states, rigid, colliders); });
  }
  if (choice.gas_give_m4_kg.empty()) return;
  const double chosen_s = period_s() / choice.substeps;
  const double shortest_s = period_s() / std::min(base::substeps_max, pressed_substeps_max * choice.substeps);
  double step_s = chosen_s;
  visit([&](const auto& bodies) {
    for (std::size_t i = 0; i < bodies.states.size(); ++i) {
      const auto& body = bodies.states[i];
      if (!body.gas || !body.is_awake() || !may_be_pressed(body, period_s())) continue;
      const double least_m3 = body.volume_m3 + std::min(period_s() * volume_rate_m3_s(body), 0.0);
      const double floor_m3 = 1.001 * gas_volume_floor * body.gas->volume_ref_m3;
      const double stiffness_pa_m3 = gas_stiffness_pa_m3(*body.gas, *body.body.gas, std::max(least_m3, floor_m3));
      const double gas_rad_s = std::sqrt(choice.gas_give_m4_kg[i] * stiffness_pa_m3);
      step_s = std::min(step_s, longest_gas_step_s(choice.integrator, gas_rad_s));
    }
  });
  if (step_s < chosen_s)
    tick_substeps = static_cast<std::uint32_t>(std::ceil(period_s() / std::max(step_s, shortest_s)));
}

bool Simulation::begins_free_tick() const {
  const auto goes_freely = [&](const auto& bodies) { return !bodies.plan.may_touch && bodies.next_task == 0; };
  return substep_index == 0 && is_explicit(choice.integrator) && visit(goes_freely) && !is_at_rest();
}

bool Simulation::end_substeps(std::uint32_t count) {
  substep_index += count;
  if (plan_is_stale_ && count > 0) make_plan();
  if (substep_index < tick_substeps) return false;
  end_tick();
  return true;
}

SubstepContext Simulation::context_on(Workers& workers) {
  return {.integrator = choice.integrator,
          .surroundings = {scene.gravity, scene.atmosphere},
          .dt_s = period_s() / tick_substeps,
          .is_first_of_tick = substep_index == 0,
          .repairs = repairs_,
          .substeps_left = tick_substeps - substep_index,
          .workers = &workers,
          .profile = profiling ? &profile : nullptr};
}

// Steps 1 to 4 of the paper's algorithm (section 2.4). True when it was the substep's last part.
template <class Real>
bool Simulation::move_freely(SoftBodies<Real>& bodies, const SubstepContext& context) {
  if (profiling) bodies.profiles.resize(bodies.states.size());
  if (!is_explicit(context.integrator)) return solve_part(bodies, context);
  integrate(bodies, context);
  return true;
}

// Step 5, with all bodies. Who has run away is stopped before it meets others.
template <class Real>
void Simulation::meet(SoftBodies<Real>& bodies, const SubstepContext& context) {
  collect_gas_events(bodies);
  freeze_runaways(bodies, context);
  rigid_before.clear();
  for (const RigidState& body : rigid) rigid_before.push_back({body.position, body.orientation});
  accelerate_rigid_bodies(rigid, scene.gravity, context.dt_s);
  const auto start_m_s = coupled_start_m_s(bodies);
  if (start_m_s.empty()) warm.clear();
  bodies.contacts.resolve({.substep = context,
                           .soft = bodies.states,
                           .rigid = rigid,
                           .colliders = colliders,
                           .tables = bodies.tables,
                           .start_m_s = start_m_s,
                           .first_order = first_order(),
                           .warm = &warm,
                           .joints = joints,
                           .carried_m_s = bodies.carried_out.velocities_m_s(),
                           .notes = context.is_last_of_tick() ? std::span(bodies.notes) : std::span<ContactNotes>(),
                           .touches = noting ? &touches : nullptr,
                           .extents = bodies.extents});
  collect_broken_joints();
  freeze_runaways(bodies, context);
}

// Step 6.
template <class Real>
void Simulation::move(SoftBodies<Real>& bodies, const SubstepContext& context) {
  const StageTimer timer(context.profile, Stage::move);
  for (SoftState<Real>& body : bodies.states) {
    if (!body.is_awake()) continue;
    for (std::size_t i = 0; i < body.x.size(); ++i) body.x[i] += body.dr[i];
  }
  move_solids(rigid, colliders, context.dt_s);
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (rigid[i].frozen || is_active(rigid[i])) continue;
    frozen.push_back({rigid[i].body.name, freeze(rigid[i], rigid_before[i].position, rigid_before[i].orientation)});
  }
}

// Explicit methods: bodies abreast or alone, a task a thread; the threads share a single large one.
template <class Real>
void Simulation::integrate(SoftBodies<Real>& bodies, const SubstepContext& context) {
  begin_notes(bodies, context);
  bodies.tasks = cut_into_tasks<Real>(bodies.plan, bodies.states, context);
  const auto run = [&](const StepTask& task, LaneScratch<Real>& scratch, Workers* shared) {
    TaskStates<Real> room{};
    step_to_contact<Real>(states_of(bodies, task, room), {bodies.plan.meshes[task.mesh].get(), bodies.plan.kernels},
                          context.of_body(shared, profile_of(bodies, task.bodies[0])), scratch);
  };
  if (bodies.tasks.size() == 1) {
    run(bodies.tasks[0], bodies.scratch->at_least(1)[0], context.workers);
  } else {
    run_tasks(*context.workers, std::span<const StepTask>(bodies.tasks), bodies.scratch->of_threads,
              [&](const StepTask& task, LaneScratch<Real>& scratch) { run(task, scratch, nullptr); });
  }
}

// Methods that solve for where a substep ends: as many bodies as take about a millisecond, once their matrices are
// factored. True when these were the last.
template <class Real>
bool Simulation::solve_part(SoftBodies<Real>& bodies, const SubstepContext& context) {
  if (bodies.next_awake == 0) {
    begin_notes(bodies, context);
    bodies.awake = awake_of(bodies);
    for (std::size_t i = 0; i < bodies.start_m_s.size(); ++i) {
      if (!bodies.states[i].is_awake()) bodies.start_m_s[i].clear();
    }
  }
  const std::size_t first = bodies.next_awake;
  const std::size_t vertices_max = solved_vertices_a_part * context.workers->threads();
  for (std::size_t vertices = 0; bodies.next_awake < bodies.awake.size() && vertices < vertices_max;) {
    vertices += bodies.states[bodies.awake[bodies.next_awake++]].x.size();
  }
  const auto part = std::span(std::as_const(bodies.awake)).subspan(first, bodies.next_awake - first);
  // A stiff body that rolls turns far in a step; one in flight does too, but nothing there feeds on what that adds.
  const FirstGuess guess = bodies.start_m_s.empty() ? FirstGuess::straight : FirstGuess::turned;
  const SolveSettings settings{
      {scene.stepping.newton_iterations, scene.stepping.error_target}, guess, choice.falls_by_parabola};
  run_tasks(*context.workers, part, bodies.solvers, [&](std::uint32_t i, SolverScratch<Real>& scratch) {
    SoftState<Real>& body = bodies.states[i];
    if (!bodies.start_m_s.empty()) bodies.start_m_s[i] = body.v;
    advance_gas(body, context.surroundings.atmosphere.pressure_pa, context.dt_s);
    solve_step(body, bodies.tables[i], settings, context.of_body(nullptr, profile_of(bodies, i)), scratch);
  });
  if (bodies.next_awake < bodies.awake.size()) return false;
  bodies.next_awake = 0;
  return true;
}

// Each body, or fleet of bodies, runs through its substeps by itself, and stays in cache. One call does about a
// millisecond of that; a body that takes longer for its tick is given fewer substeps at a time. Returns how many all
// bodies have done.
template <class Real>
std::uint32_t Simulation::step_freely(SoftBodies<Real>& bodies, const SubstepContext& context) {
  if (profiling) bodies.profiles.resize(bodies.states.size());
  const std::size_t threads = context.workers->threads();
  const std::size_t slots_max = bodies.plan.kernels->slots_per_ms / evaluations_of(context.integrator);
  const auto slots_of = [&](const StepTask& task) {
    const std::size_t lanes = task.bodies.size() == 1 ? 1 : bodies.plan.kernels->width;
    return bodies.plan.meshes[task.mesh]->rings.slot_count() * lanes;
  };
  bodies.done.resize(bodies.states.size());
  if (bodies.next_task == 0) {
    bodies.tasks = cut_into_tasks<Real>(bodies.plan, bodies.states, context);
    bodies.task_substeps = tick_substeps - substep_index;
    const std::size_t threads_a_task = bodies.tasks.size() == 1 ? threads : 1;
    for (const StepTask& task : bodies.tasks) {
      const auto most =
          static_cast<std::uint32_t>(std::max<std::size_t>(slots_max * threads_a_task / slots_of(task), 1));
      bodies.task_substeps = std::min(bodies.task_substeps, most);
    }
  }
  const std::size_t first = bodies.next_task;
  for (std::size_t slots = 0; bodies.next_task < bodies.tasks.size() && slots < slots_max * threads;) {
    slots += slots_of(bodies.tasks[bodies.next_task++]) * bodies.task_substeps;
  }
  const auto tasks = std::span(std::as_const(bodies.tasks)).subspan(first, bodies.next_task - first);
  if (tasks.size() == 1) {
    run_task(bodies, tasks[0], context, bodies.scratch->at_least(1)[0]);
  } else {
    const SubstepContext alone = context.of_body(nullptr, context.profile);
    run_tasks(*context.workers, tasks, bodies.scratch->of_threads,
              [&](const StepTask& task, LaneScratch<Real>& scratch) { run_task(bodies, task, alone, scratch); });
  }
  for (const StepTask& task : tasks) {
    for (const std::uint32_t i : task.bodies) {
      if (bodies.done[i] == 0) step_closely(bodies, i, bodies.task_substeps, context);
    }
  }
  if (bodies.next_task < bodies.tasks.size()) return 0;
  bodies.next_task = 0;
  return bodies.task_substeps;
}

template <class Real>
void Simulation::run_task(SoftBodies<Real>& bodies, const StepTask& task, const SubstepContext& context,
                          LaneScratch<Real>& scratch) {
  TaskStates<Real> room{};
  std::array<std::uint8_t, pack_slots> done{};
  physics::step_freely<Real>(states_of(bodies, task, room), {bodies.plan.meshes[task.mesh].get(), bodies.plan.kernels},
                             context.of_body(context.workers, profile_of(bodies, task.bodies[0])), bodies.task_substeps,
                             scratch, done);
  for (std::size_t i = 0; i < task.bodies.size(); ++i) bodies.done[task.bodies[i]] = done[i];
}

template <class Real>
void Simulation::step_closely(SoftBodies<Real>& bodies, std::size_t index, std::uint32_t substeps,
                              const SubstepContext& context) {
  LaneScratch<Real>& scratch = bodies.scratch->at_least(1)[0];
  SoftState<Real>& body = bodies.states[index];
  for (std::uint32_t i = 0; i < substeps && !body.frozen; ++i) {
    step_to_contact<Real>(std::array{&body}, lanes_of(bodies, index),
                          context.of_body(nullptr, profile_of(bodies, index)), scratch);
    if (body.gas_event) report_gas(body);
    if (!is_well(body, extents_of(body))) frozen.push_back({body.body.name, freeze(body)});
    for (std::size_t k = 0; k < body.x.size(); ++k) body.x[k] += body.dr[k];
  }
}

// Who sleeps keeps the contacts it fell asleep with.
template <class Real>
void Simulation::begin_notes(SoftBodies<Real>& bodies, const SubstepContext& context) const {
  if (!noting || !context.is_last_of_tick()) return;
  bodies.notes.resize(bodies.states.size());
  for (std::size_t i = 0; i < bodies.notes.size(); ++i) {
    if (!bodies.states[i].rest.asleep) bodies.notes[i].clear();
  }
}

// None where contact comes after the step, by the masses of the vertices.
template <class Real>
std::span<const std::vector<Vec3<Real>>> Simulation::coupled_start_m_s(const SoftBodies<Real>& bodies) {
  const auto is_small = [](const SoftState<Real>& body) { return body.x.size() <= coupled_vertices_max; };
  if (!std::ranges::all_of(bodies.states, is_small)) return {};
  return bodies.start_m_s;
}

std::optional<StageAccuracy> Simulation::first_order() const {
  if (choice.integrator != Integrator::tr_bdf2) return {};
  return StageAccuracy{scene.stepping.newton_iterations, scene.stepping.error_target};
}

template <class Real>
LaneTables<Real> Simulation::lanes_of(const SoftBodies<Real>& bodies, std::size_t index) {
  return {&bodies.plan.mesh_of(index), bodies.plan.kernels};
}

template <class Real>
Profile* Simulation::profile_of(SoftBodies<Real>& bodies, std::size_t index) const {
  return profiling ? &bodies.profiles[index] : nullptr;
}

template <class Real>
void Simulation::freeze_runaways(SoftBodies<Real>& bodies, const SubstepContext& context) {
  const StageTimer timer(bodies.plan.may_touch ? context.profile : nullptr, Stage::bounds);
  bodies.extents.resize(bodies.states.size());
  std::size_t vertices = 0;
  for (const SoftState<Real>& body : bodies.states) vertices += body.is_awake() ? body.x.size() : 0;
  const auto look = [&](std::size_t i) {
    if (bodies.states[i].is_awake()) bodies.extents[i] = extents_of(bodies.states[i]);
  };
  if (context.workers->threads() > 1 && vertices >= shared_vertices_min) {
    context.workers->for_each(bodies.states.size(), look);
  } else {
    for (std::size_t i = 0; i < bodies.states.size(); ++i) look(i);
  }
  for (std::size_t i = 0; i < bodies.states.size(); ++i) {
    SoftState<Real>& body = bodies.states[i];
    if (!body.is_awake() && !body.is_crowded) continue;
    const bool is_out = body.solve_failed || body.is_crowded;
    if (is_out || !is_well(body, bodies.extents[i])) frozen.push_back({body.body.name, freeze(body)});
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

template void Simulation::step_closely<float>(SoftBodies<float>&, std::size_t, std::uint32_t, const SubstepContext&);
template void Simulation::step_closely<double>(SoftBodies<double>&, std::size_t, std::uint32_t, const SubstepContext&);

}  // namespace pneuma::physics
