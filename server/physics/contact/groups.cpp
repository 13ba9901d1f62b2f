#include "physics/contact/groups.h"

#include <algorithm>
#include <numeric>

namespace pneuma::physics {

void JoinedBodies::begin(std::size_t count) {
  parent_.resize(count);
  std::iota(parent_.begin(), parent_.end(), 0U);
}

void JoinedBodies::join(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t of_a = lowest_with(a);
  const std::uint32_t of_b = lowest_with(b);
  parent_[std::max(of_a, of_b)] = std::min(of_a, of_b);
}

std::uint32_t JoinedBodies::lowest_with(std::uint32_t body) {
  while (parent_[body] != body) body = parent_[body] = parent_[parent_[body]];
  return body;
}

void group_rows(std::vector<ContactRow>& rows, std::span<const std::uint8_t> yields, std::vector<RowGroup>& groups) {
  JoinedBodies joined;
  joined.begin(yields.size());
  for (const ContactRow& row : rows) {
    if (yields[row.first.body] != 0 && yields[row.second.body] != 0) joined.join(row.first.body, row.second.body);
  }
  const auto group_of = [&](const ContactRow& row) {
    return joined.lowest_with(yields[row.first.body] != 0 ? row.first.body : row.second.body);
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // group and place
  for (std::uint32_t i = 0; i < rows.size(); ++i) order.emplace_back(group_of(rows[i]), i);
  std::ranges::sort(order, [&](const auto& p, const auto& q) {
    return p.first != q.first ? p.first < q.first : rows[p.second].key < rows[q.second].key;
  });
  std::vector<ContactRow> sorted;
  sorted.reserve(rows.size());
  groups.clear();
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || order[i].first != order[i - 1].first) groups.push_back({i, i});
    groups.back().end = i + 1;
    sorted.push_back(rows[order[i].second]);
  }
  rows.swap(sorted);
}

}  // namespace pneuma::physics
