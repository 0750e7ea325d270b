#pragma once

// A robot joint by joint as its file has it: each link in its own frame, placed in its parent's. Where the
// links of two descriptions are in each other, and a frame on each link that has no common one.

#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// A joint and its link in the link's own frame: the joint turns about, or slides along, `axis` there.
struct JointInLinkFrames {
  int parent = -1;
  Pose X_PL = Pose::Identity();  ///< The link's own frame in its parent's own frame, at q = 0.
  Vector3d axis = Vector3d::UnitZ();
  MassProperties body;  ///< In the own frame.
};

/// Lists the joints of a description; the base's own frame is Sigma_0.
std::vector<JointInLinkFrames> ListJointsInLinkFrames(const RobotDescription& robot);

/// Pose of each link's own frame in the world, the base first, with all joints at zero.
std::vector<Pose> CalcLinkPoses(const Pose& X_W0, const std::vector<JointInLinkFrames>& joints);

/// Frames of the links of `b` in those of `a`, by joint of `a`, as they stand with all joints at zero; the
/// identity for a joint without partner.
std::vector<Pose> PlaceLinkFrames(const RobotDescription& a, const RobotDescription& b);

/// A link of two descriptions: which frame it has is each description's own choice.
struct LinkPlace {
  int a = -1;  ///< Its joint in `a`; -1 the base.
  int b = -1;
  Pose X_ab = Pose::Identity();  ///< Frame i of `b` in that of `a`: they coincide so with all joints at zero.
};

/// The joints' links and a floating base, as far as `b` has parts of them.
/// @param a, b as CompleteEachOther left them; without places when their joints do not match.
std::vector<LinkPlace> PlaceLinks(const RobotDescription& a, const RobotDescription& b);

/// Adds to both descriptions a frame of the link's name on each link that joints move and on which they have
/// none in common, so that how links move is compared: the link's own frame of `b`, and in `a` where it is
/// with all joints at zero. @return whether there is such a link.
bool AddLinkFrames(RobotDescription* a, RobotDescription* b);

}  // namespace dexcheck
