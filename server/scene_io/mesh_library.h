// The meshes of a scene, each built once.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/status.h"
#include "physics/mesh/mesh_mend.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::scene_io {

class MeshLibrary {
 public:
  /// Takes over from `before` what is made of the same message, and builds the rest.
  /// Fails with the path (`meshes[0].triangles.indices[9..11]`). What all of them hold together is bounded, as each is.
  [[nodiscard]] static base::Result<MeshLibrary> build(const v1::Scene& scene, const MeshLibrary& before = {});

  /// Fails with not_found, listing the names there are.
  [[nodiscard]] base::Result<std::shared_ptr<const physics::Mesh>> find(const std::string& name) const;

  /// What was done to a mesh that asked to be mended.
  struct Mended {
    std::string mesh;
    physics::MendReport report;
  };
  /// Of the meshes that this library built, in the scene's order; not of those taken over.
  [[nodiscard]] const std::vector<Mended>& mended() const { return mended_; }

 private:
  struct Built {
    std::string source;  // the v1::Mesh, as bytes
    std::shared_ptr<const physics::Mesh> mesh;
  };
  std::map<std::string, Built> meshes_;
  std::vector<Mended> mended_;
};

}  // namespace pneuma::scene_io
