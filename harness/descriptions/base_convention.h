#pragma once

// How libraries write the state of a floating base, and how terms go from one way to the other.

#include <string>
#include <vector>

#include "harness/descriptions/term_results.h"

namespace dexcheck {

/// A way to write the base's pose and velocity. The default is this project's, which is MuJoCo's.
struct BaseConvention {
  enum class Position {
    kXyzWxyz,  ///< x, y, z, then the quaternion with its scalar first (MuJoCo).
    kXyzXyzw,  ///< x, y, z, then the quaternion with its scalar last (Pinocchio, ROS, Bullet).
    kWxyzXyz,  ///< The quaternion with its scalar first, then x, y, z (Drake, Simbody).
  };
  Position position = Position::kXyzWxyz;
  bool angular_first = false;   ///< The velocity is [angular; linear] (Drake, Simbody, Featherstone).
  bool linear_in_base = false;  ///< The origin's velocity is along the base's axes (Pinocchio).
  bool angular_in_world =
      false;  ///< The angular velocity is along the world's axes (Drake, Simbody, Bullet).

  bool operator==(const BaseConvention&) const = default;
};

/// "x y z qw qx qy qz; linear velocity in world axes, then angular velocity in the base's axes": a
/// convention in words.
std::string Describe(const BaseConvention& convention);

/// All that there are; the default first.
std::vector<BaseConvention> ListBaseConventions();

/// Converts state and terms of a floating base with joints behind it to another convention. The base's
/// entries come first: 7 of q', 6 of xi.
class BaseConversion {
 public:
  explicit BaseConversion(const BaseConvention& convention) : convention_(convention) {}

  /// q' and xi as the convention writes them.
  [[nodiscard]] VectorXd ConvertPositions(const VectorXd& q) const;
  [[nodiscard]] VectorXd ConvertVelocities(const VectorXd& q, const VectorXd& xi) const;

  /// Terms that were given in the convention at this state, in the default one. With xi' = B xi,
  ///   M = B^T M' B,  gravity = B^T gravity',  coriolis = B^T (coriolis' + M' B_dot xi),
  /// where B_dot xi = [-omega x v; 0] when the linear velocity is along the base's axes, and zero otherwise.
  /// A provider that has forces with velocities in them and no M cannot be converted then: they are left
  /// out.
  void Restore(const VectorXd& q, const VectorXd& xi, TermResults* terms) const;
  /// The other way: whole terms of the default convention in this one.
  void Apply(const VectorXd& q, const VectorXd& xi, TermResults* terms) const;

 private:
  [[nodiscard]] Matrix6d CalcB(const VectorXd& q) const;
  /// B_dot xi, of the size of xi.
  [[nodiscard]] VectorXd CalcRate(const VectorXd& q, const VectorXd& xi) const;

  BaseConvention convention_;
};

}  // namespace dexcheck
