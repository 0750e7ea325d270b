#include "harness/cli/init_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "harness/cli/init_mend.h"

namespace dexcheck::cli {
namespace {

constexpr double kHalf = 2.0;  // s, there, and as long back

JointSpan ChooseSpan(const Joint& joint, bool states_range, double home) {
  constexpr double kMargin = 0.2;  // of the range, at either end
  const double most = joint.type == JointType::kPrismatic ? 0.05 : 0.3;
  const double width = states_range ? joint.upper - joint.lower : 2.0 * most;
  // All turns are alike; those that are written stay between -pi and pi, as printed, too.
  constexpr double kTurns = 1.1;
  if (!states_range) home = std::clamp(home, joint.lower + kTurns * most, joint.upper - kTurns * most);
  const double low = states_range ? joint.lower + kMargin * width : home - most;
  const double high = states_range ? joint.upper - kMargin * width : home + most;
  JointSpan span;
  span.start = std::clamp(home, low, high);
  const double step = std::min(most, 0.5 * (high - low));
  span.end = span.start + step <= high ? span.start + step : span.start - step;
  return span;
}

/// A coupled joint goes with the one that leads it, unless its own range forbids it.
JointSpan Follow(const Joint& joint, const JointSpan& leader, const JointSpan& own) {
  const JointCoupling& coupling = *joint.coupling;
  const JointSpan led{coupling.multiplier * leader.start + coupling.offset,
                      coupling.multiplier * leader.end + coupling.offset};
  const auto is_within = [&](double q) { return q >= joint.lower && q <= joint.upper; };
  return is_within(led.start) && is_within(led.end) ? led : own;
}

std::vector<JointSpan> ChooseSpans(const RobotDescription& robot, const std::map<std::string, double>& home) {
  std::vector<JointSpan> spans;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    const auto wish = home.find(joint.name);
    JointSpan span = ChooseSpan(joint, robot.joints[i].states_range, wish == home.end() ? 0.0 : wish->second);
    if (joint.coupling && joint.coupling->leader < static_cast<int>(i))
      span = Follow(joint, spans[static_cast<size_t>(joint.coupling->leader)], span);
    spans.push_back(span);
  }
  return spans;
}

/// What the motion asks of each motor, as a fraction of its limit.
class MotorUse {
 public:
  MotorUse(const RobotModel& model, const std::map<std::string, double>& limits)
      : model_(model), terms_(model) {
    for (const Joint& joint : model.joints()) {
      const auto limit = limits.find(joint.name);
      limits_.push_back(limit == limits.end() ? std::numeric_limits<double>::infinity() : limit->second);
    }
  }

  /// The largest of the motion there; back it is as large.
  VectorXd CalcMotion(const std::vector<JointSpan>& spans) {
    VectorXd most = CalcHold(spans);
    constexpr int kSamples = 20;
    for (int k = 1; k <= kSamples; ++k) most = most.cwiseMax(CalcAt(spans, double(k) / kSamples));
    return most;
  }
  /// That of holding the robot where the motion begins.
  VectorXd CalcHold(const std::vector<JointSpan>& spans) { return CalcAt(spans, 0.0); }

 private:
  /// @param s 0 to 1, by q = start + (end - start) (10 s^3 - 15 s^4 + 6 s^5).
  VectorXd CalcAt(const std::vector<JointSpan>& spans, double s) {
    const Eigen::Index n = terms_.size();
    VectorXd q(n), rate(n), acceleration(n), friction = VectorXd::Zero(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const JointSpan& span = spans[static_cast<size_t>(i)];
      const double way = span.end - span.start;
      q[i] = span.start + way * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
      rate[i] = way * 30.0 * s * s * (1.0 - s) * (1.0 - s) / kHalf;
      acceleration[i] = way * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (kHalf * kHalf);
      if (rate[i] != 0.0) friction[i] = model_.joints()[static_cast<size_t>(i)].dry_friction;
    }
    terms_.SetState(q, rate);
    terms_.CalcDynamics();
    VectorXd use =
        (terms_.M() * acceleration + terms_.C() * rate + terms_.friction() + terms_.gravity()).cwiseAbs() +
        friction;
    for (Eigen::Index i = 0; i < n; ++i) use[i] /= limits_[static_cast<size_t>(i)];
    return use;
  }

  const RobotModel& model_;
  ModelTerms terms_;
  std::vector<double> limits_;
};

/// Natural frequency, rad/s, at which feedback damps each joint as its viscous friction does, which the law
/// takes away: torques may be twice as large before the loop is unstable.
double ChooseFrequency(const RobotModel& model) {
  VectorXd rates = CalcJointInertias(model).cwiseInverse();  // 1/s
  for (Eigen::Index i = 0; i < rates.size(); ++i) rates[i] *= model.joints()[static_cast<size_t>(i)].damping;
  return std::ceil(std::clamp(0.5 * rates.maxCoeff(), 10.0, 50.0));
}

std::vector<std::map<std::string, double>> ListPoses(const RobotModel& model,
                                                     const std::vector<JointSpan>& spans) {
  constexpr int kPoses = 20;
  std::vector<std::map<std::string, double>> poses(kPoses + 1);
  for (int k = 0; k <= kPoses; ++k) {
    for (size_t i = 0; i < spans.size(); ++i)
      poses[static_cast<size_t>(k)][model.joints()[i].name] =
          spans[i].start + (spans[i].end - spans[i].start) * k / kPoses;
  }
  return poses;
}

}  // namespace

InitMotion PlanInitMotion(const RobotDescription& robot, const RobotModel& model,
                          const std::map<std::string, double>& limits,
                          const std::map<std::string, double>& home) {
  InitMotion motion;
  motion.spans = ChooseSpans(robot, home);
  motion.frequency = ChooseFrequency(model);
  constexpr double kMostUse = 0.7, kFull = 0.9;
  constexpr int kHalvings = 4;
  MotorUse use(model, limits);
  const VectorXd hold = use.CalcHold(motion.spans);
  VectorXd most = use.CalcMotion(motion.spans);
  // A motor that cannot hold the robot is none that a smaller motion helps.
  const auto too_much = [&] { return (hold.array() < kMostUse && most.array() > kMostUse).any(); };
  for (int k = 0; k < kHalvings && too_much(); ++k) {
    for (JointSpan& span : motion.spans) span.end = span.start + 0.5 * (span.end - span.start);
    most = use.CalcMotion(motion.spans);
  }
  for (Eigen::Index i = 0; i < most.size(); ++i) {
    if (most[i] > kFull) motion.weak.push_back(model.joints()[static_cast<size_t>(i)].name);
  }
  motion.poses = ListPoses(model, motion.spans);
  return motion;
}

std::string ListJoints(const RobotDescription& robot, const std::function<double(size_t joint)>& value) {
  std::string list;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i)
    list += fmt::format("{}{} = {}", i == 0 ? "" : ", ", Quote(robot.spec.joints[i].name),
                        FormatNumber(value(i), 4));
  return list;
}

std::string WriteTolerance(double tolerance) {
  if (!(tolerance > 0.0)) return "";
  return fmt::format("# Numbers that were rounded when they were printed agree to this.\ntolerance = {}\n",
                     FormatNumber(tolerance, 1));
}

std::string WriteCompensation(const RobotDescription& robot) {
  const std::vector<Joint>& joints = robot.spec.joints;
  if (std::none_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.dry_friction > 0.0; }))
    return "";
  return fmt::format("# Dry friction, compensated along the desired rates.\ncoulomb = {{ {} }}\n",
                     ListJoints(robot, [&](size_t i) { return joints[i].dry_friction; }));
}

std::string WriteInitScenario(const RobotDescription& robot, const InitMotion& motion, double tolerance) {
  const std::string start = ListJoints(robot, [&](size_t i) { return motion.spans[i].start; });
  const std::string end = ListJoints(robot, [&](size_t i) { return motion.spans[i].end; });
  const std::string compensation = WriteCompensation(robot);
  return fmt::format(
      R"(# A motion of the joints within their ranges, by computed torque, checked at every step.
name = "motion"
description = "each joint leaves its place and comes back"
duration = 4.0
settle = 0.5
start = "rest"
{}
[model]
file = "robot.toml"

[plant]
mjcf = "robot.xml"

[joint_motion]
start = {{ {} }}
points = [
  {{ time = 2, joints = {{ {} }} }},
  {{ time = 4, joints = {{ {} }} }},
]

[control]
law = "computed_torque"
natural_frequency = {}
damping_ratio = 1
{}{})",
      WriteTolerance(tolerance), start, end, start, motion.frequency, compensation,
      compensation.empty() ? "\n[expect]\njoints = 0.01\n" : "");
}

}  // namespace dexcheck::cli
