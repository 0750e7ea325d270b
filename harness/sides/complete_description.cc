#include "harness/sides/complete_description.h"

#include <algorithm>
#include <functional>

#include "controller/common/text.h"
#include "harness/engine/engine.h"
#include "harness/engine/robot_tree.h"
#include "harness/sides/alike_names.h"
#include "harness/sides/join_names.h"
#include "harness/sides/mjcf_reader.h"

namespace dexcheck {
namespace {

/// Takes over from an engine's model.
class EngineCompletion {
 public:
  EngineCompletion(const mjModel& engine, std::string engine_source, RobotDescription* robot)
      : engine_(engine), engine_source_(std::move(engine_source)), robot_(*robot) {}

  Completion Run() {
    TakeNamesOfJoints();
    TakeBase();
    TakeGravity();
    TakeNames();
    TakeJointConstants();
    DropFrames();
    return std::move(result_);
  }

 private:
  [[nodiscard]] int FindEngineJoint(const Joint& joint) const {
    return FindByName(engine_, mjOBJ_JOINT, NameInFile(joint));
  }

  void TakeNamesOfJoints() {
    std::vector<std::string> names;
    for (int id = 0; id < engine_.njnt; ++id) {
      const int type = engine_.jnt_type[id];
      Joint joint;
      joint.name = NameOf(engine_, mjOBJ_JOINT, id);
      for (int axis = 0; type == mjJNT_BALL && axis < 3; ++axis)
        names.push_back(MakeBallEntry(joint, axis, -1).name);
      if (type == mjJNT_HINGE || type == mjJNT_SLIDE) names.push_back(joint.name);
    }
    result_.notes = TakeJointNames(names, engine_source_, &robot_);
  }

  /// A base that the file does not state floats if the engine's does, in the frame of the body of one name.
  void TakeBase() {
    const int body = FindRobotTree(engine_, engine_source_).floating_body;
    if (body == 0) return;
    if (!robot_.states_base) {
      LetBaseFloat(&robot_);
      result_.notes.push_back("base: " + robot_.spec.source +
                              " does not say how its root moves; it floats as in " + engine_source_);
    }
    if (robot_.spec.base.type != BaseType::kFloating) return;
    const std::string name = engine_.names + engine_.name_bodyadr[body];
    if (MoveBaseTo(name, &robot_)) return;
    result_.notes.push_back("links by other names: " + Quote(robot_.spec.base.link) + " is " + Quote(name));
    robot_.spec.base.link = name;
  }

  void TakeGravity() {
    if (robot_.states_gravity) return;
    for (int k = 0; k < 3; ++k) robot_.spec.gravity[k] = engine_.opt.gravity[k];
    result_.unstated.emplace_back("gravity_vector");
    result_.notes.push_back("gravity: only " + engine_source_ + " states it, " +
                            FormatNumbers(robot_.spec.gravity));
  }

  /// Whether the base carries the joint; of a ball, its first entry hangs there.
  [[nodiscard]] bool IsOnBase(const Joint& joint) const {
    int parent = joint.parent;
    if (joint.type == JointType::kBall) parent = FirstOfBall(joint).parent;
    return parent < 0;
  }
  [[nodiscard]] const Joint& FirstOfBall(const Joint& last) const { return *(&last - last.ball_axis); }

  /// Bodies that joints of one name move are the same one.
  void TakeNames() {
    Base& base = robot_.spec.base;
    std::vector<std::string> renamed;
    const auto rename = [&](std::string* name, int body) {
      const std::string other = engine_.names + engine_.name_bodyadr[body];
      if (other.empty() || *name == other) return;
      renamed.push_back(Quote(*name) + " is " + Quote(other));
      *name = other;
    };
    for (Joint& joint : robot_.spec.joints) {
      const int id = FindEngineJoint(joint);
      if (id < 0) continue;
      if (joint.type == JointType::kBall && joint.ball_axis < 2) continue;
      const int body = engine_.jnt_bodyid[id];
      // Of several joints of one body the last moves it; the links between them have no body.
      if (id + 1 < engine_.body_jntadr[body] + engine_.body_jntnum[body]) continue;
      rename(&joint.link, body);
      if (IsOnBase(joint) && FindByName(engine_, mjOBJ_BODY, base.link) < 0) {
        rename(&base.link, engine_.body_weldid[engine_.body_parentid[body]]);
      }
    }
    if (!renamed.empty()) result_.notes.push_back("links by other names: " + JoinNames(renamed));
  }

  /// One constant of the joints: which statement it is, its check, and how it is taken over.
  void TakeConstant(bool DescribedJoint::*statement, const std::string& check, const std::string& what,
                    const std::function<double(int)>& value, const std::function<void(int, size_t)>& take) {
    std::vector<std::string> taken;
    bool stated = false;
    double largest = 0.0;
    for (size_t i = 0; i < robot_.spec.joints.size(); ++i) {
      const Joint& joint = robot_.spec.joints[i];
      const int id = FindEngineJoint(joint);
      stated = stated || robot_.joints[i].*statement;
      if (id < 0 || robot_.joints[i].*statement) continue;
      take(id, i);
      if (value(id) == 0.0) continue;
      taken.push_back(joint.name);
      largest = std::max(largest, value(id));
    }
    if (!stated) result_.unstated.push_back(check);
    if (taken.empty()) return;
    result_.notes.push_back(what + ": only " + engine_source_ + " states it, up to " + FormatNumber(largest) +
                            ", for " + JoinNames(taken));
  }

  void TakeJointConstants() {
    const auto of_dof = [this](const mjtNum* values) {
      return [this, values](int id) { return values[engine_.jnt_dofadr[id]]; };
    };
    TakeConstant(
        &DescribedJoint::states_armature, "joint_armature", "armature", of_dof(engine_.dof_armature),
        [&](int id, size_t i) { robot_.spec.joints[i].armature = of_dof(engine_.dof_armature)(id); });
    TakeConstant(&DescribedJoint::states_damping, "joint_damping", "damping", of_dof(engine_.dof_damping),
                 [&](int id, size_t i) { robot_.spec.joints[i].damping = of_dof(engine_.dof_damping)(id); });
    TakeConstant(&DescribedJoint::states_dry_friction, "joint_dry_friction", "dry friction",
                 of_dof(engine_.dof_frictionloss), [&](int id, size_t i) {
                   robot_.spec.joints[i].dry_friction = of_dof(engine_.dof_frictionloss)(id);
                 });
    const auto is_limited = [&](int id) { return engine_.jnt_limited[id] != 0 ? 1.0 : 0.0; };
    for (size_t i = 0; i < robot_.spec.joints.size(); ++i) {
      const int id = FindEngineJoint(robot_.spec.joints[i]);
      if (id < 0 || robot_.joints[i].states_range || is_limited(id) == 0.0) continue;
      robot_.spec.joints[i].lower = engine_.jnt_range[2 * id];
      robot_.spec.joints[i].upper = engine_.jnt_range[2 * id + 1];
      result_.notes.push_back("range of " + robot_.spec.joints[i].name + ": only " + engine_source_ +
                              " states it");
    }
  }

  void DropFrames() {
    std::vector<std::string> dropped;
    const auto has_no_site = [&](const Frame& frame) {
      const bool lacks = FindByName(engine_, mjOBJ_SITE, frame.name) < 0;
      if (lacks) dropped.push_back(frame.name);
      return lacks;
    };
    std::erase_if(robot_.spec.frames, has_no_site);
    if (!dropped.empty()) {
      result_.notes.push_back("frames without a site in " + engine_source_ + ": " + JoinNames(dropped));
    }
  }

  const mjModel& engine_;
  std::string engine_source_;
  RobotDescription& robot_;
  Completion result_;
};

}  // namespace

Completion CompleteFromEngine(const mjModel& engine, const std::string& engine_source,
                              RobotDescription* robot) {
  return EngineCompletion(engine, engine_source, robot).Run();
}

}  // namespace dexcheck
