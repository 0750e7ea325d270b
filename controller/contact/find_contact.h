#pragma once

// The contact of two posed bodies: the pair of points where the surfaces are closest (or overlap deepest).

#include "controller/common/types.h"
#include "controller/contact/contact_geometry.h"
#include "controller/contact/surface.h"

namespace dexcheck {

/// Misalignment of the normals (rad), and offset relative to the lengths involved, at which FindContact
/// stops: a few hundred rounding errors.
inline constexpr double kContactConvergence = 1e-13;

/// Where two surfaces meet.
struct FoundContact {
  ContactCoordinates kappa;  ///< normalized
  double gap = 0.0;          ///< m along the common normal; negative where the bodies overlap
};

/// Contact coordinates (39) of two bodies by geometry: the points whose normals oppose each other and whose
/// connection is along them, found by Newton's method from `guess`. X_OF is the pose of the fingertip frame
/// in the object frame. With the integrated kappa as the guess, this projects it back onto the constraint.
/// Throws SingularityError, with the remaining misalignment in rad, when it finds no such pair.
FoundContact FindContact(const Surface& fingertip, const Surface& object, const Pose& X_OF,
                         const ContactCoordinates& guess);

/// As above without a guess: starts at the object's point closest to the fingertip frame's origin.
FoundContact FindContact(const Surface& fingertip, const Surface& object, const Pose& X_OF);

}  // namespace dexcheck
