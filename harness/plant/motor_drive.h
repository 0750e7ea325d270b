#pragma once

#include <span>
#include <vector>

#include "harness/plant/plant.h"

namespace dexcheck {

/// Torques as the motors give them.
struct DriveOutput {
  VectorXd tau;           ///< tau' (n), N m.
  double effort = 0.0;    ///< Largest |tau'| / limit of the commanded torques.
  int busiest_motor = 0;  ///< Whose it is, by its entry of tau'.
};

/// Stands between the controller and the plant: gives the torques that are commanded, or ends the run.
class MotorDrive {
 public:
  explicit MotorDrive(std::span<const Motor> motors) : motors_(motors.begin(), motors.end()) {}

  /// @param output its effort is set before anything is thrown.
  /// @throws RunFailure when a torque is not finite, or a motor is at its limit.
  void Apply(const VectorXd& tau, DriveOutput* output) const;

  /// Largest |tau'| / limit over the motors, and the motor; more than 1 cannot be given.
  [[nodiscard]] double CalcEffort(const VectorXd& tau, int* busiest) const;

 private:
  std::vector<Motor> motors_;
};

}  // namespace dexcheck
