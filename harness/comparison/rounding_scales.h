#pragma once

// Bounds and scales of the robot's terms by rounding alone.

#include <algorithm>
#include <limits>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "harness/base/worst.h"

namespace dexcheck {

/// Relative rounding bound of a term whose formation chains `factors` geometric quantities (poses, Jacobians
/// are one), on chains of `depth` joints.
double CalcRoundingBound(int depth, double factors);

/// Returns a scale that can divide: 1 for a scale of zero (a model without mass, a state at rest), which
/// leaves an absolute comparison. Below the smallest normal number rounding errors no longer shrink with the
/// number, so a scale is at least that over eps: a filtered rate decays to such numbers long after a stop.
inline double Positive(double scale) {
  constexpr double kLeast = std::numeric_limits<double>::min() / std::numeric_limits<double>::epsilon();
  return scale > 0.0 ? Worst(scale, kLeast) : 1.0;
}

/// Returns the scale of a body's inertia by two descriptions, kg m^2. A body smaller than 1 nm is a point:
/// its inertia in a file is rounding.
double CalcInertiaScale(double mass, const Matrix3d& a, const Matrix3d& b);

/// Sizes of the state and the robot that rounding errors are relative to. An error of a term is divided by
/// the size of the summands that form it, so that one bound holds for every entry, large or small.
class RoundingScales {
 public:
  explicit RoundingScales(const RobotModel& model);

  /// @param terms with its state set to q, xi; reduced coordinates.
  void SetState(const ModelTerms& terms, const Eigen::Ref<const VectorXd>& q,
                const Eigen::Ref<const VectorXd>& xi);

  // At every state.
  /// Number of joints in the longest chain.
  [[nodiscard]] int depth() const { return model_->max_depth(); }
  /// Scale of the distances of the robot's points from the base, m.
  [[nodiscard]] double length() const { return arm_; }
  /// Length (or 1) by which a velocity coordinate moves points.
  [[nodiscard]] double CalcVelocityScale(int coordinate) const;
  /// Mass that a velocity coordinate moves, kg.
  [[nodiscard]] double GetSubtreeMass(int coordinate) const;
  [[nodiscard]] double total_mass() const { return subtree_mass_[0]; }
  /// Scale of an entry of M_bar'.
  [[nodiscard]] double CalcMassScale(int row, int col) const;
  /// Scale of an entry of gravity.
  [[nodiscard]] double CalcGravityScale(int coordinate) const;
  /// A thousandth of each joint's gravity scale (n, 0 for the base), N m or N: the least scale of forces
  /// where weights cancel but for rounding, in links that hang or an arm in a horizontal plane.
  [[nodiscard]] VectorXd CalcLeastForces() const;

  // At the state set.
  /// Scale of the world coordinates of the robot's points, m.
  [[nodiscard]] double world_length() const { return world_length_; }
  /// Angular velocity of a link, rad/s: root of the summed squares along the fastest chain.
  [[nodiscard]] double angular_rate() const { return angular_rate_; }
  /// Velocity of a point, m/s.
  [[nodiscard]] double linear_rate() const { return linear_rate_; }
  /// Acceleration of a point, m/s^2. Straight motion counts: its v x m v cancels, but only to rounding.
  [[nodiscard]] double acceleration() const;
  /// Scale of an entry of C_bar' xi.
  [[nodiscard]] double CalcCoriolisScale(int coordinate) const;
  [[nodiscard]] double CalcFrictionScale(int coordinate, const Eigen::Ref<const VectorXd>& xi) const;
  [[nodiscard]] double CalcKineticEnergyScale() const;
  [[nodiscard]] double CalcPotentialEnergyScale() const;
  [[nodiscard]] double CalcMomentumScale() const { return total_mass() * linear_rate_; }

 private:
  const RobotModel* model_;
  [[nodiscard]] const Joint& JointOf(int coordinate) const;

  int base_velocities_;
  double reach_;
  /// The reach, or the shortest arm that rounding of coordinates in the world leaves its bounds, m.
  double arm_;
  double rotors_ = 0.0;               // sum of the joints' armature, kg m^2
  std::vector<double> subtree_mass_;  // base first
  std::vector<double> squared_rate_;  // scratch of SetState, base first
  Vector6d base_velocity_ = Vector6d::Zero();
  double world_length_ = 0.0;
  double angular_rate_ = 0.0;
  double linear_rate_ = 0.0;
};

}  // namespace dexcheck
