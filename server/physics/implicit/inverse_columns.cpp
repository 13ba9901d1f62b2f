#include "physics/implicit/inverse_columns.h"

#include <algorithm>
#include <utility>

namespace pneuma::physics {

std::vector<std::span<const double>> InverseColumns::columns(std::span<const std::uint32_t> rows) {
  const std::lock_guard lock(mutex_);
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t row : rows) {
    if (!columns_.contains(row)) missing.push_back(row);
  }
  constexpr std::size_t at_once = 8;
  for (auto rest = std::span(std::as_const(missing)); !rest.empty();) {
    const std::size_t count = std::min(at_once, rest.size());
    find(rest.first(count));
    rest = rest.subspan(count);
  }
  std::vector<std::span<const double>> spans;
  spans.reserve(rows.size());
  for (const std::uint32_t row : rows) spans.emplace_back(columns_.at(row));
  return spans;
}

void InverseColumns::find(std::span<const std::uint32_t> rows) {
  const std::span<const std::uint32_t> places = factor_.places();
  std::vector<FactorRow<8>> values(places.size(), FactorRow<8>{});
  const auto is_pinned = [&](std::uint32_t row) { return !pinned_.empty() && pinned_[row] != 0; };
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (!is_pinned(rows[k])) values[places[rows[k]]].columns[k] = 1.0;
  }
  factor_.solve(values);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    std::vector<double>& column = columns_[rows[k]];
    column.resize(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) column[i] = values[places[i]].columns[k];
  }
}

std::size_t InverseColumns::bytes() const {
  const std::lock_guard lock(mutex_);
  std::size_t sum = 0;
  for (const auto& [row, column] : columns_) sum += column.capacity() * sizeof(double);
  return sum;
}

}  // namespace pneuma::physics
