#include "physics/world.h"

#include <algorithm>
#include <cassert>
#include <sstream>
#include <utility>

#include "physics/choice/step_choice.h"
#include "physics/contact/distinct_contacts.h"
#include "physics/forces/force_terms.h"
#include "physics/forces/soft_setup.h"
#include "physics/rest/sleep.h"
#include "physics/scene/admission.h"
#include "physics/simulation.h"

namespace pneuma::physics {

namespace {

bool names(const std::vector<std::string>& list, const std::string& name) {
  return std::ranges::find(list, name) != list.end();
}

// Whether all soft bodies go on, and solids and joints are the same ones, all in their order.
template <class Real>
bool all_go_on(const SoftBodies<Real>& bodies, const Scene& before, const Scene& after) {
  const auto are_same = [](const auto& first, const auto& second) {
    const auto name = [](const auto& each) -> const std::string& { return each.name; };
    return std::ranges::equal(first, second, {}, name, name);
  };
  const auto goes_on = [](const SoftState<Real>& state, const SoftBody& body) {
    return state.body.name == body.name && continues(state.body, body);
  };
  return std::ranges::equal(bodies.states, after.soft_bodies, goes_on) &&
         are_same(before.rigid_bodies, after.rigid_bodies) && are_same(before.colliders, after.colliders) &&
         are_same(before.joints, after.joints);
}

template <class Real>
void apply_soft_bodies(SoftBodies<Real>& bodies, const std::vector<SoftBody>& wanted,
                       const std::vector<std::string>& renewed) {
  std::vector<SoftState<Real>> states;
  states.reserve(wanted.size());
  for (const SoftBody& body : wanted) {
    const auto live = std::ranges::find(bodies.states, body.name, [](const auto& state) { return state.body.name; });
    if (live != bodies.states.end() && !names(renewed, body.name) && continues(live->body, body)) {
      states.push_back(*live);
      change_soft_state(states.back(), body);
    } else {
      states.push_back(make_soft_state<Real>(body));
    }
  }
  bodies.states = std::move(states);
  bodies.profiles.clear();
  bodies.contacts = {};
  bodies.notes = {};
}

void add_times(Profile& sum, const Profile& profile) {
  for (std::size_t stage = 0; stage < stage_count; ++stage) {
    sum[stage].time += profile[stage].time;
    sum[stage].calls += profile[stage].calls;
  }
}

// A solid is put where the scene says: World::scene() told its live pose, and an edit left that alone or set another.
std::vector<RigidState> applied_rigid_bodies(const std::vector<RigidState>& live, const std::vector<RigidBody>& wanted,
                                             const std::vector<std::string>& renewed) {
  std::vector<RigidState> states;
  states.reserve(wanted.size());
  for (const RigidBody& body : wanted) {
    states.push_back(make_rigid_state(body));
    const auto before = std::ranges::find(live, body.name, [](const RigidState& state) { return state.body.name; });
    if (before == live.end() || names(renewed, body.name)) continue;
    states.back().frozen = before->frozen;
    states.back().rest = before->rest;
    states.back().place = before->place;
    states.back().place_orientation = before->place_orientation;
    states.back().near_place = before->near_place;
    states.back().near_orientation = before->near_orientation;
  }
  return states;
}

std::vector<ColliderState> applied_colliders(const std::vector<ColliderState>& live,
                                             const std::vector<Collider>& wanted) {
  std::vector<ColliderState> states;
  states.reserve(wanted.size());
  for (const Collider& collider : wanted) {
    const auto* shape = std::get_if<MeshShape>(&collider.shape);
    const auto same = std::ranges::find_if(
        live, [&](const ColliderState& state) { return shape && state.tree && state.tree->mesh == shape->mesh; });
    if (same == live.end()) {
      states.push_back(make_collider_state(collider));
    } else {
      states.push_back({collider, collider.position, collider.orientation, same->tree});
    }
  }
  return states;
}

}  // namespace

World::World(std::unique_ptr<Simulation> simulation) : simulation_(std::move(simulation)) {}
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

base::Result<World> World::create(Scene scene) {
  if (base::Status status = check_scene(scene); !status.ok()) return status;
  FrequencyTable frequencies;
  base::Result<SubstepChoice> choice = choose_substeps(scene, frequencies);
  if (!choice.ok()) return choice.status();
  World world(std::make_unique<Simulation>(std::move(scene), std::move(*choice)));
  world.simulation_->frequencies = std::move(frequencies);
  return world;
}

base::Status World::apply(Scene scene, const std::vector<std::string>& renewed) {
  assert(simulation_->tick_substeps == 0);
  if (base::Status status = check_scene(scene); !status.ok()) return status;
  if (scene.stepping.precision != simulation_->scene.stepping.precision) {
    return {base::StatusCode::failed_precondition, "the precision of a running world cannot change",
            "stepping.precision"};
  }
  base::Result<SubstepChoice> choice = choose_substeps(scene, simulation_->frequencies);
  if (!choice.ok()) return choice.status();

  Simulation& sim = *simulation_;
  if (scene.stepping.rate_hz != sim.scene.stepping.rate_hz) {
    sim.time_base_s = sim.time_s();
    sim.tick_base = sim.tick;
  }
  sim.visit([&]<class Real>(SoftBodies<Real>& bodies) {
    if (!renewed.empty() || !all_go_on(bodies, sim.scene, scene)) sim.warm.clear();  // its keys count bodies and joints
    wake_changed<Real>(bodies.states, sim.rigid, this->scene(), scene);
    for (const Profile& profile : bodies.profiles) add_times(sim.profile, profile);
    apply_soft_bodies(bodies, scene.soft_bodies, renewed);
  });
  sim.rigid = applied_rigid_bodies(sim.rigid, scene.rigid_bodies, renewed);
  sim.colliders = applied_colliders(sim.colliders, scene.colliders);
  sim.touches.clear();
  sim.choice = std::move(*choice);
  sim.scene = std::move(scene);
  sim.make_joints(std::exchange(sim.joints, {}), renewed);
  sim.make_plan();
  return {};
}

Scene World::scene() const {
  Scene scene = simulation_->scene;
  simulation_->visit([&](const auto& bodies) {
    for (std::size_t i = 0; i < bodies.states.size(); ++i) scene.soft_bodies[i] = live_body(bodies.states[i]);
  });
  for (std::size_t i = 0; i < scene.rigid_bodies.size(); ++i) {
    const RigidState& live = simulation_->rigid[i];
    scene.rigid_bodies[i].position = live.position;
    scene.rigid_bodies[i].orientation = live.orientation;
    scene.rigid_bodies[i].velocity = live.velocity;
    scene.rigid_bodies[i].angular_velocity = live.angular_velocity;
  }
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    scene.colliders[i].position = simulation_->colliders[i].position;
    scene.colliders[i].orientation = simulation_->colliders[i].orientation;
  }
  return scene;
}

bool World::substep(Workers& workers) {
  return simulation_->substep(workers);
}

void World::step_tick(Workers& workers) {
  while (!simulation_->substep(workers)) {
  }
}

std::uint64_t World::tick() const {
  return simulation_->tick;
}
double World::time_s() const {
  return simulation_->time_s();
}
double World::tick_period_s() const {
  return simulation_->period_s();
}
std::uint32_t World::substeps() const {
  return simulation_->choice.substeps;
}
Integrator World::integrator() const {
  return simulation_->choice.integrator;
}
const std::string& World::substeps_reason() const {
  return simulation_->choice.reason;
}

const Vec3d& World::gravity_m_s2() const {
  return simulation_->scene.gravity;
}
const Atmosphere& World::atmosphere() const {
  return simulation_->scene.atmosphere;
}
Frequencies World::frequencies(std::size_t soft_index) const {
  SoftBody body = soft_body(soft_index);
  if (!gas(soft_index)) body.gas.reset();
  return simulation_->frequencies.estimate_another(body, atmosphere());
}

std::size_t World::soft_body_count() const {
  return simulation_->scene.soft_bodies.size();
}
const SoftBody& World::soft_body(std::size_t index) const {
  return simulation_->scene.soft_bodies[index];
}

const std::optional<GasState>& World::gas(std::size_t soft_index) const {
  return simulation_->visit(
      [&](const auto& bodies) -> const std::optional<GasState>& { return bodies.states[soft_index].gas; });
}

bool World::is_frozen(std::size_t soft_index) const {
  return simulation_->visit([&](const auto& bodies) { return bodies.states[soft_index].frozen; });
}

bool World::is_predictable(std::size_t soft_index) const {
  return simulation_->visit([&](const auto& bodies) {
    return physics::is_predictable(bodies.states[soft_index], {gravity_m_s2(), atmosphere()});
  });
}

bool World::is_asleep(std::size_t soft_index) const {
  return simulation_->visit([&](const auto& bodies) { return bodies.states[soft_index].rest.asleep; });
}

void World::copy_positions(std::size_t soft_index, std::span<double> out_m) const {
  simulation_->visit([&](const auto& bodies) {
    const auto& body = bodies.states[soft_index];
    assert(out_m.size() == 3 * body.x.size());
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      const Vec3d position_m = body.position_m(i);
      for (int axis = 0; axis < 3; ++axis) out_m[3 * i + static_cast<std::size_t>(axis)] = position_m[axis];
    }
  });
}

void World::copy_velocities(std::size_t soft_index, std::span<double> out_m_s) const {
  simulation_->visit([&](const auto& bodies) {
    const auto& body = bodies.states[soft_index];
    assert(out_m_s.size() == 3 * body.v.size());
    for (std::size_t i = 0; i < body.v.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        out_m_s[3 * i + static_cast<std::size_t>(axis)] = static_cast<double>(body.v[i][axis]);
      }
    }
  });
}

BodyMeasures World::measure(std::size_t soft_index) const {
  const Scene& scene = simulation_->scene;
  return simulation_->visit([&](const auto& bodies) {
    return physics::measure(bodies.states[soft_index], scene.atmosphere.pressure_pa, scene.gravity);
  });
}

BodyMeasures World::measure_motion(std::size_t soft_index) const {
  return simulation_->visit([&](const auto& bodies) {
    return physics::measure_motion(bodies.states[soft_index], simulation_->scene.atmosphere.pressure_pa);
  });
}

const std::vector<RigidState>& World::rigid_bodies() const {
  return simulation_->rigid;
}
const std::vector<ColliderState>& World::colliders() const {
  return simulation_->colliders;
}

const std::vector<JointState>& World::joints() const {
  return simulation_->joints;
}

std::string describe(const GasEvent& event) {
  std::ostringstream text;
  text << event.pressure_pa << " Pa over the outside at " << event.volume_m3 << " m3";
  return text.str();
}

std::vector<FrozenBody> World::take_frozen() {
  return std::exchange(simulation_->frozen, {});
}

std::vector<BodyGasEvent> World::take_gas_events() {
  return std::exchange(simulation_->gas_events, {});
}

std::vector<BrokenJoint> World::take_broken_joints() {
  return std::exchange(simulation_->broken_joints, {});
}

void World::note_contacts(bool on) {
  if (std::exchange(simulation_->noting, on) == on) return;
  if (on) return;
  simulation_->visit([](auto& bodies) { bodies.notes = {}; });
  simulation_->touches.clear();
}

ContactNotes World::contacts(std::size_t soft_index) const {
  return distinct(simulation_->visit(
      [&](const auto& bodies) { return bodies.notes.empty() ? ContactNotes() : bodies.notes[soft_index]; }));
}

std::vector<BodyTouch> World::touches() const {
  return simulation_->touches.touches();
}

RowCounts World::row_counts() const {
  return simulation_->visit([](const auto& bodies) { return bodies.contacts.row_counts(); });
}

void World::set_profiling(bool on) {
  simulation_->profiling = on;
}

Profile World::profile() const {
  Profile sum = simulation_->profile;
  const auto add_bytes = [&](Stage stage, std::size_t bytes) { sum[static_cast<std::size_t>(stage)].bytes += bytes; };
  simulation_->visit([&]<class Real>(const SoftBodies<Real>& bodies) {
    for (const Profile& profile : bodies.profiles) add_times(sum, profile);
    for (const auto& mesh : bodies.plan.meshes) add_bytes(Stage::springs, mesh->bytes());
    if (const LaneRooms<Real>* rooms = bodies.scratch.held()) add_bytes(Stage::integrate, rooms->bytes());
    for (const SolverScratch<Real>& scratch : bodies.solvers) add_bytes(Stage::integrate, scratch.bytes());
    if (bodies.matrices) add_bytes(Stage::integrate, bodies.matrices->bytes());
    for (const auto& start_m_s : bodies.start_m_s)
      add_bytes(Stage::integrate, start_m_s.capacity() * sizeof(Vec3<Real>));
    for (const SoftState<Real>& state : bodies.states) {
      ForceTerms::for_each([&]<class Term>() { add_bytes(Term::stage, Term::bytes(state)); });
      add_bytes(Stage::integrate, state.pinned.capacity() + state.mass_shares.capacity() * sizeof(double));
      add_bytes(Stage::move, (state.x.capacity() + state.v.capacity() + state.dr.capacity()) * sizeof(Vec3<Real>));
      add_bytes(Stage::sleep, state.place.capacity() * sizeof(Vec3<Real>));
    }
    bodies.contacts.add_bytes(sum);
    add_bytes(Stage::integrate, bodies.gains.bytes());
    for (const ContactNotes& notes : bodies.notes) {
      add_bytes(Stage::solid_contact, notes.capacity() * sizeof(VertexContact));
    }
  });
  add_bytes(Stage::solid_contact, simulation_->touches.bytes());
  add_bytes(Stage::solid_contact, simulation_->warm.capacity() * sizeof(WarmImpulse));
  add_bytes(Stage::joints, simulation_->joints.capacity() * sizeof(JointState));
  add_bytes(Stage::rigid, simulation_->rigid.capacity() * sizeof(RigidState));
  add_bytes(Stage::solid_contact, simulation_->colliders.capacity() * sizeof(ColliderState));
  return sum;
}

}  // namespace pneuma::physics
