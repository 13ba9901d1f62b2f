// No text may crash the reader of meshes, nor what mends them; and what was mended is a mesh with nothing to mend.
// Input: a byte of flags (turn faces, close holes, do not weld), then a Wavefront OBJ file.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "physics/mesh/mesh.h"
#include "physics/mesh/mesh_mend.h"
#include "scene_io/obj.h"

using namespace pneuma;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  physics::MeshMend mend;
  mend.orient = (bytes[0] & 1U) != 0;
  mend.close = (bytes[0] & 2U) != 0;
  if ((bytes[0] & 4U) != 0) mend.weld_m = 0.0;
  auto read = scene_io::parse_obj({reinterpret_cast<const char*>(bytes) + 1, size - 1});
  if (!read.ok()) {
    if (read.status().message().empty()) std::abort();
    return 0;
  }
  const auto mended = physics::mend_mesh(std::move(read->positions_m), std::move(read->faces), mend);
  if (!mended.ok()) {
    if (mended.status().message().empty()) std::abort();
    return 0;
  }
  const physics::Mesh& mesh = *mended->mesh;
  mend.weld_m = 0.0;  // vertices that are apart by less than the mesh says are near again once others are gone
  const auto again = physics::mend_mesh(mesh.positions_m, mesh.faces, mend);
  if (!again.ok() || again->report != physics::MendReport() || again->mesh->faces != mesh.faces) std::abort();
  return 0;
}
