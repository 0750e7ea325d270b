#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include "tests/common/random_robot.h"

namespace dexcheck::testing {
namespace {

std::string WritePose(const Pose& X) {
  const Eigen::Quaterniond q(X.linear());
  const Vector3d p = X.translation();
  return fmt::format(R"(pos="{:.17g} {:.17g} {:.17g}" quat="{:.17g} {:.17g} {:.17g} {:.17g}")", p.x(), p.y(),
                     p.z(), q.w(), q.x(), q.y(), q.z());
}

// Principal moments and axes: the engine diagonalises a "fullinertia" itself, but only to eight digits.
std::string WriteInertial(const MassProperties& body) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(body.inertia);
  Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) = -axes.col(0);
  Pose X = Pose::Identity();
  X.linear() = axes;
  X.translation() = body.com;
  const Vector3d moments = principal.eigenvalues();
  return fmt::format("<inertial {} mass=\"{:.17g}\" diaginertia=\"{:.17g} {:.17g} {:.17g}\"/>\n",
                     WritePose(X), body.mass, moments[0], moments[1], moments[2]);
}

void WriteLinkContent(const RobotSpec& spec, int link, std::string* text);

void WriteJoint(const RobotSpec& spec, int index, std::string* text) {
  const Joint& joint = spec.joints[static_cast<size_t>(index)];
  const Pose X = joint.X_PB * Eigen::AngleAxisd(joint.mdh.alpha, Vector3d::UnitX()) *
                 Eigen::Translation3d(joint.mdh.a, 0.0, 0.0) *
                 Eigen::AngleAxisd(joint.mdh.q, Vector3d::UnitZ()) *
                 Eigen::Translation3d(0.0, 0.0, joint.mdh.d);
  *text += fmt::format("<body name=\"{}\" {}>\n", joint.link, WritePose(X));
  *text += fmt::format(R"(<joint name="{}" type="{}" axis="0 0 1" damping="{:.17g}" armature="{:.17g}" )"
                       "limited=\"true\" range=\"{:.17g} {:.17g}\"/>\n",
                       joint.name,
                       joint.type == JointType::kBall       ? "ball"
                       : joint.type == JointType::kRevolute ? "hinge"
                                                            : "slide",
                       joint.damping, joint.armature, joint.lower, joint.upper);
  *text += WriteInertial(joint.body);
  WriteLinkContent(spec, index, text);
  *text += "</body>\n";
}

void WriteLinkContent(const RobotSpec& spec, int link, std::string* text) {
  for (const Frame& frame : spec.frames) {
    if (frame.link == link)
      *text += fmt::format("<site name=\"{}\" {}/>\n", frame.name, WritePose(frame.X_LF));
  }
  for (size_t i = 0; i < spec.joints.size(); ++i) {
    if (spec.joints[i].parent == link) WriteJoint(spec, static_cast<int>(i), text);
  }
}

void WriteWheel(const Base& base, const std::string& name, double y, std::string* text) {
  *text += fmt::format(
      "<body name=\"{0}_body\" pos=\"0 {1:.17g} 0\">\n<joint name=\"{0}\" axis=\"0 1 0\" "
      "damping=\"{2:.17g}\" armature=\"{3:.17g}\"/>\n",
      name, y, base.wheel.damping, base.wheel.armature);
  const Vector3d moments(base.wheel.transverse_inertia, base.wheel.spin_inertia,
                         base.wheel.transverse_inertia);
  *text += WriteInertial({base.wheel.mass, Vector3d::Zero(), moments.asDiagonal()});
  *text += fmt::format("<geom type=\"sphere\" size=\"{:.17g}\" contype=\"0\" conaffinity=\"0\"/>\n</body>\n",
                       base.wheel_radius);
}

}  // namespace

std::string WriteMjcf(const RobotSpec& spec, bool planar_by_free_joint, const Pose& X_0b) {
  std::string text = fmt::format(
      "<mujoco>\n<compiler angle=\"radian\" balanceinertia=\"false\"/>\n"
      "<option gravity=\"{:.17g} {:.17g} {:.17g}\"/>\n<worldbody>\n<body name=\"{}\" {}>\n",
      spec.gravity.x(), spec.gravity.y(), spec.gravity.z(), spec.base.link, WritePose(spec.base.X_B0 * X_0b));
  if (spec.base.type != BaseType::kFixed) {
    text += planar_by_free_joint
                ? "<freejoint/>\n"
                : "<joint type=\"slide\" axis=\"1 0 0\"/>\n<joint type=\"slide\" axis=\"0 1 0\"/>\n"
                  "<joint axis=\"0 0 1\"/>\n";
  }
  // Everything stands in Sigma_0, which is welded to the base's body.
  text += fmt::format("<body {}>\n", WritePose(X_0b.inverse()));
  if (spec.base.type != BaseType::kFixed) text += WriteInertial(spec.base.body);
  if (spec.base.type == BaseType::kDifferentialDrive) {
    WriteWheel(spec.base, spec.base.wheel_joint_right, -0.5 * spec.base.wheel_distance, &text);
    WriteWheel(spec.base, spec.base.wheel_joint_left, 0.5 * spec.base.wheel_distance, &text);
  }
  WriteLinkContent(spec, -1, &text);
  return text + "</body>\n</body>\n</worldbody>\n</mujoco>\n";
}

}  // namespace dexcheck::testing
