#pragma once

// Rotations that are written in another convention: angles and quaternions.

#include <optional>
#include <span>

#include "controller/common/types.h"

namespace dexcheck {

/// What makes the given rotation right, or what makes a right one so: one of the two may be unknown, and
/// angles are not unique where the pitch is a quarter turn.
struct RotationFault {
  const char* id;
  const char* words;
  Matrix3d (*undo)(const Matrix3d& given);
  Matrix3d (*apply)(const Matrix3d& right);
};

std::span<const RotationFault> ListRotationFaults();

/// The rotation with the fault undone, as far as it is known.
std::optional<Matrix3d> Undo(const RotationFault& fault, const Matrix3d& given, const Matrix3d& right);

}  // namespace dexcheck
