
#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

// Radii relative to the largest distance between two bodies that hang on one another.
constexpr double kRodRadius = 0.04;
constexpr double kBallRadius = 0.07;
constexpr double kLeastLength = 1e-4;  // m
constexpr double kLoneRadius = 0.05;   // m, of a body that no other hangs on
constexpr int kFirstHiddenGroup = 3;   // the engine shows groups 0 to 2
constexpr const char* kRodColor = "0.80 0.82 0.85 1";
constexpr const char* kBallColor = "0.30 0.50 0.78 1";
constexpr float kDiffuse = 0.7F;  // of the headlight
constexpr float kAmbient = 0.4F;  // of the headlight; a floor, seen at an angle, has little else

/// A rod between two places of a body, or a ball where they are one, in the body's frame.
struct Bone {
  int body;
  Vector3d from;
  Vector3d to;

  [[nodiscard]] double length() const { return (to - from).norm(); }
};

bool Moves(const mjModel& m, int body) { return m.body_weldid[body] != 0; }

bool FloatsFreely(const mjModel& m, int body) {
  return m.body_jntnum[body] > 0 && m.jnt_type[m.body_jntadr[body]] == mjJNT_FREE;
}

/// Brightens a model without lights, or with lamps that reach one place only, which the headlight leaves
/// dark.
void Brighten(mjModel* m) {
  for (int light = 0; light < m->nlight; ++light) {
    if (IsDirectional(*m, light)) return;
  }
  for (int i = 0; i < 3; ++i) {
    if (m->nlight == 0) m->vis.headlight.diffuse[i] = std::max(m->vis.headlight.diffuse[i], kDiffuse);
    m->vis.headlight.ambient[i] = std::max(m->vis.headlight.ambient[i], kAmbient);
  }
}

std::vector<int> ListMovingGeoms(const mjModel& m) {
  std::vector<int> geoms;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (Moves(m, m.geom_bodyid[geom])) geoms.push_back(geom);
  }
  return geoms;
}

/// Whether shapes suffice: on half of the moving bodies, as a robot of feet alone would be invisible.
bool HasShapes(const mjModel& m) {
  int moving = 0, shaped = 0;
  for (int body = 1; body < m.nbody; ++body) {
    if (m.body_jntnum[body] == 0) continue;
    ++moving;
    shaped += m.body_geomnum[body] > 0 ? 1 : 0;
  }
  return shaped > 0 && 2 * shaped >= moving;
}

std::vector<Bone> ListBones(const mjModel& m) {
  std::vector<Bone> bones;
  const auto add_rod = [&](int body, const Vector3d& to) {
    const Bone rod{body, Vector3d::Zero(), to};
    if (rod.length() > kLeastLength) bones.push_back(rod);
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
      bones.push_back({body, at, at});
    }
  }
  for (int site = 0; site < m.nsite; ++site) {
    if (Moves(m, m.site_bodyid[site])) add_rod(m.site_bodyid[site], MapVector(m.site_pos + 3 * site));
  }
  for (int body = 1; body < m.nbody; ++body) {
    if (!Moves(m, body) || !is_last[static_cast<size_t>(body)]) continue;
    const Vector3d com = MapVector(m.body_ipos + 3 * body);
    if (FloatsFreely(m, body)) {
      bones.push_back({body, com, com});
    } else {
      add_rod(body, com);
    }
  }
  return bones;
}

/// Adds a geom that touches nothing and has no mass, whatever the file's defaults are.
void AddGeom(const Bone& bone, double unit, tinyxml2::XMLElement* body) {
  const bool is_rod = bone.length() > 0.0;
  const Vector3d middle = 0.5 * (bone.from + bone.to);
  const Vector3d along = is_rod ? Vector3d(bone.to - bone.from) : Vector3d(Vector3d::UnitZ());
  Eigen::Vector4d quat;
  mju_quatZ2Vec(quat.data(), along.data());
  SetAttributes({{"type", is_rod ? "capsule" : "sphere"},
                 {"size", fmt::format("{:.17g} {:.17g}", (is_rod ? kRodRadius : kBallRadius) * unit,
                                      0.5 * bone.length())},
                 {"pos", fmt::format("{:.17g} {:.17g} {:.17g}", middle[0], middle[1], middle[2])},
                 {"quat", fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", quat[0], quat[1], quat[2], quat[3])},
                 {"rgba", is_rod ? kRodColor : kBallColor},
                 {"contype", "0"},
                 {"conaffinity", "0"},
                 {"group", "0"},
                 {"mass", "0"}},
                body->InsertNewChildElement("geom"));
}

}  // namespace

MjModelPtr LoadVisible(MjcfFile* mjcf) {
  MjModelPtr model = LoadMjcf(mjcf);
  const bool all_hidden = model->nskin == 0 && std::ranges::all_of(ListMovingGeoms(*model), [&](int geom) {
                            return model->geom_group[geom] >= kFirstHiddenGroup;
                          });
  const std::vector<tinyxml2::XMLElement*> bodies = ListBodies(*mjcf);
  const bool is_visible =
      model->nskin > 0 || HasShapes(*model) || bodies.size() != static_cast<size_t>(model->nbody);
  const std::vector<Bone> bones = is_visible ? std::vector<Bone>() : ListBones(*model);
  if (!bones.empty()) {
    double longest = 0.0;
    for (const Bone& bone : bones) longest = std::max(longest, bone.length());
    const double unit = longest > 0.0 ? longest : kLoneRadius / kBallRadius;
    // Inertias are not drawn; from geoms without mass they would be none.
    RequireSection(mjcf->root(), "compiler")->SetAttribute("inertiafromgeom", "auto");
    for (const Bone& bone : bones) AddGeom(bone, unit, bodies[static_cast<size_t>(bone.body)]);
    model = LoadMjcf(mjcf);
  }
  for (const int geom : ListMovingGeoms(*model)) {
    if (all_hidden) model->geom_group[geom] = 0;
  }
  Brighten(model.get());
  return model;
}

}  // namespace dexcheck
