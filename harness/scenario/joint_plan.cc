#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/control/stance.h"
#include "controller/dynamics/model_terms.h"
#include "harness/engine/map_vector.h"
#include "harness/scenario/start_state.h"

namespace dexcheck {
namespace {

constexpr double kVariedStart =
    DegToRad(2.0);  // rad, or this many m: how far a seed moves the start, either way

/// Finds joints, and says what of the scenario does not fit them.
class JointReader {
 public:
  JointReader(const Scenario& scenario, const RobotModel& model)
      : scenario_(scenario), source_(scenario.source), model_(model) {}

  [[nodiscard]] int Find(const std::string& key, const std::string& name, bool in_degrees) const {
    const int joint = RequireJoint(scenario_, key, model_, name);
    if (in_degrees && model_.joint(joint).type == JointType::kPrismatic)
      throw InputError(source_ + ": " + key + ": " + Quote(name) +
                       " is prismatic: give it in m, under the key without _deg");
    return joint;
  }

  /// Indices of frames. @throws InputError for one that is none.
  [[nodiscard]] std::vector<int> FindFeet(const std::vector<std::string>& names) const {
    if (model_.num_joints() == 0)
      throw InputError(source_ + ": stance: the robot must have joints to stand by");
    std::vector<int> feet;
    for (const std::string& name : names)
      feet.push_back(RequireFrame(scenario_, "stance.feet", model_, name));
    return feet;
  }

  /// Writes numbers by joint into q.
  void Set(const JointNumbers& numbers, VectorXd* q) const {
    for (const auto& [name, value] : numbers.by_name) {
      (*q)[Find(numbers.key, name, numbers.in_degrees)] = value;
    }
  }

  void RequireInRange(const std::string& key, const VectorXd& q) const {
    for (int i = 0; i < model_.num_joints(); ++i) {
      const Joint& joint = model_.joints()[static_cast<size_t>(i)];
      if (q[i] >= joint.lower && q[i] <= joint.upper) continue;
      const bool turns = joint.type == JointType::kRevolute;
      const auto show = [&](double value) { return FormatNumber(turns ? RadToDeg(value) : value, 6); };
      throw InputError(source_ + ": " + key + ": joint " + Quote(joint.name) + " must be from " +
                       show(joint.lower) + " to " + show(joint.upper) + (turns ? " degrees" : " m") +
                       ", got " + show(q[i]));
    }
  }

  /// The number of each joint.
  [[nodiscard]] VectorXd Resolve(const ByName& numbers) const {
    std::vector<std::string> names(static_cast<size_t>(model_.num_base_velocities()), "base");
    for (const Joint& joint : model_.joints()) names.push_back(joint.name);
    VectorXd values = numbers.Resolve(names, source_);
    for (size_t i = 0; i < names.size(); ++i) {
      if (!std::isnan(values[static_cast<Eigen::Index>(i)])) continue;
      throw InputError(source_ + ": " + numbers.key + ": has no number for joint " + Quote(names[i]) +
                       ", and none for \"all\"");
    }
    return values;
  }

 private:
  const Scenario& scenario_;
  const std::string& source_;
  const RobotModel& model_;
};

JointGains FindGains(const JointTask& task, const JointReader& joints, const RobotModel& model,
                     const VectorXd& q_start) {
  JointGains gains;
  const VectorXd omega = joints.Resolve(task.natural_frequency);
  gains.K_p = omega.cwiseAbs2();
  gains.K_v = 2.0 * joints.Resolve(task.damping_ratio).cwiseProduct(omega);
  // Stiffness and damping as K_p and K_v with each joint's own inertia at the start.
  ModelTerms terms(model, Coordinates::kReduced);
  terms.SetState(q_start, VectorXd::Zero(model.num_velocities()));
  terms.CalcDynamics();
  const VectorXd inertia = terms.M().diagonal();
  gains.K = inertia.cwiseProduct(gains.K_p);
  gains.D = inertia.cwiseProduct(gains.K_v);
  if (!task.stiffness.key.empty()) gains.K = joints.Resolve(task.stiffness);
  if (!task.damping.key.empty()) gains.D = joints.Resolve(task.damping);
  if (!task.coulomb.Is(0.0)) gains.coulomb = joints.Resolve(task.coulomb);
  if (!task.viscous.Is(0.0)) gains.viscous = joints.Resolve(task.viscous);
  // Nothing drives or rubs a base.
  for (VectorXd* gain : {&gains.K, &gains.D, &gains.coulomb, &gains.viscous}) {
    if (gain->size() > 0) gain->head(model.num_base_velocities()).setZero();
  }
  gains.coulomb_velocity = task.coulomb_velocity;
  return gains;
}

VectorXd VaryPosture(const RobotModel& model, std::uint64_t seed, VectorXd q) {
  std::mt19937_64 random(seed);
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joints()[static_cast<size_t>(i)];
    q[i] = std::clamp(q[i] + kVariedStart * DrawSymmetric(&random), joint.lower, joint.upper);
  }
  return q;
}

/// A robot that stands: level, on all feet, its joints in the posture that is asked for as far as the ground
/// lets them. @param q_joints rad or m.
JointPlan MakeStancePlan(const Scenario& scenario, const RobotModel& model, const JointReader& joints,
                         const VectorXd& q_joints, StartState* start) {
  constexpr double kStands = 1e-9;  // m
  const JointTask& task = *scenario.joint_task();
  const Stance stance{joints.FindFeet(task.stance->feet), 0.0, task.stance->mu, task.stance->f_min,
                      task.stance->f_max};
  VectorXd& q = start->q;
  q.setZero(model.num_positions());
  q[3] = 1.0;
  q.tail(q_joints.size()) = q_joints;
  ModelTerms robot(model);
  robot.SetState(q, VectorXd::Zero(model.num_velocities()));
  GroundContacts ground(model, stance.feet);
  ground.SetState(robot);
  q[2] = -ground.gap().mean();
  if (const double left = PutFeetDown(model, stance, &q); !(left < kStands)) {
    throw InputError(scenario.source + ": stance.feet: do not all reach the ground from that posture, " +
                     FormatNumber(left, 3) + " m are left");
  }
  joints.RequireInRange("joint_motion.start_deg", q.tail(q_joints.size()));
  JointPlan plan{
      JointMotion(std::make_shared<const StanceMotion>(
          model, stance, q, JointMotion(VectorXd::Zero(6), task.stance->points, task.stance->oscillations))),
      FindGains(task, joints, model, q)};
  plan.gains.stance = stance;
  PlaceObject(Pose::Identity(), start);
  return plan;
}

}  // namespace

JointPlan MakeJointPlan(const Scenario& scenario, const RobotPair& robots, StartState* start) {
  const RobotModel& model = robots.model;
  if (model.base().type != BaseType::kFixed && !scenario.stands()) {
    throw InputError(model.spec().source +
                     ": base.type: must be \"fixed\" for a motion of joints, or \"floating\" with [stance]");
  }
  const JointReader joints(scenario, model);
  const JointTask& task = *scenario.joint_task();
  VectorXd q = VectorXd::Zero(model.num_joints());
  joints.Set(task.start, &q);
  joints.RequireInRange(task.start.key.empty() ? "joint_motion.start_deg" : task.start.key, q);
  if (scenario.seed != 0) q = VaryPosture(model, scenario.seed, q);
  if (scenario.stands()) return MakeStancePlan(scenario, model, joints, q, start);
  start->q = q;
  std::vector<JointWayPoint> points;
  for (const JointTask::Point& point : task.points) {
    joints.Set(point.where, &q);
    joints.RequireInRange(point.where.key, q);
    points.push_back({point.time, q});
  }
  std::vector<JointOscillation> oscillations;
  for (const JointTask::Oscillation& one : task.oscillations) {
    oscillations.emplace_back(one).joint = joints.Find(one.key + ".joint", one.name, one.in_degrees);
  }
  Pose X_Bo = Pose::Identity();
  if (model.object()) {
    const mjModel& m = *robots.engine;
    X_Bo = ReadFreePose(m.qpos0 + m.jnt_qposadr[m.body_jntadr[robots.adapter->object_body()]]);
  }
  PlaceObject(X_Bo, start);
  return {JointMotion(start->q, points, oscillations), FindGains(task, joints, model, start->q)};
}

}  // namespace dexcheck
