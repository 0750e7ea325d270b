#include "harness/cli/init_stance.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/cli/init_motion.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck::cli {
namespace {

using tinyxml2::XMLElement;

/// Whether a stance knows the shape; of others, spheres are added where they touch.
bool IsKnown(int type) { return type == mjGEOM_SPHERE || type == mjGEOM_CAPSULE || type == mjGEOM_BOX; }

/// Places of a geom that can touch a plane, in its own frame; none of a shape that has none.
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
    case mjGEOM_CYLINDER: {
      std::vector<Vector3d> rim;
      rim.reserve(32);
      for (int k = 0; k < 16; ++k) {
        const double angle = 0.125 * kPi * k;
        rim.emplace_back(size[0] * std::cos(angle), size[0] * std::sin(angle), size[1]);
        rim.emplace_back(size[0] * std::cos(angle), size[0] * std::sin(angle), -size[1]);
      }
      return rim;
    }
    case mjGEOM_MESH: {
      const int mesh = m.geom_dataid[geom];
      std::vector<Vector3d> vertices;
      vertices.reserve(static_cast<size_t>(m.mesh_vertnum[mesh]));
      for (int k = 0; k < m.mesh_vertnum[mesh]; ++k)
        vertices.push_back(
            Eigen::Map<const Eigen::Vector3f>(m.mesh_vert + 3 * (m.mesh_vertadr[mesh] + k)).cast<double>());
      return vertices;
    }
    default:
      return {};
  }
}

/// Whether the joint turns the geom about its own middle, as it does a wheel.
bool TurnsAboutMiddle(const mjModel& m, int joint, int geom) {
  constexpr double kNear = 0.1;  // of the geom's size
  const Vector3d arm = MapVector(m.geom_pos + 3 * geom) - MapVector(m.jnt_pos + 3 * joint);
  return arm.cross(MapVector(m.jnt_axis + 3 * joint)).norm() < kNear * m.geom_rbound[geom];
}

/// The element of a body. @throws InputError when it has no name.
XMLElement* RequireBody(const mjModel& m, int body, MjcfFile* mjcf) {
  const std::string name = NameOf(m, mjOBJ_BODY, body);
  XMLElement* found = nullptr;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    if (std::string_view(element->Name()) == "body" && ReadAttribute(*element, "name") == name)
      found = element;
  });
  if (found == nullptr)
    throw InputError(mjcf->source() + ": body " + name + ": must have a name, it is a foot");
  return found;
}

/// Gives a geom of the engine's model a name in its file. @throws as RequireBody.
std::string NameGeom(const mjModel& m, int geom, MjcfFile* mjcf) {
  const int body = m.geom_bodyid[geom];
  // The engine keeps the order of a body's geoms.
  const std::vector<XMLElement*> geoms = ListChildren(RequireBody(m, body, mjcf), "geom");
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

struct Place {
  Foot foot;
  Vector3d p_W;  // of what touches, the base level
  Vector3d up;   // in the body's frame

  void LowerBy(double way) {
    p_W.z() -= way;
    foot.p_body -= way * up;
  }
};

/// All places of the robot's geoms that can touch.
std::vector<Place> ListPlaces(const mjModel& m, const mjData& data, int base) {
  std::vector<Place> places;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    const int body = m.geom_bodyid[geom];
    if (m.body_rootid[body] != base || !CanTouch(m, geom)) continue;
    const bool is_known = IsKnown(m.geom_type[geom]);
    const double radius = !is_known                         ? kAddedRadius
                          : m.geom_type[geom] == mjGEOM_BOX ? 0.0
                                                            : m.geom_size[3 * geom];
    const Pose X_body = ReadPose(m.geom_pos + 3 * geom, m.geom_quat + 4 * geom);
    const Pose X_W = MapPose(data.xmat + 9 * body, data.xpos + 3 * body);
    const Vector3d up = X_W.linear().transpose() * Vector3d::UnitZ();
    for (const Vector3d& p : ListPlaces(m, geom)) {
      const Vector3d p_body = X_body * p, lowest = is_known ? p_body - radius * up : p_body;
      places.push_back({{"", geom, lowest + radius * up, radius, !is_known}, X_W * lowest, up});
    }
  }
  return places;
}

/// Of one body's places that lie in a plane the outermost, four at the most.
std::vector<Place> KeepOutermost(const std::vector<Place>& places) {
  constexpr double kFlat = 1e-6, kApart = 0.02;  // m; a smaller sole is a point
  std::vector<Place> kept;
  const auto from_first = [&](const Place& place) { return Vector3d(place.p_W - kept[0].p_W); };
  for (const Vector3d& way : {Vector3d(1, 1, -1), {-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}}) {
    const auto is_nearer = [&](const Place& a, const Place& b) { return way.dot(a.p_W) < way.dot(b.p_W); };
    const Place& outermost = *std::max_element(places.begin(), places.end(), is_nearer);
    const auto is_same = [&](const Place& place) { return (place.p_W - outermost.p_W).norm() < kApart; };
    if (std::any_of(kept.begin(), kept.end(), is_same)) continue;
    const bool is_in_plane =
        kept.size() < 3 ||
        std::abs(from_first(kept[1]).cross(from_first(kept[2])).normalized().dot(from_first(outermost))) <
            kFlat;
    if (is_in_plane) kept.push_back(outermost);
  }
  return kept;
}

}  // namespace

double LeastForce(const Stand& stand) { return 0.01 * stand.weight / static_cast<double>(stand.feet.size()); }

Sway ListWay(const Stand& stand) {
  const double way = 0.03 * stand.height * stand.sway, turn = kPi / 90.0 * stand.sway;
  Sway sway{.points = {{2.0, VectorXd::Zero(6)}, {4.0, VectorXd::Zero(6)}}};
  sway.points[0].q << way, 0.0, -way, 0.0, turn, 0.0;
  if (!stand.in_plane) sway.points[1].q << 0.0, way, -way, turn, 0.0, turn;
  constexpr double kSwing = 1.0 / 3.0;  // of the way
  for (int axis = 0; axis < 6; ++axis) {
    const bool is_in_plane = axis == 0 || axis == 2 || axis == 4;
    if (is_in_plane || !stand.in_plane)
      AddSwings(axis, kSwing * (axis < 3 ? way : turn), static_cast<size_t>(axis), &sway.swings);
  }
  return sway;
}

Stand FindStand(const mjModel& m, bool at_key) {
  const MjDataPtr data = MakeData(m);
  if (at_key) mj_resetDataKeyframe(&m, data.get(), 0);
  Stand stand;
  int base = 0;
  for (int joint = 0; joint < m.njnt; ++joint) {
    double* const q = data->qpos + m.jnt_qposadr[joint];
    if (m.jnt_type[joint] == mjJNT_HINGE || m.jnt_type[joint] == mjJNT_SLIDE)
      stand.pose[NameOf(m, mjOBJ_JOINT, joint)] = *q;
    if (m.jnt_type[joint] != mjJNT_FREE) continue;
    base = m.jnt_bodyid[joint];
    WriteFreePose(Pose::Identity(), q);
  }
  mj_kinematics(&m, data.get());
  const std::vector<Place> places = ListPlaces(m, *data, base);
  std::map<int, double> lowest_of;  // by body
  double lowest = std::numeric_limits<double>::infinity();
  for (const Place& place : places) {
    const int body = m.geom_bodyid[place.foot.geom];
    lowest_of[body] = std::min(place.p_W.z(), lowest_of.try_emplace(body, place.p_W.z()).first->second);
    lowest = std::min(lowest, place.p_W.z());
  }
  // Feet are bodies that are nearly as low as the lowest, and of a leg the lowest; of each, what is lowest.
  constexpr double kNear = 0.02, kFlat = 0.01, kSole = 0.002;  // m
  std::map<int, double> near = lowest_of;
  for (const auto& [body, own] : lowest_of) {
    for (int up = m.body_parentid[body]; up > 0; up = m.body_parentid[up]) {
      const auto carrier = lowest_of.find(up);
      if (carrier == lowest_of.end() || std::abs(carrier->second - own) < kSole) continue;
      near.erase(carrier->second > own ? up : body);
    }
  }
  for (const auto& [body, own] : near) {
    if (own > lowest + kNear) continue;
    std::vector<Place> low;
    for (Place place : places) {
      const double above = place.p_W.z() - own;
      if (m.geom_bodyid[place.foot.geom] != body || above > (place.foot.is_added ? kSole : kFlat)) continue;
      // Spheres that are added stand level.
      if (place.foot.is_added) place.LowerBy(above);
      low.push_back(place);
    }
    for (Place& place : KeepOutermost(low)) {
      place.foot.frame = fmt::format("foot_{}", stand.feet.size() + 1);
      const int joint = m.body_jntadr[body];
      stand.has_wheels |= place.foot.is_added && joint >= 0 && m.jnt_limited[joint] == 0 &&
                          TurnsAboutMiddle(m, joint, place.foot.geom);
      stand.feet.push_back(place.foot);
    }
  }
  stand.height = -lowest;
  stand.weight = mj_getTotalmass(&m) * MapVector(m.opt.gravity).norm();
  return stand;
}

void PutOnFloor(const mjModel& m, const Stand& stand, MjcfFile* mjcf) {
  std::set<std::string> geoms, bodies;
  for (const Foot& foot : stand.feet) {
    if (!foot.is_added) geoms.insert(NameGeom(m, foot.geom, mjcf));
    XMLElement* const body = RequireBody(m, m.geom_bodyid[foot.geom], mjcf);
    bodies.insert(ReadAttribute(*body, "name"));
    const auto add = [&](const char* kind) {
      XMLElement* const element = body->InsertNewChildElement(kind);
      element->SetAttribute("name", foot.frame.c_str());
      element->SetAttribute("pos", fmt::format("{} {} {}", FormatNumber(foot.p_body[0]),
                                               FormatNumber(foot.p_body[1]), FormatNumber(foot.p_body[2]))
                                       .c_str());
      return element;
    };
    add("site");
    if (!foot.is_added) continue;
    XMLElement* const sphere = add("geom");
    sphere->SetAttribute("type", "sphere");
    sphere->SetAttribute("size", foot.radius);
    sphere->SetAttribute("mass", 0);
    geoms.insert(foot.frame);
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
  // What else a foot has is not judged by its distance from the ground.
  for (const std::string& body : bodies) {
    XMLElement* const exclude = contact->InsertNewChildElement("exclude");
    exclude->SetAttribute("body1", "world");
    exclude->SetAttribute("body2", body.c_str());
  }
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
  const std::string start =
      ListJoints(robot, [&](size_t i) { return stand.pose.at(robot.spec.joints[i].name); });
  std::string feet;
  for (const Foot& foot : stand.feet) feet += (feet.empty() ? "" : ", ") + QuoteToml(foot.frame);
  std::string points;
  const Sway sway = ListWay(stand);
  for (const JointWayPoint& point : sway.points) {
    const auto list = [&](int from, double unit) {
      return fmt::format("[{}, {}, {}]", FormatNumber(point.q[from] / unit, 2),
                         FormatNumber(point.q[from + 1] / unit, 2),
                         FormatNumber(point.q[from + 2] / unit, 2));
    };
    points += fmt::format("  {{ time = {}, xyz = {}, rpy_deg = {} }},\n", point.time, list(0, 1.0),
                          list(3, kPi / 180.0));
  }
  const std::string text = fmt::format(
      R"(# The posture to stand in.
[joint_motion]
start = {{ {} }}

[stance]
feet = [{}]
mu = 0.5
f_min = {}
f_max = {}
points = [
{}]
{})",
      start, feet, FormatNumber(LeastForce(stand), 2), FormatNumber(std::ceil(stand.weight)), points,
      WriteSwings(sway.swings, "axis", [](int axis) {
        return std::string(std::array{"x", "y", "z", "roll", "pitch", "yaw"}[static_cast<size_t>(axis)]);
      }));
  return WriteScenario(robot,
                       {"The robot stands on its feet and sways over them",
                        "the base shifts, sinks and turns over feet that stay", 1.0, text, 20.0, false},
                       tolerance);
}

}  // namespace dexcheck::cli
