#pragma once

// Conventions that people take for other ones when they write a robot down: the one table of them.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/model/rigid_body.h"

namespace dexcheck {

/// What of a part a convention is about.
enum class Quantity { kMass, kCom, kInertia, kOrigin, kRotation, kPlace, kAxis, kRange, kDamping, kArmature };

inline bool IsOfBody(Quantity quantity) { return quantity <= Quantity::kInertia; }
inline bool IsOfPlace(Quantity quantity) {
  return quantity > Quantity::kInertia && quantity < Quantity::kAxis;
}
inline bool IsOfRow(Quantity quantity) { return IsOfPlace(quantity) || quantity == Quantity::kAxis; }

/// "mass" and "masses"; "place" stands for origin and rotation together.
const char* NameOf(Quantity quantity, bool many);

/// "[a, b, c]" to be read: seven digits, zero for what is rounding beside the largest.
std::string ShowNumbers(const VectorXd& values);

/// What a file states of a link, or of a part that is welded to one, and of what places it.
struct StatedPart {
  MassProperties body;                   ///< In the part's own frame L.
  Matrix3d R_LC = Matrix3d::Identity();  ///< Axes along which the file gives the inertia.
  Pose X_PL = Pose::Identity();          ///< The own frame in the parent's, at q = 0.
  Vector3d axis = Vector3d::UnitZ();     ///< In L.
  std::vector<Pose> X_LD{};              ///< Frames of the next joints in L.
  double lower = 0.0, upper = 0.0, damping = 0.0, armature = 0.0;
};

/// Whether they agree in a quantity, relative; places relative to `length`, m.
bool AgreesIn(Quantity quantity, const StatedPart& a, const StatedPart& b, double length, double tolerance);
/// Gives `part` the quantity of another one.
void TakeFrom(const StatedPart& other, Quantity quantity, StatedPart* part);

struct Convention {
  std::string id;  ///< "inertia.about_origin"
  Quantity of;
  std::string words;  ///< "as if given about the link's origin"
  /// The part with the convention undone, as far as it can be wrong so. What was lost by it (products that
  /// are missing) is taken from the right one.
  std::function<std::optional<StatedPart>(const StatedPart& given, const StatedPart& right)> undo;
};

/// In the order in which they are named when several do as well.
const std::vector<Convention>& ListConventions();

/// How a fixed base may be mounted: `undo` of its X_PL, which is its place in the world.
const std::vector<Convention>& ListMountings();

/// A rotation that is written in another convention, of angles or a quaternion.
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
