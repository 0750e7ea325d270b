#pragma once

// Random states of a robot and its object, the same on every platform.

#include <cstdint>
#include <random>

#include "controller/model/robot_model.h"

namespace dexcheck {

/// Bounds of random states.
struct StateRange {
  double joint_speed = 5.0;   ///< Revolute joints, yaw, and each angular rate of the base, at most, rad/s.
  double linear_speed = 2.0;  ///< Base and prismatic joints, at most, m/s.
  double area = 5.0;          ///< The base stands within +-area of the origin, m.
};

/// Draws states one after the other; the sequence depends on the seed, on the range and on the model's
/// ranges.
class StateSource {
 public:
  /// The model must outlive this.
  StateSource(const RobotModel& model, const StateRange& range, std::uint64_t seed);

  /// q': joints within their ranges, balls turned within theirs about any direction, any heading, any
  /// attitude of a floating base. `q` has the right size.
  void DrawPositions(VectorXd* q);
  /// xi.
  void DrawVelocity(VectorXd* xi);
  /// X_o above the floor with any angles, and X_o_dot.
  void DrawObject(Vector6d* X_o, Vector6d* X_o_dot);
  /// Uniform in [low, high).
  double Draw(double low, double high);

 private:
  /// Quaternion w, x, y, z of a turn by up to `widest`, rad, about a direction of any kind.
  Eigen::Vector4d DrawTurn(double widest);

  const RobotModel* model_;
  StateRange range_;
  std::mt19937_64 bits_;
};

}  // namespace dexcheck
