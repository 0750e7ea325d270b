#pragma once

// Conventions of rotations and vectors that people take for other ones, and how each is undone.

#include <vector>

#include "harness/corrections/correction.h"

namespace dexcheck {

/// A convention of a kind, and what it costs beyond the bits of which it is.
struct OriginFix {
  CorrectionKind kind;
  int component = 0;
  double bits = 0.0;
};

/// Those that a rotation in this form can have.
std::vector<OriginFix> ListRotationFixes(const PrintedOrigin& origin);
/// Gives `right` the rotation of `given` with the convention undone.
void FixRotation(const OriginFix& fix, const PrintedOrigin& given, PrintedOrigin* right);

/// Those that a vector can have: a position or a centre of mass with its units, or an axis.
std::vector<OriginFix> ListVectorFixes(SiteKind kind, const Vector3d& given);
Vector3d FixVector(const OriginFix& fix, SiteKind kind, const Vector3d& given);

/// The reflection in an axis.
Matrix3d MakeMirror(int axis);
/// The matrix that takes the entry p[k] to k.
Matrix3d MakePermutation(const int (&p)[3]);

}  // namespace dexcheck
