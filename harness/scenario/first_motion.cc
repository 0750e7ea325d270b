#include "harness/scenario/first_motion.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "controller/control/joint_motion.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"

namespace dexcheck {
namespace {

constexpr double kHalf = 2.0;     // s, there, and as long back
constexpr double kFastest = 1.6;  // of sines: the most that one is faster than the slowest of its kind

JointSpan ChooseSpan(const Joint& joint, bool states_range, double home, double fastest) {
  constexpr double kMargin = 0.2, kSwing = 1.0 / 3.0;  // of the range, at either end; of the way
  const double most = joint.type == JointType::kPrismatic ? 0.05 : 0.3;
  const double width = states_range ? joint.upper - joint.lower : 2.0 * most;
  // All turns are the same; those that are written stay between -pi and pi, as printed, too.
  constexpr double kTurns = 1.4;
  if (!states_range) home = std::clamp(home, joint.lower + kTurns * most, joint.upper - kTurns * most);
  const double low = states_range ? joint.lower + kMargin * width : home - most;
  const double high = states_range ? joint.upper - kMargin * width : home + most;
  JointSpan span{.swing = std::min(kSwing * most, 0.5 * kMargin * width)};
  span.start = std::clamp(home, low, high);
  const double step = std::min(most, 0.5 * (high - low));
  // Least jerk's largest rate; the sines' with the highest frequencies that they may have.
  constexpr double kWay = 1.875 / kHalf, kSines = 2.0 * kPi * kFastest * (0.7 * 0.7 + 0.3 * 1.9), kPart = 0.8;
  const double part = std::min(1.0, kPart * fastest / (kWay * step + kSines * span.swing));
  span.swing *= part;
  span.end = span.start + (span.start + step <= high ? part : -part) * step;
  return span;
}

std::vector<JointSpan> ChooseSpans(const RobotDescription& robot, const std::map<std::string, double>& rates,
                                   const std::map<std::string, double>& home) {
  std::vector<JointSpan> spans;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    const auto find = [&](const std::map<std::string, double>& numbers, double otherwise) {
      const auto found = numbers.find(joint.name);
      return found == numbers.end() ? otherwise : found->second;
    };
    spans.push_back(ChooseSpan(joint, robot.joints[i].states_range, find(home, 0.0),
                               find(rates, std::numeric_limits<double>::infinity())));
  }
  return spans;
}

std::vector<JointOscillation> ListSwings(const std::vector<JointSpan>& spans) {
  std::vector<JointOscillation> swings;
  for (size_t i = 0; i < spans.size(); ++i) AddSwings(static_cast<int>(i), spans[i].swing, i, &swings);
  return swings;
}

constexpr int kParts = 100;

/// The largest that the motion asks of each motor, as a fraction of its limit.
/// @param parts of it that are looked at, out of kParts; none but where it begins for 0. @param poses by
/// which it comes, by joint.
VectorXd CalcMotorUse(const RobotModel& model, const std::map<std::string, double>& limits,
                      const std::vector<JointSpan>& spans, int parts, JointPoses* poses) {
  ModelTerms terms(model);
  VectorXd start(terms.size()), end(terms.size()), most = VectorXd::Zero(terms.size());
  std::transform(spans.begin(), spans.end(), start.begin(), [](const JointSpan& span) { return span.start; });
  std::transform(spans.begin(), spans.end(), end.begin(), [](const JointSpan& span) { return span.end; });
  const JointMotion motion(start, {{kHalf, end}, {2.0 * kHalf, start}}, ListSwings(spans));
  DesiredJoints desired;
  poses->assign(static_cast<size_t>(parts) + 1, {});
  for (int k = 0; k <= parts; ++k) {
    motion.Evaluate(2.0 * kHalf * k / kParts, &desired);
    terms.SetState(desired.q, desired.q_dot);
    terms.CalcDynamics();
    const VectorXd force = CalcForce(terms, desired);
    for (Eigen::Index i = 0; i < force.size(); ++i) {
      const Joint& joint = model.joints()[static_cast<size_t>(i)];
      (*poses)[static_cast<size_t>(k)][joint.name] = desired.q[i];
      const auto limit = limits.find(joint.name);
      const double dry = desired.q_dot[i] != 0.0 ? joint.dry_friction : 0.0;
      if (limit != limits.end()) most[i] = std::max(most[i], (std::abs(force[i]) + dry) / limit->second);
    }
  }
  return most;
}

/// Natural frequency, rad/s, at which feedback damps each joint as its viscous friction does, which the law
/// takes away: torques may be twice as large before the loop is unstable.
double ChooseFrequency(const RobotModel& model) {
  VectorXd rates = CalcJointInertias(model).cwiseInverse();  // 1/s
  for (Eigen::Index i = 0; i < rates.size(); ++i) rates[i] *= model.joints()[static_cast<size_t>(i)].damping;
  return std::ceil(std::clamp(0.5 * rates.maxCoeff(), 10.0, 50.0));
}

// A gain margin of 6 dB and a phase margin of 45 degrees; of a robot on its feet margins are not judged.
constexpr const char* kMargins =
    R"(metrics = ["joint_error_rms", "peak_effort", "gain_margin", "phase_margin"]
constraints = ["peak_effort < 1", "gain_margin > 2", "phase_margin > 0.785"])";
constexpr const char* kEffort = R"(metrics = ["joint_error_rms", "peak_effort"]
constraints = ["peak_effort < 1"])";

constexpr const char* kStudy = R"(# Which gains follow the motion best, with margins that an arm needs.
name = "gains"
description = "natural frequency x damping ratio of the motion"
scenario = "motion.toml"
set = ["expect={{}}"]
{}

[[objective]]
minimize = "joint_error_rms"

[[vary]]
key = "control.natural_frequency"
from = 5
to = 500
count = 6
spacing = "log"

[[vary]]
key = "control.damping_ratio"
from = 0.5
to = 2
count = 3
spacing = "log"
)";

}  // namespace

VectorXd CalcJointInertias(const RobotModel& model) {
  ModelTerms terms(model);
  VectorXd q = VectorXd::Zero(model.num_positions());
  if (model.base().type == BaseType::kFloating) q[3] = 1.0;
  terms.SetState(q, VectorXd::Zero(model.num_velocities()));
  terms.CalcDynamics();
  return MatrixXd(terms.M().inverse()).diagonal().cwiseInverse().tail(model.num_joints());
}

VectorXd CalcForce(const ModelTerms& terms, const DesiredJoints& desired) {
  return terms.M() * desired.q_ddot + terms.C() * desired.q_dot + terms.friction() + terms.gravity();
}

void Shrink(FirstMotion* motion) {
  for (JointSpan& span : motion->spans) {
    span.end = span.start + 0.5 * (span.end - span.start);
    span.swing *= 0.5;
  }
}

void AddSwings(int joint, double amplitude, size_t number, std::vector<JointOscillation>* swings) {
  // Multiples of the golden ratio lie evenly, however many there are, and are no multiples of each other.
  const double part = std::fmod(0.618034 * static_cast<double>(number), 1.0);
  constexpr double kRamp = 1.0;  // s
  for (const auto& [share, frequency] : {std::pair(0.7, 0.7), {0.3, 1.9}})
    swings->push_back({joint, share * amplitude,
                       std::round(1e3 * frequency * (1.0 + (kFastest - 1.0) * part)) / 1e3, kRamp,
                       2.0 * kHalf});
}

FirstMotion PlanFirstMotion(const RobotDescription& robot, const RobotModel& model,
                            const std::map<std::string, double>& limits,
                            const std::map<std::string, double>& rates,
                            const std::map<std::string, double>& home) {
  FirstMotion motion;
  motion.spans = ChooseSpans(robot, rates, home);
  motion.frequency = ChooseFrequency(model);
  constexpr double kMostUse = 0.7, kFull = 0.9;
  constexpr int kHalvings = 4;
  const VectorXd hold = CalcMotorUse(model, limits, motion.spans, 0, &motion.poses);
  VectorXd most = CalcMotorUse(model, limits, motion.spans, kParts, &motion.poses);
  // A motor that cannot hold the robot is none that a smaller motion helps.
  const auto too_much = [&] { return (hold.array() < kMostUse && most.array() > kMostUse).any(); };
  for (int k = 0; k < kHalvings && too_much(); ++k) {
    Shrink(&motion);
    most = CalcMotorUse(model, limits, motion.spans, kParts, &motion.poses);
  }
  for (Eigen::Index i = 0; i < most.size(); ++i) {
    if (most[i] > kFull) motion.weak.push_back(model.joints()[static_cast<size_t>(i)].name);
  }
  return motion;
}

std::string ListJoints(const RobotDescription& robot, const std::function<double(size_t joint)>& value) {
  std::string list;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i)
    list += fmt::format("{}{} = {}", i == 0 ? "" : ", ", QuoteToml(robot.spec.joints[i].name),
                        FormatNumber(value(i), 4));
  return list;
}

std::string WriteSwings(const std::vector<JointOscillation>& swings, const char* key,
                        const std::function<std::string(int joint)>& name) {
  std::string text = "oscillations = [\n";
  for (const JointOscillation& one : swings)
    text += fmt::format("  {{ {} = {}, amplitude = {}, frequency = {}, ramp_time = {}, end_time = {} }},\n",
                        key, QuoteToml(name(one.joint)), FormatNumber(one.amplitude, 3),
                        FormatNumber(one.frequency), FormatNumber(one.ramp_time), FormatNumber(one.end_time));
  return text + "]\n";
}

std::string WriteScenario(const RobotDescription& robot, const MotionText& motion, double tolerance) {
  const std::vector<Joint>& joints = robot.spec.joints;
  const bool has_friction =
      std::any_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.dry_friction > 0.0; });
  std::string law;
  if (has_friction)
    law = fmt::format("# Dry friction, compensated along the desired rates.\ncoulomb = {{ {} }}\n",
                      ListJoints(robot, [&](size_t i) { return joints[i].dry_friction; }));
  else if (motion.is_followed)
    law = "\n[expect]\njoints = 0.01\n";
  const std::string rounded =
      tolerance > 0.0
          ? fmt::format("# Numbers that were rounded when they were printed agree to this.\ntolerance = {}\n",
                        FormatNumber(tolerance, 1))
          : "";
  return fmt::format(
      R"(# {}, by computed torque, checked at every step.
name = "motion"
description = "{}"
duration = 4.0
settle = {}
start = "rest"
{}
[model]
file = "robot.toml"

[plant]
mjcf = "robot.xml"

{}
[control]
law = "computed_torque"
natural_frequency = {}
damping_ratio = 1
{})",
      motion.title, motion.description, motion.settle, rounded, motion.text, motion.frequency, law);
}

std::string WriteGainStudy(bool stands) { return fmt::format(kStudy, stands ? kEffort : kMargins); }

std::string WriteMotionScenario(const RobotDescription& robot, const FirstMotion& motion, double tolerance) {
  const std::string start = ListJoints(robot, [&](size_t i) { return motion.spans[i].start; });
  const std::string end = ListJoints(robot, [&](size_t i) { return motion.spans[i].end; });
  const std::string text = fmt::format(
      R"([joint_motion]
start = {{ {} }}
points = [
  {{ time = 2, joints = {{ {} }} }},
  {{ time = 4, joints = {{ {} }} }},
]
# What only moves one way hardly separates a torque from an inertia or from friction.
{})",
      start, end, start, WriteSwings(ListSwings(motion.spans), "joint", [&](int i) {
        return robot.spec.joints[static_cast<size_t>(i)].name;
      }));
  return WriteScenario(robot,
                       {"A motion of the joints within their ranges",
                        "each joint leaves its place and comes back, and swings on its way", 0.5, text,
                        motion.frequency, true},
                       tolerance);
}

}  // namespace dexcheck
