#pragma once

// How soft the engine's contacts are, from the engine's own numbers.

#include "harness/engine/adapter.h"

namespace dexcheck {

/// Fractions of a change of forces that soft contacts hold back at first. A smooth force F on the robot and
/// what it holds causes contact forces (A + R) f = -J M^-1 F + ... with A = J M^-1 J^T and the engine's R,
/// where rigid contacts have R = 0. In |.|_M the accelerations differ by the matrix (1 + J^T R^-1 J)^-1 on
/// the range of J^T (M = 1 in that metric), whose largest eigenvalue is
///
///   fraction = 1 / (1 + s),   s the smallest eigenvalue of R^-1/2 A R^-1/2 that is not zero:
///
/// directions that contacts hold twice have zeros there, and nothing moves along them.
struct ContactSoftness {
  double fraction = 0.0;             ///< Of all rows of all contacts.
  double tangential_fraction = 0.0;  ///< Of the rows along the tangents, the others taken as rigid.
  /// Likewise of the object's contacts alone.
  double object_fraction = 0.0, object_tangential_fraction = 0.0;
};

/// Where robot and object stand. Contacts that are open by less than 0.1 mm count as closed.
/// @param adapter of an engine whose contacts have constant impedances. @param q q' (p').
ContactSoftness FindContactSoftness(const Adapter& adapter, const Eigen::Ref<const VectorXd>& q,
                                    const Pose& X_Bo);

}  // namespace dexcheck
