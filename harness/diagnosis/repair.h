#pragma once

// A change of the analytic model that would make it agree with the engine.

#include <string>
#include <vector>

#include "harness/diagnosis/parameters.h"

namespace dexcheck {

enum class RepairKind {
  kParameters,    ///< One number, or several of one vector or tensor.
  kAxisReversed,  ///< A joint turns (or slides) the other way.
  kAxisTurned,    ///< It turns about, or slides along, another axis than a plain row says.
  kRowsSwapped,   ///< The MDH rows of two joints are exchanged.
  kPosesSwapped,  ///< The places where two joints start on their parents are exchanged.
  kEngineOnly,    ///< The MJCF has something that the analytic model cannot have.
};

struct Repair {
  RepairKind kind = RepairKind::kParameters;
  std::vector<Parameter>
      parameters;  ///< kParameters: what to change (a mass first when its inertia scales with it),
  std::vector<double>
      values;      ///< and the values that repair it; of kAxisTurned q and alpha, as FileTerms has them.
  int joint = -1;  ///< Of all but numbers.
  int other = -1;  ///< The swaps.
  bool is_plain = false;  ///< kAxisReversed: of a row whose link's frame stays where it is.
  std::string note;       ///< kEngineOnly, in words; of kAxisTurned the right axis.

  double explained = 0.0;  ///< Fraction of all residuals that the repair removes, after the causes before it.
  double explained_of_forces = 0.0;  ///< The same of the forces alone.
  std::vector<Repair> equivalents;   ///< Other repairs that remove just as much.

  void Add(const Parameter& parameter, double value) {
    parameters.push_back(parameter);
    values.push_back(value);
  }
};

/// The repair.
void Apply(const Repair& cause, RobotSpec* spec);

/// "link r_forearm: mass 1.9 kg in FILE, 1.998 kg repairs it". `spec` is the model as it is in the file.
std::string Describe(const Repair& cause, const RobotSpec& spec, const std::string& file);
/// "link r_forearm: mass".
std::string DescribeShort(const Repair& cause, const RobotSpec& spec);

/// A repair for each vector or tensor of which it changes numbers.
std::vector<Repair> SplitByVector(const Repair& cause);
/// Makes one repair of a mass and an inertia that grow alike, to `same`: a solid of another mass.
void MergeScaledBodies(const RobotSpec& spec, double same, std::vector<Repair>* causes);

/// The joint turns the other way: q_i becomes -q_i, and at q_i = 0 nothing moves.
void ReverseAxis(RobotSpec* spec, int joint);

/// Decimal digits that the value needs, in the units of a parameter file; 0 for zero. People write few.
int CountDigits(const RobotSpec& spec, const Parameter& parameter, double value);

/// The value as it is read back from what is printed of it, in the model's units.
double ReadBackPrinted(const RobotSpec& spec, const Parameter& parameter, double value);

/// A solved value as a person would have written it, when that is within the accuracy of solving; else as it
/// is.
double RoundSolved(const RobotSpec& spec, const Parameter& parameter, double value);
/// The same within a wider accuracy, relative; the value as it is when that is 0.
double RoundWithin(const RobotSpec& spec, const Parameter& parameter, double value, double accuracy);

/// Whether all numbers of a cause agree to four digits: published numbers are rounded.
bool LooksRounded(const Repair& cause, const RobotSpec& spec);

/// Of repairs that remove as much, the likelier: whose numbers are rounder, then whose numbers are not zero
/// in the file, then the earlier kind.
bool IsLikelier(const Repair& a, const Repair& b, const RobotSpec& spec);

}  // namespace dexcheck
