#include "base/nearest_word.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "base/limits.h"

namespace pneuma::base {

namespace {

// Shorter words begin, or are part of, too many others.
constexpr std::size_t beginning_min = 3;
constexpr std::size_t part_min = 4;
// Comparing with them all may take this many steps, about a millisecond: a client asks, and a world waits.
constexpr std::size_t cells_max = 500'000;
constexpr std::size_t list_bytes_max = 200;

/// The number of single-character changes that turn one word into the other (Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string nearest_word(std::string_view word, std::span<const std::string> candidates) {
  if (word.empty() || word.size() > name_bytes_max) return {};  // no name, and the table would be large
  const std::string* nearest = nullptr;
  // Words that share no letter are not near, however short they are.
  std::size_t least = std::min(std::max<std::size_t>(2, word.size() / 3) + 1, word.size());
  std::size_t cells_left = cells_max;
  for (const std::string& candidate : candidates) {
    const std::size_t cells = word.size() * candidate.size();
    if (cells > cells_left) break;
    cells_left -= cells;
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < least) {
      least = distance;
      nearest = &candidate;
    }
  }
  if (nearest != nullptr && least <= 1) return *nearest;
  const auto shortest = [&](const auto& is_meant) {
    const std::string* found = nullptr;
    for (const std::string& candidate : candidates) {
      if (is_meant(candidate) && (found == nullptr || candidate.size() < found->size())) found = &candidate;
    }
    return found;
  };
  if (word.size() >= beginning_min) {
    const std::string* longer = shortest([&](const std::string& candidate) { return candidate.starts_with(word); });
    if (longer != nullptr) return *longer;
  }
  if (nearest == nullptr && word.size() >= part_min) {
    nearest = shortest([&](const std::string& candidate) { return candidate.find(word) != std::string::npos; });
  }
  return nearest == nullptr ? std::string() : *nearest;
}

std::string did_you_mean(std::string_view word, std::span<const std::string> candidates) {
  const std::string nearest = nearest_word(word, candidates);
  return nearest.empty() ? "" : std::string("; did you mean ").append(nearest).append("?");
}

std::string nearest_or_all(std::string_view word, std::span<const std::string> candidates) {
  if (std::string meant = did_you_mean(word, candidates); !meant.empty()) return meant;
  if (candidates.empty()) return "; there are none";
  std::string list = candidates.size() == 1 ? "; there is " : "; there are ";
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i > 0) list += ", ";
    if (i > 0 && list.size() + candidates[i].size() > list_bytes_max) return list + "...";
    list += candidates[i];
  }
  return list;
}

}  // namespace pneuma::base
