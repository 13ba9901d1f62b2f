#include "app/factor_size.h"

#include <vector>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace pneuma::app {

namespace {

/// Row by row of the permuted matrix, those before it that it has an entry with.
std::vector<std::vector<int>> earlier_neighbours(const physics::Mesh& mesh) {
  const auto count = static_cast<Eigen::Index>(mesh.positions_m.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(2 * mesh.edges.size() + mesh.positions_m.size());
  for (Eigen::Index i = 0; i < count; ++i) entries.emplace_back(static_cast<int>(i), static_cast<int>(i), 1.0);
  for (const physics::Edge& edge : mesh.edges) {
    entries.emplace_back(static_cast<int>(edge[0]), static_cast<int>(edge[1]), 1.0);
    entries.emplace_back(static_cast<int>(edge[1]), static_cast<int>(edge[0]), 1.0);
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> inverse;
  Eigen::AMDOrdering<int>()(matrix, inverse);
  const Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order = inverse.inverse();

  std::vector<std::vector<int>> earlier(static_cast<std::size_t>(count));
  for (const physics::Edge& edge : mesh.edges) {
    const int a = order.indices()[static_cast<Eigen::Index>(edge[0])];
    const int b = order.indices()[static_cast<Eigen::Index>(edge[1])];
    earlier[static_cast<std::size_t>(std::max(a, b))].push_back(std::min(a, b));
  }
  return earlier;
}

}  // namespace

// A row of the factor has an entry for each node of the elimination tree on the ways from the row's own entries up to
// the row (T. A. Davis, Direct Methods for Sparse Linear Systems, 4.2).
std::size_t factor_entries(const physics::Mesh& mesh, std::size_t most) {
  const std::vector<std::vector<int>> earlier = earlier_neighbours(mesh);
  constexpr int none = -1;
  std::vector<int> parents(earlier.size(), none);
  std::vector<int> seen_by(earlier.size(), none);
  std::size_t entries = 0;
  for (std::size_t i = 0; i < earlier.size() && entries <= most; ++i) {
    const int row = static_cast<int>(i);
    seen_by[i] = row;
    for (int node : earlier[i]) {
      for (; seen_by[static_cast<std::size_t>(node)] != row; node = parents[static_cast<std::size_t>(node)]) {
        int& parent = parents[static_cast<std::size_t>(node)];
        if (parent == none) parent = row;
        seen_by[static_cast<std::size_t>(node)] = row;
        ++entries;
      }
    }
  }
  return entries;
}

}  // namespace pneuma::app
