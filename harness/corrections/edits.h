#pragma once

// The table of conventions that people take for other ones: each is undone by an edit of a link.

#include <optional>
#include <utility>
#include <vector>

#include "harness/corrections/correction.h"

namespace dexcheck {

/// A convention, and how it is undone.
struct LinkEdit {
  FileFault fault;
  double bits = 0.0;  ///< Beyond those of which convention.
  LinkUndo undo;
};

/// Poses and numbers that conventions of a link refer to.
struct EditFrames {
  std::vector<Pose> X_PL{};  ///< The link in its parent's frame: by its origins, and as right.
  std::vector<Pose> X_LC{};  ///< Links on it, in its frame.
  /// The right mass and centre, where they are wrong: faults of one body must not hide each other.
  std::optional<std::pair<double, Vector3d>> right{};
};

/// Conventions of an origin's rotation alone.
std::vector<LinkEdit> ListRotationEdits(const PrintedOrigin& origin);
/// Those of its rotation, position or both.
std::vector<LinkEdit> ListOriginEdits(const PrintedOrigin& origin, const EditFrames& frames = {});
/// Those of mass, centre, inertia, or centre and inertia, and what a compiler made of them.
std::vector<LinkEdit> ListInertialEdits(const PrintedLink& link, const EditFrames& frames = {});
/// Axes with the sign or the order of their numbers changed.
std::vector<std::pair<FileFault, Vector3d>> ListAxisEdits(const Vector3d& axis);

/// The matrix that puts the entry k at p[k].
Matrix3d MakePermutation(const int (&p)[3]);

/// The link with the edit, each number with the half unit that it has from those of the link.
PrintedLink Carry(const PrintedLink& link, const LinkUndo& undo);

}  // namespace dexcheck
