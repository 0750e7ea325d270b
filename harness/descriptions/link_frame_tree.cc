#include "harness/descriptions/link_frame_tree.h"

#include <algorithm>
#include <set>

#include "controller/model/rigid_body.h"

namespace dexcheck {
namespace {

/// The own frame in frame i, moved to the row's place on the joint's axis: an MJCF's may stand beside it.
Pose PlaceOnAxis(const RobotDescription& robot, int joint) {
  Pose X_iL = Pose::Identity();
  if (joint >= 0) X_iL.linear() = robot.joints[static_cast<size_t>(joint)].X_iL.linear();
  return X_iL;
}

Pose CalcRow(const Joint& joint, const MdhRow& mdh) {
  return joint.X_PB * CalcMdhTransform(mdh.alpha, mdh.a, mdh.q, mdh.d);
}

bool HasParts(const RobotDescription& robot, int joint) {
  return std::ranges::any_of(robot.parts, [&](const DescribedPart& part) { return part.joint == joint; });
}

}  // namespace

std::vector<JointInLinkFrames> ListJointsInLinkFrames(const RobotDescription& robot) {
  std::vector<JointInLinkFrames> rows;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    const Pose X_iL = PlaceOnAxis(robot, static_cast<int>(i));
    const Pose X_jP = PlaceOnAxis(robot, joint.parent);
    JointInLinkFrames& row = rows.emplace_back();
    row.parent = joint.parent;
    row.X_PL = X_jP.inverse() * CalcRow(joint, joint.mdh) * X_iL;
    row.axis = X_iL.linear().row(2).transpose();  // one of those that a ball joint turns about
    row.body = ExpressIn(joint.body, X_iL.inverse());
  }
  return rows;
}

std::vector<Pose> CalcLinkPoses(const Pose& X_W0, const std::vector<JointInLinkFrames>& rows) {
  std::vector<Pose> poses = {X_W0};
  for (const JointInLinkFrames& row : rows)
    poses.push_back(poses[static_cast<size_t>(row.parent + 1)] * row.X_PL);
  return poses;
}

std::vector<Pose> PlaceLinkFrames(const RobotDescription& a, const RobotDescription& b) {
  const auto calc_poses = [](const RobotDescription& robot) {
    const Base& base = robot.spec.base;
    const Pose X_W0 = base.type == BaseType::kFloating ? Pose::Identity() : base.X_B0;
    return CalcLinkPoses(X_W0, ListJointsInLinkFrames(robot));
  };
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  const std::vector<Pose> poses_a = calc_poses(a), poses_b = calc_poses(b);
  std::vector<Pose> placed(b_of_a.size(), Pose::Identity());
  for (size_t i = 0; i < placed.size(); ++i) {
    if (b_of_a[i] >= 0)
      placed[i] = poses_a[i + 1].inverse(Eigen::Isometry) * poses_b[static_cast<size_t>(b_of_a[i] + 1)];
  }
  return placed;
}

std::vector<LinkPlace> PlaceLinks(const RobotDescription& a, const RobotDescription& b) {
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  if (std::ranges::find(b_of_a, -1) != b_of_a.end()) return {};
  const std::vector<Pose> placed = PlaceLinkFrames(a, b);
  std::vector<LinkPlace> places;
  if (a.spec.base.type == BaseType::kFloating) places.emplace_back();
  for (size_t i = 0; i < b_of_a.size(); ++i) {
    if (!HasParts(b, b_of_a[i])) continue;  // between several joints of one body there is none
    places.push_back({static_cast<int>(i), b_of_a[i],
                      PlaceOnAxis(a, static_cast<int>(i)) * placed[i] *
                          PlaceOnAxis(b, b_of_a[i]).inverse(Eigen::Isometry)});
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
