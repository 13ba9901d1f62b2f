#include "physics/contact/rebound.h"

#include <algorithm>
#include <cmath>

#include "physics/contact/response.h"
#include "physics/contact/solver.h"
#include "physics/forces/measures.h"
#include "physics/rigid/rigid_mass.h"

namespace pneuma::physics {
namespace {

// A body on a line does not turn as a whole.
constexpr double whole_turning_share_min = 1e-9;
// The rebound is of few bodies as wholes; off by this share of what counts as resting.
constexpr std::uint32_t rebound_sweeps_max = 50;
constexpr double rebound_enough_share = 1e-6;
// Of the approach that would have taken a body in: less than this left over is none.
constexpr double stopped_share = 0.1;

/// The motion of a body as a whole.
struct WholeMotion {
  double mass_kg = 0.0;
  Vec3d centre = Vec3d::Zero();
  Vec3d velocity = Vec3d::Zero();
  Vec3d turning = Vec3d::Zero();
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d inverse_inertia_1_kg_m2 = Eigen::Matrix3d::Zero();

  [[nodiscard]] Vec3d at(const Vec3d& place) const { return velocity + turning.cross(place - centre); }
};

WholeMotion whole_of(std::span<const double> masses_kg, std::span<const Vec3d> x, std::span<const Vec3d> u) {
  WholeMotion whole;
  whole.mass_kg = total(masses_kg);
  whole.centre = weighted_sum(masses_kg, x) / whole.mass_kg;
  whole.velocity = weighted_sum(masses_kg, u) / whole.mass_kg;
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  Vec3d spin = Vec3d::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3d arm = x[i] - whole.centre;
    products += masses_kg[i] * arm * arm.transpose();
    spin += masses_kg[i] * arm.cross(u[i]);
  }
  const Eigen::Matrix3d inertia = products.trace() * Eigen::Matrix3d::Identity() - products;
  const double size = inertia.trace();
  if (!(inertia.determinant() > whole_turning_share_min * size * size * size)) return whole;
  whole.inertia_kg_m2 = inertia;
  whole.inverse_inertia_1_kg_m2 = inertia.inverse();
  whole.turning = whole.inverse_inertia_1_kg_m2 * spin;
  return whole;
}

/// What an impulse does to bodies as wholes: energy linear_j s + square_j s^2 for a share s of the impulse.
struct EnergyOfRebound {
  double taken_j = 0.0;  // by contact, of all bodies: what the rebound may give back
  double linear_j = 0.0;
  double square_j = 0.0;

  /// The largest share that gives back no more than was taken: a body that also stays squeezed keeps that much of it.
  [[nodiscard]] double share_max() const {
    const double allowed_j = std::max(0.0, taken_j);
    if (!(square_j > 0.0 && linear_j + square_j > allowed_j)) return 1.0;
    const double share = (-linear_j + std::sqrt(linear_j * linear_j + 4.0 * square_j * allowed_j)) / (2.0 * square_j);
    return std::clamp(share, 0.0, 1.0);
  }
};

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
    give_back(energy().share_max());
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
      before_[i] = whole_of(body.masses_kg(), body.start, body.u0);
      after_[i] = whole_of(body.masses_kg(), body.start, body.u);
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

  // Sets what the row is to reach. False where it was not stopped within the substep.
  bool aim(ContactRow& row) const {
    const double dt_s = world_.substep.dt_s;
    const Vec3d& all_pull = world_.substep.surroundings.gravity;
    const Vec3d place = mean_of(row.first, passes_.bodies[row.first.body].start);
    Vec3d came = before_[row.first.body].at(place);
    Vec3d goes = after_[row.first.body].at(place);
    Vec3d pull = world_.soft[row.first.body].is_awake() ? all_pull : Vec3d(Vec3d::Zero());
    Vec3d way = mean_of(row.first, passes_.surface(row.first.body).to) - place;
    row.first.arm = place - after_[row.first.body].centre;
    if (row.second.body < soft_count()) {
      const Vec3d other = mean_of(row.second, passes_.bodies[row.second.body].start);
      came -= before_[row.second.body].at(other);
      goes -= after_[row.second.body].at(other);
      row.second.arm = other - after_[row.second.body].centre;
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

  [[nodiscard]] EnergyOfRebound energy() const {
    EnergyOfRebound sum;
    for (std::size_t i = 0; i < soft_count(); ++i) {
      const auto* whole = std::get_if<RigidResponse>(&responses_[i]);
      if (whole == nullptr) continue;
      sum.taken_j += taken_energy_j(i);
      const double mass_kg = after_[i].mass_kg;
      const Vec3d change = whole->velocity_change_m_s();
      const Vec3d turn = whole->turning_change_rad_s();
      sum.linear_j += mass_kg * change.dot(after_[i].velocity) + turn.dot(after_[i].inertia_kg_m2 * after_[i].turning);
      sum.square_j += 0.5 * (mass_kg * change.squaredNorm() + turn.dot(after_[i].inertia_kg_m2 * turn));
    }
    for (std::size_t k = 0; k < world_.rigid.size(); ++k) add_energy_of_rigid(k, sum);
    for (const ContactRow& row : passes_.rows) {
      const bool is_rigid = row.first.body >= soft_count();
      sum.taken_j += row.impulse_n_s.dot(is_rigid ? mean_velocity_of_rigid(row) : surface_velocity_of(row));
    }
    double driven_j = 0.0;  // by the surfaces that the rebound pushes off
    for (const ContactRow& row : rows_) driven_j += row.impulse_n_s.dot(surface_velocity_of(row));
    sum.linear_j -= driven_j;
    return sum;
  }

  void add_energy_of_rigid(std::size_t index, EnergyOfRebound& sum) const {
    const RigidState& rigid = world_.rigid[index];
    const Vec3d& velocity_after = passes_.rigid_velocities_m_s[index];
    const Vec3d& turning_after = passes_.rigid_turnings_rad_s[index];
    const auto& whole = std::get<RigidResponse>(responses_[soft_count() + index]);
    const Eigen::Matrix3d rotation = principal_orientation(rigid).toRotationMatrix();
    const Eigen::Matrix3d inertia =
        rotation * rigid.inverse_inertia_1_kg_m2.cwiseInverse().asDiagonal() * rotation.transpose();
    const auto kinetic_j = [&](const Vec3d& velocity, const Vec3d& turning) {
      return 0.5 * rigid.body.mass_kg * velocity.squaredNorm() + 0.5 * turning.dot(inertia * turning);
    };
    const Vec3d change = whole.velocity_change_m_s();
    const Vec3d turn = whole.turning_change_rad_s();
    sum.taken_j += kinetic_j(rigid.velocity, rigid.angular_velocity) - kinetic_j(velocity_after, turning_after);
    sum.linear_j += rigid.body.mass_kg * change.dot(velocity_after) + turn.dot(inertia * turning_after);
    sum.square_j += kinetic_j(change, turn);
  }

  // What a body has less of after the passes than it had before the substep.
  [[nodiscard]] double taken_energy_j(std::size_t index) const {
    const SoftState<Real>& state = world_.soft[index];
    const CoupledBody& body = passes_.bodies[index];
    const Surroundings& surroundings = world_.substep.surroundings;
    const auto energy_j = [&](std::span<const Vec3d> x, std::span<const Vec3d> u) {
      double sum = potential_j(state, {.x = x}, surroundings);
      for (std::size_t i = 0; i < u.size(); ++i) sum += 0.5 * body.masses_kg()[i] * u[i].squaredNorm();
      return sum;
    };
    return energy_j(body.start, body.u0) - energy_j(passes_.surface(index).from, body.u);
  }

  // Of a row between rigid bodies, or one and a collider, as they give way: what its impulse does to their energy is
  // not the soft bodies'.
  [[nodiscard]] Vec3d mean_velocity_of_rigid(const ContactRow& row) const {
    const auto at = [this](const Support& side) -> Vec3d {
      const std::size_t k = side.body - soft_count();
      if (k >= world_.rigid.size()) return Vec3d::Zero();
      const RigidState& rigid = world_.rigid[k];
      return velocity_at(Vec3d(0.5 * (rigid.velocity + passes_.rigid_velocities_m_s[k])),
                         Vec3d(0.5 * (rigid.angular_velocity + passes_.rigid_turnings_rad_s[k])), side.arm);
    };
    return at(row.first) - at(row.second);
  }

  // Of a collider, where the row touches it; what gives way drives nothing.
  [[nodiscard]] Vec3d surface_velocity_of(const ContactRow& row) const {
    const std::size_t first = soft_count() + world_.rigid.size();
    if (row.second.body < first || row.second.body == soft_count() + passes_.solids.size()) return Vec3d::Zero();
    const SolidPlace& solid = passes_.solids[row.second.body - soft_count()];
    return velocity_at(solid.velocity, solid.angular_velocity, row.second.arm);
  }

  void give_back(double share) {
    for (std::size_t i = 0; i < soft_count(); ++i) {
      const auto* whole = std::get_if<RigidResponse>(&responses_[i]);
      if (whole == nullptr) continue;
      CoupledBody& body = passes_.bodies[i];
      for (std::size_t k = 0; k < body.u.size(); ++k) {
        body.u[k] += share * velocity_at(whole->velocity_change_m_s(), whole->turning_change_rad_s(),
                                         body.start[k] - after_[i].centre);
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
