#pragma once

// What can be compared without motion, before anything else: masses, joints, wheels, fingertips, object,
// options.

#include <string>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// One constant that the parameter file and the MJCF give differently.
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

/// Judges checks by a relative tolerance where that is wider than their bound.
void JudgeByTolerance(double tolerance, std::vector<CheckRecord>* records);
/// The same of a result, whose findings are then those that the tolerance leaves.
void JudgeByTolerance(double tolerance, ConstantChecks* constants);

}  // namespace dexcheck
