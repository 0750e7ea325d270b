#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/solid.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

/// Adds the exclusions of pairs of bodies, those that have names; explicit pairs, which they do not stop, go.
/// @returns "base_link and link_1" of each.
std::vector<std::string> Exclude(const mjModel& m, const std::set<std::pair<int, int>>& pairs,
                                 MjcfFile* mjcf) {
  std::vector<std::string> names;
  for (const auto& [one, other] : pairs) {
    const char *const first = mj_id2name(&m, mjOBJ_BODY, one), *const second =
                                                                   mj_id2name(&m, mjOBJ_BODY, other);
    if (first == nullptr || second == nullptr || *first == '\0' || *second == '\0') continue;
    tinyxml2::XMLElement* const exclude =
        RequireSection(mjcf->root(), "contact")->InsertNewChildElement("exclude");
    exclude->SetAttribute("body1", first);
    exclude->SetAttribute("body2", second);
    names.push_back(std::string(first) + " and " + second);
  }
  const auto find_body = [&](const tinyxml2::XMLElement& pair, const char* attribute) {
    const int geom = mj_name2id(&m, mjOBJ_GEOM, ReadAttribute(pair, attribute).c_str());
    return geom < 0 ? -1 : m.geom_bodyid[geom];
  };
  for (tinyxml2::XMLElement* contact : ListChildren(mjcf->root(), "contact")) {
    for (tinyxml2::XMLElement* pair : ListChildren(contact, "pair")) {
      if (pairs.contains(std::minmax({find_body(*pair, "geom1"), find_body(*pair, "geom2")})))
        contact->DeleteChild(pair);
    }
  }
  return names;
}

bool IsExcluded(const mjModel& m, int one, int other) {
  return std::any_of(m.exclude_signature, m.exclude_signature + m.nexclude, [&](int excluded) {
    return excluded == MakeSignature(one, other) || excluded == MakeSignature(other, one);
  });
}

bool AreNeighbours(const mjModel& m, int one, int other) {
  const int root = m.body_weldid[one], other_root = m.body_weldid[other];
  return root == other_root || m.body_weldid[m.body_parentid[root]] == other_root ||
         m.body_weldid[m.body_parentid[other_root]] == root;
}

/// Of one robot. With the world, or what stands on it, it is a matter of the motion.
bool AreOfOneTree(const mjModel& m, int one, int other) {
  return m.body_rootid[one] == m.body_rootid[other] && (m.body_weldid[one] != 0 || m.body_weldid[other] != 0);
}

/// What the engine lets touch; it pushes apart what is as near as their margin.
void AddContacts(const mjModel& m, const mjData& data, std::set<std::pair<int, int>>* pairs) {
  for (int i = 0; i < data.ncon; ++i) {
    const mjContact& contact = data.contact[i];
    const std::pair bodies = std::minmax(m.geom_bodyid[contact.geom1], m.geom_bodyid[contact.geom2]);
    if (contact.dist <= contact.includemargin && AreOfOneTree(m, bodies.first, bodies.second))
      pairs->insert(bodies);
  }
}

/// What a run's clearance is of: shapes that the engine does not let touch, too.
void AddOverlaps(const mjModel& m, const mjData& data, const Solids& solids,
                 std::set<std::pair<int, int>>* pairs) {
  constexpr double kNear = 1e-3;  // m, which a run's motion is off by
  const auto pose = [&](const Solid& s) {
    return Pose(MapPose(data.xmat + 9 * s.body, data.xpos + 3 * s.body) * s.X_BG);
  };
  for (size_t i = 0; i < solids.list.size(); ++i) {
    const Solid& a = solids.list[i];
    for (size_t k = 0; k < i; ++k) {
      const Solid& b = solids.list[k];
      const std::pair bodies = std::minmax(a.body, b.body);
      if (!AreOfOneTree(m, a.body, b.body) || AreNeighbours(m, a.body, b.body) || pairs->count(bodies) > 0)
        continue;
      const Pose X_WA = pose(a), X_WB = pose(b);
      if ((X_WA.translation() - X_WB.translation()).norm() > a.reach + b.reach + kNear) continue;
      if (CalcDistance(a, X_WA, b, X_WB) < kNear) pairs->insert(bodies);
    }
  }
}

}  // namespace

std::vector<std::string> ExcludeBaseContacts(MjcfFile* mjcf) {
  const MjModelPtr model = LoadMjcfText(mjcf->PrintFor(std::filesystem::current_path()), mjcf->source());
  const mjModel& m = *model;
  std::set<std::pair<int, int>> pairs;
  for (int body = 1; body < m.nbody; ++body) {
    const int base = m.body_parentid[body];
    if (base == 0 || m.body_weldid[base] != 0 || m.body_weldid[body] == 0) continue;
    const bool can_touch = m.body_geomnum[base] > 0 && m.body_geomnum[body] > 0;
    if (can_touch && !IsExcluded(m, base, body)) pairs.emplace(base, body);
  }
  return Exclude(m, pairs, mjcf);
}

std::vector<std::string> ExcludeOverlaps(const std::vector<std::map<std::string, double>>& poses,
                                         MjcfFile* mjcf) {
  const MjModelPtr model = LoadMjcfText(mjcf->PrintFor(std::filesystem::current_path()), mjcf->source());
  const mjModel& m = *model;
  const MjDataPtr data = MakeData(m);
  const Solids solids = ListSolids(m);
  std::set<std::pair<int, int>> pairs;
  for (const std::map<std::string, double>& pose : poses) {
    mj_resetData(&m, data.get());
    for (const auto& [name, value] : pose) {
      const int joint = mj_name2id(&m, mjOBJ_JOINT, name.c_str());
      if (joint >= 0) data->qpos[m.jnt_qposadr[joint]] = value;
    }
    mj_kinematics(&m, data.get());
    mj_comPos(&m, data.get());
    mj_collision(&m, data.get());
    AddContacts(m, *data, &pairs);
    AddOverlaps(m, *data, solids, &pairs);
  }
  return Exclude(m, pairs, mjcf);
}

}  // namespace dexcheck
