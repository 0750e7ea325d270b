#pragma once

// What can be compared without motion, before anything else: masses, joints, wheels, fingertips, object,
// options.

#include <limits>
#include <string>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/descriptions/robot_description.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// Two readers of decimal numbers form at most short sums and products of them.
inline constexpr double kConstantRounding = 64.0 * std::numeric_limits<double>::epsilon();

/// One constant in which the parameter file and the MJCF differ.
struct ConstantFinding {
  std::string check;  ///< Name of the check, such as "link_mass".
  std::string where;  ///< Part of the robot, such as "link r_forearm".
  double model = 0.0;
  double engine = 0.0;
  Location location;
  int entry = 0;  ///< Which of the numbers that the check compares there: of a vector, a range, a 3x3 tensor.
  bool engine_only = false;  ///< The analytic model has no such number: it takes the neutral value.
  std::string effect{};      ///< What it does to the motion, when one of the two leaves it out.
};

/// Something that the MJCF sets and the analytic model has no number for, and that is no disagreement: it
/// belongs to the plant of a run, which overrides it or whose checks judge it.
struct ConstantNote {
  std::string kind;  ///< As in ListEngineFields, such as "contact_pair".
  std::string text;  ///< With the element's name and all its numbers.
};

struct ConstantChecks {
  std::vector<CheckRecord> records;
  std::vector<ConstantFinding> findings;  ///< Every disagreement, in the file's order.
  std::vector<ConstantNote> notes;

  /// The check of that name, a new one when there is none.
  CheckRecord* Define(const std::string& check);
  /// Adds a disagreement, and its error to its check.
  void Add(ConstantFinding finding);
};

/// Compares constants: mass of each link; damping, armature and range of each joint; gravity; the wheels'
/// radius, place, axis, mass, inertia, damping and armature; the floor they stand on; fingertip radii; the
/// object's mass, inertia, centre of mass, shape and friction; and finds whatever the MJCF has that the
/// analytic model lacks. engine_fields.h says of each field of the engine's model how it is seen.
ConstantChecks CheckConstants(const Adapter& adapter);

/// Compares what both descriptions state: gravity, mass of each link; damping, dry friction, armature, range
/// and coupling of each joint. Locations are those of `a`.
/// @param a, b as CompleteEachOther left them.
ConstantChecks CheckConstants(const RobotDescription& a, const RobotDescription& b);

/// Compares couplings of joints, in the place of the constant checks' findings that the engine has them.
/// @param ignores none is a disagreement. @return a note on those that only the engine has, which are not
/// compared.
std::vector<std::string> CheckCouplings(const Adapter& adapter, bool ignores, ConstantChecks* constants);

/// Judges checks by a relative tolerance where that is wider than their bound.
void JudgeByTolerance(double tolerance, std::vector<CheckRecord>* records);
/// The same of a result, whose findings are then those that the tolerance leaves.
void JudgeByTolerance(double tolerance, ConstantChecks* constants);

}  // namespace dexcheck
