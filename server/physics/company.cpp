#include "physics/company.h"

#include <algorithm>
#include <array>
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

  [[nodiscard]] SoftState<Real>& state() const { return bodies->states[index]; }
};

bool same_substeps(const SubstepContext& a, const SubstepContext& b) {
  return a.integrator == b.integrator && a.dt_s == b.dt_s && a.substeps_left == b.substeps_left &&
         a.surroundings.gravity == b.surroundings.gravity && a.surroundings.atmosphere == b.surroundings.atmosphere;
}

// Alike bodies that wait for their lanes to fill.
template <class Real>
struct Rank {
  LaneTables<Real> lanes;
  SubstepContext context;
  std::vector<Member<Real>> members;

  [[nodiscard]] bool takes(const Member<Real>& member, const LaneTables<Real>& its_lanes,
                           const SubstepContext& its_context) const {
    return lanes.mesh == its_lanes.mesh && same_substeps(context, its_context) &&
           go_abreast(members.front().state(), member.state(), lanes.mesh->rings);
  }
};

template <class Real>
void step(std::span<const Member<Real>> members, const LaneTables<Real>& lanes, const SubstepContext& context,
          LaneScratch<Real>& scratch) {
  std::array<SoftState<Real>*, pack_slots> states{};
  std::array<std::uint8_t, pack_slots> done{};
  for (std::size_t i = 0; i < members.size(); ++i) states[i] = &members[i].state();
  step_freely<Real>(std::span(states).first(members.size()), lanes, context, context.substeps_left, scratch, done);
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (done[i] != 0) continue;
    members[i].simulation->step_closely(*members[i].bodies, members[i].index, context.substeps_left, context);
  }
}

// The bodies of one precision, on their way to the lanes.
template <class Real>
class Ranks {
 public:
  // Steps those that go alone at once.
  void add(Simulation& simulation, SoftBodies<Real>& bodies, const SubstepContext& context) {
    for (const StepGroup& group : bodies.plan.groups) {
      const LaneTables<Real> lanes{bodies.plan.meshes[group.mesh].get(), bodies.plan.kernels};
      for (const std::uint32_t i : group.members) {
        const Member<Real> member{&simulation, &bodies, i};
        if (!member.state().is_awake()) continue;
        if (fits_abreast(member.state(), lanes, context)) {
          add(member, lanes, context);
        } else {
          step<Real>({&member, 1}, lanes, context, scratch_);
        }
      }
    }
  }

  // Those whose lanes are not full yet.
  void step_rest() {
    for (const Rank<Real>& rank : ranks_) {
      const std::span members(rank.members);
      if (makes_fleet(members.size(), rank.lanes.kernels->width)) {
        step<Real>(members, rank.lanes, rank.context, scratch_);
      } else {
        for (const Member<Real>& member : members) step<Real>({&member, 1}, rank.lanes, rank.context, scratch_);
      }
    }
    ranks_.clear();
  }

 private:
  void add(const Member<Real>& member, const LaneTables<Real>& lanes, const SubstepContext& context) {
    auto rank = std::ranges::find_if(ranks_, [&](const auto& other) { return other.takes(member, lanes, context); });
    if (rank == ranks_.end()) rank = ranks_.insert(rank, {lanes, context, {}});
    rank->members.push_back(member);
    if (rank->members.size() < lanes.kernels->width) return;
    step<Real>(rank->members, lanes, context, scratch_);
    ranks_.erase(rank);
  }

  std::vector<Rank<Real>> ranks_;
  LaneScratch<Real> scratch_;
};

}  // namespace

struct Company::Room {
  Workers alone{1};
  std::tuple<Ranks<float>, Ranks<double>> ranks;
};

Company::Company() : room_(std::make_unique<Room>()) {}
Company::~Company() = default;
Company::Company(Company&&) noexcept = default;
Company& Company::operator=(Company&&) noexcept = default;

void Company::prepare(World& world) {
  world.simulation_->in_company = true;
  world.simulation_->make_plan();
}

void Company::step_tick(std::span<World* const> worlds) {
  std::vector<Simulation*> together;
  for (World* world : worlds) {
    Simulation& simulation = *world->simulation_;
    if (!simulation.begins_free_tick() || simulation.profiling) {
      world->step_tick(room_->alone);
      continue;
    }
    const SubstepContext context = simulation.context_on(room_->alone).of_body(nullptr, nullptr);
    simulation.touches.clear();
    simulation.visit([&]<class Real>(SoftBodies<Real>& bodies) {
      std::get<Ranks<Real>>(room_->ranks).add(simulation, bodies, context);
    });
    together.push_back(&simulation);
  }
  std::apply([](auto&... ranks) { (ranks.step_rest(), ...); }, room_->ranks);
  for (Simulation* simulation : together) simulation->end_substeps(simulation->choice.substeps);
}

}  // namespace pneuma::physics
