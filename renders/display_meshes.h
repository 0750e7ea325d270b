#pragma once

#include <mujoco/mujoco.h>

#include <span>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// Shapes that MuJoCo's scenes lack, as OpenGL display lists. mjr_render draws a mesh by calling the list of
/// its number, counted from the first mesh, so that such a shape is a geom of type mjGEOM_MESH with one of
/// these numbers as its dataid. The context must be current in all calls.
class DisplayMeshes {
 public:
  explicit DisplayMeshes(const mjrContext& context);
  ~DisplayMeshes();
  DisplayMeshes(const DisplayMeshes&) = delete;
  DisplayMeshes& operator=(const DisplayMeshes&) = delete;

  /// Shell of a cone about z that opens from the origin: height 1, radius 1 at its end.
  [[nodiscard]] int cone() const { return ToMesh(cone_); }

  /// A tube along a path. @param points at least two, m; @param radius m.
  int AddTube(std::span<const Vector3d> points, double radius);
  void ClearTubes();

 private:
  [[nodiscard]] int ToMesh(unsigned list) const;

  const mjrContext& context_;
  unsigned cone_;
  std::vector<unsigned> tubes_;
};

}  // namespace dexcheck
