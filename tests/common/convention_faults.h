#pragma once

// Common modelling errors of descriptions: other units, signs, orders, axes and frames. All tests of faulty
// descriptions use these. They share no code with the search for faults.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck::testing {

/// A link as its file states it, and the joint that moves it.
struct StatedLink {
  MassProperties body;                      ///< In the link's own frame.
  Pose X_PL;                                ///< That frame in its parent's.
  Matrix3d R_LC = Matrix3d::Identity();     ///< Axes along which the file gives the inertia.
  Vector3d axis = Vector3d::UnitZ();        ///< In the link's own frame.
  std::optional<Pose> X_LD = std::nullopt;  ///< The next joint's frame, where there is one.
  double lower = 0.0;                       ///< Lower end of the range, rad.
  double upper = 0.0;
  double damping = 0.0;
  double armature = 0.0;
};

/// Part of a file that a fault changes.
enum class FaultOf { kBody, kJoint, kConstant };

struct ConventionFault {
  std::string name;  ///< Name of the fault: "inertia halved".
  std::string text;  ///< The words that must name it.
  std::function<void(StatedLink*)> make;
  FaultOf of = FaultOf::kBody;
  /// How an explanation calls it: all of these, each in one.
  std::vector<std::string> ids{};
};

/// Some 100 kinds, of inertias, centres of mass, masses, joints and their constants.
const std::vector<ConventionFault>& ListConventionFaults();

/// Throws std::out_of_range without a fault of this name.
const ConventionFault& FindConventionFault(const std::string& name);

/// The parallel-axis term of a body's inertia about the origin of its frame: m (c.c 1 - c c^T).
Matrix3d CalcOffset(const MassProperties& body);

}  // namespace dexcheck::testing
