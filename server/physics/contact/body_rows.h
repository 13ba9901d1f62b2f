// How rows of few bodies answer to each other's impulses: a number for each two rows, and a few columns for each body.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/dense_kernels.h"
#include "physics/contact/response.h"
#include "physics/contact/row_direction.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {

/// W = S x 1 + sum U_b D_b U_b^T, in the world's axes, 1/kg. S has one number for each two rows: what the springs of
/// soft bodies make of it, the same in every direction. Each body b adds a few columns: its turning, its gas, all of a
/// rigid body's motion (response.h).
///
/// So directions of rows that stick, three a row, take the factor of a matrix of a third as many unknowns. Those of
/// rows that slide come after it, by the complement of Schur: its numbers times the cosines between directions. The
/// columns come last, by Woodbury's identity.
class BodyRows {
 public:
  /// What impulses make of the rows' velocities: a vector, so that shares of two may be added.
  using Velocities = std::vector<double>;

  BodyRows(std::size_t rows, std::size_t bodies);

  /// The normal and two across it, by columns.
  void set_axes(std::size_t row, const Eigen::Matrix3d& axes) { axes_[row] = axes; }
  /// In S: (row, by) and (by, row).
  void set_number(std::size_t row, std::size_t by, double number_1_kg);
  /// A body has a part in a row: as its first support, or as its second by a sign of -1.
  void add_part(std::size_t row, std::uint32_t body, double sign, const LowRankColumns& columns);
  /// After all numbers are set.
  void add_softness(std::size_t row, double softness_1_kg) { number(row, row) += softness_1_kg; }

  [[nodiscard]] std::size_t count() const { return rows_; }
  [[nodiscard]] double diagonal_1_kg(std::size_t at) const;
  [[nodiscard]] Velocities at_rest() const { return Velocities(3 * stride_ + shares(), 0.0); }
  /// Along the row's axes.
  [[nodiscard]] Vec3d velocity_m_s(std::size_t row, const Velocities& velocities) const;
  void push(std::size_t row, const Vec3d& impulse_n_s, Velocities& velocities) const;
  /// `impulses_n_s`: three a row.
  void push_all(std::span<const double> impulses_n_s, Velocities& velocities) const;

  /// Takes the part of W that the directions span, which are sorted by `at`. False where the numbers' share in it is
  /// not positive definite, or has no finite inverse.
  bool factor(std::span<const RowDirection> directions);
  /// x with that part times x = b, in the place of b; one number a direction.
  void solve(std::span<double> b);

 private:
  static constexpr std::size_t columns_a_body = LowRankColumns::count;
  using Columns = LowRankColumns::Columns;
  using Shares = Eigen::Matrix<double, columns_a_body, 1>;
  struct Part {
    std::uint32_t body = 0;
    Columns taken = Columns::Zero();  // U
    Columns given = Columns::Zero();  // U D
  };
  struct RowParts {
    std::array<Part, 2> sides;
    std::size_t count = 0;
  };
  // A direction of the part that was factored.
  struct Placed {
    std::size_t row = 0;
    std::size_t slot = 0;  // of its row in the factored numbers
    Vec3d along = Vec3d::Zero();
    bool sticks = false;
  };

  [[nodiscard]] double& number(std::size_t at, std::size_t by) { return numbers_[by * stride_ + at]; }
  [[nodiscard]] double number(std::size_t at, std::size_t by) const { return numbers_[by * stride_ + at]; }
  [[nodiscard]] std::size_t shares() const { return columns_a_body * signs_.size(); }
  void list_columns();
  void place(std::span<const RowDirection> directions);
  bool factor_numbers();
  bool factor_sliding(std::span<const RowDirection> directions);
  bool factor_columns();
  void solve_without_columns(std::span<double> b, std::size_t width);

  std::size_t rows_;
  std::size_t stride_;
  std::vector<double> numbers_;  // S, by columns
  std::vector<Eigen::Matrix3d> axes_;
  std::vector<RowParts> parts_;               // one a row
  std::vector<LowRankColumns::Signs> signs_;  // D, one a body

  std::vector<Placed> placed_;                   // one a direction
  std::vector<std::size_t> sticking_, sliding_;  // rows
  std::size_t leading_ = 0;                      // slots of the rows that stick, filled up to whole blocks
  std::vector<double> factor_;                   // of the numbers: of rows that stick, then what is left of the others
  std::vector<std::size_t> slid_;                // directions of rows that slide
  std::vector<double> slid_factor_;
  std::vector<std::size_t> used_;         // of the bodies' columns: those that are not zero
  std::vector<double> taken_, answered_;  // U along the directions, and what they answer to it, by direction
  Eigen::PartialPivLU<Eigen::MatrixXd> capacitance_;  // D + U^T (S x 1)^-1 U
  std::vector<double> by_row_, by_slid_;              // scratch of solve_without_columns
  Eigen::VectorXd share_;                             // scratch of solve
  const DenseKernels* kernels_ = &dense_kernels(isa_in_use());
};

}  // namespace pneuma::physics
