#include "physics/world_batch.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <ranges>
#include <tuple>
#include <vector>

#include "physics/choice/step_plan.h"
#include "physics/simulation.h"

namespace pneuma::physics {

namespace {

template <class Real>
struct Member {
  Simulation* simulation = nullptr;
  SoftBodies<Real>* bodies = nullptr;
  std::size_t index = 0;
  SubstepContext context;
  std::size_t turn = 0;  // in which World::step_tick would come to it

  [[nodiscard]] SoftState<Real>& state() const { return bodies->states[index]; }
};

bool same_substeps(const SubstepContext& a, const SubstepContext& b) {
  return a.integrator == b.integrator && a.dt_s == b.dt_s && a.substeps_left == b.substeps_left &&
         a.surroundings.gravity == b.surroundings.gravity && a.surroundings.atmosphere == b.surroundings.atmosphere;
}

// Alike bodies that wait for their lanes to fill.
template <class Real>
struct LaneBatch {
  LaneTables<Real> lanes;
  std::vector<Member<Real>> members;

  [[nodiscard]] bool takes(const Member<Real>& member, const LaneTables<Real>& its_lanes) const {
    return lanes.mesh == its_lanes.mesh && same_substeps(members.front().context, member.context) &&
           go_abreast(members.front().state(), member.state(), lanes.mesh->rings);
  }
};

// The bodies of one precision, on their way to the lanes.
template <class Real>
class LaneBatches {
 public:
  // What an earlier tick left is forgotten: it did not end.
  void begin() {
    batches_.clear();
    left_.clear();
    turn_ = 0;
    shared_ = 0;
  }

  // Bodies that go alone are stepped at once.
  void add(Simulation& simulation, SoftBodies<Real>& bodies, const SubstepContext& context) {
    for (const StepGroup& group : bodies.plan.groups) {
      const LaneTables<Real> lanes{bodies.plan.meshes[group.mesh].get(), bodies.plan.kernels};
      const auto fits = [&](std::uint32_t i) { return fits_abreast(bodies.states[i], lanes, context); };
      const auto is_awake = [&](std::uint32_t i) { return bodies.states[i].is_awake(); };
      auto awake = group.members | std::views::filter(is_awake);
      for (const std::uint32_t i : awake) {
        const Member<Real> member{&simulation, &bodies, i, context, turn_++};
        if (!fits(i)) step({&member, 1}, lanes);
      }
      for (const std::uint32_t i : awake) {
        if (fits(i)) add({&simulation, &bodies, i, context, turn_++}, lanes);
      }
    }
  }

  // Those whose lanes are not full; then those that may run away, each by itself. Returns how many shared lanes.
  std::size_t end() {
    for (const LaneBatch<Real>& batch : batches_) {
      const std::span members(batch.members);
      if (makes_fleet(members.size(), batch.lanes.kernels->width)) {
        step(members, batch.lanes);
      } else {
        for (const Member<Real>& member : members) step({&member, 1}, batch.lanes);
      }
    }
    std::ranges::sort(left_, {}, &Member<Real>::turn);
    for (const Member<Real>& member : left_) {
      member.simulation->step_closely(*member.bodies, member.index, member.context.substeps_left, member.context);
    }
    return shared_;
  }

 private:
  void add(const Member<Real>& member, const LaneTables<Real>& lanes) {
    auto batch = std::ranges::find_if(batches_, [&](const auto& other) { return other.takes(member, lanes); });
    if (batch == batches_.end()) batch = batches_.insert(batch, {lanes, {}});
    batch->members.push_back(member);
    if (batch->members.size() < lanes.kernels->width) return;
    step(batch->members, lanes);
    batches_.erase(batch);
  }

  void step(std::span<const Member<Real>> members, const LaneTables<Real>& lanes) {
    std::array<SoftState<Real>*, pack_slots> states{};
    std::array<std::uint8_t, pack_slots> done{};
    const SubstepContext& context = members.front().context;
    for (std::size_t i = 0; i < members.size(); ++i) states[i] = &members[i].state();
    step_freely<Real>(std::span(states).first(members.size()), lanes, context, context.substeps_left, scratch_, done);
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (done[i] == 0) left_.push_back(members[i]);
    }
    if (members.size() > 1) shared_ += members.size();
  }

  std::vector<LaneBatch<Real>> batches_;
  std::vector<Member<Real>> left_;
  std::size_t turn_ = 0;
  std::size_t shared_ = 0;
  LaneScratch<Real> scratch_;
};

}  // namespace

struct WorldBatch::Scratch {
  Workers alone{1};
  std::vector<Simulation*> together;
  std::tuple<LaneBatches<float>, LaneBatches<double>> batches;
};

WorldBatch::WorldBatch() : scratch_(std::make_unique<Scratch>()) {}
WorldBatch::~WorldBatch() = default;
WorldBatch::WorldBatch(WorldBatch&&) noexcept = default;
WorldBatch& WorldBatch::operator=(WorldBatch&&) noexcept = default;

void WorldBatch::prepare(World& world) {
  world.simulation_->in_batch = true;
  world.simulation_->make_plan();
}

std::size_t WorldBatch::step_tick(std::span<World* const> worlds) {
  std::vector<Simulation*>& together = scratch_->together;
  together.clear();
  std::apply([](auto&... of_precision) { (of_precision.begin(), ...); }, scratch_->batches);
  for (World* world : worlds) {
    Simulation& simulation = *world->simulation_;
    assert(std::ranges::find(together, &simulation) == together.end() && "a world is named once");
    if (!simulation.begins_free_tick() || simulation.profiling) {
      world->step_tick(scratch_->alone);
      continue;
    }
    simulation.begin_tick();
    const SubstepContext context = simulation.context_on(scratch_->alone).of_body(nullptr, nullptr);
    simulation.visit([&]<class Real>(SoftBodies<Real>& bodies) {
      std::get<LaneBatches<Real>>(scratch_->batches).add(simulation, bodies, context);
    });
    together.push_back(&simulation);
  }
  const std::size_t shared =
      std::apply([](auto&... of_precision) { return (of_precision.end() + ...); }, scratch_->batches);
  for (Simulation* simulation : together) simulation->end_substeps(simulation->tick_substeps);
  return shared;
}

}  // namespace pneuma::physics
