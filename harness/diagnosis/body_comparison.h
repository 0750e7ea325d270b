#pragma once

// Numbers that both sides state: bodies, joint constants, gravity, read from the engine's model in the
// parameter file's own terms.

#include <vector>

#include "harness/diagnosis/placement.h"
#include "harness/diagnosis/repair.h"

namespace dexcheck {

/// What the engine has in the place of numbers of the parameter file, for links that stand where the engine
/// has them: mass, centre of mass and inertia in the link's frame (of the base in Sigma_0, without the
/// wheels), damping and armature of joints, the wheels' transverse inertia, gravity.
///
/// No fit: each value is read by itself, so that any number of them may be wrong at once.
class BodyComparison {
 public:
  /// @param spec has the geometry repaired as far as possible. @param evidence, engine must outlive this.
  BodyComparison(const RobotSpec& spec, const EngineEvidence& evidence, const mjModel& engine);

  /// One cause for each number, vector or tensor that differs; a mass whose inertia differs in proportion is
  /// one with it. In the file's order.
  [[nodiscard]] std::vector<Repair> Run() const;

 private:
  void CompareBody(int link, std::vector<Repair>* causes) const;
  /// In the link's frame as the specification places it; of the base without the wheels.
  [[nodiscard]] MassProperties ReadBody(int link) const;
  void Compare(const std::vector<Parameter>& parameters, const std::vector<double>& values, double scale,
               std::vector<Repair>* causes) const;
  void CompareJoints(std::vector<Repair>* causes) const;

  const RobotSpec& spec_;
  const EngineEvidence& evidence_;
  const mjModel& engine_;
  RobotModel model_;
  Adapter adapter_;
  Placement placement_;
};

/// Whether a link stands where the engine has it: its axis, its ancestors' axes, and all frames and axes that
/// it carries.
bool IsPlaced(const Placement& placement, int link);

}  // namespace dexcheck
