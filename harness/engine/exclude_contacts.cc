#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

/// Adds the exclusions of pairs of bodies, those that have names.
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
  return names;
}

bool IsExcluded(const mjModel& m, int one, int other) {
  return std::any_of(m.exclude_signature, m.exclude_signature + m.nexclude, [&](int excluded) {
    return excluded == MakeSignature(one, other) || excluded == MakeSignature(other, one);
  });
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
    for (int i = 0; i < data->ncon; ++i) {
      const mjContact& contact = data->contact[i];
      if (contact.dist > 0.0) continue;
      const std::pair bodies = std::minmax(m.geom_bodyid[contact.geom1], m.geom_bodyid[contact.geom2]);
      // With the world, or what stands on it, it is a matter of the motion.
      if (m.body_weldid[bodies.first] != 0) pairs.insert(bodies);
    }
  }
  return Exclude(m, pairs, mjcf);
}

}  // namespace dexcheck
