#include "harness/descriptions/hypotheses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/body_frame.h"
#include "harness/descriptions/description_match.h"

namespace dexcheck {
namespace {

/// Farthest that axes and bodies can be from the base.
double CalcLength(const std::vector<OwnRow>& rows) {
  std::vector<double> reach;
  double length = 0.0;
  for (const OwnRow& row : rows) {
    const double before = row.parent < 0 ? 0.0 : reach[static_cast<size_t>(row.parent)];
    reach.push_back(before + row.X_PL.translation().norm());
    length = std::max(length, reach.back() + row.body.com.norm());
  }
  return length > 0.0 ? length : 1.0;
}

std::vector<Hypothesis> FindGravityHypotheses(const RobotDescription& a, const RobotDescription& b,
                                              double tolerance) {
  if (!a.states_gravity || !b.states_gravity) return {};
  const Vector3d& own = a.spec.gravity;
  const Vector3d& right = b.spec.gravity;
  const double size = std::max(own.norm(), right.norm());
  if ((own - right).norm() <= tolerance * size) return {};
  Hypothesis hypothesis;
  hypothesis.explained = 1.0;
  hypothesis.values.push_back("gravity: " + FormatNumbers(own) + "; right would be " + FormatNumbers(right));
  if ((own + right).norm() <= tolerance * size) {
    hypothesis.text = "gravity looks turned around (its sign)";
  } else if (own.isZero(0.0)) {
    hypothesis.text = "gravity looks forgotten";
  } else if (own.normalized().cross(right.normalized()).norm() <= tolerance && own.dot(right) > 0.0) {
    hypothesis.text = "gravity has the right direction and another value";
  } else if (std::abs(own.norm() - right.norm()) <= tolerance * size) {
    hypothesis.text = "gravity points along another axis";
  } else {
    hypothesis.text = "gravity differs";
  }
  return {hypothesis};
}

/// Constants of joints that a unit explains.
std::vector<Hypothesis> FindConstantHypotheses(const RobotDescription& a, const RobotDescription& b,
                                               const std::vector<int>& b_of_a, double tolerance) {
  struct Constant {
    const char* text;
    double factor;
    bool DescribedJoint::*states;
    std::vector<double Joint::*> values;
  };
  constexpr double kDegrees = kPi / 180.0;
  const Constant constants[] = {
      {"ranges look as if in degrees",
       kDegrees,
       &DescribedJoint::states_range,
       {&Joint::lower, &Joint::upper}},
      {"damping looks as if per degree (N m s/deg)",
       1.0 / kDegrees,
       &DescribedJoint::states_damping,
       {&Joint::damping}},
      {"damping looks as if times pi / 180", kDegrees, &DescribedJoint::states_damping, {&Joint::damping}},
      {"armature looks as if in g cm^2", 1e-7, &DescribedJoint::states_armature, {&Joint::armature}},
      {"armature looks as if in kg mm^2", 1e-6, &DescribedJoint::states_armature, {&Joint::armature}}};
  std::vector<Hypothesis> found;
  for (const Constant& constant : constants) {
    std::vector<std::string> joints;
    for (size_t i = 0; i < b_of_a.size(); ++i) {
      const auto j = static_cast<size_t>(b_of_a[i]);
      const Joint& own = a.spec.joints[i];
      if (!(a.joints[i].*constant.states) || !(b.joints[j].*constant.states)) continue;
      if (own.type == JointType::kPrismatic) continue;
      bool explains = false;
      bool fits = true;
      for (double Joint::*const value : constant.values) {
        const double right = b.spec.joints[j].*value;
        explains = explains || std::abs(own.*value - right) > tolerance * std::abs(right);
        fits = fits && std::abs(constant.factor * (own.*value) - right) <= tolerance * std::abs(right);
      }
      if (explains && fits) joints.push_back(own.name);
    }
    if (joints.empty()) continue;
    Hypothesis hypothesis;
    hypothesis.text = joints.size() == 1
                          ? fmt::format("joint {}: {}", joints[0], constant.text)
                          : fmt::format("{}: {} of {} joints", constant.text, joints.size(), b_of_a.size());
    hypothesis.explained = 1.0;
    found.push_back(hypothesis);
  }
  return found;
}

/// Parts with mass of a joint's link, in the link's own frame of the other description.
/// @param X_ab the own frame of `robot` in that of the other description.
std::vector<DescribedPart> ListParts(const RobotDescription& robot, int joint, const Pose& X_ab) {
  std::vector<DescribedPart> parts;
  for (const DescribedPart& part : robot.parts) {
    if (part.joint != joint || !part.states_inertial) continue;
    // From the part's own frame by frame i to its row's place, and from there to that of the other.
    Pose X_RL = part.X_iL;
    if (joint >= 0) {
      const Pose& X_iL = robot.joints[static_cast<size_t>(joint)].X_iL;
      X_RL = Eigen::Translation3d(-X_iL.inverse().translation()) * X_iL.inverse() * part.X_iL;
    }
    DescribedPart& own = parts.emplace_back(part);
    own.X_iL = X_ab * X_RL;
    own.body = ExpressIn(part.body, own.X_iL);
    own.X_LC = own.X_iL * part.X_LC;
  }
  return parts;
}

}  // namespace

std::vector<Hypothesis> ExplainDifference(RobotDescription a, RobotDescription b, double tolerance) {
  try {
    CompleteEachOther(&a, &b);
  } catch (const InputError&) {
    return {};
  }
  return FindHypotheses(a, b, tolerance);
}

std::vector<Hypothesis> FindHypotheses(const RobotDescription& a, const RobotDescription& b,
                                       double tolerance) {
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  if (std::any_of(b_of_a.begin(), b_of_a.end(), [](int j) { return j < 0; })) return {};
  std::vector<OwnRow> rows = ListOwnRows(a);
  const std::vector<OwnRow> others = ListOwnRows(b);
  std::vector<OwnRow> right;
  for (size_t i = 0; i < rows.size(); ++i) {
    right.push_back(others[static_cast<size_t>(b_of_a[i])]);
    right.back().parent = rows[i].parent;
  }
  const bool floats = a.spec.base.type == BaseType::kFloating;
  const Pose X_W0_a = floats ? Pose::Identity() : a.spec.base.X_B0;
  const Pose X_W0_b = floats ? Pose::Identity() : b.spec.base.X_B0;
  const double length = CalcLength(right);
  std::vector<Hypothesis> found = FindJointHypotheses(a, X_W0_a, X_W0_b, right, length, tolerance, &rows);
  const auto append = [&](const std::vector<Hypothesis>& more) {
    found.insert(found.end(), more.begin(), more.end());
  };
  append(FindGravityHypotheses(a, b, tolerance));
  append(FindConstantHypotheses(a, b, b_of_a, tolerance));

  // Bodies are compared in the own frames of `a`, where the joints are right by now.
  const VectorXd home = VectorXd::Zero(static_cast<Eigen::Index>(rows.size()));
  const std::vector<Pose> poses = CalcOwnPoses(X_W0_a, rows, home);
  const std::vector<Pose> right_poses = CalcOwnPoses(X_W0_b, right, home);
  std::vector<ComparedBody> bodies;
  const auto add = [&](int joint, const std::string& link, const MassProperties& given,
                       const MassProperties& other, int joint_b) {
    ComparedBody& body = bodies.emplace_back();
    const Pose X_ab =
        poses[static_cast<size_t>(joint + 1)].inverse() * right_poses[static_cast<size_t>(joint + 1)];
    body.joint = joint;
    body.link = link;
    body.given = given;
    body.right = ExpressIn(other, X_ab);
    if (joint >= 0) body.X_PL = rows[static_cast<size_t>(joint)].X_PL;
    body.given_parts = ListParts(a, joint, Pose::Identity());
    body.parts = ListParts(b, joint_b, X_ab);
    if (body.given_parts.size() == 1) body.R_LC = body.given_parts[0].X_LC.linear();
  };
  if (floats) add(-1, a.spec.base.link, a.spec.base.body, b.spec.base.body, -1);
  for (size_t i = 0; i < rows.size(); ++i) {
    add(static_cast<int>(i), a.spec.joints[i].link, rows[i].body, right[i].body, b_of_a[i]);
  }
  append(FindBodyHypotheses(bodies, length, tolerance));
  return found;
}

}  // namespace dexcheck
