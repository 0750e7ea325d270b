#pragma once

// Whether a repair, in the precision in which it is printed, makes what it repairs agree.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/descriptions/constant_checks.h"
#include "harness/diagnosis/repair.h"

namespace dexcheck {

/// The number of the parameter file that a constant of the constants is, when it can be read there at once.
std::optional<Parameter> FindParameter(const RobotSpec& spec, const ConstantFinding& finding);

/// Holds repairs against the engine.
class RepairCheck {
 public:
  /// @param original the model as it is in the file. @param bodies whether the engine's bodies may be read.
  /// @param tolerance relative difference that is no fault.
  RepairCheck(RobotSpec original, const mjModel& engine, std::string engine_source, int samples,
              std::uint64_t seed, bool bodies, double tolerance = 0.0);

  /// Takes out the causes whose part (joint row, frame, body, constant) does not agree after all of them are
  /// applied, until all that stay do; and equivalents that do not do as well.
  void KeepWhatRepairs(std::vector<Repair>* causes) const;

 private:
  struct Trial;
  [[nodiscard]] bool Repairs(const Repair& cause, const Trial& trial) const;
  [[nodiscard]] bool RepairsNumber(const Parameter& parameter, const Trial& trial) const;
  /// The original with the causes' repairs, in their order; nothing when that is no robot.
  [[nodiscard]] std::optional<RobotSpec> MakeRepaired(std::span<const Repair> causes) const;

  RobotSpec original_;
  const mjModel& engine_;
  std::string source_;
  int samples_;
  std::uint64_t seed_;
  bool bodies_;
  double tolerance_;
};

}  // namespace dexcheck
