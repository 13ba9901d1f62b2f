#include "physics/contact/pair_watch.h"

#include <algorithm>

namespace pneuma::physics {
namespace {

// What comes after the look may change the moves by this much before there is another.
constexpr double moves_slack = 1.1;
// A list is made for so many substeps of the moves that the bodies make now, but for no more than a share of the
// spacing of their vertices: beyond it grows faster than it lasts. Three to six cost the same for five balls.
constexpr double substeps_ahead = 4.0;
constexpr double reach_share_max = 0.3;
// What is beyond this share of the reach is looked at in coarser steps.
constexpr double near_steps = 4.0;
// Where the substep itself moves features by more than this share of the spacing, their ways tell more than balls do.
constexpr double ways_share_min = 0.5;

double between_m(const SurfaceDrift& a, const SurfaceDrift& b) {
  return (a.shift_m - b.shift_m).norm() + a.path_m + b.path_m;
}

double spacing_of(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  return std::min(bodies[pair.first].spacing_m, bodies[pair.second].spacing_m);
}

// The most that the substep may move two features of the pair towards each other.
double closing_m(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  return between_m(bodies[pair.first].substep, bodies[pair.second].substep);
}

}  // namespace

double PairWatch::drifted_m(const Drifts& since, std::span<const SurfaceBody> bodies) const {
  const auto [first, second] = drifts(bodies);
  return between_m({first.shift_m - since.first.shift_m, first.path_m - since.first.path_m},
                   {second.shift_m - since.second.shift_m, second.path_m - since.second.path_m});
}

void PairWatch::find(double reach_m, std::span<SurfaceBody> bodies, CandidateFinder& finder,
                     FeatureMeasures& measures) {
  finder.find_near(pair_, bodies, reach_m);
  measures.measure(pair_, bodies);
  std::erase_if(pair_.candidates, [&](const Candidate& candidate) { return candidate.apart_m > reach_m; });
  apart_m_.clear();
  for (const Candidate& candidate : pair_.candidates) apart_m_.push_back(candidate.apart_m);
  for (auto& list : near_) list.clear();
  found_ = drifts(bodies);
  come_m_ = 0.0;
  reach_m_ = reach_m;
  near_m_ = 0.0;
}

void PairWatch::list_near(double within_m) {
  near_m_ = within_m;
  for (auto& list : near_) list.clear();
  for (std::uint32_t i = 0; i < apart_m_.size(); ++i) {
    if (apart_m_[i] <= within_m) near_[static_cast<std::size_t>(pair_.candidates[i].pair)].push_back(i);
  }
}

void PairWatch::look(double within_m, std::span<SurfaceBody> bodies, CandidateFinder& finder, FeatureMeasures& measures,
                     SurfacePair& pair) {
  const double closing = closing_m(pair_, bodies);
  const double spacing = spacing_of(pair_, bodies);
  const double needed_m = within_m + moves_slack * closing;
  looked_m_ = needed_m;
  come_m_ += drifted_m(looked_, bodies);
  looked_ = drifts(bodies);
  pair.drifted_m = 0.0;
  watched_ = closing <= ways_share_min * spacing;
  if (!watched_) {
    reach_m_ = -1.0;
    finder.find(pair, bodies);
    measures.measure(pair, bodies);
    return;
  }
  if (reach_m_ < 0.0 || drifted_m(found_, bodies) + needed_m > reach_m_) {
    find(needed_m + std::min(substeps_ahead * closing, reach_share_max * spacing), bodies, finder, measures);
  }
  const double due_m = come_m_ + needed_m;
  if (due_m > near_m_) list_near(due_m + reach_m_ / near_steps);
  pair.candidates.clear();
  for (const FeaturePair kind : {FeaturePair::vertex_face, FeaturePair::edge_edge}) {
    auto& due = due_[static_cast<std::size_t>(kind)];
    due.clear();
    for (const std::uint32_t i : near_[static_cast<std::size_t>(kind)]) {
      if (apart_m_[i] <= due_m) due.push_back(i);
    }
    measures.for_measured(kind, pair_, due, bodies, [&](std::uint32_t i, const Candidate& candidate) {
      apart_m_[i] = candidate.apart_m + come_m_;
      if (candidate.apart_m <= needed_m) pair.candidates.push_back(candidate);
    });
  }
}

bool PairWatch::holds(double within_m, std::span<const SurfaceBody> bodies, SurfacePair& pair) const {
  if (!watched_) return false;
  pair.drifted_m = drifted_m(looked_, bodies);
  return pair.drifted_m + within_m + closing_m(pair_, bodies) <= looked_m_;
}

}  // namespace pneuma::physics
