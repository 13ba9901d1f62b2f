#include "codec/residual_tables.h"

#include <cstdlib>

namespace pneuma::codec {

namespace {

// A residual u has the likelihood of a logistic distribution at u, r / (1 + r)^2 with r = ratio^|u|, in 65,536ths. The
// ratios were fitted to the residuals of recorded scenes; they are part of the format.
constexpr std::array<std::uint32_t, table_count> ratios{
    44,    142,   243,   346,   501,   723,   955,   1199,  1575,  2137,  2754,  3429,  4514,  6210,  8104,  10130,
    13158, 17226, 20965, 24307, 28482, 33144, 36829, 39792, 43171, 46621, 49160, 51103, 53225, 55305, 56785, 57891};

ResidualTable make_table(std::uint64_t ratio) {
  constexpr std::uint64_t one = 1U << 16;
  std::array<std::uint64_t, escape + 1> weights{};  // by size; the last one for all that escapes on one side
  std::uint64_t power = one;
  std::uint64_t sum = 0;
  for (std::size_t size = 0; size < weights.size(); ++size) {
    weights[size] = (power << 32) / ((one + power) * (one + power));
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
    for (std::uint32_t i = 0; i < range.frequency; ++i) {
      table.slots[slot++] = (static_cast<std::uint32_t>(residual) << slot_residual_shift) |
                            (std::uint32_t{range.frequency} << slot_frequency_shift) | i;
    }
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
