// A convex program: the impulses of rows, normal ones not below 0 and those of friction within discs, that leave the
// least energy.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Dense>

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
  /// Its impulse stays as it is.
  void set_given(std::size_t row);
  /// On the diagonal of W, after its block is set.
  void add_softness(std::size_t row, double softness_1_kg);
  /// Returns by how much of velocity the disc changed.
  double set_disc(std::size_t row, double radius_n_s);

  /// Whether no row's velocity was off by more than enough_m_s in the end.
  bool solve(double enough_m_s, std::uint32_t& factorisations);
  [[nodiscard]] Vec3d impulse(std::size_t row) const { return f_.segment<3>(3 * static_cast<Eigen::Index>(row)); }

 private:
  /// A free direction: one coordinate, or the tangent of a disc at its edge, which mixes two.
  struct Direction {
    Eigen::Index at = 0;
    double share = 1.0;
    double next_share = 0.0;  // of at + 1
    double bend_1_kg = 0.0;   // what keeping to the edge adds
  };
  enum class Kind : std::uint8_t { contact, tie, guide, given };
  [[nodiscard]] Kind kind_of(Eigen::Index row) const { return kinds_[static_cast<std::size_t>(row)]; }
  double stop(Eigen::Index at);
  double sweep();
  void project(Eigen::VectorXd& f) const;
  void find_directions();
  bool step_together();
  [[nodiscard]] double longest_inside(const Eigen::VectorXd& step) const;

  Eigen::Index rows_;
  Eigen::MatrixXd w_;
  Eigen::VectorXd q_, f_, gradient_;
  std::vector<double> radii_n_s_, across_1_kg_;
  std::vector<Kind> kinds_;
  std::vector<Direction> directions_;
};

}  // namespace pneuma::physics
