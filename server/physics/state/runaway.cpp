#include "physics/state/runaway.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/limits.h"

namespace pneuma::physics {
namespace {

constexpr const char* not_finite = "its motion was no longer finite";
constexpr const char* torn_apart = "it was torn apart: a particle moved past its own body in one step";
constexpr const char* too_fast = "it went past the limit of speed";
constexpr const char* too_far = "it went past the limit of place";
constexpr const char* crowded = "more came near it at once than contact can look at";
constexpr const char* failed_reason = "its integrator found no finite answer";

// What every particle's place, move and velocity are to be within.
template <class Real>
struct WellLimits {
  Vec3<Real> low, high;
  Real speed_max_m_s = 0;
  Real stray_max_m = 0;

  explicit WellLimits(const SoftState<Real>& body)
      : low((-base::coordinate_max_m - body.origin_m.array()).matrix().template cast<Real>()),
        high((base::coordinate_max_m - body.origin_m.array()).matrix().template cast<Real>()),
        speed_max_m_s(static_cast<Real>(base::speed_max_m_s)),
        stray_max_m(static_cast<Real>(base::runaway_body_lengths) * body.length_m) {}
};

template <class Real>
Vec3<Real> mean_move_m(const SoftState<Real>& body) {
  Vec3<Real> sum = Vec3<Real>::Zero();
  for (const Vec3<Real>& move : body.dr) sum += move;
  return sum / static_cast<Real>(body.dr.size());
}

// By components, which is quick, and says no only where a length might be too great. No move is further from their mean
// than the furthest two are from each other.
template <class Real>
bool is_surely_well(const Extents<Real>& extents, const WellLimits<Real>& limits) {
  constexpr Real share = static_cast<Real>(0.57);  // below the root of 1/3
  bool well = extents.finite && extents.v_max_m_s <= share * limits.speed_max_m_s;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    well &= extents.move[axis].high - extents.move[axis].low <= share * limits.stray_max_m;
    well &= extents.end[axis].low >= limits.low[k] && extents.end[axis].high <= limits.high[k];
  }
  return well;
}

// What made the body no longer well; the first that holds, in the order from what says most.
template <class Real>
const char* runaway_reason(const SoftState<Real>& body) {
  const auto speed_max = static_cast<Real>(base::speed_max_m_s);
  const Real stray_max = static_cast<Real>(base::runaway_body_lengths) * body.length_m;
  const auto any = [&body](const auto& holds) {
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      if (holds(i)) return true;
    }
    return false;
  };
  if (any([&](std::size_t i) { return !body.v[i].allFinite() || !body.dr[i].allFinite(); })) return not_finite;
  const Vec3<Real> mean_move = mean_move_m(body);
  if (any([&](std::size_t i) { return !((body.dr[i] - mean_move).squaredNorm() <= stray_max * stray_max); })) {
    return torn_apart;
  }
  if (any([&](std::size_t i) { return !(body.v[i].squaredNorm() <= speed_max * speed_max); })) return too_fast;
  return too_far;
}

const char* runaway_reason(const RigidState& body) {
  if (!body.velocity.allFinite() || !body.angular_velocity.allFinite() || !body.position.allFinite()) return not_finite;
  const bool fast = body.velocity.norm() > base::speed_max_m_s || body.angular_velocity.norm() > base::speed_max_m_s;
  return fast ? too_fast : too_far;
}

}  // namespace

// A comparison with NaN is false, so a NaN fails it.
template <class Real>
bool is_well(const SoftState<Real>& body, const Extents<Real>& extents) {
  const WellLimits<Real> limits(body);
  if (is_surely_well(extents, limits)) return true;
  const Vec3<Real> mean_move = mean_move_m(body);
  const Real speed_max = limits.speed_max_m_s;
  bool well = true;
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    const Vec3<Real> end = body.x[i] + body.dr[i];
    well &= body.v[i].squaredNorm() <= speed_max * speed_max;
    well &= (end.array() >= limits.low.array() && end.array() <= limits.high.array()).all();
    well &= (body.dr[i] - mean_move).squaredNorm() <= limits.stray_max_m * limits.stray_max_m;
  }
  return well;
}

template <class Real>
const char* freeze(SoftState<Real>& body) {
  const char* reason = body.solve_failed ? failed_reason : body.is_crowded ? crowded : runaway_reason(body);
  std::ranges::fill(body.v, Vec3<Real>::Zero());
  std::ranges::fill(body.dr, Vec3<Real>::Zero());
  body.frozen = true;
  body.is_crowded = false;
  body.rest = {};
  body.place.clear();
  return reason;
}

const char* freeze(RigidState& body, const Vec3d& position, const Quatd& orientation) {
  const char* reason = body.is_crowded ? crowded : runaway_reason(body);
  body.position = position;
  body.orientation = orientation;
  body.velocity.setZero();
  body.angular_velocity.setZero();
  body.frozen = true;
  body.is_crowded = false;
  body.rest = {};
  return reason;
}

template bool is_well(const SoftState<float>&, const Extents<float>&);
template bool is_well(const SoftState<double>&, const Extents<double>&);
template const char* freeze(SoftState<float>&);
template const char* freeze(SoftState<double>&);

}  // namespace pneuma::physics
