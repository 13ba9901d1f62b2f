#include "scene_io/mesh_library.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "base/hidden_text.h"
#include "base/limits.h"
#include "base/number_text.h"
#include "physics/mesh/mesh_builders.h"
#include "scene_io/embedded_files.h"
#include "scene_io/obj.h"
#include "scene_io/quoted.h"

namespace pneuma::scene_io {
namespace {

using base::Result;
using base::Status;
using base::StatusCode;
using MeshPointer = std::shared_ptr<const physics::Mesh>;

/// A mesh, and what was done to it where it asked to be mended.
struct Made {
  MeshPointer mesh;
  std::optional<physics::MendReport> mended;
};

Result<physics::MeshMend> read_mend(const v1::Mesh::Mend& in) {
  physics::MeshMend out;
  if (in.has_weld_m()) {
    const bool good = in.weld_m() >= 0.0 && in.weld_m() <= base::coordinate_max_m;
    if (!good)
      return base::invalid("must be a length from 0 to " + base::number_text(base::coordinate_max_m), "weld_m");
    out.weld_m = in.weld_m();
  }
  if (in.has_orient()) out.orient = in.orient();
  if (in.has_close()) out.close = in.close();
  return out;
}

/// Of a triangle list, mended where that is asked for.
Result<Made> build_list(const v1::Mesh& mesh, std::vector<Eigen::Vector3d> positions_m,
                        std::vector<physics::Face> faces, const char* field) {
  const auto refused = [field](const Status& status) { return status.inside(field); };
  if (!mesh.has_mend()) {
    auto made = physics::make_mesh(std::move(positions_m), std::move(faces));
    if (!made.ok()) return refused(made.status());
    return Made{std::move(*made), std::nullopt};
  }
  const auto mend = read_mend(mesh.mend());
  if (!mend.ok()) return mend.status().inside("mend");
  auto made = physics::mend_mesh(std::move(positions_m), std::move(faces), *mend);
  if (!made.ok()) return refused(made.status());
  return Made{std::move(made->mesh), made->report};
}

Result<Made> build_triangles(const v1::Mesh& mesh) {
  const v1::Mesh::Triangles& triangles = mesh.triangles();
  const auto count = static_cast<std::size_t>(triangles.indices_size());
  if (count % 3 != 0) {
    return base::invalid("there are " + std::to_string(count) + " of them, not three a face", "triangles.indices");
  }
  if (count > 3 * base::mesh_faces_max) {
    return Status(StatusCode::limit_exceeded,
                  "has " + std::to_string(count / 3) + " faces; at most " + std::to_string(base::mesh_faces_max),
                  "triangles.indices");
  }
  std::vector<Eigen::Vector3d> positions_m;
  positions_m.reserve(static_cast<std::size_t>(triangles.positions_size()));
  for (const v1::Vec3& position : triangles.positions())
    positions_m.emplace_back(position.x(), position.y(), position.z());
  std::vector<physics::Face> faces;
  faces.reserve(count / 3);
  for (int i = 0; i < triangles.indices_size(); i += 3) {
    faces.push_back({triangles.indices(i), triangles.indices(i + 1), triangles.indices(i + 2)});
  }
  return build_list(mesh, std::move(positions_m), std::move(faces), "triangles");
}

Result<Made> build_asset(const v1::Mesh& mesh) {
  const EmbeddedFile* end = embedded_files + embedded_file_count;
  const std::string path = "assets/" + mesh.asset() + ".obj";
  const EmbeddedFile* file = std::find_if(embedded_files, end, [&path](const auto& its) { return its.name == path; });
  if (file == end) {
    return base::not_found("no asset is named " + in_quotes(mesh.asset()) + "; there is: hand", "asset");
  }
  auto obj = parse_obj(file->text);
  if (!obj.ok()) return obj.status().inside("asset");
  return build_list(mesh, std::move(obj->positions_m), std::move(obj->faces), "asset");
}

template <class Value>
Value value_or(bool is_set, Value value, Value otherwise) {
  return is_set ? value : otherwise;
}

/// `where` is the path from the mesh.
Result<Made> build_mesh(const v1::Mesh& mesh) {
  const auto whole = [](Result<MeshPointer> result, const char* field) -> Result<Made> {
    if (!result.ok()) return result.status().inside(field);
    return Made{std::move(*result), std::nullopt};
  };
  const bool is_list = mesh.has_triangles() || mesh.shape_case() == v1::Mesh::kAsset;
  if (mesh.has_mend() && !is_list) return base::invalid("is for triangles and assets", "mend");
  switch (mesh.shape_case()) {
    case v1::Mesh::kIcosphere: {
      const v1::Mesh::Icosphere& sphere = mesh.icosphere();
      return whole(
          physics::make_icosphere(sphere.subdivisions(), value_or(sphere.has_radius_m(), sphere.radius_m(), 1.0)),
          "icosphere");
    }
    case v1::Mesh::kGrid: {
      const v1::Mesh::Grid& grid = mesh.grid();
      return whole(physics::make_grid(grid.columns(), grid.rows(), value_or(grid.has_width_m(), grid.width_m(), 1.0),
                                      value_or(grid.has_height_m(), grid.height_m(), 1.0)),
                   "grid");
    }
    case v1::Mesh::kBox: {
      const v1::Vec3& half = mesh.box().half_extents();
      return whole(physics::make_box({half.x(), half.y(), half.z()}, mesh.box().subdivisions()), "box");
    }
    case v1::Mesh::kTriangles:
      return build_triangles(mesh);
    case v1::Mesh::kAsset:
      return build_asset(mesh);
    case v1::Mesh::SHAPE_NOT_SET:
      break;
  }
  return base::invalid("has no shape; one of icosphere, grid, box, triangles, asset is wanted");
}

Status check_name(const std::string& name) {
  if (name.empty()) return base::invalid("is empty", "name");
  if (name.size() > base::name_bytes_max) {
    return {StatusCode::limit_exceeded,
            "has " + std::to_string(name.size()) + " bytes; at most " + std::to_string(base::name_bytes_max), "name"};
  }
  if (base::has_hidden(name)) return base::invalid("has a control character, or one that does not show", "name");
  return {};
}

}  // namespace

Result<MeshLibrary> MeshLibrary::build(const v1::Scene& scene, const MeshLibrary& before) {
  if (static_cast<std::size_t>(scene.meshes_size()) > base::world_bodies_max) {
    return Status(StatusCode::limit_exceeded,
                  "are " + std::to_string(scene.meshes_size()) + "; at most " + std::to_string(base::world_bodies_max),
                  "meshes");
  }
  MeshLibrary library;
  constexpr std::size_t world_faces_max = base::world_vertices_max * (base::mesh_faces_max / base::mesh_vertices_max);
  std::size_t vertex_count = 0;
  std::size_t face_count = 0;
  for (int i = 0; i < scene.meshes_size(); ++i) {
    const std::string path = "meshes[" + std::to_string(i) + "]";
    const v1::Mesh& mesh = scene.meshes(i);
    if (const Status status = check_name(mesh.name()); !status.ok()) return status.inside(path);
    if (library.meshes_.contains(mesh.name())) {
      return base::invalid("another mesh is named " + in_quotes(mesh.name()) + " too", path + ".name");
    }
    Built built{mesh.SerializeAsString(), nullptr};
    const auto known = before.meshes_.find(mesh.name());
    if (known != before.meshes_.end() && known->second.source == built.source) {
      built.mesh = known->second.mesh;
    } else {
      auto made = build_mesh(mesh);
      if (!made.ok()) return made.status().inside(path);
      built.mesh = std::move(made->mesh);
      if (made->mended) library.mended_.push_back({mesh.name(), *made->mended});
    }
    // Written out, a mesh that is mended may have more vertices and faces than are built; the scene keeps them all.
    vertex_count +=
        std::max(built.mesh->positions_m.size(), static_cast<std::size_t>(mesh.triangles().positions_size()));
    face_count += static_cast<std::size_t>(mesh.triangles().indices_size()) / 3;
    if (face_count > world_faces_max) {
      return Status(StatusCode::limit_exceeded,
                    "the meshes up to this one have more than " + std::to_string(world_faces_max) + " faces", path);
    }
    if (vertex_count > base::world_vertices_max) {
      return Status(
          StatusCode::limit_exceeded,
          "the meshes up to this one have more than " + std::to_string(base::world_vertices_max) + " vertices", path);
    }
    library.meshes_.emplace(mesh.name(), std::move(built));
  }
  return library;
}

Result<MeshPointer> MeshLibrary::find(const std::string& name) const {
  const auto found = meshes_.find(name);
  if (found != meshes_.end()) return found->second.mesh;
  std::string names;
  for (const auto& [known, built] : meshes_) append_name(names, known);
  if (name.empty()) return base::invalid("is missing" + (names.empty() ? "" : "; meshes: " + names));
  return base::not_found("no mesh is named " + in_quotes(name) + "; " +
                         (names.empty() ? "there are no meshes" : "meshes: " + names));
}

}  // namespace pneuma::scene_io
