#include "physics/contact/groups.h"

#include <algorithm>
#include <numeric>

namespace pneuma::physics {

void group_rows(std::vector<ContactRow>& rows, std::span<const std::uint8_t> yields, std::vector<RowGroup>& groups) {
  std::vector<std::uint32_t> first(yields.size());
  std::iota(first.begin(), first.end(), 0U);
  const auto root_of = [&](std::uint32_t body) {
    while (first[body] != body) body = first[body] = first[first[body]];
    return body;
  };
  for (const ContactRow& row : rows) {
    if (yields[row.first.body] == 0 || yields[row.second.body] == 0) continue;
    const std::uint32_t a = root_of(row.first.body);
    const std::uint32_t b = root_of(row.second.body);
    first[std::max(a, b)] = std::min(a, b);  // the lowest names the group, whatever the order
  }
  const auto group_of = [&](const ContactRow& row) {
    return root_of(yields[row.first.body] != 0 ? row.first.body : row.second.body);
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
