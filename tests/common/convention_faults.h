#pragma once

// What people do to the numbers of a description: other units, signs, orders, axes and frames. Every test
// that spoils descriptions takes its faults from here. They are made by other code than that which finds
// them.

#include <functional>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck::testing {

/// A link as its file states it: the body in the link's own frame, and that frame in its parent's.
struct StatedLink {
  MassProperties body;
  Pose X_PL;
};

struct ConventionFault {
  std::string name;  ///< What is wrong, and how: "inertia halved".
  std::string text;  ///< The words that must name it.
  std::function<void(StatedLink*)> make;
  bool is_of_joint = false;
};

/// 66 kinds, of inertias, centres of mass, masses and joints.
const std::vector<ConventionFault>& ListConventionFaults();

/// Throws std::out_of_range without a fault of this name.
const ConventionFault& FindConventionFault(const std::string& name);

/// What the parallel-axis theorem adds to a body's inertia about the origin of its frame: m (c.c 1 - c c^T).
Matrix3d CalcOffset(const MassProperties& body);

/// Ixx, Iyy, Izz, Ixy, Ixz, Iyz.
std::vector<double> ListInertia(const Matrix3d& inertia);

}  // namespace dexcheck::testing
