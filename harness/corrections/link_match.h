#pragma once

// Which link of one file is which of another, and what of each moves as one.

#include <vector>

#include "harness/corrections/printed_robot.h"

namespace dexcheck {

/// By link of one file the link of the other; -1 where it has none.
struct LinkMatch {
  std::vector<int> b_of_a;
  std::vector<int> a_of_b;
};

/// Matches links by name, then by their joints' names, then by similar names, then by the tree, which
/// decides too where names contradict it.
/// Whose names say which link is which.
enum class MatchBy {
  kLinks,   ///< Links' names; joints' where there are no such links.
  kTree,    ///< Links' names; where there are no such links the tree.
  kJoints,  ///< Joints' names; links' where there are no such joints.
};
LinkMatch MatchLinks(const PrintedRobot& a, const PrintedRobot& b, MatchBy by = MatchBy::kLinks);

bool Moves(const PrintedLink& link);
/// Whether a link turns about an axis or moves along one.
bool HasAxis(const PrintedLink& link);

/// A link that both files have, and what is welded to it and only this file has.
struct Node {
  int link = -1;
  int parent = -1;         ///< The link of the node that carries it; -1: the world.
  std::vector<int> chain;  ///< Links whose origins lead from there to it, itself last.
  std::vector<int> parts;  ///< Links with an inertial that move with it.
};

/// The nodes of a robot by link; those of other links are empty (link -1). Links that move and that the other
/// file lacks are left out with all that they carry.
std::vector<Node> ListNodes(const PrintedRobot& robot, const std::vector<int>& other);

// Mass properties are those in a link's frame, or the tolerances that digits give them.

/// A pose and the tolerance that digits give it.
struct PoseTolerance {
  Vector3d length = Vector3d::Zero();
  double angle = 0.0;
};

Pose CalcNodePose(const PrintedRobot& robot, const Node& node);
/// An origin of a node's chain: the node stands at before * X * after.
struct ChainOrigin {
  int link;
  Pose before, X, after;
};
std::vector<ChainOrigin> ListOrigins(const PrintedRobot& robot, const Node& node);
/// Whether two poses differ by more than this angle, or along an axis by more than this length.
bool IsTurned(const Pose& X, const Pose& Y, double open);
bool IsMoved(const Pose& X, const Pose& Y, const Vector3d& open);
/// Pose of the frame of one of its parts in a node's frame.
Pose CalcPartPose(const PrintedRobot& robot, const Node& node, int part);
MassProperties CalcNodeBody(const PrintedRobot& robot, const Node& node);
/// Tolerance of these by the half units of the digits. @param robot is changed and put back.
PoseTolerance CalcPoseTolerance(const Node& node, PrintedRobot* robot);
MassProperties CalcBodyTolerance(const Node& node, PrintedRobot* robot);

/// Adds |after - before|.
void AddChange(const Pose& before, const Pose& after, PoseTolerance* tolerance);
void AddChange(const MassProperties& before, const MassProperties& after, MassProperties* tolerance);

}  // namespace dexcheck
