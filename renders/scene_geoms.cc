#include "renders/scene_geoms.h"

#include <cmath>

#include "controller/common/errors.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

constexpr float kGlow = 0.35F;  // emission, so that colours stay recognisable in shadow

class GeomAdder {
 public:
  GeomAdder(DisplayMeshes* meshes, mjvScene* scene) : meshes_(*meshes), scene_(*scene) {}

  void operator()(const Arrow& arrow) {
    const Vector3d along = arrow.to - arrow.from;
    if (along.norm() <= arrow.radius) return;
    mjvGeom& geom = Add(mjGEOM_ARROW, arrow.color);
    // The engine draws arrows half as long as their given length.
    const Vector3d end = arrow.from + 2.0 * along;
    MakeConnector(mjGEOM_ARROW, arrow.radius, arrow.from.data(), end.data(), &geom);
  }

  void operator()(const Cone& cone) {
    mjvGeom& geom = Add(mjGEOM_MESH, cone.color);
    geom.dataid = meshes_.cone();
    const Vector3d x = cone.axis.unitOrthogonal();
    const Vector3d y = cone.axis.cross(x);
    const double radius = cone.height * std::tan(cone.half_angle);
    Matrix3d scaled;
    scaled << radius * x, radius * y, cone.height * cone.axis;
    Place(cone.apex, scaled, &geom);
  }

  void operator()(const Polyline& line) {
    if (line.points.size() < 2) return;
    mjvGeom& geom = Add(mjGEOM_MESH, line.color);
    // Near the camera in floats: relative to the path's first point.
    const Vector3d origin = line.points.front();
    std::vector<Vector3d> points;
    for (const Vector3d& point : line.points) points.push_back(point - origin);
    geom.dataid = meshes_.AddTube(points, line.radius);
    Place(origin, Matrix3d::Identity(), &geom);
  }

  void operator()(const Axes& axes) {
    constexpr double kSlimness = 0.03;
    for (int k = 0; k < 3; ++k) {
      Color color = {0.15F, 0.15F, 0.15F, 1.0F};
      color[static_cast<size_t>(k)] = 0.9F;
      const Vector3d origin = axes.X_WF.translation();
      (*this)(
          Arrow{origin, origin + axes.length * axes.X_WF.linear().col(k), kSlimness * axes.length, color});
    }
  }

  void operator()(const Dot& dot) {
    mjvGeom& geom = Add(mjGEOM_SPHERE, dot.color);
    for (float& size : geom.size) size = static_cast<float>(dot.radius);
    Place(dot.center, Matrix3d::Identity(), &geom);
  }

 private:
  mjvGeom& Add(int type, const Color& color) {
    Require(scene_.ngeom < scene_.maxgeom, "decorations", "must fit into the scene's number of geoms",
            scene_.maxgeom);
    mjvGeom& geom = scene_.geoms[scene_.ngeom++];
    // mjv_initGeom leaves some members, such as what transparent geoms are sorted by, as they were.
    geom = mjvGeom{};
    mjv_initGeom(&geom, type, nullptr, nullptr, nullptr, color.data());
    geom.category = mjCAT_DECOR;
    geom.emission = kGlow;
    geom.specular = 0.3F;
    geom.shininess = 0.4F;
    return geom;
  }

  /// @param scaled rotation whose columns carry the shape's sizes.
  static void Place(const Vector3d& p, const Matrix3d& scaled, mjvGeom* geom) {
    for (int i = 0; i < 3; ++i) {
      geom->pos[i] = static_cast<float>(p[i]);
      for (int j = 0; j < 3; ++j) geom->mat[3 * i + j] = static_cast<float>(scaled(i, j));
    }
  }

  DisplayMeshes& meshes_;
  mjvScene& scene_;
};

}  // namespace

void AddDecorations(std::span<const Decoration> decorations, DisplayMeshes* meshes, mjvScene* scene) {
  GeomAdder adder(meshes, scene);
  for (const Decoration& decoration : decorations) std::visit(adder, decoration);
}

}  // namespace dexcheck
