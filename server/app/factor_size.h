// How large the factored matrix of an implicit step will be, found before it is factored.
#pragma once

#include <cstddef>

#include "physics/mesh/mesh.h"

namespace pneuma::app {

/// Entries below the diagonal of the factor of a matrix with an entry for each edge of the mesh, in the order that
/// physics/implicit/sparse_cholesky.h takes. Skins of balls have some 30 a vertex; one that is folded into many handles
/// may fill all of its matrix. Counting stops past `most`.
[[nodiscard]] std::size_t factor_entries(const physics::Mesh& mesh, std::size_t most);

}  // namespace pneuma::app
