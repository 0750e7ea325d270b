// A scenario that moves joints and holds nothing, made real.

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/object/euler_zyz.h"
#include "harness/scenario/setup.h"

namespace dexcheck {
namespace {

constexpr double kVariedStart =
    DegToRad(2.0);  // rad, or this many m: how far a seed moves the start, either way

}  // namespace

int Setup::FindJointOf(const std::string& key, const std::string& name, bool in_degrees) const {
  const std::string where = scenario_.source + ": " + key + ": ";
  const int joint = model_.FindJoint(name);
  if (joint < 0) {
    std::vector<std::string> names;
    for (const Joint& one : model_.joints()) names.push_back(one.name);
    const std::string nearest = FindNearest(name, names);
    throw InputError(where + Quote(name) + " is no joint of the model" +
                     (nearest.empty() ? "" : " (" + Quote(nearest) + "?)"));
  }
  if (in_degrees && model_.joints()[static_cast<size_t>(joint)].type == JointType::kPrismatic) {
    throw InputError(where + Quote(name) + " is prismatic: give it in m, under the key without _deg");
  }
  return joint;
}

void Setup::SetJoints(const JointNumbers& numbers, VectorXd* q) const {
  for (const auto& [name, value] : numbers.by_name) {
    (*q)[FindJointOf(numbers.key, name, numbers.in_degrees)] = value;
  }
}

void Setup::RequireInRange(const std::string& key, const VectorXd& q) const {
  for (int i = 0; i < model_.num_joints(); ++i) {
    const Joint& joint = model_.joints()[static_cast<size_t>(i)];
    if (q[i] >= joint.lower && q[i] <= joint.upper) continue;
    const bool turns = joint.type == JointType::kRevolute;
    const auto show = [&](double value) { return FormatNumber(turns ? RadToDeg(value) : value, 6); };
    throw InputError(scenario_.source + ": " + key + ": joint " + Quote(joint.name) + " must be from " +
                     show(joint.lower) + " to " + show(joint.upper) + (turns ? " degrees" : " m") + ", got " +
                     show(q[i]));
  }
}

void Setup::PlaceJoints() {
  if (model_.base().type != BaseType::kFixed) {
    throw InputError(model_.spec().source + ": base.type: must be \"fixed\" for a motion of joints");
  }
  const JointMotionOptions& options = *scenario_.joint_motion;
  VectorXd q = VectorXd::Zero(model_.num_joints());
  SetJoints(options.start, &q);
  RequireInRange(options.start.key.empty() ? "joint_motion.start_deg" : options.start.key, q);
  if (scenario_.seed != 0) {
    std::mt19937_64 random(scenario_.seed);
    for (int i = 0; i < model_.num_joints(); ++i) {
      const double draw = 2.0 * static_cast<double>(random() >> 11U) * 0x1p-53 - 1.0;
      const Joint& joint = model_.joints()[static_cast<size_t>(i)];
      q[i] = std::clamp(q[i] + kVariedStart * draw, joint.lower, joint.upper);
    }
  }
  q_start_ = q;
  std::vector<JointWayPoint> points;
  for (const JointMotionOptions::Point& point : options.points) {
    SetJoints(point.where, &q);
    RequireInRange(point.where.key, q);
    points.push_back({point.time, q});
  }
  std::vector<JointOscillation> oscillations;
  for (const JointMotionOptions::Oscillation& one : options.oscillations) {
    oscillations.push_back({FindJointOf(one.key + ".joint", one.joint, one.in_degrees), one.amplitude,
                            one.frequency, one.ramp_time});
  }
  joint_motion_.emplace(q_start_, points, oscillations);
  if (has_object()) {
    // Where the MJCF puts it.
    const int joint = engine_->body_jntadr[adapter_->object_body()];
    const mjtNum* const pose = engine_->qpos0 + engine_->jnt_qposadr[joint];
    X_Bo_start_.translation() << pose[0], pose[1], pose[2];
    X_Bo_start_.linear() = Eigen::Quaterniond(pose[3], pose[4], pose[5], pose[6]).toRotationMatrix();
  }
  X_start_ << X_Bo_start_.translation(), CalcAnyZyzAngles(X_Bo_start_.linear());
  FindJointGains();
}

void Setup::FindJointGains() {
  std::vector<std::string> names;
  for (const Joint& joint : model_.joints()) names.push_back(joint.name);
  const auto resolve = [&](const ByName& numbers) {
    const VectorXd values = numbers.Resolve(names, scenario_.source);
    for (size_t i = 0; i < names.size(); ++i) {
      if (!std::isnan(values[static_cast<Eigen::Index>(i)])) continue;
      throw InputError(scenario_.source + ": " + numbers.key + ": has no number for joint " +
                       Quote(names[i]) + ", and none for \"all\"");
    }
    return values;
  };
  const JointControlOptions& control = scenario_.joint_control;
  const VectorXd omega = resolve(control.natural_frequency);
  joint_gains_.K_p = omega.cwiseAbs2();
  joint_gains_.K_v = 2.0 * resolve(control.damping_ratio).cwiseProduct(omega);
  // Stiffness and damping as K_p and K_v with each joint's own inertia at the start.
  ModelTerms terms(model_, Coordinates::kReduced);
  terms.SetState(q_start_, VectorXd::Zero(model_.num_velocities()));
  terms.CalcDynamics();
  const VectorXd inertia = terms.M().diagonal();
  joint_gains_.K = inertia.cwiseProduct(joint_gains_.K_p);
  joint_gains_.D = inertia.cwiseProduct(joint_gains_.K_v);
  if (!control.stiffness.key.empty()) joint_gains_.K = resolve(control.stiffness);
  if (!control.damping.key.empty()) joint_gains_.D = resolve(control.damping);
}

}  // namespace dexcheck
