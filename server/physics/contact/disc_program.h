// The impulses of rows that are solved together: normal ones not below 0, and those of friction within discs. With
// discs of given radii, they are those of a convex program: what leaves the least energy.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/dense_kernels.h"
#include "physics/lanes/isa.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// min 1/2 f.W f + f.q over f_n >= 0 and |f_t| <= radius, f and q by row as (normal, two across).
class DiscProgram {
 public:
  explicit DiscProgram(std::size_t rows);

  /// `wanted_m_s` is q; `across_1_kg` bounds the row's block of W across its normal.
  void set_row(std::size_t row, const Vec3d& wanted_m_s, const Vec3d& start_n_s, double across_1_kg);
  /// Block (row, by) of W and its transpose.
  void set_block(std::size_t row, std::size_t by, const Eigen::Matrix3d& block_1_kg);
  /// Its impulse may be any across the normal, and along it where `also_along`, or else has no share along it.
  void set_free(std::size_t row, bool also_along);
  /// On the diagonal of W, after its block is set.
  void add_softness(std::size_t row, double softness_1_kg);
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
  [[nodiscard]] Vec3d impulse(std::size_t row) const { return {f_[3 * row], f_[3 * row + 1], f_[3 * row + 2]}; }

 private:
  /// A free direction: one coordinate, or the tangent of a disc at its edge, which mixes two.
  struct Direction {
    std::size_t at = 0;
    double share = 1.0;
    double next_share = 0.0;  // of at + 1
    double bend_1_kg = 0.0;   // what keeping to the edge adds
  };
  enum class Kind : std::uint8_t { contact, tie, guide };
  /// A row that slides: its friction goes with its normal impulse, by so much across the normal.
  struct Slide {
    std::size_t row = 0;
    std::size_t normal = 0;  // in directions_
    double share = 0.0;
    double next_share = 0.0;
  };
  // One number a coordinate, and zeros up to stride_.
  using Vector = std::vector<double>;

  [[nodiscard]] double& w(std::size_t at, std::size_t by) { return w_[by * stride_ + at]; }
  [[nodiscard]] double w(std::size_t at, std::size_t by) const { return w_[by * stride_ + at]; }
  [[nodiscard]] const double* column(std::size_t by) const { return w_.data() + by * stride_; }
  void push(std::size_t at, double change_n_s);
  double stop(std::size_t at);
  enum class Radii : std::uint8_t { fixed, follow_normals };
  double sweep(Radii radii = Radii::fixed);
  bool sweep_until(double enough_m_s, int sweeps);
  void follow_normals();
  bool solve_for_directions();
  void find_slide_columns();
  bool aim_with_friction();
  void go(double length);
  bool step_with_friction();
  void spread_found();
  void project(Vector& f) const;
  void find_gradient(const Vector& f, Vector& gradient) const;
  void add_differences(const Vector& from, const Vector& to, Vector& gradient) const;
  [[nodiscard]] static double energy(const Vector& f, const Vector& gradient, const Vector& q);
  void find_directions();
  void reduce();
  bool step_together();
  [[nodiscard]] double longest_inside(const Vector& step) const;

  std::size_t rows_;
  std::size_t stride_;
  Vector w_;  // by columns (dense_kernels.h)
  Vector q_, f_, gradient_;
  double off_m_s_ = 0.0;
  std::vector<double> radii_n_s_, across_1_kg_, friction_;
  std::vector<Kind> kinds_;
  std::vector<Direction> directions_;
  std::vector<Slide> slides_;
  Vector slide_columns_, normals_n_s_, wanted_, without_;                          // scratch of aim_with_friction
  Vector start_f_, start_gradient_, best_f_;                                       // scratch of solve_with_friction
  Vector reduced_, found_, step_, by_step_, straight_f_, next_f_, next_gradient_;  // scratch of both methods
  const DenseKernels* kernels_ = &dense_kernels(isa_in_use());
};

}  // namespace pneuma::physics
