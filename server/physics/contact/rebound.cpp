#include "physics/contact/rebound.h"

#include <algorithm>
#include <cmath>

#include "physics/contact/response.h"
#include "physics/contact/solver.h"
#include "physics/contact/taken_energy.h"
#include "physics/rigid/rigid_mass.h"

namespace pneuma::physics {
namespace {

// The rebound is of few bodies as wholes; off by this share of what counts as resting.
constexpr std::uint32_t rebound_sweeps_max = 50;
constexpr double rebound_enough_share = 1e-6;
// Of the approach that would have taken a body in: less than this left over is none.
constexpr double stopped_share = 0.1;

template <class Real>
class Rebound {
 public:
  Rebound(const CoupledWorld<Real>& world, CoupledPasses& passes) : world_(world), passes_(passes) {}

  void run() {
    list_rows();
    if (rows_.empty()) return;
    list_wholes();
    std::erase_if(rows_, [this](ContactRow& row) { return !aim(row); });
    if (rows_.empty()) return;
    const double resting_m_s = world_.physics().resting_m_s;
    (void)solve_rows(rows_, responses_,
                     {.sweeps_max = rebound_sweeps_max, .enough_m_s = rebound_enough_share * resting_m_s});
    give_back(energy().share_max());  // a body that also stays squeezed keeps that much of it
  }

 private:
  [[nodiscard]] std::size_t soft_count() const { return passes_.bodies.size(); }

  // Of what bounces and is free to.
  void list_rows() {
    const auto gives_way = [this](const Support& side) {
      if (side.body < soft_count()) return passes_.bodies[side.body].is_free && world_.soft[side.body].tie == 0;
      return side.body >= soft_count() + world_.rigid.size() || world_.rigid[side.body - soft_count()].tie == 0;
    };
    for (const ContactRow& row : passes_.rows) {
      const bool bounces = row.restitution > 0.0 && gives_way(row.first) && gives_way(row.second);
      if (bounces && row.impulse_n_s.dot(row.normal) > 0.0) rows_.push_back(row);
    }
  }

  // Before the substep and after its passes, and what each does with an impulse.
  void list_wholes() {
    before_.resize(soft_count());
    after_.resize(soft_count());
    for (std::size_t i = 0; i < soft_count(); ++i) {
      const CoupledBody& body = passes_.bodies[i];
      if (!body.in_contact) {
        responses_.emplace_back(FixedResponse{});
        continue;
      }
      before_[i] = whole_of(body, body.start, body.u0);
      after_[i] = whole_of(body, passes_.surface(i).from, body.u);
      if (body.is_free) {
        responses_.emplace_back(RigidResponse(1.0 / after_[i].mass_kg, after_[i].inverse_inertia_1_kg_m2));
      } else {
        responses_.emplace_back(FixedResponse{});
      }
    }
    for (std::size_t k = 0; k < passes_.solids.size(); ++k) {
      if (k < world_.rigid.size()) {
        const RigidState& rigid = world_.rigid[k];
        responses_.emplace_back(RigidResponse(inverse_masses_1_kg(rigid), inverse_inertia_1_kg_m2(rigid)));
      } else {
        responses_.emplace_back(FixedResponse{});
      }
    }
  }

  // Sets what the row is to reach, where both end the substep. False where it was not stopped within it.
  bool aim(ContactRow& row) const {
    const double dt_s = world_.substep.dt_s;
    const Vec3d& all_pull = world_.substep.surroundings.gravity;
    const bool is_soft = row.second.body < soft_count();
    const Vec3d start = mean_of(row.first, passes_.bodies[row.first.body].start);
    Vec3d place = mean_of(row.first, passes_.surface(row.first.body).from);
    if (is_soft) place = 0.5 * (place + mean_of(row.second, passes_.surface(row.second.body).from));
    Vec3d came = before_[row.first.body].at(start);
    Vec3d goes = after_[row.first.body].at(place);
    Vec3d pull = world_.soft[row.first.body].is_awake() ? all_pull : Vec3d(Vec3d::Zero());
    Vec3d way = mean_of(row.first, passes_.surface(row.first.body).to) - start;
    row.first.arm = place - after_[row.first.body].centre;
    if (is_soft) {
      const Vec3d other = mean_of(row.second, passes_.bodies[row.second.body].start);
      came -= before_[row.second.body].at(other);
      goes -= after_[row.second.body].at(place);
      row.second.arm = place - after_[row.second.body].centre;
      way -= mean_of(row.second, passes_.surface(row.second.body).to) - other;
      if (world_.soft[row.second.body].is_awake()) pull -= all_pull;
    } else {
      const std::size_t k = row.second.body - soft_count();
      const SolidPlace& solid = passes_.solids[k];
      const bool is_rigid = k < world_.rigid.size();
      const Vec3d origin = is_rigid ? world_.rigid[k].position : world_.colliders[k - world_.rigid.size()].position;
      row.second.arm = place - origin;
      const Vec3d gravity =
          is_rigid && world_.rigid[k].is_awake() ? pull_m_s2(world_.rigid[k], all_pull) : Vec3d(Vec3d::Zero());
      came -= velocity_at(solid.velocity - dt_s * gravity, solid.angular_velocity, row.second.arm);
      const Vec3d surface_velocity =
          is_rigid ? velocity_at(passes_.rigid_velocities_m_s[k], passes_.rigid_turnings_rad_s[k], row.second.arm)
                   : velocity_at(solid.velocity, solid.angular_velocity, row.second.arm);
      way -= dt_s * surface_velocity;
      pull -= gravity;
      goes -= surface_velocity;
    }
    // Both end the substep on each other; so the gap at its start is the way that they came.
    const double gap_m = std::max(0.0, -way.dot(row.normal));
    const double pull_m_s2 = std::max(0.0, -pull.dot(row.normal));
    const double came_m_s = came.dot(row.normal);
    const double hit_m_s = -std::sqrt(came_m_s * came_m_s + 2.0 * pull_m_s2 * gap_m);
    const double goes_m_s = goes.dot(row.normal);
    const double past_m_s = hit_m_s + gap_m / dt_s;  // the speed that would have taken it in
    const double resting_m_s = world_.physics().resting_m_s;
    const bool was_stopped = came_m_s < -resting_m_s && goes_m_s + gap_m / dt_s > stopped_share * past_m_s;
    row.free_m_s = goes_m_s * row.normal;
    row.least_m_s = -row.restitution * hit_m_s;
    row.impulse_n_s.setZero();
    row.friction = 0.0;
    return was_stopped;
  }

  [[nodiscard]] GivenEnergy energy() const {
    GivenEnergy sum;
    sum.taken_j = taken_energy_j(world_, passes_);
    for (std::size_t i = 0; i < soft_count(); ++i) {
      const auto* whole = std::get_if<RigidResponse>(&responses_[i]);
      if (whole == nullptr) continue;
      const double mass_kg = after_[i].mass_kg;
      const Vec3d change = whole->velocity_change_m_s();
      const Vec3d turn = whole->turning_change_rad_s();
      sum.linear_j +=
          mass_kg * change.dot(after_[i].velocity) + turn.dot(after_[i].inertia_kg_m2 * after_[i].turning_rad_s());
      sum.square_j += 0.5 * (mass_kg * change.squaredNorm() + turn.dot(after_[i].inertia_kg_m2 * turn));
    }
    for (std::size_t k = 0; k < world_.rigid.size(); ++k) add_energy_of_rigid(k, sum);
    double driven_j = 0.0;  // by the surfaces that the rebound pushes off
    for (const ContactRow& row : rows_) driven_j += row.impulse_n_s.dot(driving_velocity(row, world_, passes_));
    sum.linear_j -= driven_j;
    return sum;
  }

  void add_energy_of_rigid(std::size_t index, GivenEnergy& sum) const {
    const RigidState& rigid = world_.rigid[index];
    const Vec3d& velocity_after = passes_.rigid_velocities_m_s[index];
    const Vec3d& turning_after = passes_.rigid_turnings_rad_s[index];
    const auto& whole = std::get<RigidResponse>(responses_[soft_count() + index]);
    const Eigen::Matrix3d inertia = inertia_kg_m2(rigid);
    const Vec3d change = whole.velocity_change_m_s();
    const Vec3d turn = whole.turning_change_rad_s();
    sum.linear_j += rigid.body.mass_kg * change.dot(velocity_after) + turn.dot(inertia * turning_after);
    sum.square_j += 0.5 * (rigid.body.mass_kg * change.squaredNorm() + turn.dot(inertia * turn));
  }

  void give_back(double share) {
    for (std::size_t i = 0; i < soft_count(); ++i) {
      const auto* whole = std::get_if<RigidResponse>(&responses_[i]);
      if (whole == nullptr) continue;
      CoupledBody& body = passes_.bodies[i];
      for (std::size_t k = 0; k < body.u.size(); ++k) {
        body.u[k] += share * velocity_at(whole->velocity_change_m_s(), whole->turning_change_rad_s(),
                                         passes_.surface(i).from[k] - after_[i].centre);
      }
    }
    for (std::size_t k = 0; k < world_.rigid.size(); ++k) {
      const auto& whole = std::get<RigidResponse>(responses_[soft_count() + k]);
      passes_.rigid_velocities_m_s[k] += share * whole.velocity_change_m_s();
      passes_.rigid_turnings_rad_s[k] += share * whole.turning_change_rad_s();
    }
  }

  const CoupledWorld<Real>& world_;
  CoupledPasses& passes_;
  std::vector<ContactRow> rows_;
  std::vector<WholeMotion> before_, after_;  // one a soft body
  std::vector<Response> responses_;          // soft bodies, rigid ones, colliders
};

}  // namespace

template <class Real>
void rebound(const CoupledWorld<Real>& world, CoupledPasses& passes) {
  Rebound<Real>(world, passes).run();
}

template void rebound(const CoupledWorld<float>&, CoupledPasses&);
template void rebound(const CoupledWorld<double>&, CoupledPasses&);

}  // namespace pneuma::physics
