#pragma once

#include <array>
#include <vector>

namespace dexcheck {

struct TriangleMesh {
  std::vector<std::array<float, 3>> vertices;  ///< m.
  std::vector<std::array<int, 3>> faces;       ///< Numbers of vertices.
};

/// The mesh with at most this many faces: vertices of one cell of a cubic grid become their mean, faces that
/// lose an edge go. Cells are as small as the number of faces allows, to a factor of 1.3; a mesh that has few
/// enough faces stays as it is.
TriangleMesh SimplifyMesh(const TriangleMesh& mesh, size_t most_faces);

}  // namespace dexcheck
