// The bodies that a golden vector is of.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "codec/frame_codec.h"
#include "support/golden.h"
#include "unit/codec/meshes.h"

namespace pneuma::codec {

struct GoldenBody {
  MeshOrderPtr order;
  std::vector<std::uint32_t> indices;
  std::optional<Mechanics> mechanics{};
};

inline std::vector<double> parse_doubles(const std::string& text) {
  std::istringstream words(text);
  std::vector<double> all;
  for (std::string word; words >> word;) all.push_back(std::stod(word));
  return all;
}

inline std::vector<float> parse_floats(const std::string& text) {
  std::vector<float> all;
  for (const double value : parse_doubles(text)) all.push_back(static_cast<float>(value));
  return all;
}

/// Whether the line is about mechanics, which it adds to.
inline bool take_mechanics(const std::string& key, const std::string& value, std::optional<Mechanics>& mechanics) {
  if (key == "frame_s") {
    mechanics.emplace().frame_s = std::stod(value);
  } else if (key == "substeps") {
    mechanics->substeps = static_cast<std::uint32_t>(std::stoul(value));
  } else if (key == "masses_kg") {
    mechanics->masses_kg = parse_floats(value);
  } else if (key == "rest_lengths_m") {
    mechanics->rest_lengths_m = parse_floats(value);
  } else if (key == "stiffnesses_n_m") {
    mechanics->stiffnesses_n_m = parse_floats(value);
  } else if (key == "damping_n_s_m") {
    mechanics->damping_n_s_m = std::stod(value);
  } else if (key == "gas") {
    const auto gas = parse_doubles(value);
    mechanics->gas = {gas[0], gas[1], static_cast<std::uint32_t>(gas[2]), gas[3]};
  } else if (key == "gravity_m_s2") {
    const auto gravity = parse_doubles(value);
    mechanics->gravity_m_s2 = {gravity[0], gravity[1], gravity[2]};
  } else if (key == "plane") {
    const auto plane = parse_doubles(value);
    mechanics->planes.push_back({{plane[0], plane[1], plane[2]}, plane[3], plane[4], plane[5]});
  } else {
    return false;
  }
  return true;
}

/// The faces 0 0 1, 1 1 2 and so on.
inline std::vector<std::uint32_t> path(std::uint32_t vertices) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i + 1 < vertices; ++i) indices.insert(indices.end(), {i, i, i + 1});
  return indices;
}

/// Whether a line says something else of a stream or body than what bodies it has.
inline bool is_of_frames(const std::string& key) {
  constexpr std::array known{"stream",    "body",   "bad-body", "grid_step_m", "key",   "delta", "bad-key",
                             "bad-delta", "points", "check",    "velocities",  "drift", "moves"};
  return std::ranges::find(known, key) != known.end();
}

/// Throws where a line is of no kind that it knows, so that a vector of a new kind is not passed over.
inline std::vector<GoldenBody> bodies_of(const support::GoldenRecord& record) {
  std::vector<GoldenBody> bodies;
  for (const auto& [key, value] : record) {
    if (key == "mesh") {
      const std::vector<std::int64_t> numbers = support::parse_integers(value);
      const std::vector<std::uint32_t> indices(numbers.begin() + 1, numbers.end());
      bodies.push_back({order_of(static_cast<std::uint32_t>(numbers.at(0)), indices), indices});
    } else if (key == "path") {
      const auto vertices = static_cast<std::uint32_t>(std::stoul(value));
      const std::vector<std::uint32_t> indices = path(vertices);
      bodies.push_back({order_of(vertices, indices), indices});
    } else if (!is_of_frames(key) && (bodies.empty() || !take_mechanics(key, value, bodies.back().mechanics))) {
      throw std::runtime_error("a golden vector has a line \"" + key + '"');
    }
  }
  return bodies;
}

inline SimulatedMotionPtr simulation_of(const GoldenBody& body, double grid_step_m) {
  if (!body.mechanics) return nullptr;
  return std::make_shared<SimulatedMotion>(body.order, body.indices, *body.mechanics, grid_step_m);
}

}  // namespace pneuma::codec
