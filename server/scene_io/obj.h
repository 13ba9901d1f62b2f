// Triangle meshes from Wavefront OBJ text: its `v` and `f` lines; the rest is passed over.
#pragma once

#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/status.h"
#include "physics/mesh/mesh.h"

namespace pneuma::scene_io {

struct ObjMesh {
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<physics::Face> faces;
};

/// A face's corners may carry texture and normal indices (`f 1/1/1 2/2/2 3/3/3`), which are passed over; a face of more
/// than three corners is refused. Indices count from 1; whether they are in range is make_mesh's to say. Fails with the
/// line's number.
[[nodiscard]] base::Result<ObjMesh> parse_obj(std::string_view text);

}  // namespace pneuma::scene_io
