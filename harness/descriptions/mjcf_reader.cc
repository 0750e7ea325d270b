#include "harness/descriptions/mjcf_reader.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/base/files.h"
#include "harness/descriptions/constant_table.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/robot_tree.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

class MjcfDescriptionReader {
 public:
  MjcfDescriptionReader(const mjModel& engine, std::string source)
      : engine_(engine), source_(std::move(source)), other_equalities_(static_cast<int>(engine.neq)) {}

  RobotDescription Read() {
    robot_.format = RobotFormat::kMjcf;
    robot_.spec.name = *engine_.names == '\0' ? source_ : engine_.names;
    robot_.spec.source = source_;
    robot_.spec.gravity = MapVector(engine_.opt.gravity);
    PlaceBase();
    for (int body = 1; body < engine_.nbody; ++body) AddBody(body);
    if (robot_.spec.joints.empty() && floating_ <= 0)
      throw InputError(source_ + ": must have a joint: nothing in it moves");
    FuseParts(&robot_);
    AddSites();
    AddCouplings();
    NoteTheRest();
    return std::move(robot_);
  }

 private:
  /// Place of a body: the joint that moves it (-1 the base) and its frame in that joint's frame i.
  struct Place {
    int joint = -1;
    Pose X_iL = Pose::Identity();
  };

  [[nodiscard]] bool IsBase(int body) const { return engine_.body_weldid[body] == 0; }

  /// A floating robot has the bodies that it carries; another one has all but those that float.
  [[nodiscard]] bool IsOfRobot(int body) const {
    const int root = engine_.body_rootid[body];
    if (floating_ > 0) return root == floating_;
    const int count = engine_.body_jntnum[root];
    return count == 0 || engine_.jnt_type[engine_.body_jntadr[root]] != mjJNT_FREE;
  }

  /// The base's link is the floating body, or the fixed body that everything hangs on; several such bodies
  /// are the world.
  void PlaceBase() {
    places_.resize(static_cast<size_t>(engine_.nbody));
    const RobotTree robot = FindRobotTree(engine_, source_);
    floating_ = robot.floating_body;
    if (!robot.others.empty())
      robot_.notes.push_back("no part of the robot, which has the most joints: " + JoinNames(robot.others));
    if (floating_ > 0) {
      robot_.spec.base.link = NameOf(engine_, mjOBJ_BODY, floating_);
      LetBaseFloat(&robot_);
      return;
    }
    int base = -1;
    for (int body = 1; body < engine_.nbody; ++body) {
      if (engine_.body_jntnum[body] == 0 || !IsBase(engine_.body_parentid[body])) continue;
      const int parent = engine_.body_parentid[body];
      base = base < 0 || base == parent ? parent : 0;
    }
    if (base > 0 && engine_.names[engine_.name_bodyadr[base]] == '\0') base = 0;
    base = std::max(base, 0);
    robot_.spec.base.link = NameOf(engine_, mjOBJ_BODY, base);
    for (int body = base; body > 0; body = engine_.body_parentid[body]) {
      robot_.spec.base.X_B0 =
          ReadPose(engine_.body_pos + 3 * body, engine_.body_quat + 4 * body) * robot_.spec.base.X_B0;
    }
    places_[0].X_iL = robot_.spec.base.X_B0.inverse();
    if (base == 0) places_[0].X_iL.setIdentity();
  }

  void AddBody(int body) {
    if (!IsOfRobot(body)) return;
    const Place& parent = places_[static_cast<size_t>(engine_.body_parentid[body])];
    Place place = {parent.joint,
                   parent.X_iL * ReadPose(engine_.body_pos + 3 * body, engine_.body_quat + 4 * body)};
    const int first = engine_.body_jntadr[body];
    const int count = engine_.body_jntnum[body];
    if (body == floating_) {
      place = Place{};
    } else {
      for (int k = 0; k < count; ++k) place = AddJoint(first + k, k + 1 == count, place);
    }
    places_[static_cast<size_t>(body)] = place;
    if (count == 0 && place.joint >= 0) AddFrame(body, place);
    AddPart(body, place, ReadEngineBody(engine_, body),
            ReadPose(engine_.body_ipos + 3 * body, engine_.body_iquat + 4 * body));
  }

  /// A body that is welded to a link is a frame on it, as a link of a URDF is, unless a site has its name.
  void AddFrame(int body, const Place& place) {
    const char* const name = engine_.names + engine_.name_bodyadr[body];
    if (*name != '\0' && mj_name2id(&engine_, mjOBJ_SITE, name) < 0)
      robot_.spec.frames.push_back({name, place.joint, place.X_iL, {}});
  }

  void AddPart(int body, const Place& place, const MassProperties& mass, const Pose& X_LC) {
    DescribedPart& part = robot_.parts.emplace_back();
    part.name = NameOf(engine_, mjOBJ_BODY, body);
    part.body = mass;
    part.states_inertial = mass.mass > 0.0;
    part.X_LC = X_LC;
    part.joint = place.joint;
    part.X_iL = place.X_iL;
    const int first = engine_.body_geomadr[body];
    for (const bool touching : {true, false}) {
      for (int geom = first; geom >= 0 && geom < first + engine_.body_geomnum[body]; ++geom) {
        if (touching && !CanTouch(engine_, geom)) continue;
        part.shapes.push_back(ReadGeom(geom));
      }
      if (!part.shapes.empty()) return;
    }
  }

  [[nodiscard]] DescribedShape ReadGeom(int geom) const {
    const Vector3d size = MapVector(engine_.geom_size + 3 * geom);
    const Pose X_LG = ReadPose(engine_.geom_pos + 3 * geom, engine_.geom_quat + 4 * geom);
    const auto describe = [&](ShapeKind kind, const Vector3d& half) {
      return DescribeShape(kind, half, X_LG);
    };
    switch (engine_.geom_type[geom]) {
      case mjGEOM_SPHERE:
        return describe(ShapeKind::kEllipsoid, Vector3d::Constant(size[0]));
      case mjGEOM_CAPSULE:
        return describe(ShapeKind::kCapsule, {size[0], size[0], size[0] + size[1]});
      case mjGEOM_CYLINDER:
        return describe(ShapeKind::kCylinder, {size[0], size[0], size[1]});
      case mjGEOM_ELLIPSOID:
        return describe(ShapeKind::kEllipsoid, size);
      case mjGEOM_BOX:
        return describe(ShapeKind::kBox, size);
      default:  // a mesh: around it
        return describe(ShapeKind::kMesh, Vector3d::Constant(engine_.geom_rbound[geom]));
    }
  }

  /// @param place of the body before this joint. @return its place behind it.
  Place AddJoint(int id, bool is_last, const Place& place) {
    const std::string name = NameOf(engine_, mjOBJ_JOINT, id);
    const int type = engine_.jnt_type[id];
    if (type == mjJNT_FREE) {
      throw InputError(source_ + ": joint " + Quote(name) +
                       ": must be a hinge, a slide or a ball, got a free joint");
    }
    const std::string body = NameOf(engine_, mjOBJ_BODY, engine_.jnt_bodyid[id]);
    const Vector3d anchor = MapVector(engine_.jnt_pos + 3 * id);
    const Vector3d axis = MapVector(engine_.jnt_axis + 3 * id).normalized();
    const double reference = engine_.qpos0[engine_.jnt_qposadr[id]];
    DescribedJoint stated;
    Joint joint;
    joint.name = name;
    joint.link = is_last ? body : body + ":" + name;
    joint.parent = place.joint;
    joint.type = type == mjJNT_SLIDE  ? JointType::kPrismatic
                 : type == mjJNT_BALL ? JointType::kBall
                                      : JointType::kRevolute;
    // Frame i: z along the axis, at the anchor; the body stands as the file says at q = reference. A ball's
    // has the body's own axes.
    Pose X_Li = Pose::Identity();
    if (type != mjJNT_BALL && axis != Vector3d::UnitZ()) X_Li.linear() = MakeRotationFromZ(axis);
    X_Li.translation() = anchor;
    stated.X_iL = X_Li.inverse();
    joint.X_PB = place.X_iL * X_Li;
    if (type == mjJNT_HINGE) joint.mdh.q = -reference;
    if (type == mjJNT_SLIDE) joint.mdh.d = -reference;
    const int dof = engine_.jnt_dofadr[id];
    for (const DescribedConstant& constant : ListDescribedConstants())
      joint.*constant.value = (engine_.*constant.engine)[dof];
    stated.states_range = engine_.jnt_limited[id] != 0;
    joint.lower = stated.states_range ? engine_.jnt_range[2 * id] : -kPi;
    joint.upper = stated.states_range ? engine_.jnt_range[2 * id + 1] : kPi;
    if (type == mjJNT_BALL) joint.lower = 0.0;
    stated.forces = ReadForces(id);
    robot_.spec.joints.push_back(joint);
    robot_.joints.push_back(stated);
    joint_ids_.push_back(id);
    return {static_cast<int>(robot_.spec.joints.size()) - 1, stated.X_iL};
  }

  /// Sum of the limits of a joint's motors; none where one of them has no limit.
  [[nodiscard]] std::optional<StatedForces> ReadForces(int joint) const {
    std::optional<StatedForces> sum;
    for (int i = 0; i < engine_.nu; ++i) {
      const int transmission = engine_.actuator_trntype[i];
      if (transmission != mjTRN_JOINT && transmission != mjTRN_JOINTINPARENT) continue;
      if (engine_.actuator_trnid[2 * i] != joint) continue;
      const std::optional<std::pair<double, double>> limits = FindForceLimits(engine_, i);
      if (!limits) return std::nullopt;
      if (!sum) sum.emplace();
      sum->lower += limits->first;
      sum->upper += limits->second;
    }
    return sum;
  }

  void AddSites() {
    for (int site = 0; site < engine_.nsite; ++site) {
      if (engine_.names[engine_.name_siteadr[site]] == '\0') continue;
      if (!IsOfRobot(engine_.site_bodyid[site])) continue;
      const Place& place = places_[static_cast<size_t>(engine_.site_bodyid[site])];
      const Pose X_LF = ReadPose(engine_.site_pos + 3 * site, engine_.site_quat + 4 * site);
      robot_.spec.frames.push_back({NameOf(engine_, mjOBJ_SITE, site), place.joint, place.X_iL * X_LF, {}});
      constexpr double kSamePlace = 1e-9;  // m
      const int tip = FindTipSphere(engine_, site, kSamePlace);
      if (tip >= 0 && CanTouch(engine_, tip))
        robot_.spheres[robot_.spec.frames.size() - 1] = engine_.geom_size[3 * tip];
    }
  }

  /// Couplings of first order; all others are counted.
  void AddCouplings() {
    for (size_t i = 0; i < robot_.joints.size(); ++i) {
      std::optional<JointCoupling> coupling = FindEngineCoupling(engine_, joint_ids_[i]);
      if (!coupling) continue;
      coupling->leader = IndexOf(joint_ids_, coupling->leader);
      if (coupling->leader < 0) continue;
      robot_.spec.joints[i].coupling = coupling;
      --other_equalities_;
    }
  }

  void NoteTheRest() {
    std::vector<std::string> left;
    std::vector<std::string> springs;
    for (int id = 0; id < engine_.njnt; ++id) {
      if (engine_.jnt_stiffness[id] != 0.0) springs.push_back(NameOf(engine_, mjOBJ_JOINT, id));
    }
    if (!springs.empty()) left.push_back("springs of " + JoinNames(springs));
    const auto count = [&](auto number, const std::string& what) {
      if (number > 0) left.push_back(std::to_string(number) + " " + what);
    };
    count(engine_.ntendon, "tendons");
    count(engine_.nu, "actuators");
    count(other_equalities_, "equality constraints");
    if (engine_.opt.density != 0.0 || engine_.opt.viscosity != 0.0) left.emplace_back("a fluid");
    if (!left.empty()) robot_.notes.push_back("not taken over: " + JoinNames(left));
  }

  const mjModel& engine_;
  std::string source_;
  RobotDescription robot_;
  int floating_ = 0;           // the base's body, when it floats
  std::vector<Place> places_;  // by body
  std::vector<int> joint_ids_;
  int other_equalities_;
};

}  // namespace

RobotDescription ReadMjcfDescription(const mjModel& engine, const std::string& source) {
  return MjcfDescriptionReader(engine, source).Read();
}

MassProperties ReadEngineBody(const mjModel& engine, int body) {
  const Matrix3d moments = MapVector(engine.body_inertia + 3 * body).asDiagonal();
  return ExpressIn({engine.body_mass[body], Vector3d::Zero(), moments},
                   ReadPose(engine.body_ipos + 3 * body, engine.body_iquat + 4 * body));
}

std::string ReduceToMechanism(const MjcfFile& mjcf) {
  MjcfFile reduced(mjcf.PrintFor(CurrentFolder()), mjcf.source());
  tinyxml2::XMLElement* const root = reduced.root();
  constexpr std::string_view kKept[] = {"compiler", "option",    "size",    "default",
                                        "asset",    "worldbody", "equality"};
  bool uses_geoms = false;
  for (tinyxml2::XMLElement* child : ListChildren(root)) {
    const std::string_view name = child->Name();
    if (name == "compiler") uses_geoms = uses_geoms || ReadAttribute(*child, "inertiafromgeom") == "true";
    if (!Contains(kKept, name)) root->DeleteChild(child);
  }
  DeleteInSections(root, {"equality"}, [](const tinyxml2::XMLElement& child) {
    return std::string_view(child.Name()) != "joint";
  });
  bool has_mesh = false;
  for (tinyxml2::XMLElement* world : ListChildren(root, "worldbody")) {
    VisitElements(world, [&](tinyxml2::XMLElement* body) {
      const bool is_world = body == world;
      if (!is_world && std::string_view(body->Name()) != "body") return;
      const bool drops_geoms = is_world || (!uses_geoms && body->FirstChildElement("inertial") != nullptr);
      for (tinyxml2::XMLElement* child : ListChildren(body)) {
        const std::string_view name = child->Name();
        if (name == "camera" || name == "light" || (drops_geoms && name == "geom")) {
          body->DeleteChild(child);
        } else if (name == "geom") {
          has_mesh = true;
        }
      }
    });
  }
  VisitElements(root, [&](tinyxml2::XMLElement* element) {
    element->DeleteAttribute("material");
    element->DeleteAttribute("rgba");
  });
  DeleteInSections(root, {"asset"}, [&](const tinyxml2::XMLElement& child) {
    return !has_mesh || std::string_view(child.Name()) != "mesh";
  });
  return reduced.Print();
}

}  // namespace dexcheck
