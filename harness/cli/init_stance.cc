#include "harness/cli/init_stance.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/init_motion.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck::cli {
namespace {

using tinyxml2::XMLElement;

/// Places of a geom that can touch a plane, in its own frame; none of shapes that a stance does not know.
std::vector<Vector3d> ListPlaces(const mjModel& m, int geom) {
  const Vector3d size = MapVector(m.geom_size + 3 * geom);
  switch (m.geom_type[geom]) {
    case mjGEOM_SPHERE:
      return {Vector3d::Zero()};
    case mjGEOM_CAPSULE:
      return {size[1] * Vector3d::UnitZ(), -size[1] * Vector3d::UnitZ()};
    case mjGEOM_BOX: {
      std::vector<Vector3d> corners;
      corners.reserve(8);
      for (int k = 0; k < 8; ++k)
        corners.emplace_back(size.cwiseProduct(Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
      return corners;
    }
    default:
      return {};
  }
}

/// The element of that name anywhere in the world.
XMLElement* FindBody(MjcfFile* mjcf, const std::string& name) {
  XMLElement* found = nullptr;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    if (std::string_view(element->Name()) == "body" && ReadAttribute(*element, "name") == name)
      found = element;
  });
  return found;
}

/// Gives a geom of the engine's model a name in its file. @throws InputError when its body has none.
std::string NameGeom(const mjModel& m, int geom, MjcfFile* mjcf) {
  const int body = m.geom_bodyid[geom];
  XMLElement* const element = FindBody(mjcf, NameOf(m, mjOBJ_BODY, body));
  if (element == nullptr)
    throw InputError(mjcf->source() + ": body " + NameOf(m, mjOBJ_BODY, body) +
                     ": must have a name, it is a foot");
  // The engine keeps the order of a body's geoms.
  const std::vector<XMLElement*> geoms = ListChildren(element, "geom");
  XMLElement* const own = geoms.at(static_cast<size_t>(geom - m.body_geomadr[body]));
  if (own->Attribute("name") == nullptr) own->SetAttribute("name", fmt::format("foot_geom_{}", geom).c_str());
  return own->Attribute("name");
}

/// The plane of that name that the world has, or a new one.
std::string RequireFloor(const mjModel& m, MjcfFile* mjcf) {
  for (int geom = 0; geom < m.ngeom && m.geom_bodyid[geom] == 0; ++geom) {
    const char* const name = mj_id2name(&m, mjOBJ_GEOM, geom);
    if (m.geom_type[geom] == mjGEOM_PLANE && name != nullptr && *name != '\0') return name;
  }
  constexpr const char* kFloor = "stance_floor";
  XMLElement* const geom = RequireSection(mjcf->root(), "worldbody")->InsertNewChildElement("geom");
  geom->SetAttribute("name", kFloor);
  geom->SetAttribute("type", "plane");
  geom->SetAttribute("size", "0 0 1");
  return kFloor;
}

}  // namespace

Stand FindStand(const mjModel& m, const std::string& source) {
  const MjDataPtr data = MakeData(m);
  if (m.nkey > 0) mj_resetDataKeyframe(&m, data.get(), 0);
  mj_kinematics(&m, data.get());
  Stand stand;
  int base = 0;
  for (int joint = 0; joint < m.njnt; ++joint) {
    if (m.jnt_type[joint] == mjJNT_FREE) base = m.jnt_bodyid[joint];
    if (m.jnt_type[joint] == mjJNT_HINGE || m.jnt_type[joint] == mjJNT_SLIDE)
      stand.pose[NameOf(m, mjOBJ_JOINT, joint)] = data->qpos[m.jnt_qposadr[joint]];
  }
  struct Place {
    Foot foot;
    double height;
  };
  std::vector<Place> places;
  std::map<int, double> lowest_of;  // by body
  double lowest = std::numeric_limits<double>::infinity();
  for (int geom = 0; geom < m.ngeom; ++geom) {
    const int body = m.geom_bodyid[geom];
    if (m.body_rootid[body] != base || !CanTouch(m, geom)) continue;
    const Pose X_body = ReadPose(m.geom_pos + 3 * geom, m.geom_quat + 4 * geom);
    const double radius = m.geom_type[geom] == mjGEOM_BOX ? 0.0 : m.geom_size[3 * geom];
    for (const Vector3d& p : ListPlaces(m, geom)) {
      const Vector3d p_body = X_body * p;
      double p_world[3];
      mju_rotVecMat(p_world, p_body.data(), data->xmat + 9 * body);
      const double height = p_world[2] + data->xpos[3 * body + 2] - radius;
      places.push_back({{"", geom, p_body, radius}, height});
      lowest_of[body] = std::min(height, lowest_of.try_emplace(body, height).first->second);
      lowest = std::min(lowest, height);
    }
  }
  // Feet are bodies that are nearly as low as the lowest; of each, what is lowest.
  constexpr double kNear = 0.02, kFlat = 0.001;  // m
  for (Place& place : places) {
    const double own = lowest_of[m.geom_bodyid[place.foot.geom]];
    if (own > lowest + kNear || place.height > own + kFlat) continue;
    place.foot.frame = fmt::format("foot_{}", stand.feet.size() + 1);
    stand.feet.push_back(place.foot);
  }
  if (stand.feet.size() < 3)
    throw InputError(
        fmt::format("{}: base: floats, and must stand on three spheres, ends of capsules or corners of "
                    "boxes that collide, got {}{}",
                    source, stand.feet.size(), m.nkey > 0 ? " in its first key frame" : " at zero"));
  stand.height = data->xpos[3 * base + 2] - lowest;
  stand.weight = mj_getTotalmass(&m) * MapVector(m.opt.gravity).norm();
  return stand;
}

void PutOnFloor(const mjModel& m, const Stand& stand, MjcfFile* mjcf) {
  std::set<std::string> geoms;
  for (const Foot& foot : stand.feet) {
    geoms.insert(NameGeom(m, foot.geom, mjcf));
    XMLElement* const body = FindBody(mjcf, NameOf(m, mjOBJ_BODY, m.geom_bodyid[foot.geom]));
    XMLElement* const site = body->InsertNewChildElement("site");
    site->SetAttribute("name", foot.frame.c_str());
    site->SetAttribute("pos", fmt::format("{} {} {}", FormatNumber(foot.p_body[0]),
                                          FormatNumber(foot.p_body[1]), FormatNumber(foot.p_body[2]))
                                  .c_str());
  }
  XMLElement* const option = RequireSection(mjcf->root(), "option");
  for (const auto& [name, value] : {std::pair("timestep", "0.001"),
                                    {"integrator", "Euler"},
                                    {"cone", "elliptic"},
                                    {"impratio", "100"},
                                    {"collision", "predefined"}})
    option->SetAttribute(name, value);
  const std::string floor = RequireFloor(m, mjcf);
  XMLElement* const contact = RequireSection(mjcf->root(), "contact");
  for (XMLElement* pair : ListChildren(contact, "pair")) contact->DeleteChild(pair);
  for (const std::string& geom : geoms) {
    XMLElement* const pair = contact->InsertNewChildElement("pair");
    for (const auto& [name, value] : {std::pair<const char*, std::string>("geom1", floor),
                                      {"geom2", geom},
                                      {"condim", "3"},
                                      {"solref", "0.002 1"},
                                      {"solimp", "0.99 0.99 0.001 0.5 2"},
                                      {"friction", "0.8 0.8 0.005 0.0001 0.0001"}})
      pair->SetAttribute(name, value.c_str());
  }
}

void AddFeet(const Stand& stand, RobotDescription* robot) {
  for (const Foot& foot : stand.feet) {
    for (Frame& frame : robot->spec.frames) {
      if (frame.name == foot.frame && foot.radius > 0.0) frame.sphere_radius = foot.radius;
    }
  }
}

std::string WriteStandScenario(const RobotDescription& robot, const Stand& stand, double tolerance) {
  const std::string start = ListJoints(robot, [&](size_t i) {
    const Joint& joint = robot.spec.joints[i];
    const auto at = stand.pose.find(joint.name);
    // Not at an end, where rounding to the digits printed would put it outside.
    const double margin = 0.01 * (joint.upper - joint.lower);
    return std::clamp(at == stand.pose.end() ? 0.0 : at->second, joint.lower + margin, joint.upper - margin);
  });
  std::string feet;
  for (const Foot& foot : stand.feet) feet += (feet.empty() ? "" : ", ") + Quote(foot.frame);
  const double way = 0.03 * stand.height;
  return fmt::format(
      R"(# The robot stands on its feet and sways over them, by computed torque, checked at every step.
name = "motion"
description = "the base shifts, sinks and turns over feet that stay"
duration = 4.0
settle = 1.0
start = "rest"
{}
[model]
file = "robot.toml"

[plant]
mjcf = "robot.xml"

# The posture to stand in.
[joint_motion]
start = {{ {} }}

[stance]
feet = [{}]
mu = 0.5
f_min = {}
f_max = {}
points = [
  {{ time = 2, xyz = [{}, 0, {}], rpy_deg = [0, 2, 0] }},
  {{ time = 4, xyz = [0, {}, {}], rpy_deg = [2, 0, 2] }},
]

[control]
law = "computed_torque"
natural_frequency = 20
damping_ratio = 1
{})",
      WriteTolerance(tolerance), start, feet,
      FormatNumber(0.01 * stand.weight / static_cast<double>(stand.feet.size()), 2),
      FormatNumber(std::ceil(stand.weight)), FormatNumber(way, 2), FormatNumber(-way, 2),
      FormatNumber(way, 2), FormatNumber(-way, 2), WriteCompensation(robot));
}

}  // namespace dexcheck::cli
