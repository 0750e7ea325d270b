#pragma once

// Forces that act at a point of a body, not at its centre of mass.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {

/// Which way bodies are turned at one step: links, then the object, as their candidates follow each other.
using Turns = std::vector<Matrix3d>;

/// Rows of steps in which a fault acts.
struct StepRange {
  Eigen::Index begin = 0, end = 0;
  bool operator==(const StepRange&) const = default;
};

/// The candidate of that fault at that place, of which there is one.
const Candidate& FindCandidate(std::span<const Candidate> candidates, std::string_view fault,
                               std::string_view place);
/// The arm, across the force, of a force and a moment (6).
Vector3d CalcArm(const Eigen::Ref<const VectorXd>& wrench);

/// Adds a force that keeps its direction in the world and acts at a point of a body, for those bodies of
/// which one explains most of y. The point is where it explains most, found by Gauss-Newton steps.
/// @param turns of each step. @param reach how far from the centre of mass it may be, m.
/// @param candidates with force and moment of each body.
void AddForcesAtPoints(const VectorXd& y, const std::vector<Turns>& turns, double reach,
                       std::vector<Candidate>* candidates);

/// One that has a force and moment (6, world axes) at a step; none where no point of the body has it.
std::optional<Candidate> MakeForceOfWrench(const std::string& place, const VectorXd& wrench,
                                           const StepRange& within, Eigen::Index step, double reach,
                                           const std::vector<Turns>& turns,
                                           std::span<const Candidate> candidates);

/// Returns one of those beside other faults. @param one, force (N) the first guess. @param beside columns of
/// the others.
/// @returns none where there is no such point.
std::optional<Candidate> RefinePoint(const VectorXd& y, const std::vector<Turns>& turns, double reach,
                                     const Candidate& one, const VectorXd& force, const StepRange& within,
                                     const MatrixXd& beside, std::span<const Candidate> candidates);

/// Columns of a centre of mass at `place` that is about d (m) off: by d it changes the inertia about the old
/// one by b(d, d), b(d, e) = m (d^T e 1 - (d e^T + e d^T) / 2), and those of d_k get b(d, e_k).
/// @param more mass than the nominal one, kg.
MatrixXd CalcCenterColumns(const std::string& place, const Vector3d& d, double more,
                           std::span<const Candidate> candidates);

/// Whether a body can have a payload's amplitudes, within these errors: mass, first moment, inertia.
bool IsPossibleLoad(const VectorXd& amplitude, const VectorXd& error);

}  // namespace dexcheck
