#include "physics/contact/step_mix.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "physics/contact/row_matrix.h"

namespace pneuma::physics {
namespace {

// A step that changes so many times as much as the least one did has nothing in common with those before.
constexpr double change_max = 2.0;
// Of the sum of squares: of steps that hardly differ any mix would do.
constexpr double regularisation = 1e-8;
// Mixes of larger shares, or that are so many times as long, lead where nothing holds them: impulses that only hold
// each other have no bound. Of two thousand scenes of a solid on a ball, two blew up without these.
constexpr double shares_max = 100.0;
constexpr double longer_max = 2.0;

}  // namespace

void StepMix::forget() {
  differences_.clear();
  products_.setZero();
  change_before_.clear();
  next_before_.clear();
}

void StepMix::go_on(std::span<const double> change, std::vector<double>& next) {
  const double size = std::sqrt(dot(change, change));
  if (!change_before_.empty() && size > change_max * least_change_) forget();
  least_change_ = change_before_.empty() ? size : std::min(least_change_, size);
  if (!change_before_.empty()) remember(change, next);
  change_before_.assign(change.begin(), change.end());
  next_before_ = next;
  if (differences_.empty()) return;
  Products products = products_;  // with rows of zeros for steps that there were not
  products.diagonal().array() += regularisation * products.trace();
  Shares shares = Shares::Zero();
  for (std::size_t k = 0; k < differences_.size(); ++k) {
    shares[static_cast<Eigen::Index>(k)] = dot(differences_[k].change, change);
  }
  shares = products.ldlt().solve(shares).eval();
  mixed_ = next;
  for (std::size_t k = 0; k < differences_.size(); ++k) {
    const double share = shares[static_cast<Eigen::Index>(k)];
    for (std::size_t i = 0; i < mixed_.size(); ++i) mixed_[i] -= share * differences_[k].next[i];
  }
  const bool holds = shares.allFinite() && shares.cwiseAbs().sum() <= shares_max &&
                     dot(mixed_, mixed_) <= longer_max * longer_max * dot(next, next);
  if (holds) {
    next.swap(mixed_);
  } else {
    forget();
  }
}

void StepMix::remember(std::span<const double> change, std::span<const double> next) {
  if (differences_.size() < steps_max) {
    latest_ = differences_.size();
    differences_.emplace_back();
  } else {
    latest_ = (latest_ + 1) % steps_max;
  }
  Difference& latest = differences_[latest_];
  latest.change.resize(change.size());
  latest.next.resize(next.size());
  for (std::size_t i = 0; i < change.size(); ++i) {
    latest.change[i] = change[i] - change_before_[i];
    latest.next[i] = next[i] - next_before_[i];
  }
  for (std::size_t k = 0; k < differences_.size(); ++k) {
    const double product = dot(differences_[k].change, latest.change);
    products_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(latest_)) = product;
    products_(static_cast<Eigen::Index>(latest_), static_cast<Eigen::Index>(k)) = product;
  }
}

}  // namespace pneuma::physics
