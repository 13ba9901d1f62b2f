#include "scene_io/mesh_library.h"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "base/limits.h"
#include "scene_io/embedded_files.h"
#include "scene_io/obj.h"
#include "scene_io/quoted.h"

namespace pneuma::scene_io {
namespace {

using base::Result;
using base::Status;
using base::StatusCode;
using MeshPointer = std::shared_ptr<const physics::Mesh>;

Result<MeshPointer> build_triangles(const v1::Mesh::Triangles& triangles) {
  const auto count = static_cast<std::size_t>(triangles.indices_size());
  if (count % 3 != 0)
    return base::invalid("there are " + std::to_string(count) + " of them, not three a face", "indices");
  if (count > 3 * base::mesh_faces_max) {
    return Status(StatusCode::limit_exceeded,
                  "has " + std::to_string(count / 3) + " faces; at most " + std::to_string(base::mesh_faces_max),
                  "indices");
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
  return physics::make_mesh(std::move(positions_m), std::move(faces));
}

Result<MeshPointer> build_asset(const std::string& name) {
  const EmbeddedFile* end = embedded_files + embedded_file_count;
  const std::string path = "assets/" + name + ".obj";
  const EmbeddedFile* file = std::find_if(embedded_files, end, [&path](const auto& its) { return its.name == path; });
  if (file == end) return base::not_found("no asset is named " + in_quotes(name) + "; there is: hand");
  auto obj = parse_obj(file->text);
  if (!obj.ok()) return obj.status();
  return physics::make_mesh(std::move(obj->positions_m), std::move(obj->faces));
}

template <class Value>
Value value_or(bool is_set, Value value, Value otherwise) {
  return is_set ? value : otherwise;
}

/// `where` is the path from the mesh.
Result<MeshPointer> build_mesh(const v1::Mesh& mesh) {
  const auto inside = [](Result<MeshPointer> result, const char* field) {
    return result.ok() ? result : Result<MeshPointer>(result.status().inside(field));
  };
  switch (mesh.shape_case()) {
    case v1::Mesh::kIcosphere: {
      const v1::Mesh::Icosphere& sphere = mesh.icosphere();
      return inside(
          physics::make_icosphere(sphere.subdivisions(), value_or(sphere.has_radius_m(), sphere.radius_m(), 1.0)),
          "icosphere");
    }
    case v1::Mesh::kGrid: {
      const v1::Mesh::Grid& grid = mesh.grid();
      return inside(physics::make_grid(grid.columns(), grid.rows(), value_or(grid.has_width_m(), grid.width_m(), 1.0),
                                       value_or(grid.has_height_m(), grid.height_m(), 1.0)),
                    "grid");
    }
    case v1::Mesh::kBox: {
      const v1::Vec3& half = mesh.box().half_extents();
      return inside(physics::make_box({half.x(), half.y(), half.z()}, mesh.box().subdivisions()), "box");
    }
    case v1::Mesh::kTriangles:
      return inside(build_triangles(mesh.triangles()), "triangles");
    case v1::Mesh::kAsset:
      return inside(build_asset(mesh.asset()), "asset");
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
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  if (std::any_of(name.begin(), name.end(), is_control)) return base::invalid("has a control character", "name");
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
  std::size_t vertex_count = 0;
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
      built.mesh = std::move(*made);
    }
    vertex_count += built.mesh->positions_m.size();
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
