#include "harness/engine/skeleton.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "harness/engine/compiled_model.h"
#include "harness/engine/map_vector.h"

namespace dexcheck {
namespace {

// Of the largest distance between two bodies that hang on one another.
constexpr double kRodRadius = 0.04;
constexpr double kBallRadius = 0.07;
constexpr double kLeastLength = 1e-4;  // m
constexpr double kLoneRadius = 0.05;   // m, of a body that no other hangs on
constexpr int kFirstHiddenGroup = 3;   // the engine shows groups 0 to 2
constexpr float kRodColor[4] = {0.80F, 0.82F, 0.85F, 1.0F};
constexpr float kBallColor[4] = {0.30F, 0.50F, 0.78F, 1.0F};
constexpr float kHeadlight[3] = {0.7F, 0.7F, 0.7F};

/// A rod between two places of a body, or a ball where they are one, in the body's frame.
struct Bone {
  int body;
  Vector3d from;
  Vector3d to;

  [[nodiscard]] double length() const { return (to - from).norm(); }
};

bool Moves(const mjModel& m, int body) { return m.body_weldid[body] != 0; }

std::vector<int> ListMovingGeoms(const mjModel& m) {
  std::vector<int> geoms;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (Moves(m, m.geom_bodyid[geom])) geoms.push_back(geom);
  }
  return geoms;
}

bool FloatsFreely(const mjModel& m, int body) {
  return m.body_jntnum[body] > 0 && m.jnt_type[m.body_jntadr[body]] == mjJNT_FREE;
}

/// Of a model without lights: the engine's own headlight leaves it dark.
void Brighten(mjModel* m) {
  if (m->nlight > 0) return;
  for (int i = 0; i < 3; ++i) {
    m->vis.headlight.diffuse[i] = std::max(m->vis.headlight.diffuse[i], kHeadlight[i]);
    m->vis.headlight.ambient[i] = std::max(m->vis.headlight.ambient[i], 0.4F * kHeadlight[i]);
  }
}

/// By body, as the engine has a body's geoms in one block.
std::vector<Bone> ListBones(const mjModel& m) {
  std::vector<std::vector<Bone>> of_body(static_cast<size_t>(m.nbody));
  const auto add_rod = [&](int body, const Vector3d& to) {
    const Bone rod{body, Vector3d::Zero(), to};
    if (rod.length() > kLeastLength) of_body[static_cast<size_t>(body)].push_back(rod);
  };
  std::vector<bool> is_last(static_cast<size_t>(m.nbody), true);
  for (int body = 1; body < m.nbody; ++body) {
    if (!Moves(m, body)) continue;
    is_last[static_cast<size_t>(m.body_parentid[body])] = false;
    if (m.body_parentid[body] > 0) add_rod(m.body_parentid[body], MapVector(m.body_pos + 3 * body));
    for (int i = 0; i < m.body_jntnum[body]; ++i) {
      const int joint = m.body_jntadr[body] + i;
      if (m.jnt_type[joint] == mjJNT_FREE) continue;
      const Vector3d at = MapVector(m.jnt_pos + 3 * joint);
      of_body[static_cast<size_t>(body)].push_back({body, at, at});
    }
  }
  for (int site = 0; site < m.nsite; ++site) {
    if (Moves(m, m.site_bodyid[site])) add_rod(m.site_bodyid[site], MapVector(m.site_pos + 3 * site));
  }
  std::vector<Bone> bones;
  for (int body = 1; body < m.nbody; ++body) {
    std::vector<Bone>& own = of_body[static_cast<size_t>(body)];
    if (Moves(m, body) && is_last[static_cast<size_t>(body)]) {
      const Vector3d com = MapVector(m.body_ipos + 3 * body);
      if (FloatsFreely(m, body)) {
        own.push_back({body, com, com});
      } else {
        add_rod(body, com);
      }
    }
    bones.insert(bones.end(), own.begin(), own.end());
  }
  return bones;
}

void FillGeom(mjModel* m, int geom, const Bone& bone, double unit) {
  const bool is_rod = bone.length() > 0.0;
  const Vector3d middle = 0.5 * (bone.from + bone.to);
  m->name_geomadr[geom] = static_cast<int>(m->nnames - 1);  // no name
  m->geom_type[geom] = is_rod ? mjGEOM_CAPSULE : mjGEOM_SPHERE;
  m->geom_bodyid[geom] = bone.body;
  m->geom_dataid[geom] = m->geom_matid[geom] = -1;
  const double radius = (is_rod ? kRodRadius : kBallRadius) * unit;
  m->geom_size[3 * geom] = radius;
  m->geom_size[3 * geom + 1] = 0.5 * bone.length();
  m->geom_rbound[geom] = radius + 0.5 * bone.length();
  mju_copy3(m->geom_pos + 3 * geom, middle.data());
  const Vector3d along = is_rod ? Vector3d(bone.to - bone.from) : Vector3d(Vector3d::UnitZ());
  mju_quatZ2Vec(m->geom_quat + 4 * geom, along.data());
  std::copy_n(is_rod ? kRodColor : kBallColor, 4, m->geom_rgba + 4 * geom);
  if (m->body_geomnum[bone.body]++ == 0) m->body_geomadr[bone.body] = geom;
}

}  // namespace

MjModelPtr MakeVisible(MjModelPtr model) {
  Brighten(model.get());
  const std::vector<int> geoms = ListMovingGeoms(*model);
  if (model->nskin > 0) return model;
  if (!geoms.empty()) {
    const bool all_hidden = std::all_of(
        geoms.begin(), geoms.end(), [&](int geom) { return model->geom_group[geom] >= kFirstHiddenGroup; });
    for (const int geom : geoms) {
      if (all_hidden) model->geom_group[geom] = 0;
    }
    return model;
  }
  const std::vector<Bone> bones = ListBones(*model);
  if (bones.empty()) return model;
  double longest = 0.0;
  for (const Bone& bone : bones) longest = std::max(longest, bone.length());
  const double unit = longest > 0.0 ? longest : kLoneRadius / kBallRadius;
  const auto first = static_cast<int>(model->ngeom);
  MjModelPtr drawn = MakeResizedCopy(*model, [&](mjModel* m) { m->ngeom += static_cast<int>(bones.size()); });
  for (size_t i = 0; i < bones.size(); ++i)
    FillGeom(drawn.get(), first + static_cast<int>(i), bones[i], unit);
  return drawn;
}

}  // namespace dexcheck
