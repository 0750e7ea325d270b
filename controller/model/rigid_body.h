#pragma once

// Mass properties of a link: given, or from its shapes by closed form.

#include <array>
#include <string>
#include <variant>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// Mass, centre of mass and rotational inertia of a rigid body.
struct MassProperties {
  double mass = 0.0;                    ///< kg
  Vector3d com = Vector3d::Zero();      ///< Centre of mass in the body's frame, m.
  Matrix3d inertia = Matrix3d::Zero();  ///< About the centre of mass, in the body's axes, kg m^2.
};

/// Solid of revolution, box or ellipsoid with uniform density. Its own frame has the origin at the centre of
/// mass.
struct SolidSphere {
  double radius;  ///< m
};
struct SolidCylinder {
  double radius;  ///< m
  double length;  ///< Along the shape's z axis, m.
};
struct SolidCapsule {
  double radius;  ///< m
  double length;  ///< Of the cylindrical part, along the shape's z axis, m.
};
struct SolidBox {
  Vector3d size;  ///< Full edge lengths, m.
};
struct SolidTorus {
  double ring_radius;  ///< Centre to the middle of the tube, m. The ring lies in the shape's x-y plane.
  double tube_radius;  ///< m
};
struct SolidEllipsoid {
  Vector3d semi_axes;  ///< Along the shape's x, y, z, m.
};
using Shape = std::variant<SolidSphere, SolidCylinder, SolidCapsule, SolidBox, SolidTorus, SolidEllipsoid>;

/// Symmetric tensor of its entries xx, yy, zz, xy, xz, yz, and back.
Matrix3d ToTensor(const Vector6d& entries);
Vector6d ToEntries(const Matrix3d& tensor);

/// Rotation of roll, pitch, yaw: R_z(yaw) R_y(pitch) R_x(roll).
Matrix3d TurnRollPitchYaw(const Vector3d& angles);

/// Rotational inertia of a uniform solid about its centre of mass, in its own axes, kg m^2.
Matrix3d CalcUniformInertia(const Shape& shape, double mass);

/// Mass properties of a uniform solid whose frame stands at X_BS in the body's frame B.
MassProperties CalcMassProperties(const Shape& shape, double mass, const Pose& X_BS);

/// Rotational inertia of a point mass at c about the frame's origin, m (c^2 1 - c c^T), kg m^2: what a body's
/// has there besides that about its centre of mass.
Matrix3d CalcPointInertia(double mass, const Vector3d& c);

/// Mass properties of several bodies that move as one, all given in one frame.
MassProperties Combine(const std::vector<MassProperties>& parts);

/// Empty when the properties can belong to a real body: mass >= 0, finite, inertia symmetric with principal
/// moments that are not negative and satisfy the triangle inequality; otherwise what is wrong, with the
/// value.
std::string FindPhysicalInconsistency(const MassProperties& body);

/// Describes a fault as above, except for the triangle inequality: M is positive definite without it.
std::string FindUndefinedDynamics(const MassProperties& body);

// Bodies and axes in other frames.

/// Mass properties in a frame A, given those in B and the pose X_AB of B in A.
MassProperties ExpressIn(const MassProperties& body, const Pose& X_AB);

/// A rotation that turns z into the given unit vector; axes of coordinates are only permuted.
Matrix3d MakeRotationFromZ(const Vector3d& z);

}  // namespace dexcheck
