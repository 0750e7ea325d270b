#include "harness/scenario/stand.h"

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
#include "controller/control/stance.h"
#include "controller/dynamics/model_terms.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

/// A place that may be a foot.
struct Place {
  Foot foot;
  Vector3d p_W;  ///< The lowest point there, m, with the base level at the origin.
};

/// Places of a geom that can touch a plane, in its own frame.
std::vector<Vector3d> ListPlaces(const mjModel& m, int geom) {
  const Vector3d size = MapVector(m.geom_size + 3 * geom);
  std::vector<Vector3d> places;
  if (m.geom_type[geom] == mjGEOM_SPHERE) places = {Vector3d::Zero()};
  if (m.geom_type[geom] == mjGEOM_CAPSULE)
    places = {size[1] * Vector3d::UnitZ(), -size[1] * Vector3d::UnitZ()};
  for (int k = 0; m.geom_type[geom] == mjGEOM_BOX && k < 8; ++k)
    places.emplace_back(size.cwiseProduct(Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  return places;
}

/// All places of the robot's geoms that can touch, by body.
std::map<int, std::vector<Place>> ListPlaces(const mjModel& m, const mjData& data, int base) {
  std::map<int, std::vector<Place>> places;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    const int body = m.geom_bodyid[geom];
    if (m.body_rootid[body] != base || !CanTouch(m, geom)) continue;
    const double radius = m.geom_type[geom] == mjGEOM_BOX ? 0.0 : m.geom_size[3 * geom];
    const Pose X_body = ReadPose(m.geom_pos + 3 * geom, m.geom_quat + 4 * geom);
    const Pose X_W = BodyPose(data, body);
    for (const Vector3d& p : ListPlaces(m, geom)) {
      const Vector3d p_body = X_body * p;
      places[body].push_back({{"", geom, p_body, radius}, X_W * p_body - radius * Vector3d::UnitZ()});
    }
  }
  return places;
}

/// The outermost of one body's places that lie in a plane, four at the most.
std::vector<Place> KeepOutermost(const std::vector<Place>& places) {
  constexpr double kFlat = 1e-6, kApart = 0.02;  // m; a smaller sole is a point
  std::vector<Place> kept;
  const auto from_first = [&](const Place& place) { return Vector3d(place.p_W - kept[0].p_W); };
  for (const Vector3d& way : {Vector3d(1, 1, -1), {-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}}) {
    const Place& outermost =
        *std::ranges::max_element(places, {}, [&](const Place& place) { return way.dot(place.p_W); });
    const auto is_same = [&](const Place& place) { return (place.p_W - outermost.p_W).norm() < kApart; };
    if (std::ranges::any_of(kept, is_same)) continue;
    const bool is_in_plane =
        kept.size() < 3 ||
        std::abs(from_first(kept[1]).cross(from_first(kept[2])).normalized().dot(from_first(outermost))) <
            kFlat;
    if (is_in_plane) kept.push_back(outermost);
  }
  return kept;
}

/// The element of a body.
XMLElement* FindBody(const mjModel& m, int body, MjcfFile* mjcf) {
  XMLElement* found = nullptr;
  for (XMLElement* element : ListElements(mjcf->root(), "body"))
    if (ReadAttribute(*element, "name") == NameOf(m, mjOBJ_BODY, body)) found = element;
  if (found == nullptr) throw InputError(mjcf->source() + ": a body that is a foot must have a name");
  return found;
}

/// Gives a geom of a body a name in its file. The engine keeps the order of a body's geoms.
std::string NameGeom(const mjModel& m, int geom, XMLElement* body) {
  XMLElement* const own =
      ListChildren(body, "geom").at(static_cast<size_t>(geom - m.body_geomadr[m.geom_bodyid[geom]]));
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
  SetAttributes({{"name", kFloor}, {"type", "plane"}, {"size", "0 0 1"}}, geom);
  return kFloor;
}

}  // namespace

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
  const std::map<int, std::vector<Place>> places = ListPlaces(m, *data, base);
  std::map<int, double> lowest_of;  // by body
  double lowest = std::numeric_limits<double>::infinity();
  for (const auto& [body, own] : places) {
    lowest_of[body] = std::ranges::min(own, {}, [](const Place& place) { return place.p_W.z(); }).p_W.z();
    lowest = std::min(lowest, lowest_of[body]);
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
    std::ranges::copy_if(places.at(body), std::back_inserter(low),
                         [level = own + kFlat](const Place& place) { return place.p_W.z() <= level; });
    for (Place& place : KeepOutermost(low)) {
      place.foot.frame = fmt::format("foot_{}", stand.feet.size() + 1);
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
    XMLElement* const body = FindBody(m, m.geom_bodyid[foot.geom], mjcf);
    geoms.insert(NameGeom(m, foot.geom, body));
    bodies.insert(ReadAttribute(*body, "name"));
    SetAttributes({{"name", foot.frame},
                   {"pos", fmt::format("{} {} {}", FormatNumber(foot.p_body[0]), FormatNumber(foot.p_body[1]),
                                       FormatNumber(foot.p_body[2]))}},
                  body->InsertNewChildElement("site"));
  }
  SetAttributes({{"timestep", "0.001"},
                 {"integrator", "Euler"},
                 {"cone", "elliptic"},
                 {"impratio", "100"},
                 {"collision", "predefined"}},
                RequireSection(mjcf->root(), "option"));
  const std::string floor = RequireFloor(m, mjcf);
  XMLElement* const contact = RequireSection(mjcf->root(), "contact");
  for (XMLElement* pair : ListChildren(contact, "pair")) contact->DeleteChild(pair);
  // Other parts of a foot are not judged by their distance from the ground.
  for (const std::string& body : bodies)
    SetAttributes({{"body1", "world"}, {"body2", body}}, contact->InsertNewChildElement("exclude"));
  for (const std::string& geom : geoms)
    SetAttributes({{"geom1", floor},
                   {"geom2", geom},
                   {"condim", "3"},
                   {"solref", "0.002 1"},
                   {"solimp", "0.99 0.99 0.001 0.5 2"},
                   {"friction", "0.8 0.8 0.005 0.0001 0.0001"}},
                  contact->InsertNewChildElement("pair"));
}

void AddFeet(const Stand& stand, RobotDescription* robot) {
  for (const Foot& foot : stand.feet) {
    for (Frame& frame : robot->spec.frames) {
      if (frame.name == foot.frame && foot.radius > 0.0) frame.sphere_radius = foot.radius;
    }
  }
}

namespace {

/// How the base sways: down by 3 % of its height, turned by 2 degrees, and swinging by a third of that.
struct Sway {
  std::vector<JointWayPoint> points;
  std::vector<JointOscillation> swings;  ///< By axis.
};

Sway ListWay(const Stand& stand) {
  const double way = 0.03 * stand.height * stand.sway, turn = kPi / 90.0 * stand.sway;
  Sway sway{.points = {{2.0, VectorXd::Zero(6)}, {4.0, VectorXd::Zero(6)}}};
  sway.points[0].q << way, 0.0, -way, 0.0, turn, 0.0;
  sway.points[1].q << 0.0, way, -way, turn, 0.0, turn;
  constexpr double kSwing = 1.0 / 3.0;  // of the way
  for (int axis = 0; axis < 6; ++axis)
    AddSwings(axis, kSwing * (axis < 3 ? way : turn), static_cast<size_t>(axis), &sway.swings);
  return sway;
}

/// Follows a robot that stands: whether it can, and what it asks of its motors.
class StandTrial {
 public:
  StandTrial(const RobotModel& model, const std::map<std::string, double>& limits, const Stand& stand)
      : model_(model), terms_(model), joints_(model.num_joints()), limits_(limits) {
    for (const Foot& foot : stand.feet) stance_.feet.push_back(model.FindFrame(foot.frame));
    stance_.mu = 0.45;  // less than the scenario's
    // The engine shares a sole's load among its corners evenly, not as the law asks: with a quarter of its
    // share each, no corner of six humanoids lifts.
    stance_.f_min = 0.25 * stand.weight / static_cast<double>(stand.feet.size());
    stance_.f_max = stand.weight;
  }

  /// Puts the feet on the ground, and then, with the base lower by `sink`, the centre of mass over them.
  [[nodiscard]] bool Settle(double sink, VectorXd* q) {
    GroundContacts ground(model_, stance_.feet);
    (*q)[3] = 1.0;
    SetAtRest(*q);
    ground.SetState(terms_);
    (*q)[2] = -ground.gap().mean();
    if (!(PutFeetDown(model_, stance_, q) < 1e-9)) return false;
    for (int k = 0; sink > 0.0 && k < 4; ++k) {
      SetAtRest(*q);
      ground.SetState(terms_);
      VectorXd way = -terms_.CalcEnergyAndMomentum().com;
      for (int i = 0; i < ground.count(); ++i) way += ground.X_WF(i).translation() / ground.count();
      way.conservativeResizeLike(VectorXd::Zero(6));
      way[2] = k == 0 ? -sink : 0.0;
      DesiredJoints next;
      StanceMotion(model_, stance_, *q, JointMotion(way, {}, {})).Evaluate(0.0, &next);
      *q = next.q;
    }
    return true;
  }

  /// Whether the robot can sway from there as the scenario says, its joints well within their ranges.
  [[nodiscard]] bool Sways(const VectorXd& q, Stand* stand) {
    stand->poses.clear();
    stand->weak.clear();
    StanceForces forces(model_, stance_);
    const Sway sway = ListWay(*stand);
    const StanceMotion motion(model_, stance_, q, JointMotion(VectorXd::Zero(6), sway.points, sway.swings));
    GroundContacts ground(model_, stance_.feet);
    DesiredJoints desired;
    constexpr int kSamples = 64;
    constexpr double kStays = 1e-9;  // m, m/s, of feet
    for (int k = 0; k <= kSamples; ++k) {
      motion.Evaluate(4.0 * k / kSamples, &desired);
      if (!desired.q.allFinite() || !IsInRange(desired.q)) return false;
      terms_.SetState(desired.q, desired.q_dot);
      terms_.CalcDynamics();
      // Legs with too few joints cannot move the base in all ways.
      ground.SetState(terms_);
      const double rate = (ground.J() * desired.q_dot).lpNorm<Eigen::Infinity>();
      if (!(std::max(rate, ground.gap().lpNorm<Eigen::Infinity>()) < kStays)) return false;
      VectorXd force = CalcForce(terms_, desired);
      try {
        forces.TakeOff(terms_, force);
      } catch (const Error&) {  // outside the cones, or feet in one line
        return false;
      }
      Note(desired.q.tail(joints_), force.tail(joints_), stand);
    }
    return true;
  }

 private:
  void SetAtRest(const VectorXd& q) {
    terms_.SetState(q, VectorXd::Zero(model_.num_velocities()));
    terms_.CalcDynamics();
  }

  [[nodiscard]] bool IsInRange(const VectorXd& q) const {
    for (int i = 0; i < joints_; ++i) {
      const double at = q[q.size() - joints_ + i];
      if (at < model_.joint(i).lower || at > model_.joint(i).upper) return false;
    }
    return true;
  }

  void Note(const VectorXd& q, const VectorXd& force, Stand* stand) const {
    JointPositions& pose = stand->poses.emplace_back();
    for (int i = 0; i < joints_; ++i) {
      const std::string& name = model_.joint(i).name;
      pose[name] = q[i];
      const auto limit = limits_.find(name);
      const bool is_weak = limit != limits_.end() && std::abs(force[i]) > 0.9 * limit->second;
      if (is_weak && std::ranges::find(stand->weak, name) == stand->weak.end()) stand->weak.push_back(name);
    }
  }

  const RobotModel& model_;
  ModelTerms terms_;
  int joints_;
  const std::map<std::string, double>& limits_;
  Stance stance_;
};

}  // namespace

std::string FindPosture(const RobotModel& model, const std::map<std::string, double>& limits, Stand* stand) {
  if (stand->feet.size() < 3) return fmt::format("{} places touch the ground", stand->feet.size());
  StandTrial trial(model, limits, *stand);
  bool settles = false;
  // Fractions of the way to the middle of a joint's range, which bends a knee as it can be bent.
  for (const double bend : {0.0, 0.1, 0.2, 0.3, 0.45, 0.6}) {
    VectorXd q = VectorXd::Zero(model.num_positions());
    for (int i = 0; i < model.num_joints(); ++i) {
      const Joint& joint = model.joint(i);
      // Rounding to the digits printed would put an end of the range outside.
      const double margin = 0.01 * (joint.upper - joint.lower);
      const double at = std::clamp(stand->pose[joint.name], joint.lower + margin, joint.upper - margin);
      q[q.size() - model.num_joints() + i] = (1.0 - bend) * at + 0.5 * bend * (joint.lower + joint.upper);
    }
    if (!trial.Settle(0.1 * bend * stand->height, &q)) continue;
    settles = true;
    for (stand->sway = 1.0; stand->sway > 0.2; stand->sway *= 0.5) {
      if (!trial.Sways(q, stand)) continue;
      for (int i = 0; i < model.num_joints(); ++i)
        stand->pose[model.joint(i).name] = q[q.size() - model.num_joints() + i];
      return "";
    }
  }
  if (!settles) return "its feet do not all reach the ground";
  return "in no posture that was tried it sways within its joints' ranges and the ground's friction cones";
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
      start, feet, FormatNumber(0.01 * stand.weight / static_cast<double>(stand.feet.size()), 2),
      FormatNumber(std::ceil(stand.weight)), points, WriteSwings(sway.swings, "axis", [](int axis) {
        return std::string(std::array{"x", "y", "z", "roll", "pitch", "yaw"}[static_cast<size_t>(axis)]);
      }));
  return WriteScenario(robot,
                       {"The robot stands on its feet and sways over them",
                        "the base shifts, sinks and turns over feet that stay", 1.0, text, 20.0, false},
                       tolerance);
}

}  // namespace dexcheck
