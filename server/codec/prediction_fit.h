// The encoder's choice of a predictor. Another encoder may choose otherwise; what it chose is in the frame.
#pragma once

#include <cstdint>
#include <vector>

#include "codec/lanes.h"
#include "codec/mesh_order.h"
#include "codec/prediction.h"

namespace pneuma::codec {

struct Predictor {
  Neighbours neighbours = Neighbours::mean;
  DriftWeights weights;
};

/// The weights that leave the least squares on a sample of the vertices, and how to use the neighbours there.
[[nodiscard]] Predictor fit_predictor(const MeshOrder& order, const std::vector<Lanes>& moves,
                                      const std::vector<Lanes>& move, const std::vector<Lanes>& move_before);

}  // namespace pneuma::codec
