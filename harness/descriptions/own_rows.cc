#include "harness/descriptions/own_rows.h"

#include "controller/model/body_frame.h"

namespace dexcheck {
namespace {

/// Of the own frame, which may stand beside the joint's axis, as an MJCF's does: to the row's place on it.
Eigen::Translation3d MoveToAxis(const RobotDescription& robot, int joint) {
  if (joint < 0) return Eigen::Translation3d(Vector3d::Zero());
  return Eigen::Translation3d(robot.joints[static_cast<size_t>(joint)].X_iL.inverse().translation());
}

Pose CalcRow(const Joint& joint, const MdhRow& mdh) {
  return joint.X_PB * CalcMdhTransform(mdh.alpha, mdh.a, mdh.q, mdh.d);
}

}  // namespace

std::vector<OwnRow> ListOwnRows(const RobotDescription& robot) {
  std::vector<OwnRow> rows;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    const Pose X_iL = robot.joints[i].X_iL * MoveToAxis(robot, static_cast<int>(i));
    Pose X_jP = Pose::Identity();
    if (joint.parent >= 0)
      X_jP = robot.joints[static_cast<size_t>(joint.parent)].X_iL * MoveToAxis(robot, joint.parent);
    OwnRow& row = rows.emplace_back();
    row.parent = joint.parent;
    row.is_revolute = joint.type != JointType::kPrismatic;
    row.X_PL = X_jP.inverse() * CalcRow(joint, joint.mdh) * X_iL;
    row.X_PW = robot.joints[i].X_PW;
    row.axis = X_iL.linear().row(2).transpose();  // one of those that a ball joint turns about
    row.body = ExpressIn(joint.body, X_iL.inverse());
  }
  return rows;
}

std::vector<Pose> CalcOwnPoses(const Pose& X_W0, const std::vector<OwnRow>& rows) {
  std::vector<Pose> poses = {X_W0};
  for (const OwnRow& row : rows) poses.push_back(poses[static_cast<size_t>(row.parent + 1)] * row.X_PL);
  return poses;
}

std::vector<OwnRow> ReadRowsAs(const RobotDescription& robot, MdhRow (*change)(MdhRow), bool classic) {
  std::vector<OwnRow> rows = ListOwnRows(robot);
  std::vector<Pose> behind(rows.size(), Pose::Identity());  // of a classic row: what stands behind the joint
  for (size_t i = 0; i < rows.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    MdhRow mdh = change(joint.mdh);
    if (classic) {
      behind[i] = Eigen::Translation3d(mdh.a, 0.0, 0.0) * Eigen::AngleAxisd(mdh.alpha, Vector3d::UnitX());
      mdh.a = mdh.alpha = 0.0;
      rows[i].body = ExpressIn(joint.body, behind[i]);
    }
    const Pose before = joint.parent < 0 ? Pose::Identity() : behind[static_cast<size_t>(joint.parent)];
    rows[i].X_PL = before * CalcRow(joint, mdh);
  }
  return rows;
}

std::vector<DescribedPart> ListParts(const RobotDescription& robot, int joint, const Pose& X_ab) {
  std::vector<DescribedPart> parts;
  for (const DescribedPart& part : robot.parts) {
    if (part.joint != joint || !part.states_inertial) continue;
    Pose X_RL = part.X_iL;
    if (joint >= 0) {
      const Pose& X_iL = robot.joints[static_cast<size_t>(joint)].X_iL;
      X_RL = (X_iL * MoveToAxis(robot, joint)).inverse() * part.X_iL;
    }
    DescribedPart& own = parts.emplace_back(part);
    own.X_iL = X_ab * X_RL;
    own.body = ExpressIn(part.body, own.X_iL);
    own.X_LC = own.X_iL * part.X_LC;
  }
  return parts;
}

}  // namespace dexcheck
