#pragma once

// Faults of conventions and units that people make on one link or on all: which of them would make two
// descriptions agree.

#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// One fault that explains a disagreement.
struct Hypothesis {
  /// One line: "all inertias look as if given about the link's origin: 7 of 7 links".
  std::string text;
  /// What the first description has and what would be right, one line each; at most a few.
  std::vector<std::string> values;
  /// Fraction of the residuals, squared and scaled, that are gone with the fault undone.
  double explained = 0.0;
};

/// To what numbers agree once a fault is undone, relative: published ones have some seven digits.
inline constexpr double kHypothesisTolerance = 1e-6;

/// Tries the faults that are known, each on all parts and on each part, and says which explain why `a`
/// differs from `b`; those of geometry first, then gravity, then those of bodies, each at most once per part.
/// A fault is named only when what it is about agrees to `tolerance` (relative) with the fault undone,
/// and did not before.
/// @param a, b as CompleteEachOther left them; `a` is the one that may be wrong.
std::vector<Hypothesis> FindHypotheses(const RobotDescription& a, const RobotDescription& b,
                                       double tolerance = kHypothesisTolerance);

/// The same of two descriptions as they were read; nothing when they are of two mechanisms.
std::vector<Hypothesis> ExplainDifference(RobotDescription a, RobotDescription b,
                                          double tolerance = kHypothesisTolerance);

// The parts of the search.

/// A body of `a`, and that of `b` which it should be, both in the link's own frame of `a`.
struct ComparedBody {
  int joint = -1;  ///< Of `a`; -1 for the base.
  std::string link;
  MassProperties given;
  MassProperties right;
  /// Axes along which the file gives the inertia, when the body is one part; the identity otherwise.
  Matrix3d R_LC = Matrix3d::Identity();
  Pose X_PL = Pose::Identity();  ///< The link's own frame in its parent's, at q = 0.
  // With `body`, X_LC and, as X_iL, the part's own frame in the link's own frame of `a`.
  std::vector<DescribedPart> given_parts;  ///< Of the given body, where they have mass.
  std::vector<DescribedPart> parts;        ///< Of the right body.
};

/// Faults of single bodies, of lists of bodies, and of their units.
/// @param length of the robot, that places are compared relative to, m.
std::vector<Hypothesis> FindBodyHypotheses(const std::vector<ComparedBody>& bodies, double length,
                                           double tolerance);

/// Whether one of the faults of single bodies explains this one.
bool IsExplainedAlone(const ComparedBody& body, double length, double tolerance);

/// A joint and its link in the link's own frame: the joint turns about, or slides along, `axis` there.
struct OwnRow {
  int parent = -1;
  bool is_revolute = true;
  Pose X_PL = Pose::Identity();  ///< The link's own frame in its parent's own frame, at q = 0.
  Vector3d axis = Vector3d::UnitZ();
  MassProperties body;  ///< In the own frame.
};

/// The rows of a description; the base's own frame is Sigma_0.
std::vector<OwnRow> ListOwnRows(const RobotDescription& robot);

/// Pose of each link's own frame in the world, the base first, at the joints' positions q.
std::vector<Pose> CalcOwnPoses(const Pose& X_W0, const std::vector<OwnRow>& rows, const VectorXd& q);

/// Faults of joints' places, zeros, axes and units.
/// @param right rows of `b` in the order of `a`'s. @param rows of `a`; gets them with those undone that were
/// found. @param X_W0_a, X_W0_b Sigma_0 in the world, of a base that is fixed.
std::vector<Hypothesis> FindJointHypotheses(const RobotDescription& a, const Pose& X_W0_a, const Pose& X_W0_b,
                                            const std::vector<OwnRow>& right, double length, double tolerance,
                                            std::vector<OwnRow>* rows);

}  // namespace dexcheck
