// What the extreme cases share: a scene file brought to life, stepped and measured.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "numerics/extremes/extreme_case.h"
#include "physics/world.h"

namespace pneuma::extremes {

/// As a program would take it from the file in tests/numerics/scenes, or why it would not.
[[nodiscard]] base::Result<physics::Scene> load(const std::string& file);
/// Of a file that must load.
[[nodiscard]] physics::Scene scene_of(const std::string& file);

/// A world that came to be, or did not, and the bodies that it told of since.
class Run {
 public:
  explicit Run(physics::Scene scene);

  /// Why the scene is no world; empty where it is one, and all below is for that.
  [[nodiscard]] const std::string& refusal() const { return refusal_; }
  void seconds(double seconds);
  void tick();

  [[nodiscard]] physics::World& world() { return *world_; }
  [[nodiscard]] const physics::World& world() const { return *world_; }
  /// Whether the body froze, or its gas told of a lost volume or burst.
  [[nodiscard]] bool has_reported(const std::string& body) const;
  [[nodiscard]] bool has_frozen() const;

  /// Every vertex of every body, and what is measured of it.
  [[nodiscard]] bool is_finite() const;
  [[nodiscard]] std::vector<physics::Vec3d> positions_m(std::size_t body = 0) const;
  /// Kinetic, elastic, of gas and of height, of all soft bodies.
  [[nodiscard]] double energy_j() const;

 private:
  std::optional<physics::World> world_;
  std::string refusal_;
  std::vector<std::string> reporters_;  // names of bodies
  physics::Workers workers_{1};
};

/// Mean distance from the mean.
[[nodiscard]] double radius_m(std::span<const physics::Vec3d> positions_m);
/// Of an icosphere with gas in a vacuum, by the closed form: s = (1 + sqrt(1 + 12 nRT / K)) / 2 times its radius at
/// rest lengths, K = sum k l0^2.
[[nodiscard]] double rest_radius_m(const physics::SoftBody& ball);
[[nodiscard]] double nrt_j(const physics::SoftBody& body);
/// Root of the mean square distance between the vertices of two configurations.
[[nodiscard]] double distance_m(std::span<const physics::Vec3d> a, std::span<const physics::Vec3d> b);

inline constexpr std::array<physics::Integrator, 8> every_integrator{
    physics::Integrator::automatic, physics::Integrator::implicit_euler,  physics::Integrator::tr_bdf2,
    physics::Integrator::xpbd,      physics::Integrator::explicit_euler,  physics::Integrator::midpoint,
    physics::Integrator::rk4,       physics::Integrator::symplectic_euler};

/// Two digits, or a whole number: "0.31 %", "35 %"; "14 times" from 1,000 % up.
[[nodiscard]] std::string percent(double share);
/// Two digits, or a whole number from 100 up: "3.1e-07", "128".
[[nodiscard]] std::string brief(double value);

/// What came of a scene by each integrator: all that run it to its end come within the limit. One that may fail may
/// instead be refused, or report that a body ran away.
class Survey {
 public:
  /// `error` of a run to its end.
  using Error = std::function<double(Run&)>;
  explicit Survey(double error_max) : error_max_(error_max) {}
  /// Runs the scene by its own integrator, called `name` in the figure.
  void add(physics::Scene scene, const std::string& name, bool may_fail, const Error& error);
  /// By every integrator, at the substeps that each chooses. The explicit ones may fail.
  void add_all(const physics::Scene& scene, const Error& error);
  /// "what: AUTO 0.1 %, worst XPBD 0.5 %, 4 refused"
  using Format = std::string (*)(double);
  [[nodiscard]] Result result(const std::string& what, Format format) const;

 private:
  double error_max_;
  bool holds_ = true;
  std::optional<double> automatic_;  // the worst by AUTO; none where it was refused or froze
  std::string worst_by_;
  double worst_ = -1.0;
  int refused_ = 0;
  int reported_ = 0;
};

/// As the scene format has it: "TR_BDF2".
[[nodiscard]] std::string method_name(physics::Integrator integrator);
[[nodiscard]] physics::Scene with_integrator(physics::Scene scene, physics::Integrator integrator);

}  // namespace pneuma::extremes
