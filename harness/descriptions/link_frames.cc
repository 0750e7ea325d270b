#include "harness/descriptions/link_frames.h"

#include <algorithm>
#include <set>

#include "harness/descriptions/description_match.h"
#include "harness/descriptions/own_rows.h"

namespace dexcheck {
namespace {

/// Of each link's own frame in the world, the base first, with all joints at zero.
std::vector<Pose> CalcZeroPoses(const RobotDescription& robot) {
  const Base& base = robot.spec.base;
  const Pose X_W0 = base.type == BaseType::kFloating ? Pose::Identity() : base.X_B0;
  return CalcOwnPoses(X_W0, ListOwnRows(robot));
}

bool HasParts(const RobotDescription& robot, int joint) {
  return std::any_of(robot.parts.begin(), robot.parts.end(),
                     [&](const DescribedPart& part) { return part.joint == joint; });
}

}  // namespace

std::vector<LinkPlace> PlaceLinks(const RobotDescription& a, const RobotDescription& b) {
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  if (std::find(b_of_a.begin(), b_of_a.end(), -1) != b_of_a.end()) return {};
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
