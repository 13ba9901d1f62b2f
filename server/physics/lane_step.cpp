#include "physics/lane_step.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <optional>

#include "physics/gas.h"

namespace pneuma::physics {

namespace {

// Waking other threads takes some microseconds, in which one thread does about this many slots.
constexpr std::size_t parallel_slots_min = 4'096;

// More than the second cache level holds, at about a hundred bytes a slot.
constexpr std::size_t streaming_slots_min = 16'384;

// The substep on the bodies under way in the lanes.
template <class Real>
class LaneStep {
 public:
  LaneStep(std::span<SoftState<Real>* const> bodies, LaneLayout layout, const LaneMesh<Real>& mesh,
           const LaneKernels<Real>& kernels, const LaneSettings& settings, bool advance, LaneScratch<Real>& scratch,
           Workers* workers, Profile* profile)
      : layout_(layout),
        width_(layout == LaneLayout::fleet ? kernels.width : 1),
        mesh_(mesh),
        kernels_(kernels),
        settings_(settings),
        advance_(advance),
        scratch_(scratch),
        workers_(layout == LaneLayout::alone && mesh.rings.slot_count() >= parallel_slots_min ? workers : nullptr),
        bodies_(bodies, layout, width_, mesh, scratch, workers_),
        profile_(profile),
        damped_(bodies[0]->body.springs.damping_n_s_m > 0.0),
        gas_(has_lane_gas(bodies[0]->body, mesh.rings)),
        scaled_(!mesh.stiffness_scales.empty()),
        pulled_(layout == LaneLayout::fleet && !mesh.edges.lengths_m.empty()),
        weighed_(!bodies[0]->mass_shares.empty()),
        sprung_(damped_ || gas_ || has_stiffness(bodies)),
        other_forces_(has_other_forces(*bodies[0], mesh.rings, settings.surroundings.atmosphere)) {
    make_room();
    set_constants();
    bodies_.load(gas_, weighed_);
  }

  // The forces of a substep and what they do, between two states of the gas.
  void substep() {
    const auto from_start = [&](Substage substage) { evaluate_and_update(scratch_.x, scratch_.v, substage); };
    const auto from_stage = [&](Substage substage) {
      evaluate_and_update(scratch_.x_stage, scratch_.v_stage, substage);
    };
    switch (settings_.integrator) {
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

  // Lets the gas of each body flow. A lane in which more happens than that is not to be kept.
  void flow() {
    for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
      SoftState<Real>& body = bodies_[lane];
      if (!body.gas) continue;
      eventful_[lane] = static_cast<std::uint8_t>(eventful_[lane] | static_cast<int>(is_gas_eventful(body)));
      flow_gas(*body.gas, *body.body.gas, body.volume_m3, body.pressure_pa,
               settings_.surroundings.atmosphere.pressure_pa, settings_.dt_s);
    }
  }

  // Sets well[lane] where all substeps so far kept a body within what freezes it, and its gas just flowed.
  void find_well(std::uint32_t substeps, std::span<std::uint8_t> well) {
    if (workers_ != nullptr) {
      for (const PerLane<Real>& maxima : scratch_.block_maxima) {
        update_.v_max_m_s.lanes[0] = std::max(update_.v_max_m_s.lanes[0], maxima.lanes[0]);
        update_.move_max_m.lanes[0] = std::max(update_.move_max_m.lanes[0], maxima.lanes[1]);
      }
    }
    bodies_.find_well(substeps, update_.v_max_m_s, update_.move_max_m, well);
    for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
      if (eventful_[lane] != 0) well[lane] = 0;
    }
  }

  // Hands back the bodies that `wanted` has.
  void store(std::span<const std::uint8_t> wanted) const { bodies_.store(wanted, advance_); }

 private:
  [[nodiscard]] static bool has_stiffness(std::span<SoftState<Real>* const> bodies) {
    return std::ranges::any_of(bodies, [](const auto* body) { return body->body.springs.stiffness_n_m > 0.0; });
  }
  void make_room() {
    const std::size_t size = bodies_.slot_count() * (layout_ == LaneLayout::fleet ? 3 * width_ : 4);
    const auto resize_where = [size](bool needed, LaneArray<Real>& array) {
      if (needed) array.resize(size);
    };
    const Integrator integrator = settings_.integrator;
    const bool rk4 = integrator == Integrator::rk4;
    const bool staged = rk4 || integrator == Integrator::midpoint;
    scratch_.x.resize(size);
    scratch_.v.resize(size);
    if (sprung_) {
      scratch_.force.resize(size);
    } else {
      scratch_.force.assign(size, Real{0});
    }
    resize_where(gas_, scratch_.gradient);
    resize_where(weighed_, scratch_.inverse_shares);
    if (pulled_) scratch_.pulls.resize(mesh_.edges.lengths_m.size() * width_);
    resize_where(!advance_, scratch_.move);
    resize_where(staged, scratch_.x_stage);
    resize_where(staged, scratch_.v_stage);
    resize_where(rk4, scratch_.x_slopes);
    resize_where(rk4, scratch_.v_slopes);
    scratch_.block_volumes.resize(bodies_.block_count());
    if (workers_ != nullptr) scratch_.block_maxima.assign(bodies_.block_count(), {});
    scratch_.pinned_slots.clear();
    for (std::size_t i = 0; i < bodies_[0].pinned.size(); ++i) {
      if (bodies_[0].pinned[i] != 0) scratch_.pinned_slots.push_back(mesh_.rings.slots[i]);
    }
  }

  void set_constants() {
    ring_.packs = mesh_.rings.packs.data();
    ring_.neighbours = mesh_.rings.neighbours.data();
    ring_.far_neighbours = mesh_.rings.far_neighbours.data();
    if (bodies_.slot_count() >= streaming_slots_min) ring_.fetch_end = mesh_.rings.packs.size();
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
    update_.x = scratch_.x.data();
    update_.v = scratch_.v.data();
    update_.move = scratch_.move.data();
    update_.x_stage = scratch_.x_stage.data();
    update_.v_stage = scratch_.v_stage.data();
    update_.x_slopes = scratch_.x_slopes.data();
    update_.v_slopes = scratch_.v_slopes.data();
    update_.dt_s = static_cast<Real>(settings_.dt_s);
    for (std::size_t c = 0; c < 3; ++c) {
      update_.gravity_m_s2[c] = static_cast<Real>(settings_.surroundings.gravity[static_cast<Eigen::Index>(c)]);
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
      const StageTimer timer(profile_, Stage::springs);
      if (workers_ == nullptr) {
        ring_.x = x.data();
        ring_.v = v.data();
        if (pulled_) kernels_.pulls[scaled_][damped_](ring_);
        for (std::size_t block = 0; block < bodies_.block_count(); ++block) pass_over(block, ring_);
      } else {
        bodies_.for_blocks([&](std::size_t block) {
          RingPass<Real> pass = ring_;
          pass.x = x.data();
          pass.v = v.data();
          pass_over(block, pass);
        });
      }
    }
    if (gas_) set_pressures();
    if (other_forces_) add_others(x, v);

    const StageTimer timer(profile_, Stage::integrate);
    if (workers_ == nullptr) {
      if (weighed_) weigh(0, bodies_.slot_count());
      update_.begin = 0;
      update_.end = bodies_.slot_count();
      kernels_(layout_, substage, gas_, advance_, update_);
    } else {
      bodies_.for_blocks([&](std::size_t block) {
        UpdatePass<Real> pass = update_;
        pass.begin = bodies_.slots_begin(block);
        pass.end = bodies_.slots_end(block);
        if (weighed_) weigh(pass.begin, pass.end);
        Real* maxima = scratch_.block_maxima[block].lanes;
        pass.v_max_m_s.lanes[0] = maxima[0];
        pass.move_max_m.lanes[0] = maxima[1];
        kernels_(layout_, substage, gas_, advance_, pass);
        maxima[0] = pass.v_max_m_s.lanes[0];
        maxima[1] = pass.move_max_m.lanes[0];
      });
    }
    if (!scratch_.pinned_slots.empty()) hold_pinned(substage);
  }

  void weigh(std::size_t slots_from, std::size_t slots_to) const {
    WeighPass<Real> pass = weigh_;
    pass.begin = bodies_.at(slots_from, 0, 0);
    pass.end = bodies_.at(slots_to, 0, 0);
    kernels_.weighs[gas_](pass);
  }

  void pass_over(std::size_t block, RingPass<Real>& pass) const {
    pass.begin = block * block_packs;
    pass.end = bodies_.packs_end(block);
    pass.volumes_18_m3 = &scratch_.block_volumes[block];
    if (pulled_) {
      kernels_.pulled_rings[gas_](pass);
    } else {
      kernels_(layout_, scaled_, damped_, gas_, pass);
    }
  }

  void set_pressures() {
    {
      const StageTimer timer(profile_, Stage::volume);
      for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
        double volume_18_m3 = 0.0;
        for (const PerLane<Real>& block : scratch_.block_volumes) {
          volume_18_m3 += static_cast<double>(block.lanes[lane]);
        }
        bodies_[lane].volume_m3 = volume_18_m3 / 18.0;
      }
    }
    const StageTimer timer(profile_, Stage::pressure);
    for (std::size_t lane = 0; lane < bodies_.size(); ++lane) {
      update_pressure(bodies_[lane], settings_.surroundings.atmosphere);
      update_.pressure_sixth_pa.lanes[lane] = static_cast<Real>(bodies_[lane].pressure_pa / 6.0);
    }
    if (layout_ == LaneLayout::alone) return;
    std::fill(update_.pressure_sixth_pa.lanes + bodies_.size(), std::end(update_.pressure_sixth_pa.lanes),
              update_.pressure_sixth_pa.lanes[bodies_.size() - 1]);
  }

  void add_others(const LaneArray<Real>& x, const LaneArray<Real>& v) {
    assert(layout_ == LaneLayout::alone);
    SoftState<Real>& body = bodies_[0];
    const auto to_points = [&](const LaneArray<Real>& lanes, std::vector<Vec3<Real>>& points) {
      points.resize(body.x.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Real* from = lanes.data() + bodies_.at(mesh_.rings.slots[i], 0, 0);
        points[i] = {from[0], from[1], from[2]};
      }
    };
    to_points(x, scratch_.other_x);
    to_points(v, scratch_.other_v);
    scratch_.other_force.assign(body.x.size(), Vec3<Real>::Zero());
    add_other_forces<Real>(body, scratch_.other_x, scratch_.other_v, settings_.surroundings, settings_.dt_s, !gas_,
                           scratch_.other_force, profile_);
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      Real* force = scratch_.force.data() + bodies_.at(mesh_.rings.slots[i], 0, 0);
      for (std::size_t c = 0; c < 3; ++c)
        force[c] = (sprung_ ? force[c] : 0) + scratch_.other_force[i][static_cast<Eigen::Index>(c)];
    }
  }

  // Pinned vertices are where the bodies say, at rest.
  void hold_pinned(Substage substage) {
    const bool last = substage == Substage::euler || substage == Substage::symplectic ||
                      substage == Substage::midpoint_full || substage == Substage::rk4_fourth;
    LaneArray<Real>& v = last ? scratch_.v : scratch_.v_stage;
    LaneArray<Real>& x = last ? scratch_.x : scratch_.x_stage;
    const bool moved_x = !last || advance_;
    for (const std::uint32_t slot : scratch_.pinned_slots) {
      for (std::size_t lane = 0; lane < width_; ++lane) {
        const Vec3<Real>& pin = bodies_.of_lane(lane).x[mesh_.rings.vertices[slot]];
        for (std::size_t c = 0; c < 3; ++c) {
          v[bodies_.at(slot, c, lane)] = 0;
          if (moved_x) {
            x[bodies_.at(slot, c, lane)] = pin[static_cast<Eigen::Index>(c)];
          } else {
            scratch_.move[bodies_.at(slot, c, lane)] = 0;
          }
        }
      }
    }
  }

  LaneLayout layout_;
  std::size_t width_;  // bodies abreast
  const LaneMesh<Real>& mesh_;
  const LaneKernels<Real>& kernels_;
  const LaneSettings& settings_;
  bool advance_;  // x in every substep; otherwise the move is left for contact
  LaneScratch<Real>& scratch_;
  Workers* workers_;
  LaneBodies<Real> bodies_;
  Profile* profile_;
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
};

// What a substep changes of a body besides x, v and dr.
struct GasBefore {
  std::optional<GasState> gas;
  double volume_m3 = 0.0;
  double pressure_pa = 0.0;
};

}  // namespace

bool has_lane_gas(const SoftBody& body, const Rings& rings) {
  return body.gas && body.volume.method == VolumeMethod::exact && body.pressure_spread == PressureSpread::faces &&
         rings.encloses;
}

template <class Real>
bool has_other_forces(const SoftState<Real>& body, const Rings& rings, const Atmosphere& atmosphere) {
  const bool other_gas = body.gas && !has_lane_gas(body.body, rings);
  return other_gas || !body.hinges.empty() || has_wind(body.body, atmosphere) || !body.grabs.empty();
}

template <class Real>
void step_alone(SoftState<Real>& body, const LaneMesh<Real>& mesh, const LaneKernels<Real>& kernels,
                const LaneSettings& settings, LaneScratch<Real>& scratch, Workers* workers, Profile* profile) {
  advance_gas(body, settings.surroundings.atmosphere.pressure_pa, settings.dt_s);  // it may lose its gas for good
  const std::array<SoftState<Real>*, 1> bodies{&body};
  LaneStep<Real> step(bodies, LaneLayout::alone, mesh, kernels, settings, false, scratch, workers, profile);
  step.substep();
  step.store(std::array<std::uint8_t, 1>{1});
}

template <class Real>
void step_freely(std::span<SoftState<Real>* const> bodies, const LaneMesh<Real>& mesh, const LaneKernels<Real>& kernels,
                 const LaneSettings& settings, std::uint32_t substeps, LaneScratch<Real>& scratch, Workers* workers,
                 Profile* profile, std::span<std::uint8_t> done) {
  assert(bodies.size() <= kernels.width || bodies.size() == 1);
  std::array<GasBefore, pack_slots> before;
  for (std::size_t lane = 0; lane < bodies.size(); ++lane) {
    before[lane] = {bodies[lane]->gas, bodies[lane]->volume_m3, bodies[lane]->pressure_pa};
  }
  const LaneLayout layout = bodies.size() == 1 ? LaneLayout::alone : LaneLayout::fleet;
  LaneStep<Real> step(bodies, layout, mesh, kernels, settings, true, scratch, workers, profile);
  for (std::uint32_t i = 0; i < substeps; ++i) {
    step.flow();
    step.substep();
  }
  step.find_well(substeps, done);
  for (std::size_t lane = 0; lane < bodies.size(); ++lane) {
    if (done[lane] != 0) continue;
    bodies[lane]->gas = before[lane].gas;
    bodies[lane]->volume_m3 = before[lane].volume_m3;
    bodies[lane]->pressure_pa = before[lane].pressure_pa;
  }
  step.store(done);
}

#define PNEUMA_INSTANTIATE(Real)                                                                                      \
  template bool has_other_forces<Real>(const SoftState<Real>&, const Rings&, const Atmosphere&);                      \
  template void step_alone<Real>(SoftState<Real>&, const LaneMesh<Real>&, const LaneKernels<Real>&,                   \
                                 const LaneSettings&, LaneScratch<Real>&, Workers*, Profile*);                        \
  template void step_freely<Real>(std::span<SoftState<Real>* const>, const LaneMesh<Real>&, const LaneKernels<Real>&, \
                                  const LaneSettings&, std::uint32_t, LaneScratch<Real>&, Workers*, Profile*,         \
                                  std::span<std::uint8_t>);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
