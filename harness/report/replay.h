#pragma once

// The scene and motion of a run, for the replay in its page (page/replay.js).

#include <mujoco/mujoco.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "renders/viewpoint.h"

namespace dexcheck {

/// Most instants whose poses are kept; the page interpolates between them. With 10 s of the shipped robot and
/// its hand they are about 1 MB of base64.
inline constexpr long kMostReplayFrames = 601;
/// And at most so many a second.
inline constexpr double kReplayRate = 60.0;
/// Most triangles of all meshes together; finer ones are simplified.
inline constexpr int kMostReplayTriangles = 60'000;

struct ReplayData {
  nlohmann::ordered_json json;
  std::string values;  ///< Little-endian numbers; the JSON says where each array begins.
};

/// Everything that the engine shows by default: geoms of groups 0 to 2 that are not wholly transparent,
/// height fields left out. What is welded together is one part, and each part's pose is kept, with contact
/// forces and the desired pose of the object, at evenly spread rows.
/// @param run as CheckRunFrames accepts it.
ReplayData MakeReplayData(const mjModel& model, const RunFrames& run);

struct TriangleMesh {
  std::vector<std::array<float, 3>> vertices;  ///< m.
  std::vector<std::array<int, 3>> faces;       ///< Numbers of vertices.
};

/// The mesh with at most this many faces: vertices of one cell of a cubic grid become their mean, faces that
/// lose an edge go. Cells are as small as the number of faces allows, to a factor of 1.3; a mesh that has few
/// enough faces stays as it is.
TriangleMesh SimplifyMesh(const TriangleMesh& mesh, size_t most_faces);

}  // namespace dexcheck
