#pragma once

// A robot joint by joint as its file has it: each link in its own frame, placed in its parent's.

#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// A joint and its link in the link's own frame: the joint turns about, or slides along, `axis` there.
struct OwnRow {
  int parent = -1;
  bool is_revolute = true;
  Pose X_PL = Pose::Identity();  ///< The link's own frame in its parent's own frame, at q = 0.
  Pose X_PW = Pose::Identity();  ///< Of what is welded to the parent and carries the joint.
  Vector3d axis = Vector3d::UnitZ();
  MassProperties body;  ///< In the own frame.
};

/// The rows of a description; the base's own frame is Sigma_0.
std::vector<OwnRow> ListOwnRows(const RobotDescription& robot);

/// Pose of each link's own frame in the world, the base first, with all joints at zero.
std::vector<Pose> CalcOwnPoses(const Pose& X_W0, const std::vector<OwnRow>& rows);

/// The rows as if the file's Denavit-Hartenberg rows had been changed so, and were classic ones.
std::vector<OwnRow> ReadRowsAs(const RobotDescription& robot, MdhRow (*change)(MdhRow), bool classic);

/// Parts of a link that have mass, in the own frame of another description.
/// @param joint that moves it; -1 for the base. @param X_ab the link's own frame in that of the other
/// description. @return `body`, X_LC and, as X_iL, the part's own frame, all in that frame.
std::vector<DescribedPart> ListParts(const RobotDescription& robot, int joint, const Pose& X_ab);

}  // namespace dexcheck
