// How a script puts bodies elsewhere: World::place.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "base/limits.h"
#include "base/nearest_word.h"
#include "base/number_text.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/simulation.h"
#include "physics/state/origin.h"

namespace pneuma::physics {

namespace {

using base::Status;

Vec3d vertex_of(const std::vector<double>& numbers, std::size_t vertex) {
  return {numbers[3 * vertex], numbers[3 * vertex + 1], numbers[3 * vertex + 2]};
}

/// What is wrong with a number that is not finite, or past the limit.
Status refuse(double number, double limit, const std::string& where) {
  if (!std::isfinite(number)) return base::invalid("is not finite", where);
  return {base::StatusCode::limit_exceeded,
          "is " + base::number_text(number) + "; its magnitude may be at most " + base::number_text(limit), where};
}

/// Each vector finite and no longer than `limit` on any axis.
Status check_list(const std::vector<double>& numbers, std::size_t vertices, double limit, const std::string& field) {
  if (numbers.empty()) return {};
  if (numbers.size() != 3 * vertices) {
    return base::invalid("has " + std::to_string(numbers.size()) + " numbers; the body has " +
                             std::to_string(vertices) + " vertices, of three each",
                         field);
  }
  const auto wrong = std::ranges::find_if_not(numbers, [limit](double number) { return std::abs(number) <= limit; });
  if (wrong == numbers.end()) return {};
  return refuse(*wrong, limit, field + "[" + std::to_string((wrong - numbers.begin()) / 3) + "]");
}

/// The states of the bodies that are named, in that order.
template <class State, class Placement>
Status find_all(std::vector<State>& states, const std::vector<Placement>& placements, const std::string& list,
                std::vector<State*>& found) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const std::string& name = placements[i].body;
    const std::string field = list + "[" + std::to_string(i) + "].name";
    const auto state = std::ranges::find(states, name, [](const State& each) { return each.body.name; });
    if (state == states.end()) {
      std::vector<std::string> names;
      for (const State& each : states) names.push_back(each.body.name);
      return base::not_found("no such body \"" + name + "\"" + base::nearest_or_all(name, names), field);
    }
    if (!seen.insert(name).second) return base::invalid("\"" + name + "\" is named twice", field);
    if (state->frozen) return {base::StatusCode::failed_precondition, "\"" + name + "\" is frozen", field};
    found.push_back(&*state);
  }
  return {};
}

Status check_vector(const std::optional<Vec3d>& vector, double limit, const std::string& field) {
  if (!vector) return {};
  constexpr std::array axes{".x", ".y", ".z"};
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const double number = (*vector)[static_cast<Eigen::Index>(axis)];
    if (!(std::abs(number) <= limit)) return refuse(number, limit, field + axes[axis]);
  }
  return {};
}

Status check_rigid(const RigidPlacement& to, const std::string& field) {
  Status wrong = check_vector(to.position, base::coordinate_max_m, field + ".position");
  if (wrong.ok()) wrong = check_vector(to.velocity, base::speed_max_m_s, field + ".velocity");
  if (wrong.ok()) wrong = check_vector(to.angular_velocity, base::speed_max_m_s, field + ".angular_velocity");
  if (!wrong.ok() || !to.orientation) return wrong;
  constexpr double rounding = 1e-9;
  if (std::abs(to.orientation->norm() - 1.0) <= rounding) return {};
  return base::invalid("is no unit quaternion", field + ".orientation");
}

/// The origin that a body has may stay while the body is near it: so it comes back to the bits that it was told with.
template <class Real>
bool is_near(const SoftState<Real>& body, const std::vector<double>& positions_m) {
  constexpr double lengths_max = 4.0;
  const double far_m = lengths_max * static_cast<double>(body.length_m);
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    if ((vertex_of(positions_m, i) - body.origin_m).cwiseAbs().maxCoeff() > far_m) return false;
  }
  return true;
}

template <class Real>
void put(SoftState<Real>& body, const SoftPlacement& to) {
  if (!to.positions_m.empty()) {
    if (std::is_same_v<Real, float> && !is_near(body, to.positions_m)) {
      Vec3d sum = Vec3d::Zero();
      for (std::size_t i = 0; i < body.x.size(); ++i) sum += vertex_of(to.positions_m, i);
      body.origin_m = origin_near(sum / static_cast<double>(body.x.size()), static_cast<double>(body.length_m));
    }
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      body.x[i] = (vertex_of(to.positions_m, i) - body.origin_m).template cast<Real>();
    }
  }
  if (!to.velocities_m_s.empty()) {
    for (std::size_t i = 0; i < body.v.size(); ++i) {
      if (!body.is_pinned(i)) body.v[i] = vertex_of(to.velocities_m_s, i).template cast<Real>();
    }
  }
  body.rest = {};
  body.place.clear();  // seen from the origin that it had
}

void put(RigidState& body, const RigidPlacement& to) {
  if (to.position) body.position = *to.position;
  if (to.orientation) body.orientation = *to.orientation;
  if (to.velocity) body.velocity = free_part(body.body.locked.translation, *to.velocity);
  if (to.angular_velocity) body.angular_velocity = free_part(body.body.locked.rotation, *to.angular_velocity);
  body.rest = {};
}

}  // namespace

Status World::place(const std::vector<SoftPlacement>& soft, const std::vector<RigidPlacement>& rigid) {
  Simulation& sim = *simulation_;
  std::vector<RigidState*> solids;
  if (Status wrong = find_all(sim.rigid, rigid, "rigid_bodies", solids); !wrong.ok()) return wrong;
  return sim.visit([&]<class Real>(SoftBodies<Real>& bodies) -> Status {
    std::vector<SoftState<Real>*> skins;
    if (Status wrong = find_all(bodies.states, soft, "soft_bodies", skins); !wrong.ok()) return wrong;
    for (std::size_t i = 0; i < soft.size(); ++i) {
      const std::string field = "soft_bodies[" + std::to_string(i) + "]";
      const std::size_t vertices = skins[i]->x.size();
      Status wrong = check_list(soft[i].positions_m, vertices, base::coordinate_max_m, field + ".positions");
      if (wrong.ok()) wrong = check_list(soft[i].velocities_m_s, vertices, base::speed_max_m_s, field + ".velocities");
      if (!wrong.ok()) return wrong;
    }
    for (std::size_t i = 0; i < rigid.size(); ++i) {
      const Status wrong = check_rigid(rigid[i], "rigid_bodies[" + std::to_string(i) + "]");
      if (!wrong.ok()) return wrong;
    }
    for (const SoftPlacement& to : soft) sim.wake(to.body);
    for (const RigidPlacement& to : rigid) sim.wake(to.body);
    for (std::size_t i = 0; i < soft.size(); ++i) put(*skins[i], soft[i]);
    for (std::size_t i = 0; i < rigid.size(); ++i) put(*solids[i], rigid[i]);
    // What touched, touches no more.
    bodies.contacts = {};
    if (!bodies.notes.empty()) {
      for (const SoftState<Real>* body : skins) {
        bodies.notes[static_cast<std::size_t>(body - bodies.states.data())] = {};
      }
    }
    return {};
  });
}

}  // namespace pneuma::physics
