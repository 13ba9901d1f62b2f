#include "physics/forces/sampled_volume.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/limits.h"
#include "physics/state/bounds.h"

namespace pneuma::physics {

namespace {

// The largest whole number not above `value`, from 0 to `max`; 0 where it is not a number.
std::uint32_t floor_within(double value, std::uint32_t max) {
  const double limit = max;
  return static_cast<std::uint32_t>(value > 0.0 ? (value < limit ? value : limit) : 0.0);
}

// Where the skin crosses a row, in the grid's own lengths.
struct Crossing {
  double x = 0.0;
  double z = 0.0;
};

class GridEdge {
 public:
  GridEdge(const Vec3d& low, const Vec3d& high) : low_(low) {
    const double per_row = 1.0 / (high.y() - low.y());
    x_per_row_ = per_row * (high.x() - low.x());
    z_per_row_ = per_row * (high.z() - low.z());
  }
  /// At a row between the ends, of which the lower one counts.
  [[nodiscard]] Crossing at(double y) const {
    const double up = y - low_.y();
    return {low_.x() + up * x_per_row_, low_.z() + up * z_per_row_};
  }

 private:
  const Vec3d& low_;
  double x_per_row_;
  double z_per_row_;
};

// The first row at y or above, as each row is somewhere from its number up to the next.
template <class Grid>
std::uint32_t first_row(const Grid& grid, double y) {
  const std::uint32_t row = floor_within(y, grid.rows());
  return row + (row < grid.rows() && grid.row_y(row) < y ? 1 : 0);
}

// The rows that a face crosses. A row runs into the face where the face's border runs down, and leaves where it runs
// up, if the face looks up; so the border says which way it looks, and no sliver's area is asked for. Returns how many
// crossings that took.
template <class Grid>
std::uint64_t scan_face(std::array<Vec3d, 3>& corners, Grid& grid) {
  auto& [low, middle, high] = corners;
  std::uint32_t row = first_row(grid, std::min({low.y(), middle.y(), high.y()}));
  if (row >= grid.rows() || !(grid.row_y(row) < std::max({low.y(), middle.y(), high.y()}))) return 0;
  bool turned = false;
  const auto order = [&turned](Vec3d& below, Vec3d& above) {
    if (!(above.y() < below.y())) return;
    below.swap(above);
    turned = !turned;
  };
  order(low, middle);
  order(middle, high);
  order(low, middle);
  const GridEdge lower(low, middle);
  const GridEdge upper(middle, high);
  const GridEdge whole(low, high);
  std::uint64_t crossings = 0;
  for (; row < grid.rows(); ++row) {
    const double y = grid.row_y(row);
    if (!(y < high.y())) break;
    const Crossing one = whole.at(y);
    const Crossing other = y < middle.y() ? lower.at(y) : upper.at(y);
    const Crossing& in = turned ? other : one;
    const Crossing& out = turned ? one : other;
    crossings += 1 + (in.x < out.x ? grid.add(row, in, out, 1) : grid.add(row, out, in, -1));
  }
  return crossings;
}

// Of the box's volume, as `grid` counts it. The grid's y is in rows and its z in heights of the box.
template <class Real, class Grid>
double scanned_volume_m3(std::span<const Vec3<Real>> x, std::span<const Face> faces, Grid grid) {
  const Aabb<Real> box = fit_aabb<Real>(x);
  const Vec3d corner = box.min.template cast<double>();
  const Vec3d extents_m = box.max.template cast<double>() - corner;
  const Vec3d to_grid = Vec3d(grid.columns(), grid.rows(), 1.0).cwiseQuotient(extents_m);
  std::uint64_t crossings = 0;
  for (const Face& face : faces) {
    std::array<Vec3d, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = (x[face[i]].template cast<double>() - corner).cwiseProduct(to_grid);
    }
    crossings += scan_face(corners, grid);
    if (crossings > base::volume_crossings_max) return 0.0;
  }
  return grid.share() * extents_m.prod();
}

// A line in the middle of each cell. The heights along a row within one face grow evenly, so their sum is their number
// times the height in their middle.
class CellGrid {
 public:
  explicit CellGrid(std::uint32_t resolution) : resolution_(resolution) {}

  [[nodiscard]] std::uint32_t rows() const { return resolution_; }
  [[nodiscard]] std::uint32_t columns() const { return resolution_; }
  [[nodiscard]] static double row_y(std::uint32_t row) { return row + 0.5; }

  /// Returns at how many lines it looked one by one: none.
  std::uint32_t add(std::uint32_t /*row*/, const Crossing& from, const Crossing& to, int sign) {
    const std::uint32_t begin = first_column(from.x);
    const std::uint32_t end = first_column(to.x);
    if (begin >= end) return 0;
    const double way = (0.5 * (begin + end) - from.x) / (to.x - from.x);
    heights_ += sign * static_cast<double>(end - begin) * (from.z + way * (to.z - from.z));
    return 0;
  }
  [[nodiscard]] double share() const { return heights_ / (static_cast<double>(resolution_) * resolution_); }

 private:
  // The first whose middle is at x or beyond.
  [[nodiscard]] std::uint32_t first_column(double x) const {
    const std::uint32_t column = floor_within(x - 0.5, resolution_);
    return column + (column < x - 0.5 ? 1 : 0);
  }

  std::uint32_t resolution_;
  double heights_ = 0.0;
};

// Random numbers by counter (Wellons, "Prospecting for Hash Functions", 2018: lowbias32).
std::uint32_t hash(std::uint32_t number) {
  number ^= number >> 16;
  number *= 0x7feb352dU;
  number ^= number >> 15;
  number *= 0x846ca68bU;
  return number ^ (number >> 16);
}

// Between 0 and 1, neither of them.
double unit(std::uint32_t number) {
  return (number + 0.5) * 0x1p-32;
}

// Rows of the same height, and in each the same number of cells of the same width, a sample in each; where that does
// not come out even, the first rows have a cell more. The samples of a row share their y, so that those within a face
// are an interval; x is anywhere in the cell.
class SampleGrid {
 public:
  explicit SampleGrid(std::uint32_t samples)
      : rows_(static_cast<std::uint32_t>(std::sqrt(samples))), cells_(samples / rows_), longer_rows_(samples % rows_) {}

  [[nodiscard]] std::uint32_t rows() const { return rows_; }
  [[nodiscard]] static std::uint32_t columns() { return 1; }  // x is in widths of the box: cells differ between rows
  // Multiples of the golden section, modulo 1, from the middle on.
  [[nodiscard]] static double row_y(std::uint32_t row) { return row + unit(0x80000000U + row * 0x9e3779b9U); }

  /// Returns at how many samples it looked.
  std::uint32_t add(std::uint32_t row, const Crossing& from, const Crossing& to, int sign) {
    const bool longer = row < longer_rows_;
    const std::uint32_t cells = cells_ + (longer ? 1 : 0);
    const double begin = from.x * cells;
    const double end = to.x * cells;
    const double z_per_cell = (to.z - from.z) / (end - begin);
    std::int64_t below = 0;
    const std::uint32_t first = floor_within(begin, cells);
    std::uint32_t cell = first;
    for (; cell < cells; ++cell) {
      const double x = cell + unit(hash((row << 16U) + cell));
      if (!(x < end)) break;
      if (x < begin) continue;
      below += sample_z(row, cell) < from.z + (x - begin) * z_per_cell ? 1 : 0;
    }
    below_[longer ? 1 : 0] += sign * below;
    return cell - first;
  }
  [[nodiscard]] double share() const {
    return (static_cast<double>(below_[0]) / cells_ + static_cast<double>(below_[1]) / (cells_ + 1)) / rows_;
  }

 private:
  // Multiples of the square roots of 3 and 2, modulo 1 (Richtmyer's sequence, 1951): neighbours both ways are far from
  // each other in height. Against heights by hash, a third of the error.
  static double sample_z(std::uint32_t row, std::uint32_t cell) { return unit(cell * 0xbb67ae85U + row * 0x6a09e667U); }

  std::uint32_t rows_;
  std::uint32_t cells_;  // of a row
  std::uint32_t longer_rows_;
  std::array<std::int64_t, 2> below_{};  // samples under the skin, of the shorter rows and of the longer
};

}  // namespace

template <class Real>
double subdivided_volume_m3(std::span<const Vec3<Real>> x, std::span<const Face> faces, std::uint32_t resolution) {
  return scanned_volume_m3<Real>(x, faces, CellGrid(resolution));
}

template <class Real>
double monte_carlo_volume_m3(std::span<const Vec3<Real>> x, std::span<const Face> faces, std::uint32_t samples) {
  return scanned_volume_m3<Real>(x, faces, SampleGrid(samples));
}

template double subdivided_volume_m3<float>(std::span<const Vec3<float>>, std::span<const Face>, std::uint32_t);
template double subdivided_volume_m3<double>(std::span<const Vec3<double>>, std::span<const Face>, std::uint32_t);
template double monte_carlo_volume_m3<float>(std::span<const Vec3<float>>, std::span<const Face>, std::uint32_t);
template double monte_carlo_volume_m3<double>(std::span<const Vec3<double>>, std::span<const Face>, std::uint32_t);

}  // namespace pneuma::physics
