// The impulses of rows that are solved together: normal ones not below 0, and those of friction within discs. With
// discs of given radii, they are those of a convex program: what leaves the least energy.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/body_rows.h"
#include "physics/contact/dense_rows.h"
#include "physics/contact/row_direction.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// min 1/2 f.W f + f.q over f_n >= 0 and |f_t| <= radius, f and q by row as (normal, two across). `Rows` holds W:
/// DenseRows or BodyRows.
template <class Rows>
class DiscProgram {
 public:
  /// `rows` outlives the program. W is set before the program is solved.
  explicit DiscProgram(Rows& rows);

  /// `wanted_m_s` is q; `across_1_kg` bounds the row's block of W across its normal.
  void set_row(std::size_t row, const Vec3d& wanted_m_s, const Vec3d& start_n_s, double across_1_kg);
  /// Its impulse may be any across the normal, and along it where `also_along`, or else has no share along it.
  void set_free(std::size_t row, bool also_along);
  /// Returns by how much of velocity the disc changed.
  double set_disc(std::size_t row, double radius_n_s);

  /// Of Coulomb's law, for solve_with_friction().
  void set_friction(std::size_t row, double friction) { friction_[row] = friction; }

  /// Whether no row's velocity was off by more than enough_m_s in the end.
  bool solve(double enough_m_s, std::uint32_t& factorisations);
  /// The same where the discs' radii are the normal impulses times friction, by Newton's method on all of it. That is
  /// no convex program, so the method may come to nothing: then false, and the impulses are the nearest it found.
  bool solve_with_friction(double enough_m_s, std::uint32_t& factorisations);
  /// How far off the last solve's last look found a row's velocity.
  [[nodiscard]] double off_m_s() const { return off_m_s_; }
  [[nodiscard]] Vec3d impulse(std::size_t row) const { return Vec3d::Map(f_.data() + 3 * row); }

 private:
  enum class Kind : std::uint8_t { contact, tie, guide };
  /// A row that slides: its friction goes with its normal impulse, by so much across the normal.
  struct Slide {
    std::size_t row = 0;
    std::size_t normal = 0;  // in directions_
    Vec3d share = Vec3d::Zero();
  };
  using Vector = std::vector<double>;  // three numbers a row, or one a direction
  using Velocities = typename Rows::Velocities;

  [[nodiscard]] Vec3d gradient(std::size_t row, const Velocities& velocities) const {
    return Vec3d::Map(q_.data() + 3 * row) + w_.velocity_m_s(row, velocities);
  }
  void push(std::size_t row, const Vec3d& change_n_s);
  double stop(std::size_t row, Eigen::Index axis);
  enum class Radii : std::uint8_t { fixed, follow_normals };
  double sweep(Radii radii = Radii::fixed);
  bool sweep_until(double enough_m_s, int sweeps);
  void follow_normals();
  bool factor_directions();
  bool aim_with_friction();
  void go(double length);
  bool step_with_friction();
  bool spread_found();
  void project(Vector& f) const;
  void find_velocities();
  void add_differences(const Vector& from, const Vector& to, Velocities& velocities) const;
  [[nodiscard]] double energy(const Vector& f, const Velocities& velocities) const;
  void find_directions();
  bool step_together();
  [[nodiscard]] double longest_inside(const Vector& step) const;

  Rows& w_;
  std::size_t rows_;
  Vector q_, f_;
  Velocities velocities_;  // W f
  double off_m_s_ = 0.0;
  std::vector<double> radii_n_s_, across_1_kg_, friction_;
  std::vector<Vec3d> diagonal_1_kg_;
  std::vector<Kind> kinds_;
  std::vector<RowDirection> directions_;
  std::vector<Slide> slides_;
  // Scratch of both methods, of solve_with_friction, and of solve.
  Vector found_, step_;
  Vector start_f_, best_f_, normals_n_s_, wanted_, without_;
  Velocities start_velocities_, rubbed_;
  Vector straight_f_, next_f_;
  Velocities by_step_, next_velocities_;
};

}  // namespace pneuma::physics
