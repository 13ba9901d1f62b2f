#include "codec/residual_tables.h"

#include <cstdlib>

namespace pneuma::codec {

namespace {

// A residual u has the likelihood ratio^|u|, the ratio in 65,536ths: a geometric distribution to both sides. The ratios
// were fitted to the residuals of recorded scenes; they are part of the format.
constexpr std::array<std::uint32_t, table_count> ratios{150,   3730,  4310,  4910,  7080,  8360,  12860, 18390,
                                                        23380, 28000, 34570, 41690, 48820, 52960, 56420, 58420};

// The reciprocal of f is too large by less than f 2^-shift / f, so the quotient of n by less than n f 2^-shift / f;
// that is below 1 / f, and changes no whole part, while n < 2^22 f and 2^22 f^2 <= 2^shift.
void set_reciprocal(ResidualTable::Range& range) {
  if (range.frequency == 0) return;
  range.reciprocal_shift = 32 + static_cast<std::uint32_t>(std::bit_width(range.frequency - 1U));
  range.reciprocal = ((std::uint64_t{1} << range.reciprocal_shift) - 1) / range.frequency + 1;
}

ResidualTable make_table(std::uint64_t ratio) {
  std::array<std::uint64_t, escape + 1> weights{};  // by size; the last one for all that escapes on one side
  std::uint64_t power = std::uint64_t{1} << 32;
  std::uint64_t sum = 0;
  for (std::size_t size = 0; size < weights.size(); ++size) {
    weights[size] = power;
    sum += size == 0 ? weights[size] : 2 * weights[size];
    power = power * ratio >> 16;
  }

  ResidualTable table{};
  std::uint64_t left = probability_total;
  for (std::int32_t residual = -residual_max; residual <= escape; ++residual) {
    if (residual == 0) continue;
    const std::uint64_t weight = weights[static_cast<std::size_t>(std::abs(residual))];
    // The escape stands for both sides, and can always be written.
    const std::uint64_t frequency =
        residual == escape ? 1 + 2 * weight * probability_total / sum : weight * probability_total / sum;
    table.ranges[range_of(residual)].frequency = static_cast<std::uint16_t>(frequency);
    left -= frequency;
  }
  table.ranges[range_of(0)].frequency = static_cast<std::uint16_t>(left);

  std::uint32_t slot = 0;
  for (std::int32_t residual = -residual_max; residual <= escape; ++residual) {
    ResidualTable::Range& range = table.ranges[range_of(residual)];
    range.begin = static_cast<std::uint16_t>(slot);
    set_reciprocal(range);
    const std::uint32_t same = (static_cast<std::uint32_t>(residual) << slot_residual_shift) |
                               (residual == escape ? slot_escape_bit : 0) |
                               (std::uint32_t{range.frequency} << slot_frequency_shift);
    for (std::uint32_t i = 0; i < range.frequency; ++i) table.slots[slot++] = same | i;
  }
  return table;
}

}  // namespace

const std::array<ResidualTable, table_count>& residual_tables() {
  static const std::array<ResidualTable, table_count> tables = [] {
    std::array<ResidualTable, table_count> all;
    for (std::uint32_t i = 0; i < table_count; ++i) all[i] = make_table(ratios[i]);
    return all;
  }();
  return tables;
}

}  // namespace pneuma::codec
