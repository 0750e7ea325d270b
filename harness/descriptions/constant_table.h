#pragma once

// The constants of a robot's parts, one entry each: where a description has them, where an engine's model has
// them, and what a part without them has. Comparisons of descriptions, the checks of a run, what a file lacks
// and the parts that are taken out of an engine's model all go by this table.

#include <mujoco/mujoco.h>

#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {

/// A kind of parts of an engine's model.
enum class PartKind { kJoint, kActuator, kTendon, kConstraint };

/// Roles of a joint, by the part that it carries.
enum JointRole : unsigned {
  kRobotJoint = 1,
  kWheelJoint = 2,
  kFreeJoint = 4,  ///< The base or the object: nothing holds or drives it.
};

/// A constant of a joint that descriptions may state, and that acts on the motion.
struct DescribedConstant {
  const char* check;
  const char* word;  ///< Of --ignore, and in notes.
  bool DescribedJoint::*states;
  double Joint::*value;
  mjtNum* mjModel::*engine;  ///< By dof.
  /// Describes its largest effect, where least inertia is moved: ": rates of elbow decay within 0.1 s".
  std::string (*describe_effect)(const Joint& joint, double value, double least_inertia);
};

/// A number, or a few, that each part of a kind has in an engine's model.
struct Constant {
  const char* check;
  PartKind part;
  const char* name;  ///< As an MJCF writes it, or what it is.
  std::variant<mjtNum * mjModel::*, int * mjModel::*, EngineFlag * mjModel::*> array;
  enum class Index { kPart, kPosition, kDof } index = Index::kPart;  ///< What the array is by.
  int count = 1;                                                     ///< Numbers of each part.
  std::optional<double> neutral = {};  ///< With it the part does nothing; of several numbers the first.
  bool (*applies)(const mjModel& engine, int part) = nullptr;  ///< Whether it means anything; null: always.
  unsigned roles = kRobotJoint | kWheelJoint | kFreeJoint;     ///< Which joints must have the neutral value.
};

/// All of them.
std::span<const Constant> ListConstants();
/// Those that descriptions may state.
std::span<const DescribedConstant> ListDescribedConstants();

/// The numbers of a constant of one part; zeros where it means nothing.
std::vector<double> ReadConstant(const Constant& constant, const mjModel& engine, int part);
/// Gives a part the neutral value of all its constants, of joints of those that belong to the role.
void MakeIdle(PartKind kind, int part, unsigned role, mjModel* engine);

/// The active equality/joint of first order that makes a joint of the engine's model follow another one; -1
/// when there is none.
int FindCouplingConstraint(const mjModel& engine, int joint);

/// The coupling that such a constraint gives to a joint of the engine's model; `leader` is the engine's
/// joint. None when there is no such constraint.
std::optional<JointCoupling> FindEngineCoupling(const mjModel& engine, int joint);

}  // namespace dexcheck
