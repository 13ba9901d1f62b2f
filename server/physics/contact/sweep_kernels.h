// The inner loops of rows between bodies that answer by the masses of their vertices. One source
// (sweep_kernel_source.h), compiled for each instruction set as the lane kernels are; all do the same operations on
// each number in the same order.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pneuma::physics {

/// A row as a sweep needs it. Vectors are x, y, z and a 0. Corners that give way come first.
struct alignas(64) LumpedRow {
  double normal[4] = {};
  double weights[4] = {};         // of each corner's value in the row's own
  double pushes_1_kg[4] = {};     // of the row's impulse in each corner's value
  std::uint32_t corners[4] = {};  // slots; one without a share is the first, with weight 0
  double mass_kg = 0.0;           // that the row's impulse meets; 0 where nothing answers
  double friction = 0.0;
  std::uint32_t corner_count = 4;  // 2, or 4
  std::uint32_t pushed_count = 4;  // of the corners
};

/// What a solve finds of a row: its impulse along the normal, and the one across it.
struct alignas(32) LumpedImpulse {
  double rubbed_n_s[4] = {};
  double pressed_n_s = 0.0;
  double least_m_s = 0.0;  // along the normal: what the row's value is to reach
};

/// A sweep over some of the rows. Values are four numbers a slot.
struct RowSweep {
  const LumpedRow* rows = nullptr;
  LumpedImpulse* impulses = nullptr;
  const std::uint32_t* which = nullptr;
  std::size_t count = 0;
  double* values = nullptr;
  bool with_friction = true;
};

struct SweepKernels {
  /// along[i]: row i's value along its normal.
  void (*project)(const LumpedRow* rows, std::size_t count, const double* values, double* along) = nullptr;
  /// Answers one row after the other. Returns the largest change of a row's value; squared.
  double (*sweep)(const RowSweep& sweep) = nullptr;
};

enum class Isa;
/// has_isa(isa).
[[nodiscard]] const SweepKernels& sweep_kernels(Isa isa);

}  // namespace pneuma::physics
