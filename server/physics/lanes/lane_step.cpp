#include "physics/lanes/lane_step.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <optional>

#include "physics/forces/gas.h"
#include "physics/lanes/lane_team.h"

namespace pneuma::physics {

namespace {

// Waking other threads takes some microseconds, in which one thread does about this many slots.
constexpr std::size_t parallel_slots_min = 4'096;

// More than the second cache level holds, at about a hundred bytes a slot.
constexpr std::size_t streaming_slots_min = 16'384;

// Of the threads that share a body, one. Alone, it is the first.
template <class Real>
struct Membership {
  LaneTeam<Real>* team = nullptr;
  std::size_t member = 0;
  BlockRun blocks;
  LaneScratch<Real>* first = nullptr;  // the first one's room
};

bool is_last(Substage substage) {
  return substage == Substage::euler || substage == Substage::symplectic || substage == Substage::midpoint_full ||
         substage == Substage::rk4_fourth;
}

// The substep on the bodies under way in the lanes, or on a member's share of one.
template <class Real>
class LaneStep {
 public:
  LaneStep(std::span<SoftState<Real>* const> bodies, const LaneTables<Real>& lanes, const SubstepContext& context,
           bool advance, LaneScratch<Real>& scratch, const Membership<Real>& membership)
      : layout_(bodies.size() == 1 ? LaneLayout::alone : LaneLayout::fleet),
        width_(layout_ == LaneLayout::fleet ? lanes.kernels->width : 1),
        mesh_(*lanes.mesh),
        kernels_(*lanes.kernels),
        context_(context),
        advance_(advance),
        scratch_(scratch),
        team_(membership.team),
        member_(membership.member),
        first_scratch_(*membership.first),
        bodies_(bodies, layout_, width_, mesh_, scratch, membership.blocks),
        damped_(bodies[0]->body.springs.damping_n_s_m > 0.0),
        gas_(has_lane_gas(*bodies[0], mesh_.rings)),
        scaled_(!mesh_.stiffness_scales.empty()),
        pulled_(layout_ == LaneLayout::fleet && !mesh_.edges.lengths_m.empty()),
        weighed_(!bodies[0]->mass_shares.empty()),
        sprung_(damped_ || gas_ || has_stiffness(bodies)),
        other_forces_(has_other_forces(*bodies[0], mesh_.rings, context.surroundings)) {
    make_room();
    set_constants();
    bodies_.load(gas_, weighed_);
    if (team_ != nullptr && sprung_) join_team();
  }

  // The forces of a substep and what they do, between two states of the gas.
  void substep() {
    const auto from_start = [&](Substage substage) { evaluate_and_update(scratch_.x, scratch_.v, substage); };
    const auto from_stage = [&](Substage substage) {
      evaluate_and_update(scratch_.x_stage, scratch_.v_stage, substage);
    };
    switch (context_.integrator) {
      case Integrator::explicit_euler:
        return from_start(Substage::euler);
      case Integrator::symplectic_euler:
        return from_start(Substage::symplectic);
      case Integrator::midpoint:
        from_start(Substage::midpoint_half);
        return from_stage(Substage::midpoint_full);
      case Integrator::rk4:
        from_start(Substage::rk4_first);
        from_stage(Substage::rk4_second);
        from_stage(Substage::rk4_third);
        return from_stage(Substage::rk4_fourth);
      default:
        assert(false && "no explicit method");
    }
  }

  // Lets the gas of each body flow. A lane in which more happens than that (advance_gas) is not to be kept.
  void flow() {
    if (member_ != 0) return;
    for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
      SoftState<Real>& body = bodies_[lane];
      if (!body.gas) continue;
      if (bursts(body) || inverts(body)) eventful_[lane] = 1;
      if (!flows(*body.body.gas)) continue;
      flow_gas(*body.gas, *body.body.gas, body.volume_m3, body.pressure_pa,
               context_.surroundings.atmosphere.pressure_pa, context_.dt_s);
    }
  }

  // Sets done[lane] where all substeps so far kept a body within what freezes it, and its gas just flowed, and hands
  // back those bodies.
  void hand_back(std::uint32_t substeps, std::span<std::uint8_t> done) {
    std::array<std::uint8_t, pack_slots> well{};
    bodies_.find_well(substeps, update_.v_max_m_s, update_.move_max_m, well);
    for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
      if (eventful_[lane] != 0) well[lane] = 0;
    }
    if (team_ == nullptr) {
      std::ranges::copy_n(well.begin(), static_cast<std::ptrdiff_t>(bodies_.size()), done.begin());
    } else {
      team_->is_well(member_) = well[0];
      team_->meet(member_, [&] { done[0] = team_->are_all_well() ? 1 : 0; });
    }
    bodies_.store(done, advance_);
  }

  // Hands back v and the move.
  void hand_back() const {
    std::array<std::uint8_t, pack_slots> all{};
    all.fill(1);
    bodies_.store(all, advance_);
  }

 private:
  [[nodiscard]] static bool has_stiffness(std::span<SoftState<Real>* const> bodies) {
    return std::ranges::any_of(bodies, [](const auto* body) { return body->body.springs.stiffness_n_m > 0.0; });
  }
  void make_room() {
    const std::size_t size = mesh_.rings.slot_count() * (layout_ == LaneLayout::fleet ? 3 * width_ : 4);
    resize_moving(scratch_, size);
    if (sprung_) {
      scratch_.force.resize(size);
    } else {
      scratch_.force.assign(size, Real{0});
    }
    if (gas_) scratch_.gradient.resize(size);
    if (weighed_) scratch_.inverse_shares.resize(size);
    if (pulled_) scratch_.pulls.resize(mesh_.edges.lengths_m.size() * width_);
    scratch_.block_volumes.resize(block_count_of(mesh_.rings));
    scratch_.pinned_slots.clear();
    if (bodies_[0].pinned.empty()) return;
    bodies_.for_slots([&](std::size_t slot, std::uint32_t vertex) {
      if (bodies_[0].is_pinned(vertex)) scratch_.pinned_slots.push_back(static_cast<std::uint32_t>(slot));
    });
  }

  // What the method moves.
  void resize_moving(LaneScratch<Real>& scratch, std::size_t size) const {
    const bool rk4 = context_.integrator == Integrator::rk4;
    const bool staged = rk4 || context_.integrator == Integrator::midpoint;
    scratch.x.resize(size);
    scratch.v.resize(size);
    if (!advance_) scratch.move.resize(size);
    if (staged) {
      scratch.x_stage.resize(size);
      scratch.v_stage.resize(size);
    }
    if (rk4) {
      scratch.x_slopes.resize(size);
      scratch.v_slopes.resize(size);
    }
  }

  static void point_at(LaneScratch<Real>& scratch, UpdatePass<Real>& update) {
    update.x = scratch.x.data();
    update.v = scratch.v.data();
    update.move = scratch.move.data();
    update.x_stage = scratch.x_stage.data();
    update.v_stage = scratch.v_stage.data();
    update.x_slopes = scratch.x_slopes.data();
    update.v_slopes = scratch.v_slopes.data();
  }

  // The halo's own motion, and its places in the member's x and v.
  void join_team() {
    const std::vector<std::uint32_t>& halo = team_->halo_of(member_);
    LaneScratch<Real>& moving = team_->halo_scratch(member_);
    resize_moving(moving, 4 * halo.size());
    halo_update_ = update_;
    halo_update_.begin = 0;
    halo_update_.end = halo.size();
    point_at(moving, halo_update_);
    if (weighed_) moving.inverse_shares.resize(4 * halo.size());
    moving.pinned_slots.clear();
    for (std::size_t i = 0; i < halo.size(); ++i) {
      const std::uint32_t vertex = mesh_.rings.vertices[halo[i]];
      for (auto* scratch : {&moving, &scratch_}) {
        const std::size_t slot = scratch == &moving ? i : halo[i];
        put_row(bodies_[0].x[vertex], scratch->x, slot);
        put_row(bodies_[0].v[vertex], scratch->v, slot);
      }
      if (weighed_) {
        const auto inverse = static_cast<Real>(1.0 / bodies_[0].mass_shares[vertex]);
        put_row({inverse, inverse, inverse}, moving.inverse_shares, i);
      }
      if (bodies_[0].is_pinned(vertex)) moving.pinned_slots.push_back(static_cast<std::uint32_t>(i));
    }
  }

  void set_constants() {
    ring_.packs = mesh_.rings.packs.data();
    ring_.neighbours = mesh_.rings.neighbours.data();
    ring_.far_neighbours = mesh_.rings.far_neighbours.data();
    if (mesh_.rings.slot_count() >= streaming_slots_min) ring_.fetch_end = bodies_.packs_end();
    ring_.lengths_m = mesh_.lengths_m.data();
    ring_.stiffness_scales = mesh_.stiffness_scales.data();
    ring_.edge_ends = mesh_.edges.ends.data();
    ring_.edge_lengths_m = mesh_.edges.lengths_m.data();
    ring_.edge_stiffness_scales = mesh_.edges.stiffness_scales.data();
    ring_.edge_count = mesh_.edges.lengths_m.size();
    ring_.ring_edges = mesh_.edges.of_ring.data();
    ring_.pulls_n_m = scratch_.pulls.data();
    ring_.force = scratch_.force.data();
    ring_.gradient = scratch_.gradient.data();
    weigh_.inverse_shares = scratch_.inverse_shares.data();
    weigh_.force = scratch_.force.data();
    weigh_.gradient = scratch_.gradient.data();
    update_.force = scratch_.force.data();
    update_.gradient = scratch_.gradient.data();
    point_at(scratch_, update_);
    update_.begin = bodies_.slots_begin();
    update_.end = bodies_.slots_end();
    update_.dt_s = static_cast<Real>(context_.dt_s);
    for (std::size_t c = 0; c < 3; ++c) {
      update_.gravity_m_s2[c] = static_cast<Real>(context_.surroundings.gravity[static_cast<Eigen::Index>(c)]);
    }
    for (std::size_t lane = 0; lane < pack_slots; ++lane) {
      const SoftState<Real>& body = bodies_.of_lane(lane);
      const Springs& springs = body.body.springs;
      ring_.stiffness_n_m.lanes[lane] = static_cast<Real>(springs.stiffness_n_m);
      ring_.rest_scale.lanes[lane] = static_cast<Real>(springs.rest_scale);
      ring_.damping_n_s_m.lanes[lane] = static_cast<Real>(springs.damping_n_s_m);
      update_.inverse_mass_1_kg.lanes[lane] = Real{1} / body.vertex_mass_kg;
    }
  }

  void evaluate_and_update(const LaneArray<Real>& x, const LaneArray<Real>& v, Substage substage) {
    if (sprung_) {
      const StageTimer timer(context_.profile, Stage::springs);
      pass_over_rings(x, v);
    }
    if (team_ == nullptr) {
      if (other_forces_) list_points(x, v);
      find_common_forces();
    } else {
      share_forces(x, v);
    }
    if (other_forces_) add_others();

    const StageTimer timer(context_.profile, Stage::integrate);
    if (weighed_) weigh(bodies_.at(bodies_.slots_begin(), 0, 0), bodies_.at(bodies_.slots_end(), 0, 0), weigh_);
    kernels_(layout_, substage, gas_, advance_, update_);
    if (!scratch_.pinned_slots.empty()) hold_pinned(substage, scratch_);
    if (team_ != nullptr && sprung_) move_halo(substage);
  }

  void weigh(std::size_t begin, std::size_t end, WeighPass<Real> pass) const {
    pass.begin = begin;
    pass.end = end;
    kernels_.weighs[gas_](pass);
  }

  void pass_over_rings(const LaneArray<Real>& x, const LaneArray<Real>& v) {
    ring_.x = x.data();
    ring_.v = v.data();
    if (team_ != nullptr) team_->prepare_to_send(member_, gas_);
    if (pulled_) kernels_.pulls[scaled_][damped_](ring_);
    for (std::size_t block = bodies_.blocks().begin; block < bodies_.blocks().end; ++block) {
      ring_.begin = block * block_packs;
      ring_.end = std::min(ring_.begin + block_packs, bodies_.packs_end());
      ring_.volumes_18_m3 = &scratch_.block_volumes[block];
      if (pulled_) {
        kernels_.pulled_rings[gas_](ring_);
      } else {
        kernels_(layout_, scaled_, damped_, gas_, ring_);
      }
    }
  }

  // What all of a body goes into: its volume and pressure, and the forces that the kernels do not know.
  void find_common_forces() {
    if (gas_) set_pressures();
    if (!other_forces_) return;
    assert(layout_ == LaneLayout::alone);
    scratch_.other_force.assign(bodies_[0].x.size(), Vec3<Real>::Zero());
    add_other_forces<Real>(bodies_[0],
                           {.x = scratch_.other_x,
                            .v = scratch_.other_v,
                            .surroundings = context_.surroundings,
                            .explicit_dt_s = context_.dt_s,
                            .profile = context_.profile},
                           &mesh_.rings, scratch_.other_force);
  }

  void share_forces(const LaneArray<Real>& x, const LaneArray<Real>& v) {
    if (sprung_) team_->send(member_, gas_, scratch_);
    if (other_forces_) list_points(x, v);
    team_->meet(member_, [&] {
      find_common_forces();
      team_->pressure_sixth_pa = update_.pressure_sixth_pa;
    });
    update_.pressure_sixth_pa = team_->pressure_sixth_pa;
  }

  void set_pressures() {
    {
      const StageTimer timer(context_.profile, Stage::volume);
      for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
        bodies_[lane].volume_m3 = (team_ == nullptr ? volume_18_m3(lane) : team_->volume_18_m3()) / 18.0;
      }
    }
    const StageTimer timer(context_.profile, Stage::pressure);
    for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
      update_pressure(bodies_[lane], context_.surroundings.atmosphere.pressure_pa);
      update_.pressure_sixth_pa.lanes[lane] = static_cast<Real>(bodies_[lane].pressure_pa / 6.0);
    }
    if (layout_ == LaneLayout::alone) return;
    std::fill(update_.pressure_sixth_pa.lanes + bodies_.size(), std::end(update_.pressure_sixth_pa.lanes),
              update_.pressure_sixth_pa.lanes[bodies_.size() - 1]);
  }

  [[nodiscard]] double volume_18_m3(std::size_t lane) const {
    double sum = 0.0;
    for (const PerLane<Real>& block : scratch_.block_volumes) sum += static_cast<double>(block.lanes[lane]);
    return sum;
  }

  void list_points(const LaneArray<Real>& x, const LaneArray<Real>& v) {
    bodies_.for_slots([&](std::size_t slot, std::uint32_t vertex) {
      const Real* position = x.data() + 4 * slot;
      const Real* velocity = v.data() + 4 * slot;
      first_scratch_.other_x[vertex] = {position[0], position[1], position[2]};
      first_scratch_.other_v[vertex] = {velocity[0], velocity[1], velocity[2]};
    });
  }

  void add_others() {
    const auto add = [&](Real* force, std::uint32_t vertex) {
      for (std::size_t c = 0; c < 3; ++c) {
        force[c] = (sprung_ ? force[c] : 0) + first_scratch_.other_force[vertex][static_cast<Eigen::Index>(c)];
      }
    };
    bodies_.for_slots([&](std::size_t slot, std::uint32_t vertex) { add(scratch_.force.data() + 4 * slot, vertex); });
    if (team_ == nullptr || !sprung_) return;
    const std::vector<std::uint32_t>& halo = team_->halo_of(member_);
    Real* force = team_->received(member_).force.data();
    for (std::size_t i = 0; i < halo.size(); ++i) add(force + 4 * i, mesh_.rings.vertices[halo[i]]);
  }

  // The same operations on the same numbers as its owners', and on to where the rings look for it.
  void move_halo(Substage substage) {
    const bool last = is_last(substage);
    if (last && !advance_) return;  // no rings after that
    typename LaneTeam<Real>::HaloForces& forces = team_->received(member_);
    halo_update_.force = forces.force.data();
    halo_update_.gradient = forces.gradient.data();
    halo_update_.pressure_sixth_pa = update_.pressure_sixth_pa;
    if (weighed_) {
      weigh(0, forces.force.size(),
            {.inverse_shares = team_->halo_scratch(member_).inverse_shares.data(),
             .force = forces.force.data(),
             .gradient = forces.gradient.data()});
    }
    kernels_(layout_, substage, gas_, advance_, halo_update_);
    const std::vector<std::uint32_t>& halo = team_->halo_of(member_);
    LaneScratch<Real>& moving = team_->halo_scratch(member_);
    if (!moving.pinned_slots.empty()) hold_pinned(substage, moving);
    const auto show = [&](const LaneArray<Real>& from, LaneArray<Real>& to) {
      for (std::size_t i = 0; i < halo.size(); ++i) std::copy_n(from.data() + 4 * i, 4, to.data() + 4 * halo[i]);
    };
    show(last ? moving.x : moving.x_stage, last ? scratch_.x : scratch_.x_stage);
    if (damped_ || other_forces_) show(last ? moving.v : moving.v_stage, last ? scratch_.v : scratch_.v_stage);
  }

  // Pinned vertices are where the bodies say, at rest.
  void hold_pinned(Substage substage, LaneScratch<Real>& scratch) {
    const bool last = is_last(substage);
    LaneArray<Real>& v = last ? scratch.v : scratch.v_stage;
    LaneArray<Real>& x = last ? scratch.x : scratch.x_stage;
    const bool moved_x = !last || advance_;
    for (const std::uint32_t slot : scratch.pinned_slots) {
      const std::uint32_t in_mesh = &scratch == &scratch_ ? slot : team_->halo_of(member_)[slot];
      for (std::size_t lane = 0; lane < width_; ++lane) {
        const Vec3<Real>& pin = bodies_.of_lane(lane).x[mesh_.rings.vertices[in_mesh]];
        for (std::size_t c = 0; c < 3; ++c) {
          v[bodies_.at(slot, c, lane)] = 0;
          if (moved_x) {
            x[bodies_.at(slot, c, lane)] = pin[static_cast<Eigen::Index>(c)];
          } else {
            scratch.move[bodies_.at(slot, c, lane)] = 0;
          }
        }
      }
    }
  }

  LaneLayout layout_;
  std::size_t width_;  // bodies abreast
  const LaneMesh<Real>& mesh_;
  const LaneKernels<Real>& kernels_;
  const SubstepContext& context_;
  bool advance_;  // x in every substep; otherwise the move is left for contact
  LaneScratch<Real>& scratch_;
  LaneTeam<Real>* team_;  // null: the step is by one thread
  std::size_t member_;
  LaneScratch<Real>& first_scratch_;  // with the lists of other forces
  LaneBodies<Real> bodies_;
  bool damped_;
  bool gas_;
  bool scaled_;   // springs differ in stiffness
  bool pulled_;   // the pulls of edges come first
  bool weighed_;  // the vertices are of different mass
  bool sprung_;   // there is anything for the ring pass to do
  bool other_forces_;
  std::array<std::uint8_t, pack_slots> eventful_{};  // one a lane
  RingPass<Real> ring_;
  WeighPass<Real> weigh_;
  UpdatePass<Real> update_;
  UpdatePass<Real> halo_update_;
};

// Calls run(step) on the bodies, or for each thread of the workers that is to share a single large one, at once.
template <class Real, class Run>
void run_steps(std::span<SoftState<Real>* const> bodies, const LaneTables<Real>& lanes, const SubstepContext& context,
               bool advance, LaneScratch<Real>& scratch, const Run& run) {
  const Rings& rings = lanes.mesh->rings;
  const std::size_t blocks = block_count_of(rings);
  if (has_other_forces(*bodies[0], rings, context.surroundings)) {
    scratch.other_x.resize(bodies[0]->x.size());
    scratch.other_v.resize(bodies[0]->x.size());
  }
  const bool is_large = bodies.size() == 1 && rings.slot_count() >= parallel_slots_min;
  const std::size_t members = is_large && context.workers != nullptr ? std::min(context.workers->threads(), blocks) : 1;
  if (members > 1 && (!scratch.team || !scratch.team->is_for(rings, members))) {
    scratch.team = std::make_unique<LaneTeam<Real>>(rings, members);
  }
  if (members == 1 || !scratch.team->should_share()) {
    LaneStep<Real> step(bodies, lanes, context, advance, scratch, {.blocks = {0, blocks}, .first = &scratch});
    return run(step);
  }
  LaneTeam<Real>& team = *scratch.team;
  // Who threw here would leave the others waiting for ever.
  context.workers->for_each(members, [&](std::size_t member) noexcept {
    const SubstepContext own = context.of_body(nullptr, member == 0 ? context.profile : nullptr);
    LaneStep<Real> step(bodies, lanes, own, advance, member == 0 ? scratch : team.scratch_of(member),
                        {&team, member, team.blocks_of(member), &scratch});
    run(step);
  });
}

// What a substep changes of a body besides x, v and dr.
struct GasBefore {
  std::optional<GasState> gas;
  double volume_m3 = 0.0;
  double pressure_pa = 0.0;
};

}  // namespace

template <class Real>
void step_to_contact(std::span<SoftState<Real>* const> bodies, const LaneTables<Real>& lanes,
                     const SubstepContext& context, LaneScratch<Real>& scratch) {
  assert(bodies.size() <= lanes.kernels->width || bodies.size() == 1);
  for (SoftState<Real>* body : bodies) advance_gas(*body, context.surroundings.atmosphere.pressure_pa, context.dt_s);
  const auto run = [&](std::span<SoftState<Real>* const> some) {
    run_steps<Real>(some, lanes, context, false, scratch, [](LaneStep<Real>& step) {
      step.substep();
      step.hand_back();
    });
  };
  const auto has_gas = [&](const SoftState<Real>* body) { return has_lane_gas(*body, lanes.mesh->rings); };
  if (std::ranges::all_of(bodies, [&](const auto* body) { return has_gas(body) == has_gas(bodies[0]); })) {
    return run(bodies);
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) run(bodies.subspan(i, 1));  // one has just lost its gas for good
}

template <class Real>
void step_freely(std::span<SoftState<Real>* const> bodies, const LaneTables<Real>& lanes, const SubstepContext& context,
                 std::uint32_t substeps, LaneScratch<Real>& scratch, std::span<std::uint8_t> done) {
  assert(bodies.size() <= lanes.kernels->width || bodies.size() == 1);
  std::array<GasBefore, pack_slots> before;
  for (std::size_t lane = 0; lane < bodies.size(); ++lane) {
    before[lane] = {bodies[lane]->gas, bodies[lane]->volume_m3, bodies[lane]->pressure_pa};
  }
  run_steps<Real>(bodies, lanes, context, true, scratch, [&](LaneStep<Real>& step) {
    for (std::uint32_t i = 0; i < substeps; ++i) {
      step.flow();
      step.substep();
    }
    step.hand_back(substeps, done);
  });
  for (std::size_t lane = 0; lane < bodies.size(); ++lane) {
    if (done[lane] != 0) continue;
    bodies[lane]->gas = before[lane].gas;
    bodies[lane]->volume_m3 = before[lane].volume_m3;
    bodies[lane]->pressure_pa = before[lane].pressure_pa;
  }
}

#define PNEUMA_INSTANTIATE(Real)                                                                                     \
  template void step_to_contact<Real>(std::span<SoftState<Real>* const>, const LaneTables<Real>&,                    \
                                      const SubstepContext&, LaneScratch<Real>&);                                    \
  template void step_freely<Real>(std::span<SoftState<Real>* const>, const LaneTables<Real>&, const SubstepContext&, \
                                  std::uint32_t, LaneScratch<Real>&, std::span<std::uint8_t>);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
