// How far each way to measure a volume is off on a mesh turned many ways; for the report and the benchmarks alike.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "physics/forces/volume.h"
#include "physics/mesh/mesh_builders.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::physics {

/// A method, and from coarse to fine the resolutions that it is tried with.
struct VolumeLadder {
  VolumeMethod method = VolumeMethod::exact;
  std::string_view name;                       // in scene files
  std::vector<std::uint32_t> resolutions{0u};  // 0: it has none
};

inline const std::vector<VolumeLadder>& volume_ladders() {
  static const std::vector<VolumeLadder> ladders{
      {VolumeMethod::exact, "EXACT"},
      {VolumeMethod::box, "BOX"},
      {VolumeMethod::ball, "BALL"},
      {VolumeMethod::ellipsoid, "ELLIPSOID"},
      {VolumeMethod::subdivided, "SUBDIVIDED", {4, 8, 16, 32, 64, 128}},
      {VolumeMethod::monte_carlo, "MONTE_CARLO", {256, 1'024, 4'096, 16'384, 65'536}},
  };
  return ladders;
}

/// A ball of 162 vertices that measures its volume so.
inline SoftBody ball_measured_by(const Volume& volume) {
  SoftBody body;
  body.mesh = *make_icosphere(2, 1.0);
  body.volume = volume;
  return body;
}

/// The hand of the built-in scene, of 1,159 vertices.
inline SoftBody hand_measured_by(const Volume& volume) {
  SoftBody body = scene_io::to_physics(*scene_io::load_scene("hand"))->soft_bodies[0];
  body.volume = volume;
  return body;
}

/// The vertices of a mesh turned sixty ways about its origin, the same on every call.
inline std::vector<std::vector<Vec3d>> turned_m(const Mesh& mesh) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-1.0, 1.0);
  std::vector<std::vector<Vec3d>> all(60, mesh.positions_m);
  for (std::vector<Vec3d>& x : all) {
    Quatd turn;
    for (const Eigen::Index i : {2, 1, 0, 3}) turn.coeffs()[i] = anywhere(random);  // z, y, x, w
    for (Vec3d& p : x) p = turn.normalized() * p;
  }
  return all;
}

/// Relative to the exact volume.
struct VolumeError {
  double rms = 0.0;
  double max = 0.0;
};

/// Of a body at each of its mesh's turned positions.
inline VolumeError volume_error(const SoftBody& body, const std::vector<std::vector<Vec3d>>& poses_m) {
  const double exact_m3 = signed_volume_m3(body.mesh->positions_m, body.mesh->faces);
  double squares = 0.0;
  double worst = 0.0;
  for (const std::vector<Vec3d>& x : poses_m) {
    const double error = body_volume_m3<double>(body, x) / exact_m3 - 1.0;
    squares += error * error;
    worst = std::max(worst, std::abs(error));
  }
  return {std::sqrt(squares / static_cast<double>(poses_m.size())), worst};
}

}  // namespace pneuma::physics
