#include <algorithm>
#include <set>

#include "controller/model/rigid_body.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/fault_search.h"

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

bool HasParts(const RobotDescription& robot, int joint) {
  return std::ranges::any_of(robot.parts, [&](const DescribedPart& part) { return part.joint == joint; });
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

std::vector<Pose> CalcZeroPoses(const RobotDescription& robot) {
  const Base& base = robot.spec.base;
  const Pose X_W0 = base.type == BaseType::kFloating ? Pose::Identity() : base.X_B0;
  return CalcOwnPoses(X_W0, ListOwnRows(robot));
}

void TakeOwnRow(int index, const Pose& X_PL, const Vector3d& axis, RobotDescription* robot) {
  Joint& joint = robot->spec.joints[static_cast<size_t>(index)];
  Pose& X_iL = robot->joints[static_cast<size_t>(index)].X_iL;
  const Pose X_Li = X_iL.inverse();
  if (!X_Li.linear().col(2).isApprox(axis)) X_iL.linear() = MakeRotationFromZ(axis).transpose();
  Pose X_jP = Pose::Identity();
  if (joint.parent >= 0) X_jP = robot->joints[static_cast<size_t>(joint.parent)].X_iL;
  joint.X_PB = X_jP * X_PL * X_iL.inverse();
  joint.mdh = MdhRow{};
  const Pose turn = X_iL * X_Li;
  joint.body = ExpressIn(joint.body, turn);
  const auto move = [&](int carrier, Pose* X) {
    if (carrier == index) *X = turn * *X;
  };
  for (Joint& child : robot->spec.joints) move(child.parent, &child.X_PB);
  for (Frame& frame : robot->spec.frames) move(frame.link, &frame.X_LF);
  for (DescribedPart& part : robot->parts) move(part.joint, &part.X_iL);
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

std::vector<LinkPlace> PlaceLinks(const RobotDescription& a, const RobotDescription& b) {
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  if (std::ranges::find(b_of_a, -1) != b_of_a.end()) return {};
  const std::vector<Pose> poses_a = CalcZeroPoses(a);
  const std::vector<Pose> poses_b = CalcZeroPoses(b);
  std::vector<LinkPlace> places;
  if (a.spec.base.type == BaseType::kFloating) places.emplace_back();
  for (size_t i = 0; i < b_of_a.size(); ++i) {
    const auto j = static_cast<size_t>(b_of_a[i]);
    if (!HasParts(b, b_of_a[i])) continue;  // between several joints of one body there is none
    const Pose X_own = poses_a[i + 1].inverse(Eigen::Isometry) * poses_b[j + 1];
    places.push_back({static_cast<int>(i), b_of_a[i],
                      a.joints[i].X_iL * X_own * b.joints[j].X_iL.inverse(Eigen::Isometry)});
  }
  return places;
}

bool AddLinkFrames(RobotDescription* a, RobotDescription* b) {
  std::set<int> has_frame;
  std::set<std::string> taken;
  for (const Frame& frame : a->spec.frames) has_frame.insert(frame.link);
  for (const RobotDescription* const robot : {a, b}) {
    for (const Frame& frame : robot->spec.frames) taken.insert(frame.name);
  }
  const size_t before = a->spec.frames.size();
  for (const LinkPlace& place : PlaceLinks(*a, *b)) {
    if (place.a < 0 || has_frame.contains(place.a)) continue;
    const std::string& name = a->spec.joints[static_cast<size_t>(place.a)].link;
    if (!taken.insert(name).second) continue;
    const Pose& X_bL = b->joints[static_cast<size_t>(place.b)].X_iL;
    a->spec.frames.push_back({name, place.a, place.X_ab * X_bL, {}});
    b->spec.frames.push_back({name, place.b, X_bL, {}});
  }
  return a->spec.frames.size() > before;
}

}  // namespace dexcheck
