#include "physics/contact/spins.h"

#include <algorithm>

#include "physics/contact/taken_energy.h"

namespace pneuma::physics {
namespace {

// A turn of a body under stress meets a torque a substep later. Past this share of its inertia in that torque a turn is
// shortened, or a light body between a heavy load and the floor rocks with it.
constexpr double stiff_share = 2.0;

template <class Real>
class Spins {
 public:
  Spins(const CoupledWorld<Real>& world, CoupledPasses& passes) : world_(world), passes_(passes) {}

  void keep() {
    list_bodies();
    for (const ContactRow& row : passes_.rows) {
      push(row.first, row.second, row.impulse_n_s);
      push(row.second, row.first, -row.impulse_n_s);
    }
    const double share = list_turns();
    for (std::size_t i = 0; i < soft_count(); ++i) {
      if (is_kept(i)) turn(i, share);
    }
  }

 private:
  [[nodiscard]] std::size_t soft_count() const { return passes_.bodies.size(); }
  [[nodiscard]] bool is_kept(std::size_t index) const {
    return index < soft_count() && passes_.bodies[index].in_contact && passes_.bodies[index].is_free;
  }

  void list_bodies() {
    before_.resize(soft_count());
    after_.resize(soft_count());
    spins_.resize(soft_count());
    for (std::size_t i = 0; i < soft_count(); ++i) {
      if (!is_kept(i)) continue;
      const CoupledBody& body = passes_.bodies[i];
      before_[i] = whole_of(body, body.start, body.u0);
      after_[i] = whole_of(body, passes_.surface(i).from, body.u);
      spins_[i] = before_[i].spin_kg_m2_s;
    }
  }

  // Both get it at one place: a rigid body where its arm ends, two soft ones in the middle of where the substep found
  // them. What does not give way has no angular momentum to keep, and pushes where the soft body comes to.
  void push(const Support& at, const Support& by, const Vec3d& impulse_n_s) {
    if (!is_kept(at.body) || at.body == by.body) return;
    const CoupledBody& body = passes_.bodies[at.body];
    const std::size_t rigid = by.body - soft_count();
    Vec3d arm = Vec3d::Zero();
    if (is_kept(by.body)) {
      arm = 0.5 * (mean_of(at, body.start) + mean_of(by, passes_.bodies[by.body].start)) - before_[at.body].centre;
    } else if (by.body >= soft_count() && rigid < world_.rigid.size()) {
      arm = world_.rigid[rigid].position + by.arm - before_[at.body].centre;
    } else {
      arm = mean_of(at, passes_.surface(at.body).from) - after_[at.body].centre;
    }
    spins_[at.body] += arm.cross(impulse_n_s);
  }

  // Sets what each lacks. Returns the share of it that gives no more energy than contact took.
  double list_turns() {
    turns_rad_s_.assign(soft_count(), Vec3d::Zero());
    GivenEnergy given;
    for (std::size_t i = 0; i < soft_count(); ++i) {
      if (!is_kept(i)) continue;
      const WholeMotion& after = after_[i];
      if (!after.turns()) continue;
      const double s = world_.substep.dt_s;
      const double stiff_kg_m2 = stiff_share * s * s * passes_.bodies[i].stress_n_m - after.inertia_kg_m2.trace() / 3.0;
      const Eigen::Matrix3d inertia = after.inertia_kg_m2 + std::max(0.0, stiff_kg_m2) * Eigen::Matrix3d::Identity();
      turns_rad_s_[i] = inertia.inverse() * (spins_[i] - after.spin_kg_m2_s);
      given.linear_j += turns_rad_s_[i].dot(after.spin_kg_m2_s);
      given.square_j += 0.5 * turns_rad_s_[i].dot(after.inertia_kg_m2 * turns_rad_s_[i]);
    }
    if (!(given.linear_j + given.square_j > 0.0)) return 1.0;
    given.taken_j = taken_energy_j(world_, passes_);
    return given.share_max();
  }

  void turn(std::size_t index, double share) {
    const Vec3d turn_rad_s = share * turns_rad_s_[index];
    CoupledBody& body = passes_.bodies[index];
    const std::vector<Vec3d>& places = passes_.surface(index).from;
    for (std::size_t k = 0; k < body.u.size(); ++k) body.u[k] += turn_rad_s.cross(places[k] - after_[index].centre);
  }

  const CoupledWorld<Real>& world_;
  CoupledPasses& passes_;
  std::vector<WholeMotion> before_, after_;
  std::vector<Vec3d> spins_;  // kg m^2/s, that each is to have
  std::vector<Vec3d> turns_rad_s_;
};

}  // namespace

template <class Real>
void keep_spins(const CoupledWorld<Real>& world, CoupledPasses& passes) {
  Spins<Real>(world, passes).keep();
}

template void keep_spins(const CoupledWorld<float>&, CoupledPasses&);
template void keep_spins(const CoupledWorld<double>&, CoupledPasses&);

}  // namespace pneuma::physics
