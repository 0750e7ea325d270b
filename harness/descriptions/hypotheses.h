#pragma once

// Why two descriptions of one robot differ: which conventions and units, on which parts, would make them
// agree.

#include <optional>
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
  /// Fraction of what differs (a mass, a centre of mass, a place, ...) that is right with the fault undone.
  double explained = 0.0;
  /// "inertia.about_origin": the convention; several when these two files cannot tell which.
  std::vector<std::string> ids;
  /// Links or joints that have it.
  std::vector<std::string> parts;
};

/// What explains a difference, and what is left of it.
struct ExplainedDifference {
  /// Conventions, and the numbers that remain wrong ("number.mass"); nothing when no convention explains any
  /// of it, or when they are of two mechanisms.
  std::vector<Hypothesis> hypotheses;
  /// The first description with all conventions undone and its numbers as they are; none where nothing was
  /// undone, or where it is a table of Denavit-Hartenberg rows that would have to be written in another way.
  std::optional<RobotDescription> undone;
};

/// To what numbers agree once a fault is undone, relative: published ones have some seven digits.
inline constexpr double kHypothesisTolerance = 1e-6;

/// Searches the table of conventions (conventions.h) for what explains why `a` differs from `b`: on one part,
/// on several, on all; geometry first, then constants, then bodies. Besides conventions, numbers that remain
/// wrong are listed ("number.mass"). A fault is named only when what it is about agrees to `tolerance`
/// (relative) with the fault undone, and did not before; when several do equally well, all of them.
/// @param a, b as they were read; `a` is the one that may be wrong.
ExplainedDifference Explain(const RobotDescription& a, const RobotDescription& b,
                            double tolerance = kHypothesisTolerance);
inline std::vector<Hypothesis> ExplainDifference(const RobotDescription& a, const RobotDescription& b,
                                                 double tolerance = kHypothesisTolerance) {
  return Explain(a, b, tolerance).hypotheses;
}

}  // namespace dexcheck
