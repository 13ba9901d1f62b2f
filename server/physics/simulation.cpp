#include "physics/simulation.h"

#include <algorithm>
#include <utility>

#include "physics/contact/touch_groups.h"
#include "physics/forces/gas.h"
#include "physics/forces/soft_setup.h"
#include "physics/rest/sleep.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/state/origin.h"

namespace pneuma::physics {

RigidState make_rigid_state(const RigidBody& body) {
  RigidState state;
  state.body = body;
  state.position = body.position;
  state.orientation = body.orientation;
  state.velocity = free_part(body.locked.translation, body.velocity);
  state.angular_velocity = free_part(body.locked.rotation, body.angular_velocity);
  state.inverse_mass_1_kg = 1.0 / body.mass_kg;
  state.inverse_inertia_1_kg_m2 = principal_inertia_kg_m2(body.shape, body.mass_kg).cwiseInverse();
  state.principal_axes = principal_axes(body.shape);
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
  warm.clear();  // its keys count joints
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
      const Abreast abreast = !is_explicit(choice.integrator) ? Abreast::none
                              : in_batch                      ? Abreast::of_several_worlds
                                                              : Abreast::of_the_world;
      bodies.plan = make_step_plan<Real>(bodies.states, !rigid.empty() || !colliders.empty() || !joints.empty(),
                                         abreast, bodies.plan);
    } else {
      bodies.plan = {};
    }
    if (!is_explicit(choice.integrator)) make_tables<Real>(bodies, held_before);
    bodies.scratch = {};
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

void Simulation::end_tick() {
  substep_index = 0;
  tick_substeps = 0;
  ++tick;
  visit([this](auto& bodies) {
    bodies.carried_out.end(bodies.states, rigid);
    bodies.contacts.end_tick();
    if (bodies.scratch.held() != nullptr && !bodies.scratch.held()->has_team()) bodies.scratch.give_back();
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

}  // namespace pneuma::physics
