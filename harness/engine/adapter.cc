#include "harness/engine/adapter.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/robot_tree.h"

namespace dexcheck {
namespace {

/// Returns the body that carries the joints which move `body`: itself, or the one it is welded to.
int MovingBody(const mjModel& engine, int body) { return engine.body_weldid[body]; }

bool IsRound(int geom_type) {
  return geom_type == mjGEOM_SPHERE || geom_type == mjGEOM_CYLINDER || geom_type == mjGEOM_CAPSULE ||
         geom_type == mjGEOM_ELLIPSOID;
}

/// Returns the radius that a body rolls on: of its round geoms that can touch something, or of all if none
/// can.
double CalcRollingRadius(const mjModel& engine, int body) {
  double touching = 0.0;
  double any = 0.0;
  for (int geom = 0; geom < engine.ngeom; ++geom) {
    if (engine.geom_bodyid[geom] != body || !IsRound(engine.geom_type[geom])) continue;
    const double radius = engine.geom_size[3 * geom];
    any = std::max(any, radius);
    if (CanTouch(engine, geom)) touching = std::max(touching, radius);
  }
  return touching > 0.0 ? touching : any;
}

constexpr int kNoBody = -1;

/// Types of the engine's joints by JointType.
constexpr std::array<std::pair<mjtJoint, const char*>, 3> kJointKinds = {
    {{mjJNT_HINGE, "hinge"}, {mjJNT_SLIDE, "slide"}, {mjJNT_BALL, "ball"}}};

/// Whether another joint of the same body stands between this one and the body.
bool HasJointBehind(const mjModel& engine, int joint) {
  const int body = engine.jnt_bodyid[joint];
  return joint + 1 < engine.body_jntadr[body] + engine.body_jntnum[body];
}

/// Returns the body of a joint's link: by name, or by the joint when the MJCF gives the body none. Only the
/// last of several joints of one body moves it; the others' links have no body.
template <typename Need>
int FindLinkBody(const mjModel& engine, const Joint& joint, int joint_id, const Need& need) {
  if (joint_id >= 0) {
    if (HasJointBehind(engine, joint_id)) return kNoBody;
    const int body = engine.jnt_bodyid[joint_id];
    if (engine.names[engine.name_bodyadr[body]] == '\0') return body;
  }
  return need(mjOBJ_BODY, "body", joint.link);
}

/// Lists the wheels' and base's joints of an MJCF, known by name or place; all others must be in the
/// parameters.
std::set<int> ListBaseJoints(const RobotModel& model, const mjModel& engine) {
  std::set<int> joints;
  const auto add_joints_of = [&](const std::string& body_name) {
    const int body = FindByName(engine, mjOBJ_BODY, body_name);
    if (body < 0) return;
    for (int k = 0; k < engine.body_jntnum[body]; ++k) joints.insert(engine.body_jntadr[body] + k);
  };
  if (model.base().type != BaseType::kFixed) add_joints_of(model.base().link);
  if (model.object()) add_joints_of(model.object()->name);
  if (model.base().type == BaseType::kDifferentialDrive) {
    for (const std::string& name : {model.base().wheel_joint_right, model.base().wheel_joint_left}) {
      joints.insert(FindByName(engine, mjOBJ_JOINT, name));
    }
  }
  return joints;
}

}  // namespace

Adapter::Adapter(const RobotModel& model, const mjModel& engine, const std::string& engine_source)
    : model_(&model), engine_(&engine) {
  MatchJoints(engine_source);
  MatchBase(engine_source);
}

void Adapter::MatchJoints(const std::string& engine_source) {
  const mjModel& engine = *engine_;
  const auto fail = [&](const std::string& problem) { throw InputError(engine_source + ": " + problem); };

  // The missing parts of either description are listed first, in one line.
  std::vector<std::string> only_in_model;
  std::set<int> known = ListBaseJoints(*model_, engine);
  const auto need = [&](mjtObj type, const std::string& kind, const std::string& name) {
    const int id = FindByName(engine, type, name);
    if (id < 0) only_in_model.push_back(kind + " " + Quote(name));
    return id;
  };
  link_bodies_.push_back(need(mjOBJ_BODY, "body", model_->base().link));
  if (model_->base().type == BaseType::kDifferentialDrive) {
    need(mjOBJ_JOINT, "wheel joint", model_->base().wheel_joint_right);
    need(mjOBJ_JOINT, "wheel joint", model_->base().wheel_joint_left);
  }
  for (const Joint& joint : model_->joints()) {
    joint_ids_.push_back(need(mjOBJ_JOINT, "joint", joint.name));
    link_bodies_.push_back(FindLinkBody(engine, joint, joint_ids_.back(), need));
    known.insert(joint_ids_.back());
  }
  for (const Frame& frame : model_->frames()) {
    int body = link_bodies_[static_cast<size_t>(frame.link + 1)];
    if (frame.name != model_->link_name(frame.link))
      body = frame.sphere_radius ? -1 : FindByName(engine, mjOBJ_BODY, frame.name);
    const int site = body >= 0 ? mj_name2id(&engine, mjOBJ_SITE, frame.name.c_str())
                               : need(mjOBJ_SITE, "site", frame.name);
    frame_sites_.push_back(site);
    frame_bodies_.push_back(site >= 0 ? engine.site_bodyid[site] : body);
  }
  if (model_->object()) object_body_ = need(mjOBJ_BODY, "body", model_->object()->name);
  if (object_body_ >= 0 && engine.body_jntnum[object_body_] > 0) {
    object_qpos_ = engine.jnt_qposadr[engine.body_jntadr[object_body_]];
    object_dof_ = engine.jnt_dofadr[engine.body_jntadr[object_body_]];
  }
  std::vector<std::string> only_in_engine;
  const BaseType base = model_->base().type;
  const std::set<int> trees = FindTrees();
  for (int id = 0; id < engine.njnt; ++id) {
    if (known.contains(id)) continue;
    const bool may_stand_apart = base == BaseType::kFixed || base == BaseType::kFloating;
    if (may_stand_apart && !trees.empty() && !trees.contains(FindTree(engine, id))) {
      other_joints_.push_back(id);
      continue;
    }
    only_in_engine.push_back("joint " + Quote(NameOf(engine, mjOBJ_JOINT, id)));
  }
  if (!only_in_model.empty() || !only_in_engine.empty()) {
    std::string problem = "does not match " + model_->spec().source;
    if (!only_in_model.empty()) problem += "; only in the parameters: " + JoinNames(only_in_model);
    if (!only_in_engine.empty()) problem += "; only in the MJCF: " + JoinNames(only_in_engine);
    fail(problem);
  }

  // Each joint must have one kind, move the link of one name, and hang on the same parent.
  for (int i = 0; i < model_->num_joints(); ++i) {
    const Joint& joint = model_->joint(i);
    const int id = joint_ids_[static_cast<size_t>(i)];
    const int body = engine.jnt_bodyid[id];
    const std::string key = "joint " + Quote(joint.name) + ": ";
    const auto& [kind, kind_name] = kJointKinds.at(static_cast<size_t>(joint.type));
    if (engine.jnt_type[id] != kind)
      fail(key + "must be a " + kind_name + " (" + NameOf(joint.type) + " in the parameters)");
    const int link_body = link_bodies_[static_cast<size_t>(i + 1)];
    if (link_body != kNoBody && body != link_body) {
      fail(key + "must move body " + Quote(joint.link) + ", moves " +
           Quote(NameOf(engine, mjOBJ_BODY, body)));
    }
    for (int k = 0; k < CountVelocities(joint.type); ++k) joint_dofs_.push_back(engine.jnt_dofadr[id] + k);
    joint_qpos_.push_back(engine.jnt_qposadr[id]);
    if (id > engine.body_jntadr[body]) {
      if (joint.parent >= 0 && joint_ids_[static_cast<size_t>(joint.parent)] == id - 1) continue;
      fail(key + "must come after joint " + Quote(NameOf(engine, mjOBJ_JOINT, id - 1)) +
           " of the same body, comes after link " + Quote(model_->link_name(joint.parent)));
    }
    const int parent = MovingBody(engine, engine.body_parentid[body]);
    if (link_bodies_[static_cast<size_t>(joint.parent + 1)] == kNoBody) {
      fail(key + "must hang on body " + Quote(NameOf(engine, mjOBJ_BODY, parent)) + ", hangs on link " +
           Quote(model_->link_name(joint.parent)) + ", which has none");
    }
    const int expected = MovingBody(engine, link_bodies_[static_cast<size_t>(joint.parent + 1)]);
    if (parent != expected) {
      fail(key + "must hang on body " + Quote(model_->link_name(joint.parent)) + ", hangs on " +
           Quote(NameOf(engine, mjOBJ_BODY, parent)));
    }
  }
}

std::set<int> Adapter::FindTrees() const {
  std::set<int> trees;
  for (const int joint : joint_ids_) {
    if (joint >= 0) trees.insert(FindTree(*engine_, joint));
  }
  const bool floats = model_->base().type == BaseType::kFloating;
  if (floats && link_bodies_[0] > 0) trees.insert(engine_->body_rootid[link_bodies_[0]]);
  return trees;
}

void Adapter::MatchBase(const std::string& engine_source) {
  const mjModel& engine = *engine_;
  const int body = link_bodies_[0];
  const std::string key = "body " + Quote(model_->base().link) + ": ";
  const auto fail = [&](const std::string& problem) {
    throw InputError(engine_source + ": " + key + problem);
  };

  welded_bodies_.resize(link_bodies_.size());
  for (int b = 1; b < engine.nbody; ++b) {
    for (size_t link = 0; link < link_bodies_.size(); ++link) {
      if (link_bodies_[link] == kNoBody) continue;
      const bool is_world = MovingBody(engine, link_bodies_[link]) == 0;
      if (!is_world && MovingBody(engine, b) == link_bodies_[link]) welded_bodies_[link].push_back(b);
    }
  }

  if (model_->base().type == BaseType::kFixed) {
    if (MovingBody(engine, body) != 0) fail("must be fixed to the world (base.type is \"fixed\")");
    return;
  }
  const int first = engine.body_jntadr[body];
  const int count = engine.body_jntnum[body];
  for (int k = 0; k < count; ++k) base_joints_.push_back(first + k);
  base_is_free_ = count == 1 && engine.jnt_type[first] == mjJNT_FREE;
  const bool planar = count == 3 && engine.jnt_type[first] == mjJNT_SLIDE &&
                      engine.jnt_type[first + 1] == mjJNT_SLIDE && engine.jnt_type[first + 2] == mjJNT_HINGE;
  if (model_->base().type == BaseType::kFloating) {
    if (!base_is_free_) fail("must move by a free joint (base.type is \"floating\")");
    return;
  }
  if (!base_is_free_ && !planar) fail("must move by a free joint, or by two slides and a hinge");

  const MjDataPtr data = MakeDataWithoutContacts(engine);
  mj_kinematics(&engine, data.get());
  const Pose& X_B0 = model_->base().X_B0;
  if (base_is_free_) {
    X_0b_ = X_B0.inverse() * BodyPose(*data, body);
  } else {
    reference_anchor_ = MapVector(data->xanchor + 3 * (first + 2));
    X_0b_ = X_B0.inverse() * Eigen::Translation3d(reference_anchor_);
    for (size_t k = 0; k < 2; ++k) slide_axes_[k] = MapVector(data->xaxis + 3 * base_joints_[k]);
    const Vector3d hinge = MapVector(data->xaxis + 3 * (first + 2));
    hinge_sign_ = hinge.z() < 0.0 ? -1.0 : 1.0;
    constexpr double kRounding = 1e-12;  // unit vectors from a normalised quaternion
    const double skew = std::abs(slide_axes_[0].dot(slide_axes_[1])) + std::abs(slide_axes_[0].z()) +
                        std::abs(slide_axes_[1].z()) + hinge.head<2>().norm();
    if (skew > kRounding) fail("its slides must be horizontal and square, its hinge vertical");
  }
  if (model_->base().type == BaseType::kDifferentialDrive) MatchWheels(*data, engine_source);
}

void Adapter::MatchWheels(const mjData& reference, const std::string& engine_source) {
  for (const std::string& name : {model_->base().wheel_joint_right, model_->base().wheel_joint_left}) {
    const std::string key = engine_source + ": wheel joint " + Quote(name) + ": ";
    EngineWheel wheel;
    wheel.joint = FindByName(*engine_, mjOBJ_JOINT, name);
    const int body = engine_->jnt_bodyid[wheel.joint];
    if (engine_->jnt_type[wheel.joint] != mjJNT_HINGE ||
        MovingBody(*engine_, engine_->body_parentid[body]) != link_bodies_[0]) {
      throw InputError(key + "must be a hinge on body " + Quote(model_->base().link));
    }
    wheel.dof = engine_->jnt_dofadr[wheel.joint];
    wheel.radius = CalcRollingRadius(*engine_, body);
    if (wheel.radius <= 0.0) throw InputError(key + "its body needs a round geom");
    wheel.center = model_->base().X_B0.inverse() * MapVector(reference.xanchor + 3 * wheel.joint);
    wheel.axis = MapVector(reference.xaxis + 3 * wheel.joint);
    for (int b = 1; b < engine_->nbody; ++b) {
      if (MovingBody(*engine_, b) == body) welded_bodies_[0].push_back(b);
    }
    wheels_.push_back(wheel);
  }
}

void Adapter::CalcBaseRates(const Vector3d& anchor_velocity, double yaw_rate,
                            Eigen::Ref<VectorXd> rates) const {
  if (base_joints_.empty()) return;
  if (base_is_free_) {
    // The free joint's angular velocity is in the body's own axes, which yaw does not change.
    rates.head<3>() = anchor_velocity;
    rates.tail<3>() = yaw_rate * X_0b_.linear().row(2).transpose();
    return;
  }
  for (int k = 0; k < 2; ++k) rates[k] = slide_axes_[static_cast<size_t>(k)].dot(anchor_velocity);
  rates[2] = hinge_sign_ * yaw_rate;
}

void Adapter::SetPositions(const Eigen::Ref<const VectorXd>& q, mjtNum* qpos) const {
  for (size_t i = 0; i < joint_qpos_.size(); ++i) {
    const Joint& joint = model_->joints()[i];
    const int at = model_->position_index(static_cast<int>(i));
    if (joint.type != JointType::kBall) {
      qpos[joint_qpos_[i]] = q[at];
    } else {
      mju_copy4(qpos + joint_qpos_[i], q.data() + at);
      mju_normalize4(qpos + joint_qpos_[i]);
    }
  }
  if (base_joints_.empty()) return;

  if (model_->base().type == BaseType::kFloating) {
    mjtNum* const pose = qpos + engine_->jnt_qposadr[base_joints_[0]];
    mju_copy3(pose, q.data());
    mju_copy4(pose + 3, q.data() + 3);
    mju_normalize4(pose + 3);
    return;
  }
  // Sigma_0 moves over the floor and yaws, the joints' anchor with it.
  const Vector3d origin = model_->base().X_B0.translation() + Vector3d(q[0], q[1], 0.0);
  const Pose X_WA = Eigen::Translation3d(origin) * Eigen::AngleAxisd(q[2], Vector3d::UnitZ()) * X_0b_;
  if (base_is_free_) {
    WriteFreePose(X_WA, qpos + engine_->jnt_qposadr[base_joints_[0]]);
  } else {
    const Vector3d displacement = X_WA.translation() - reference_anchor_;
    const double rates[3] = {slide_axes_[0].dot(displacement), slide_axes_[1].dot(displacement),
                             hinge_sign_ * q[2]};
    for (size_t k = 0; k < 3; ++k) {
      const int address = engine_->jnt_qposadr[base_joints_[k]];
      qpos[address] = engine_->qpos0[address] + rates[k];
    }
  }
  for (const EngineWheel& wheel : wheels_) qpos[engine_->jnt_qposadr[wheel.joint]] = 0.0;
}

Pose Adapter::GetBasePose(const mjtNum* qpos) const {
  if (base_is_free_) {
    return ReadFreePose(qpos + engine_->jnt_qposadr[base_joints_[0]]) * X_0b_.inverse();
  }
  Pose X_W0 = model_->base().X_B0;
  if (base_joints_.empty()) return X_W0;
  Vector3d anchor = reference_anchor_;
  for (size_t k = 0; k < 2; ++k) {
    const int address = engine_->jnt_qposadr[base_joints_[k]];
    anchor += (qpos[address] - engine_->qpos0[address]) * slide_axes_[k];
  }
  X_W0.linear() = Eigen::AngleAxisd(GetHingeYaw(qpos), Vector3d::UnitZ()).toRotationMatrix();
  X_W0.translation() = anchor - X_W0.linear() * X_0b_.translation();
  return X_W0;
}

int Adapter::RequireTipGeom(int frame) const {
  const int geom = FindTipSphere(*engine_, frame_sites_[static_cast<size_t>(frame)]);
  if (geom >= 0 && CanTouch(*engine_, geom)) return geom;
  throw InputError("MJCF: fingertip " + Quote(model_->frame(frame).name) +
                   ": its body needs a sphere that can touch");
}

void Adapter::GetPositions(const mjtNum* qpos, Eigen::Ref<VectorXd> q) const {
  for (size_t i = 0; i < joint_qpos_.size(); ++i) {
    const int count = CountPositions(model_->joints()[i].type);
    mju_copy(q.data() + model_->position_index(static_cast<int>(i)), qpos + joint_qpos_[i], count);
  }
  if (base_joints_.empty()) return;

  if (model_->base().type == BaseType::kFloating) {
    mju_copy(q.data(), qpos + engine_->jnt_qposadr[base_joints_[0]], 7);
    return;
  }
  const Pose X_W0 = GetBasePose(qpos);
  q.head<2>() = (X_W0.translation() - model_->base().X_B0.translation()).head<2>();
  q[2] = base_is_free_ ? std::atan2(X_W0.linear()(1, 0), X_W0.linear()(0, 0)) : GetHingeYaw(qpos);
}

double Adapter::GetHingeYaw(const mjtNum* qpos) const {
  const int address = engine_->jnt_qposadr[base_joints_[2]];
  return hinge_sign_ * (qpos[address] - engine_->qpos0[address]);
}

void Adapter::GetBaseMotion(const mjtNum* qpos, const mjtNum* rates, Vector3d* linear,
                            Vector3d* angular) const {
  linear->setZero();
  angular->setZero();
  if (base_joints_.empty()) return;
  const mjtNum* const own = rates + engine_->jnt_dofadr[base_joints_[0]];
  if (base_is_free_) {
    // The free joint's angular velocity is in the body's own axes.
    const mjtNum* const pose = qpos + engine_->jnt_qposadr[base_joints_[0]];
    const Eigen::Quaterniond rotation(pose[3], pose[4], pose[5], pose[6]);
    *linear = MapVector(own);
    *angular = rotation.normalized() * MapVector(own + 3);
    return;
  }
  *linear = own[0] * slide_axes_[0] + own[1] * slide_axes_[1];
  angular->z() = hinge_sign_ * own[2];
}

}  // namespace dexcheck
