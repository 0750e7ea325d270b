#pragma once

// What rounding can explain: bounds and scales of the robot's terms.

#include <algorithm>
#include <limits>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "harness/base/worst.h"

namespace dexcheck {

/// Relative rounding bound of a term whose formation chains `factors` geometric quantities (poses, Jacobians
/// are one), on chains of `depth` joints.
double CalcRoundingBound(int depth, double factors);

/// A scale of zero (a model without mass, a state at rest) leaves an absolute comparison. Below the smallest
/// normal number rounding errors no longer shrink with what is rounded, so a scale is at least that over eps:
/// what a filter leaves of a rate long after it has stopped.
inline double Positive(double scale) {
  constexpr double kLeast = std::numeric_limits<double>::min() / std::numeric_limits<double>::epsilon();
  return scale > 0.0 ? Worst(scale, kLeast) : 1.0;
}

/// Scale of a body's inertia by two descriptions, kg m^2. A body smaller than 1 nm is a point: what inertia a
/// file has for it is what rounding left there.
double CalcInertiaScale(double mass, const Matrix3d& a, const Matrix3d& b);

/// Sizes of the state and the robot that rounding errors are relative to. An error of a term is divided by
/// the size of what is summed up to form it, so that one bound holds for every entry, large or small.
class RoundingScales {
 public:
  explicit RoundingScales(const RobotModel& model);

  /// @param terms with its state set to q, xi; reduced coordinates.
  void SetState(const ModelTerms& terms, const Eigen::Ref<const VectorXd>& q,
                const Eigen::Ref<const VectorXd>& xi);

  // At every state.
  /// Of the longest chain of joints.
  [[nodiscard]] int depth() const { return model_->max_depth(); }
  /// Of the robot's points' distances from the base, m.
  [[nodiscard]] double length() const { return arm_; }
  /// Length (or 1) by which a velocity coordinate moves points.
  [[nodiscard]] double CalcVelocityScale(int coordinate) const;
  /// Mass that a velocity coordinate moves, kg.
  [[nodiscard]] double GetSubtreeMass(int coordinate) const;
  [[nodiscard]] double total_mass() const { return subtree_mass_[0]; }
  /// Of an entry of M_bar'.
  [[nodiscard]] double CalcMassScale(int row, int col) const;
  /// Of an entry of gravity.
  [[nodiscard]] double CalcGravityScale(int coordinate) const;
  /// A thousandth of that of each joint (n, 0 of the base), N m or N: no smaller are scales of forces where
  /// weights cancel but to rounding, of links that hang or an arm in a horizontal plane.
  [[nodiscard]] VectorXd CalcLeastForces() const;

  // At the state set.
  /// Of the world coordinates of the robot's points, m.
  [[nodiscard]] double world_length() const { return world_length_; }
  /// Of a link, rad/s: root of the summed squares along the fastest chain.
  [[nodiscard]] double angular_rate() const { return angular_rate_; }
  /// Of a point, m/s.
  [[nodiscard]] double linear_rate() const { return linear_rate_; }
  /// Of a point, m/s^2. Straight motion counts: its v x m v cancels, but only to rounding.
  [[nodiscard]] double acceleration() const;
  /// Of an entry of C_bar' xi.
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
