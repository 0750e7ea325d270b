#include "renders/display_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/common/errors.h"
#include "renders/mesa.h"

namespace dexcheck {
namespace {

constexpr int kConeSides = 48;
constexpr int kTubeSides = 8;

unsigned BeginList() {
  const unsigned list = LoadMesa().glGenLists(1);
  if (list == 0) throw Error("OpenGL: cannot make a display list");
  LoadMesa().glNewList(list, GL_COMPILE);
  return list;
}

/// Seen from both sides.
unsigned MakeCone() {
  const unsigned list = BeginList();
  LoadMesa().glBegin(GL_TRIANGLES);
  for (const bool outside : {true, false}) {
    const float sign = outside ? 1.0F : -1.0F;
    for (int k = 0; k < kConeSides; ++k) {
      const auto vertex = [&](int i, float z) {
        const double angle = 2.0 * kPi * i / kConeSides;
        const auto c = static_cast<float>(std::cos(angle));
        const auto s = static_cast<float>(std::sin(angle));
        LoadMesa().glNormal3f(sign * c, sign * s, -sign);
        LoadMesa().glVertex3f(z * c, z * s, z);
      };
      vertex(k, 0.0F);
      vertex(outside ? k + 1 : k, 1.0F);
      vertex(outside ? k : k + 1, 1.0F);
    }
  }
  LoadMesa().glEnd();
  LoadMesa().glEndList();
  return list;
}

}  // namespace

DisplayMeshes::DisplayMeshes(const mjrContext& context) : context_(context), cone_(MakeCone()) {}

DisplayMeshes::~DisplayMeshes() {
  ClearTubes();
  LoadMesa().glDeleteLists(cone_, 1);
}

int DisplayMeshes::ToMesh(unsigned list) const {
  return static_cast<int>(list) - static_cast<int>(context_.baseMesh);
}

void DisplayMeshes::ClearTubes() {
  for (const unsigned list : tubes_) LoadMesa().glDeleteLists(list, 1);
  tubes_.clear();
}

int DisplayMeshes::AddTube(std::span<const Vector3d> points, double radius) {
  Require(points.size() >= 2, "points of a tube", "must be at least two", static_cast<double>(points.size()));
  const unsigned list = BeginList();
  tubes_.push_back(list);
  std::array<Vector3d, kTubeSides> previous;
  Vector3d x = Vector3d::Zero();
  for (size_t i = 0; i < points.size(); ++i) {
    Vector3d along = points[std::min(i + 1, points.size() - 1)] - points[i == 0 ? 0 : i - 1];
    if (along.isZero()) along = Vector3d::UnitZ();
    along.normalize();
    // The last ring's direction, turned as little as the path's bend requires.
    x -= along.dot(x) * along;
    x = x.norm() > 0.1 ? x.normalized() : along.unitOrthogonal();
    const Vector3d y = along.cross(x);
    std::array<Vector3d, kTubeSides> outward;
    for (int k = 0; k < kTubeSides; ++k) {
      const double angle = 2.0 * kPi * k / kTubeSides;
      outward[static_cast<size_t>(k)] = std::cos(angle) * x + std::sin(angle) * y;
    }
    if (i > 0) {
      const auto vertex = [&](size_t point, const Vector3d& normal) {
        const Vector3d p = points[point] + radius * normal;
        LoadMesa().glNormal3dv(normal.data());
        LoadMesa().glVertex3dv(p.data());
      };
      LoadMesa().glBegin(GL_TRIANGLE_STRIP);
      for (int k = 0; k <= kTubeSides; ++k) {
        const auto side = static_cast<size_t>(k % kTubeSides);
        vertex(i, outward[side]);
        vertex(i - 1, previous[side]);
      }
      LoadMesa().glEnd();
    }
    previous = outward;
  }
  LoadMesa().glEndList();
  return ToMesh(list);
}

}  // namespace dexcheck
