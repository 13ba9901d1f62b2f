// What a step of each method costs, and the choice between them.
#include "physics/choice/step_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <limits>
#include <numbers>
#include <sstream>
#include <string_view>

#include "base/limits.h"
#include "physics/choice/longest_step.h"
#include "physics/choice/stability.h"
#include "physics/mesh/mesh.h"

namespace pneuma::physics {

namespace {

// Of the angle that breathing goes through in a tick: from here on implicit Euler stops what lands within a substep,
// and restitution gives back 0.99 of e^2 h and more. At 19 and less, springs that take a few substeps kept a third or
// less. Measured on balls of 42 to 642 vertices, 1 and 10 kg, k from 1e4 to 1e6 N/m.
constexpr double stopped_at_once_rad = 24.0;

// What a step costs in steps of symplectic Euler, one force evaluation each by the fastest kernel for a body alone:
// measured on the ball above over the two seconds after it was let go at 0.9 of its size, k from 20 to 1e5 N/m.
constexpr double implicit_euler_cost = 20.0;
constexpr double tr_bdf2_cost = 60.0;
// What a solved step costs at contact, in steps without: a ball of 162 vertices and 1e6 N/m that lies on a floor, or
// rolls, took 3 to 5 times as long as in flight.
constexpr double contact_passes_cost = 4.0;
// And that many times more for each so many vertices of a body: a contact's answer there is a column of their inverse.
constexpr double contact_vertices = 1'000.0;

// The longest step of rigid bodies in joints with each other: a chain of 50 links of 1 g with 50 kg at its tip
// stretches by 0.003 % at this one, and tears at four times as long.
constexpr double joint_step_s = 1.0 / 240.0;

struct MethodCost {
  Integrator integrator;
  double cost;
};
// XPBD is not among them: what it costs to be within an error is not known before it is tried. Of those that cost the
// same the first is taken.
constexpr std::array<MethodCost, 6> candidates{{{Integrator::symplectic_euler, 1.0},
                                                {Integrator::explicit_euler, 1.0},
                                                {Integrator::midpoint, 2.0},
                                                {Integrator::rk4, 4.0},
                                                {Integrator::implicit_euler, implicit_euler_cost},
                                                {Integrator::tr_bdf2, tr_bdf2_cost}}};

bool is_alone(const Scene& scene) {
  return scene.soft_bodies.size() == 1 && !scene.soft_bodies.front().collision.self && scene.rigid_bodies.empty() &&
         scene.colliders.empty() && scene.joints.empty();
}

// Whether implicit steps meet contacts together with their motion, or nothing touches.
bool meets_within_steps(const Scene& scene) {
  const auto is_met_after = [](const SoftBody& body) {
    return body.collision.soft == SoftCollision::bounds || body.mesh->positions_m.size() > coupled_vertices_max;
  };
  return is_alone(scene) || std::ranges::none_of(scene.soft_bodies, is_met_after);
}

// The motion of a body as a whole.
struct Flight {
  double fall_time_s = unlimited;  // in which it falls by its own length
  bool may_fall_exactly = false;   // by implicit Euler
  double spin_rad_s = 0.0;         // at the start
  double relaxation_s = 0.0;       // damping over stiffness
};

Flight flight_of(const SoftBody& body, const Vec3d& gravity_m_s2, bool may_fall_exactly) {
  if (!body.pins.empty() || (body.pin_boundary && !body.mesh->closed)) return {};
  const double relaxation_s = body.springs.damping_n_s_m / body.springs.stiffness_n_m;  // 0 / 0 binds nothing below
  return {std::sqrt(2.0 * diagonal_m(body.mesh->positions_m) / gravity_m_s2.norm()), may_fall_exactly,
          body.angular_velocity.norm(), relaxation_s};
}

// The step at which a fall by the body's length is off by `error` of it. The methods of order 1 put a fall from rest
// g h t / 2 off its place at t, the others none.
double fall_step_s(Integrator integrator, const Flight& flight, double error) {
  const bool exact = integrator == Integrator::midpoint || integrator == Integrator::rk4 ||
                     integrator == Integrator::tr_bdf2 ||
                     (integrator == Integrator::implicit_euler && flight.may_fall_exactly);
  return exact ? unlimited : error * flight.fall_time_s;
}

// The step at which a turn by a radian is off by `error` of it. Explicit Euler takes the tangent for the arc. The
// methods that solve keep a free body's angular momentum (solve_step.cpp) and still turn it by less than the arc: by
// that share of (wh)^2, measured on a ball of k = 1e6 N/m at 4 and 8 rad/s. They also shrink it by (wh)^2 / 2 a step,
// which its springs take back in its relaxation time. A body whose damping outweighs its springs is given by TR-BDF2
// the step at which the chord stands for the arc. By implicit Euler's it goes on to shrink, and turns the faster: at 3
// rad/s a ball of 1e3 N/m and 1e4 N s/m fell in on itself in ten seconds. The others resolve what they step, and turn
// it with it.
double turn_step_s(Integrator integrator, const Flight& flight, double error) {
  constexpr double implicit_euler_share = 0.82;
  constexpr double tr_bdf2_share = 0.5;
  constexpr double shrinking_share = 1.0 / 32.0;
  const double w = flight.spin_rad_s;
  if (!(w > 0.0)) return unlimited;
  const double by_chord_s = 2.0 * error / w;
  const auto solved_s = [&](double share, double least_s) {
    const double by_arc_s = std::sqrt(error / share) / w;
    const double by_shrinking_s = 2.0 * error / (w * w * flight.relaxation_s);
    return std::max(least_s, std::min(by_arc_s, by_shrinking_s));
  };
  switch (integrator) {
    case Integrator::explicit_euler:
      return by_chord_s;
    case Integrator::implicit_euler:
    case Integrator::xpbd:
      return solved_s(implicit_euler_share, shrinking_share * by_chord_s);
    case Integrator::tr_bdf2:
      return solved_s(tr_bdf2_share, by_chord_s);
    default:
      return unlimited;
  }
}

/// To three digits.
double rounded(double value) {
  if (!(value > 0.0)) return value;
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 2.0);
  return std::round(value / unit) * unit;
}

bool has_rigid_joints(const Scene& scene) {
  return std::ranges::any_of(scene.joints, [](const Joint& joint) {
    return joint.first.of == Anchor::Of::rigid && joint.second.of == Anchor::Of::rigid;
  });
}

/// What the bodies of a scene ask of a method.
class Demands {
 public:
  Demands(const Scene& scene, FrequencyTable& known)
      : scene_(scene),
        period_s_(1.0 / scene.stepping.rate_hz),
        is_alone_(is_alone(scene)),
        meets_within_steps_(meets_within_steps(scene)),
        frequencies_(known.estimate(scene.soft_bodies, scene.atmosphere)) {}

  struct Step {
    double step_s = unlimited;
    double substeps = 1.0;
    std::size_t body = 0;  // that asks for it, or of_joints
  };
  static constexpr std::size_t of_joints = std::numeric_limits<std::size_t>::max();
  [[nodiscard]] Step longest_step(Integrator integrator) const {
    const double error = scene_.stepping.error_target;
    const Step step = shortest([&](std::size_t body) {
      return std::min({longest_step_s(integrator, frequencies_[body], error, period_s_),
                       fall_step_s(integrator, flight(body), error), turn_step_s(integrator, flight(body), error)});
    });
    if (!has_rigid_joints(scene_) || step.step_s <= joint_step_s) return step;
    return {joint_step_s, std::max(1.0, std::ceil(period_s_ / joint_step_s)), of_joints};
  }
  [[nodiscard]] Step given_limit(Integrator integrator) const {
    return shortest([&](std::size_t body) { return given_limit_s(integrator, frequencies_[body]); });
  }
  [[nodiscard]] const Frequencies& of(std::size_t body) const { return frequencies_[body]; }
  [[nodiscard]] const std::string& name(std::size_t body) const { return scene_.soft_bodies[body].name; }

  [[nodiscard]] std::string reason(Integrator integrator, const Step& step) const {
    if (step.substeps <= 1.0) return "one substep is enough for every body";
    if (step.body == of_joints) return "joints between rigid bodies: a step of at most 1/240 s";
    const Flight flown = flight(step.body);
    const double error = scene_.stepping.error_target;
    std::ostringstream text;
    text << '"' << name(step.body) << "\" ";
    if (fall_step_s(integrator, flown, error) <= step.step_s) {
      text << "falls by its own length in " << rounded(flown.fall_time_s) << " s";
    } else if (turn_step_s(integrator, flown, error) <= step.step_s) {
      text << "turns at " << rounded(flown.spin_rad_s) << " rad/s";
    } else {
      const Frequencies& frequencies = of(step.body);
      text << "vibrates at up to " << rounded(frequencies.fastest_rad_s) << " rad/s and "
           << (scene_.soft_bodies[step.body].gas ? "breathes" : "stretches as a whole") << " at "
           << rounded(frequencies.breathing_rad_s) << " rad/s";
    }
    text << ": a step of at most " << rounded(step.step_s) << " s";
    return text.str();
  }

 private:
  [[nodiscard]] Flight flight(std::size_t body) const {
    return flight_of(scene_.soft_bodies[body], scene_.gravity, may_fall_exactly(body));
  }
  // Drag, joints and its own folds hold a body in flight. What lands softly asks for the steps of its fall as before:
  // in longer ones its bounce is lost.
  [[nodiscard]] bool may_fall_exactly(std::size_t index) const {
    const SoftBody& body = scene_.soft_bodies[index];
    const bool is_let_go = body.drag == Drag() && !body.collision.self && !is_jointed(body);
    const bool is_stopped_at_once = frequencies_[index].breathing_rad_s * period_s_ >= stopped_at_once_rad;
    return meets_within_steps_ && is_let_go && (is_alone_ || is_stopped_at_once);
  }
  [[nodiscard]] bool is_jointed(const SoftBody& body) const {
    const auto is_it = [&](const Anchor& end) { return end.of == Anchor::Of::soft && end.body == body.name; };
    return std::ranges::any_of(scene_.joints,
                               [&](const Joint& joint) { return is_it(joint.first) || is_it(joint.second); });
  }
  template <class Rule>
  [[nodiscard]] Step shortest(const Rule& rule) const {
    Step step;
    for (std::size_t i = 0; i < frequencies_.size(); ++i) {
      const double step_s = rule(i);
      if (step_s < step.step_s) step = {step_s, std::max(1.0, std::ceil(period_s_ / step_s)), i};
    }
    return step;
  }

  const Scene& scene_;
  double period_s_;
  bool is_alone_;
  bool meets_within_steps_;
  std::vector<Frequencies> frequencies_;
};

std::string body_path(std::size_t body) {
  return std::string("soft_bodies[").append(std::to_string(body)).append("]");
}

base::Status too_many(const Demands& demands, const Demands::Step& step) {
  std::ostringstream what;
  what << "a step of \"" << demands.name(step.body) << "\" may be at most " << step.step_s << " s, which asks for "
       << step.substeps << " substeps a tick; the limit is " << base::substeps_max
       << " (lower stiffness, damping or pressure, more mass, a higher rate_hz, or an implicit integrator helps)";
  return {base::StatusCode::failed_precondition, what.str(), body_path(step.body)};
}

bool can_touch(const Scene& scene) {
  const auto meets_soft = [](const SoftBody& body) { return body.collision.soft != SoftCollision::none; };
  return !scene.rigid_bodies.empty() || !scene.colliders.empty() || !scene.joints.empty() ||
         std::ranges::count_if(scene.soft_bodies, meets_soft) > 1;
}

// What contact makes of an implicit step's cost.
double passes_cost_of(const Scene& scene) {
  double most = 1.0;
  for (const SoftBody& body : scene.soft_bodies) {
    most = std::max(most, static_cast<double>(body.mesh->positions_m.size()) / contact_vertices);
  }
  return contact_passes_cost * most;
}

SubstepChoice choose_both(const Scene& scene, const Demands& demands) {
  const double given = scene.stepping.substeps;
  const double most = given > 0.0 ? given : base::substeps_max;
  const bool touchable = can_touch(scene);
  const double passes_cost = passes_cost_of(scene);
  struct Rank {
    bool inaccurate = true;
    double cost = unlimited;
    auto operator<=>(const Rank&) const = default;
  } best;
  Integrator integrator = Integrator::automatic;
  Demands::Step taken;
  for (const MethodCost& candidate : candidates) {
    Demands::Step step = demands.longest_step(candidate.integrator);
    const bool accurate = step.substeps <= most;
    if (!accurate) step = demands.given_limit(candidate.integrator);
    if (step.substeps > most) continue;
    if (given > 0.0 || !accurate) step.substeps = most;
    const bool has_passes = touchable && !is_explicit(candidate.integrator);
    const Rank rank{!accurate, (has_passes ? passes_cost : 1.0) * candidate.cost * step.substeps};
    if (rank < best) {
      best = rank;
      integrator = candidate.integrator;
      taken = step;
    }
  }
  std::ostringstream reason;
  reason << name_of(integrator);
  if (best.inaccurate) {
    reason << " is stable, but not within the error target, with " << taken.substeps << " substeps";
  } else {
    reason << " costs least, about " << best.cost << " force evaluations a tick";
  }
  if (touchable && !is_explicit(integrator)) reason << ", the passes that it takes at contact included";
  if (!scene.soft_bodies.empty() && !best.inaccurate) {
    const Demands::Step symplectic = demands.longest_step(Integrator::symplectic_euler);
    if (integrator != Integrator::symplectic_euler) {
      reason << " where SYMPLECTIC_EULER asks for " << symplectic.substeps << " substeps";
    }
    reason << "; " << demands.reason(integrator, taken);
  }
  return SubstepChoice{static_cast<std::uint32_t>(taken.substeps), integrator, reason.str()};
}

// Whether a bound that costs little already says so: an edit of a large scene should not wait for the estimate.
bool surely_within_limits(const Scene& scene) {
  const double step_s = 1.0 / scene.stepping.rate_hz / scene.stepping.substeps;
  const Integrator integrator = scene.stepping.integrator;
  if (!is_explicit(integrator) && integrator != Integrator::xpbd) return true;
  return std::ranges::all_of(scene.soft_bodies, [&](const SoftBody& body) {
    const Frequencies bound = bound_frequencies(body, scene.atmosphere);
    // Damping helps explicit Euler and midpoint, and may be less than its bound.
    const double undamped_s = limit_of_one_s(integrator, bound.fastest_rad_s, 0.0);
    return step_s <= std::min(undamped_s, given_limit_s(integrator, bound));
  });
}

base::Result<SubstepChoice> choose_given(const Scene& scene, FrequencyTable& known) {
  const Stepping& stepping = scene.stepping;
  if (surely_within_limits(scene)) return SubstepChoice{stepping.substeps, stepping.integrator, "as the scene says"};
  const Demands demands(scene, known);
  const Demands::Step last = demands.given_limit(stepping.integrator);
  if (last.substeps <= stepping.substeps) {
    return SubstepChoice{stepping.substeps, stepping.integrator, "as the scene says"};
  }
  const bool xpbd = stepping.integrator == Integrator::xpbd;
  std::ostringstream limit;
  limit << '"' << demands.name(last.body) << '"';
  if (xpbd) {
    limit << " rests within " << 100.0 * xpbd_given_rest_error_max << " % of its volume";
  } else {
    limit << " is stable";
  }
  limit << " up to a step of " << last.step_s << " s, " << last.substeps << " substeps";
  const Demands::Step chosen = demands.longest_step(stepping.integrator);
  switch (stepping.on_unstable) {
    case OnUnstable::refuse: {
      std::ostringstream what;
      what << stepping.substeps << " are too few: " << limit.str()
           << " (with a margin and the error target, 0 or on_unstable SUBSTEP ";
      if (chosen.substeps > base::substeps_max) {
        what << "asks for " << chosen.substeps << ", past the limit of " << base::substeps_max;
      } else {
        what << "takes " << chosen.substeps;
      }
      what << "; ALLOW goes on)";
      return base::Status(base::StatusCode::failed_precondition, what.str(), "stepping.substeps");
    }
    case OnUnstable::substep: {
      if (chosen.substeps > base::substeps_max) return too_many(demands, chosen);
      return SubstepChoice{static_cast<std::uint32_t>(chosen.substeps), stepping.integrator,
                           "raised from " + std::to_string(stepping.substeps) + ": " + limit.str()};
    }
    case OnUnstable::allow:
      break;
  }
  return SubstepChoice{
      stepping.substeps, stepping.integrator,
      std::string("as the scene says, though ") + (xpbd ? "inaccurate: " : "unstable: ") + limit.str()};
}

base::Result<SubstepChoice> choose_by_stepping(const Scene& scene, FrequencyTable& known) {
  if (scene.stepping.integrator == Integrator::automatic) return choose_both(scene, Demands(scene, known));
  if (scene.stepping.substeps > 0) return choose_given(scene, known);
  const Demands demands(scene, known);
  const Demands::Step step = demands.longest_step(scene.stepping.integrator);
  if (step.substeps > base::substeps_max) return too_many(demands, step);
  return SubstepChoice{.substeps = static_cast<std::uint32_t>(step.substeps),
                       .integrator = scene.stepping.integrator,
                       .reason = demands.reason(scene.stepping.integrator, step)};
}

}  // namespace

std::string_view name_of(Integrator integrator) {
  switch (integrator) {
    case Integrator::explicit_euler:
      return "EXPLICIT_EULER";
    case Integrator::midpoint:
      return "MIDPOINT";
    case Integrator::rk4:
      return "RK4";
    case Integrator::symplectic_euler:
      return "SYMPLECTIC_EULER";
    case Integrator::implicit_euler:
      return "IMPLICIT_EULER";
    case Integrator::tr_bdf2:
      return "TR_BDF2";
    case Integrator::xpbd:
      return "XPBD";
    case Integrator::automatic:
      return "AUTO";
  }
  return {};
}

base::Result<SubstepChoice> choose_substeps(const Scene& scene, FrequencyTable& known) {
  base::Result<SubstepChoice> choice = choose_by_stepping(scene, known);
  if (!choice.ok()) return choice;
  choice->falls_by_parabola = meets_within_steps(scene);
  if (scene.stepping.substeps > 0 || std::isinf(longest_gas_step_s(choice->integrator, 1.0))) return choice;
  for (const Frequencies& body : known.estimate(scene.soft_bodies, scene.atmosphere)) {
    choice->gas_give_m4_kg.push_back(body.gas_give_m4_kg);
  }
  return choice;
}

}  // namespace pneuma::physics
