#include <fmt/format.h>
#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/types.h"
#include "harness/base/files.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/robot_tree.h"
#include "harness/engine/solid.h"
#include "harness/engine/xml.h"

namespace dexcheck {

namespace {

/// Adds the exclusions of pairs of bodies that have names, and deletes explicit pairs, which exclusions do
/// not stop. @returns "base_link and link_1" of each.
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
  DeleteInSections(mjcf->root(), {"contact"}, [&](const tinyxml2::XMLElement& pair) {
    return std::string_view(pair.Name()) == "pair" &&
           pairs.contains(std::minmax({find_body(pair, "geom1"), find_body(pair, "geom2")}));
  });
  return names;
}

bool AreNeighbours(const mjModel& m, int one, int other) {
  const int root = m.body_weldid[one], other_root = m.body_weldid[other];
  return root == other_root || m.body_weldid[m.body_parentid[root]] == other_root ||
         m.body_weldid[m.body_parentid[other_root]] == root;
}

/// Whether the contact of two bodies may be excluded. Every moving body is the robot, also in several trees
/// on the world, as fingers are. A contact with the world, or with bodies on it, depends on the motion,
/// unless they overlap before it begins.
bool MayBeExcluded(const mjModel& m, int one, int other, bool at_start) {
  const int moving = (m.body_weldid[one] != 0 ? 1 : 0) + (m.body_weldid[other] != 0 ? 1 : 0);
  return moving == 2 || (moving == 1 && (at_start || m.body_rootid[one] == m.body_rootid[other]));
}

/// Adds the pairs that the engine lets touch and that are nearer than their margin.
void AddContacts(const mjModel& m, const mjData& data, bool at_start, std::set<std::pair<int, int>>* pairs) {
  for (int i = 0; i < data.ncon; ++i) {
    const mjContact& contact = data.contact[i];
    const std::pair bodies = std::minmax(m.geom_bodyid[contact.geom1], m.geom_bodyid[contact.geom2]);
    if (contact.dist <= contact.includemargin && MayBeExcluded(m, bodies.first, bodies.second, at_start))
      pairs->insert(bodies);
  }
}

/// Adds the pairs that a run's clearance finds overlapping, also shapes that the engine lets not touch.
void AddOverlaps(const mjModel& m, const mjData& data, const Solids& solids, bool at_start,
                 std::set<std::pair<int, int>>* pairs) {
  constexpr double kNear = 1e-3;  // m, which a run's motion is off by
  const auto pose = [&](const Solid& s) { return Pose(BodyPose(data, s.body) * s.X_BG); };
  for (size_t i = 0; i < solids.list.size(); ++i) {
    const Solid& a = solids.list[i];
    for (size_t k = 0; k < i; ++k) {
      const Solid& b = solids.list[k];
      const std::pair bodies = std::minmax(a.body, b.body);
      // Engine and clearance leave out neighbours, but not a link and the fixed body that it turns on.
      const bool is_left_out = AreNeighbours(m, a.body, b.body) && !(at_start && bodies.first == 0);
      if (!MayBeExcluded(m, a.body, b.body, at_start) || is_left_out || pairs->count(bodies) > 0) continue;
      const Pose X_WA = pose(a), X_WB = pose(b);
      if ((X_WA.translation() - X_WB.translation()).norm() > a.reach + b.reach + kNear) continue;
      if (CalcDistance(a, X_WA, b, X_WB) < kNear) pairs->insert(bodies);
    }
  }
}

}  // namespace

std::vector<std::string> ExcludeBaseContacts(MjcfFile* mjcf) {
  const MjModelPtr model = LoadMjcfText(mjcf->PrintFor(CurrentFolder()), mjcf->source());
  const mjModel& m = *model;
  std::set<std::pair<int, int>> pairs;
  for (int body = 1; body < m.nbody; ++body) {
    const int base = m.body_parentid[body];
    if (base == 0 || m.body_weldid[base] != 0 || m.body_weldid[body] == 0) continue;
    const bool can_touch = m.body_geomnum[base] > 0 && m.body_geomnum[body] > 0;
    if (can_touch && !AreExcluded(m, base, body)) pairs.emplace(base, body);
  }
  return Exclude(m, pairs, mjcf);
}

std::vector<std::string> ExcludeOverlaps(const std::vector<std::map<std::string, double>>& poses,
                                         bool with_world, MjcfFile* mjcf) {
  const MjModelPtr model = LoadMjcfText(mjcf->PrintFor(CurrentFolder()), mjcf->source());
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
    const bool at_start = with_world && &pose == &poses.front();
    AddContacts(m, *data, at_start, &pairs);
    AddOverlaps(m, *data, solids, at_start, &pairs);
  }
  return Exclude(m, pairs, mjcf);
}

namespace {

using tinyxml2::XMLElement;

constexpr const char* kActs = "left out, which acts on the motion beside motors";

void DeleteSections(const char* name, MjcfFile* mjcf) {
  for (XMLElement* section : ListChildren(mjcf->root(), name)) {
    for (const XMLElement* part : ListChildren(section))
      mjcf->Note(*part, std::string("<") + name + " " + part->Name() + ">", kActs);
    mjcf->root()->DeleteChild(section);
  }
}

/// Deletes actuators and sensors that refer to tendons and constraints, whose sections are gone.
void DeleteUsers(MjcfFile* mjcf) {
  DeleteInSections(mjcf->root(), {"actuator", "sensor"}, [](const XMLElement& part) {
    return part.Attribute("tendon") != nullptr || std::string_view(part.Name()).starts_with("tendon");
  });
}

void DeleteWord(XMLElement* element, const char* attribute, MjcfFile* mjcf) {
  if (element->Attribute(attribute) == nullptr) return;
  mjcf->Note(*element, std::string("<") + element->Name() + " " + attribute + ">", kActs);
  element->DeleteAttribute(attribute);
}

void DeleteKeyFrames(MjcfFile* mjcf) {
  DeleteChildren(mjcf->root(), "keyframe", [](const XMLElement&) { return true; });
}

/// Deletes the joint with its sensors, and all key frames, which have numbers of all joints.
void DeleteJoint(XMLElement* joint, MjcfFile* mjcf) {
  const std::string name = ReadAttribute(*joint, "name");
  DeleteInSections(mjcf->root(), {"sensor"}, [&](const XMLElement& part) {
    return !name.empty() && ReadAttribute(part, "joint") == name;
  });
  DeleteKeyFrames(mjcf);
  joint->Parent()->DeleteChild(joint);
}

}  // namespace

void KeepMechanism(MjcfFile* mjcf) {
  DeleteSections("equality", mjcf);
  DeleteSections("tendon", mjcf);
  DeleteUsers(mjcf);
  DeleteControls(mjcf->root());
  std::vector<XMLElement*> balls;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    const std::string_view kind = element->Name();
    if (kind == "joint" && ReadAttribute(*element, "type") == "ball") {
      balls.push_back(element);
    } else if (kind == "joint") {
      DeleteWord(element, "stiffness", mjcf);
      DeleteWord(element, "springdamper", mjcf);
      DeleteWord(element, "margin", mjcf);
    } else if (kind == "body") {
      DeleteWord(element, "gravcomp", mjcf);
    } else if (kind == "flag") {
      DeleteWord(element, "multiccd", mjcf);
    }
  });
  for (XMLElement* ball : balls) {
    mjcf->Note(*ball, "<joint type=\"ball\">", "held, of which a run's law has no number");
    DeleteJoint(ball, mjcf);
  }
}

namespace {

std::vector<XMLElement*> ListFreeJoints(MjcfFile* mjcf) {
  std::vector<XMLElement*> joints;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    const std::string_view kind = element->Name();
    if (kind == "freejoint" || (kind == "joint" && ReadAttribute(*element, "type") == "free"))
      joints.push_back(element);
  });
  return joints;
}

/// Deletes the elements that refer to one of these names.
void DeleteNaming(const std::set<std::string>& names, MjcfFile* mjcf) {
  DeleteInSections(mjcf->root(), {"actuator", "sensor", "contact"}, [&](const XMLElement& part) {
    bool is_user = false;
    for (const auto* word = part.FirstAttribute(); word != nullptr; word = word->Next())
      is_user |= std::string_view(word->Name()) != "name" && names.contains(word->Value());
    return is_user;
  });
}

}  // namespace

void LeaveOutOthers(const mjModel& engine, MjcfFile* mjcf) {
  const RobotTree robot = FindRobotTree(engine, mjcf->source());
  std::vector<XMLElement*> others = ListElements(mjcf->root(), "body");
  std::erase_if(others, [&](const XMLElement* body) {
    return std::ranges::find(robot.others, ReadAttribute(*body, "name")) == robot.others.end();
  });
  const int dof = robot.floating_body == 0 ? -1 : engine.body_dofadr[robot.floating_body];
  if (dof >= 0 && (engine.dof_damping[dof] != 0.0 || engine.dof_armature[dof] != 0.0 ||
                   engine.dof_frictionloss[dof] != 0.0)) {
    for (XMLElement* joint : ListFreeJoints(mjcf)) {
      if (std::string_view(joint->Name()) == "freejoint") continue;
      mjcf->Note(*joint, "<joint type=\"free\">", "without the damping, armature and friction of a joint");
      for (const char* word : {"damping", "armature", "frictionloss"}) joint->SetAttribute(word, "0");
    }
  }
  std::set<std::string> names;
  for (XMLElement* body : others) {
    VisitElements(body, [&](XMLElement* part) { names.insert(ReadAttribute(*part, "name")); });
    mjcf->Note(*body, "<body name=\"" + ReadAttribute(*body, "name") + "\">",
               "left out, no part of the robot");
    body->Parent()->DeleteChild(body);
  }
  if (others.empty()) return;
  DeleteNaming(names, mjcf);
  DeleteKeyFrames(mjcf);
}

void HoldBase(double lift, MjcfFile* mjcf) {
  for (XMLElement* joint : ListFreeJoints(mjcf)) {
    XMLElement* const body = joint->Parent()->ToElement();
    Vector3d p = Vector3d::Zero();
    std::istringstream(ReadAttribute(*body, "pos", "0 0 0")) >> p[0] >> p[1] >> p[2];
    body->SetAttribute("pos", fmt::format("{} {} {}", p[0], p[1], p[2] + lift).c_str());
    DeleteJoint(joint, mjcf);
  }
}

void RequireExactSolver(MjcfFile* mjcf) {
  XMLElement* const option = RequireSection(mjcf->root(), "option");
  option->SetAttribute("solver", "Newton");
  option->SetAttribute("iterations", "100");
  option->SetAttribute("tolerance", "1e-14");
}

namespace {

/// The model of the MJCF with so many pairs more, whose numbers nobody has set.
MjModelPtr LoadWithRoom(const std::filesystem::path& mjcf, size_t pairs) {
  MjcfFile document(mjcf);
  tinyxml2::XMLElement* geom = nullptr;
  for (tinyxml2::XMLElement* world : ListChildren(document.root(), "worldbody")) {
    for (tinyxml2::XMLElement* element : ListElements(world, "geom"))
      if (element->Attribute("name") != nullptr) geom = element;
  }
  for (size_t i = 0; geom != nullptr && i < pairs; ++i)
    SetAttributes({{"geom1", geom->Attribute("name")}, {"geom2", geom->Attribute("name")}},
                  RequireSection(document.root(), "contact")->InsertNewChildElement("pair"));
  return LoadMjcf(&document);
}

/// Copies the numbers of all elements, in the first rows where there is room for more.
void CopyNumbers(const mjModel& from, mjModel* to) {
#undef MJ_M
#define MJ_M(size) m->size
#define X(type, name, rows, columns)                                                               \
  if (!std::string_view(#name).starts_with("name")) {                                              \
    const mjModel* m = &from;                                                                      \
    std::copy_n(from.name, static_cast<size_t>(m->rows) * static_cast<size_t>(columns), to->name); \
  }
  MJMODEL_POINTERS
#undef X
  to->opt = from.opt;
  to->vis = from.vis;
  to->stat = from.stat;
}

void FillPair(mjModel* m, int pair, const std::pair<int, int>& geoms) {
  const auto [a, b] = geoms;
  m->pair_dim[pair] = 3;
  m->pair_geom1[pair] = a;
  m->pair_geom2[pair] = b;
  m->pair_signature[pair] = MakeSignature(m->geom_bodyid[a], m->geom_bodyid[b]);
  m->pair_margin[pair] = 0.0;
  m->pair_gap[pair] = 0.0;
  const mjtNum solref[mjNREF] = {0.02, 1.0};
  const mjtNum solimp[mjNIMP] = {0.9, 0.95, 0.001, 0.5, 2.0};
  std::copy_n(solref, mjNREF, m->pair_solref + mjNREF * pair);
  std::copy_n(solimp, mjNIMP, m->pair_solimp + mjNIMP * pair);
  constexpr int kOfGeom[5] = {0, 0, 1, 2, 2};  // sliding twice, torsional, rolling twice
  for (int k = 0; k < 5; ++k) {
    m->pair_friction[5 * pair + k] =
        std::max(m->geom_friction[3 * a + kOfGeom[k]], m->geom_friction[3 * b + kOfGeom[k]]);
  }
}

}  // namespace

MjModelPtr AddContactPairs(const mjModel& model, std::span<const std::pair<int, int>> geoms,
                           const std::filesystem::path& mjcf) {
  if (CollidesByType(model))
    throw InputError("MJCF: option collision: must be \"predefined\" for plant.collide");
  const auto first = static_cast<size_t>(model.npair);
  MjModelPtr wider = LoadWithRoom(mjcf, geoms.size());
  if (static_cast<size_t>(wider->npair) != first + geoms.size() || wider->ngeom != model.ngeom)
    throw InputError(mjcf.string() + ": must have a geom with a name for plant.collide");
  CopyNumbers(model, wider.get());
  for (size_t k = 0; k < geoms.size(); ++k) FillPair(wider.get(), static_cast<int>(first + k), geoms[k]);
  return wider;
}

}  // namespace dexcheck
