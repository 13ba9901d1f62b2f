#include "physics/contact/filter.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "physics/contact/groups.h"
#include "physics/contact/surface_rows.h"

namespace pneuma::physics {
namespace {

// What two features may come to: of the distance that they keep, or of the one that they start with where that is less.
constexpr double kept_share = 0.1;
constexpr double start_share = 0.9;
// But no nearer than this share of what they keep, which single precision still tells from nothing: what is pressed for
// long would lose a tenth of its distance in each substep.
constexpr double floor_share = 0.02;
// A cut changes what other pairs of its vertices do, which may need another. From here on, the vertices of a pair that
// would still cross do not move among themselves. Each such round stops a vertex or joins two groups, so they end.
constexpr std::uint32_t patient_rounds = 12;
// Of a safe share: so that the next round need not cut the same pair by its last digit.
constexpr double caution = 0.98;

// Whether a plane with the candidate's direction keeps the two that far apart all the way: at both ends, so between.
bool are_parted(const Candidate& candidate, const FourPoints& start, const FourPoints& moves, double margin_m) {
  if (candidate.apart.isZero(0.0)) return false;
  const std::size_t of_first = candidate.pair == FeaturePair::vertex_face ? 1 : 2;
  double start_m = std::numeric_limits<double>::infinity();
  double end_m = start_m;
  for (std::size_t i = 0; i < of_first; ++i) {
    const double at_m = candidate.apart.dot(start[i]);
    start_m = std::min(start_m, at_m);
    end_m = std::min(end_m, at_m + candidate.apart.dot(moves[i]));
  }
  double other_start_m = -std::numeric_limits<double>::infinity();
  double other_end_m = other_start_m;
  for (std::size_t i = of_first; i < 4; ++i) {
    const double at_m = candidate.apart.dot(start[i]);
    other_start_m = std::max(other_start_m, at_m);
    other_end_m = std::max(other_end_m, at_m + candidate.apart.dot(moves[i]));
  }
  return start_m - other_start_m >= margin_m && end_m - other_end_m >= margin_m;
}

struct Cut {
  FeatureCorners corners;
  double share = 1.0;
};

class MoveFilter {
 public:
  MoveFilter(std::span<const SurfacePair> pairs, std::span<SurfaceBody> bodies) : pairs_(pairs), bodies_(bodies) {}

  std::vector<FeatureCorners> run() {
    bool cut = true;
    for (std::uint32_t round = 1; cut; ++round) {
      cuts_.clear();
      for (const SurfacePair& pair : pairs_) find_cuts(pair, round);
      cut = apply(round);
    }
    return std::move(stopped_);
  }

 private:
  void find_cuts(const SurfacePair& pair, std::uint32_t round) {
    const double kept_m = kept_distance_m(pair, bodies_);
    const double far_m = round > 1 ? std::numeric_limits<double>::infinity() : kept_share * kept_m + closing_m(pair);
    for (const Candidate& candidate : pair.candidates) {
      if (candidate.apart_m >= far_m) continue;
      const FeatureCorners corners = corners_of(pair, candidate);
      if (round > 1 && !changed_in(corners, round - 1)) continue;
      const FourPoints moves = corners.moves(bodies_);
      const double margin_m = kept_share * kept_m;
      const double free_m = candidate.apart_m - margin_m;
      if (free_m >= 0.0 && free_m * free_m >= largest_relative_move_m2(candidate.pair, moves)) continue;
      const FourPoints start = corners.start(bodies_);
      const bool is_measured = !candidate.apart.isZero(0.0);
      const double distance = is_measured ? candidate.apart_m : distance_m(candidate.pair, start);
      const double floor_m = floor_share * kept_m;
      const double least_m = std::min(distance, std::max(floor_m, std::min(margin_m, start_share * distance)));
      if (are_parted(candidate, start, moves, least_m)) continue;
      const double share = safe_share(candidate.pair, start, moves, least_m);
      if (share < 1.0) cuts_.push_back({corners, share});
    }
  }

  // The most that any two features of the pair move towards each other, with the cuts that the filter began with.
  [[nodiscard]] double closing_m(const SurfacePair& pair) {
    moves_.resize(bodies_.size());
    for (const std::uint32_t index : {pair.first, pair.second}) {
      if (moves_[index]) continue;
      const SurfaceBody& body = bodies_[index];
      moves_[index] = drift_of(body.to.size(),
                               [&](std::size_t i) -> Vec3d { return body.cut_move_m(static_cast<std::uint32_t>(i)); });
    }
    return between_m(*moves_[pair.first], *moves_[pair.second]);
  }

  // A candidate whose four ways are as they were when it was last looked at needs no other look.
  [[nodiscard]] bool changed_in(const FeatureCorners& corners, std::uint32_t round) const {
    for (std::size_t i = 0; i < 4; ++i) {
      if (changed_in_[corners.bodies[i]][corners.vertices[i]] == round) return true;
    }
    return false;
  }

  bool apply(std::uint32_t round) {
    if (cuts_.empty()) return false;
    if (stopped_.empty()) begin();
    const bool at_once = round > patient_rounds;
    for (const Cut& cut : cuts_) {
      stopped_.push_back(cut.corners);
      for (std::size_t i = 0; i < 4; ++i) {
        next_.push_back({cut.corners.bodies[i], cut.corners.vertices[i],
                         at_once ? 0.0 : caution * cut.share * share_of(cut.corners, i)});
      }
    }
    bool changed = false;
    for (const VertexCut& cut : next_) {
      double& share = bodies_[cut.body].cuts[cut.vertex];
      if (cut.share >= share) continue;
      changed = true;
      share = cut.share;
      changed_in_[cut.body][cut.vertex] = round;
    }
    next_.clear();
    return take_along(round) || changed;
  }

  void begin() {
    changed_in_.resize(bodies_.size());
    first_of_.assign(bodies_.size(), 0);
    std::size_t count = 0;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      first_of_[i] = count;
      count += bodies_[i].cuts.size();
    }
    for (const SurfacePair& pair : pairs_) {
      for (const std::uint32_t body : {pair.first, pair.second}) changed_in_[body].resize(bodies_[body].cuts.size());
    }
    const auto has_free = [](const SurfaceBody& body) { return !body.free.empty(); };
    any_free_ = std::ranges::any_of(bodies_, has_free);
    if (!any_free_) return;
    joined_.begin(count);
    is_stopped_.assign(count, 0);
    sums_.assign(count, {});
    for (SurfaceBody& body : bodies_) {
      if (has_free(body)) body.drifts.assign(body.cuts.size(), Vec3d::Zero());
    }
  }

  // Joins the features that stop each other, and has each such group go by its mean move. True where that is another
  // one than before.
  bool take_along(std::uint32_t round) {
    if (!any_free_) return false;
    for (const Cut& cut : cuts_) {
      for (std::size_t i = 0; i < 4; ++i) {
        const std::uint32_t vertex = index_of(cut.corners, i);
        joined_.join(index_of(cut.corners, 0), vertex);
        if (is_stopped_[vertex] != 0) continue;
        is_stopped_[vertex] = 1;
        stops_.push_back({cut.corners.bodies[i], cut.corners.vertices[i], 1.0});
      }
    }
    // In an order that does not follow from that of the candidates.
    std::ranges::sort(stops_, {}, [](const VertexCut& stop) { return std::pair(stop.body, stop.vertex); });
    for (const VertexCut& stop : stops_) sums_[first_of_[stop.body] + stop.vertex] = {};
    for (const VertexCut& stop : stops_) {
      const SurfaceBody& body = bodies_[stop.body];
      Sum& sum = sum_of(stop);
      if (body.free.empty() || body.free[stop.vertex] == 0 || body.inverse_masses_1_kg[stop.vertex] == 0.0) {
        sum.is_held = true;
      } else {
        const double mass_kg = 1.0 / body.inverse_masses_1_kg[stop.vertex];
        sum.mass_kg += mass_kg;
        sum.moves_kg_m += mass_kg * body.move_m(stop.vertex);
      }
    }
    bool changed = false;
    for (const VertexCut& stop : stops_) {
      SurfaceBody& body = bodies_[stop.body];
      if (body.drifts.empty()) continue;
      const Sum& sum = sum_of(stop);
      const Vec3d drift_m = sum.is_held ? Vec3d(Vec3d::Zero()) : Vec3d(sum.moves_kg_m / sum.mass_kg);
      if (drift_m == body.drifts[stop.vertex]) continue;
      body.drifts[stop.vertex] = drift_m;
      changed_in_[stop.body][stop.vertex] = round;
      changed = true;
    }
    return changed;
  }

  [[nodiscard]] double share_of(const FeatureCorners& corners, std::size_t i) const {
    return bodies_[corners.bodies[i]].cuts[corners.vertices[i]];
  }

  [[nodiscard]] std::uint32_t index_of(const FeatureCorners& corners, std::size_t i) const {
    return static_cast<std::uint32_t>(first_of_[corners.bodies[i]] + corners.vertices[i]);
  }

  struct VertexCut {
    std::uint32_t body = 0;
    std::uint32_t vertex = 0;
    double share = 1.0;
  };

  // Of a group of vertices that stop each other.
  struct Sum {
    bool is_held = false;
    double mass_kg = 0.0;
    Vec3d moves_kg_m = Vec3d::Zero();
  };
  [[nodiscard]] Sum& sum_of(const VertexCut& stop) {
    return sums_[joined_.lowest_with(static_cast<std::uint32_t>(first_of_[stop.body] + stop.vertex))];
  }

  std::span<const SurfacePair> pairs_;
  std::span<SurfaceBody> bodies_;
  std::vector<std::optional<SurfaceDrift>> moves_;      // one a body of a pair
  std::vector<std::vector<std::uint32_t>> changed_in_;  // one a vertex, of each body: when its move did
  std::vector<Cut> cuts_;
  std::vector<VertexCut> next_;
  std::vector<FeatureCorners> stopped_;
  bool any_free_ = false;
  // Of all bodies' vertices, one after the other, where any is free.
  std::vector<std::size_t> first_of_;  // one a body: its first
  JoinedBodies joined_;
  std::vector<std::uint8_t> is_stopped_;
  std::vector<Sum> sums_;         // of groups, at their lowest vertices
  std::vector<VertexCut> stops_;  // all that are stopped
};

}  // namespace

std::vector<FeatureCorners> cut_moves(std::span<const SurfacePair> pairs, std::span<SurfaceBody> bodies) {
  return MoveFilter(pairs, bodies).run();
}

}  // namespace pneuma::physics
