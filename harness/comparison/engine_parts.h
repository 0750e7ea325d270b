#pragma once

// Parts of an engine's model besides the mechanism that a description states: motors, springs, tendons,
// constraints, flags, a fluid, contacts, and whatever acts on the joint that carries a base. They are one
// list of numbers, compared with another model's list or with a description, which has none of them.

#include <mujoco/mujoco.h>

#include <optional>
#include <string>
#include <vector>

#include "harness/comparison/constant_checks.h"
#include "harness/descriptions/constant_table.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// A number of a part.
struct PartNumber {
  std::string check;
  std::string name;  ///< "gear[0]"
  double value = 0.0;
  /// The number of a model without the part; none where it means something beside another model's part alone.
  std::optional<double> neutral = {};
  double tolerance = 0.0;   ///< Absolute; 0: to rounding.
  bool is_summary = false;  ///< Judges a part that only one model has. Two models' parts have other numbers.
};

/// A part of an engine's model in numbers.
struct EnginePart {
  std::string key;    ///< Two models' parts of one key correspond.
  std::string name;   ///< "actuator servo"; empty where each number has a name of its own.
  std::string place;  ///< Its name where only one model has it.
  Location at = {};
  std::vector<PartNumber> numbers = {};
  std::vector<std::string> acts_on = {};  ///< Names of other parts, in an order of its kind.
  std::optional<PartKind> kind = {};      ///< None of a part that is not in the table of constants.
  int id = -1;
  unsigned role = kRobotJoint;
};

/// Parts that a list leaves out, since they are compared otherwise.
struct PartOptions {
  bool leaves_out_motors = false;  ///< How motors make their forces: a URDF has no place for it.
  /// Couplings of joints (equality/joint) that the model has, too,
  bool leaves_out_couplings = false;
  bool leaves_out_all_couplings = false;  ///< and those that it has not.
};

/// All parts of a model, and what is no disagreement.
struct EngineParts {
  std::vector<EnginePart> parts;
  std::vector<ConstantNote> notes;
  std::vector<std::string> motors;  ///< Names of those that are left out.
};
EngineParts ListEngineParts(const Adapter& adapter, const PartOptions& options = {});

/// Compares the parts of two models. Anything but the neutral value is a finding where only one has the part.
/// @param first none for a description.
void CompareParts(const std::vector<EnginePart>& first, const std::vector<EnginePart>& second,
                  ConstantChecks* result);

/// Takes the parts that both models have out of the second one, so that its terms are the mechanism's. The
/// first one's terms are those of its description, and have none of them.
/// @return lines on forces of later releases of the engine that were taken out.
std::vector<std::string> LeaveOutShared(const std::vector<EnginePart>& first,
                                        const std::vector<EnginePart>& second, const mjModel& first_engine,
                                        mjModel* second_engine);

/// Lets a motor of the second model correspond to one of another name in the first, where each is the only
/// one there of no partner that acts on the same joint.
void MatchMotors(const std::vector<EnginePart>& first, std::vector<EnginePart>* second);

/// Names the motors that only one of two files has. @return a line for each file that has such.
std::vector<std::string> ListLoneMotors(const std::vector<EnginePart>& first,
                                        const std::vector<EnginePart>& second, const std::string& first_file,
                                        const std::string& second_file);

/// Compares the order in which two files have the motors that both have, which is the order of controls.
/// @return a line with both orders; none where they are one.
std::vector<std::string> CompareMotorOrder(const std::vector<EnginePart>& first,
                                           const std::vector<EnginePart>& second,
                                           const std::string& first_file, const std::string& second_file);

}  // namespace dexcheck
