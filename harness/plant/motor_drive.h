#pragma once

#include <vector>

#include "harness/plant/imperfections.h"
#include "harness/plant/plant.h"

namespace dexcheck {

/// Torques as the motors deliver them.
struct DriveOutput {
  VectorXd tau;           ///< tau' (n), N m.
  double effort = 0.0;    ///< Largest |tau'| / limit of the commanded torques.
  int busiest_motor = 0;  ///< Entry of tau' of the motor with the largest effort.
  VectorXd cut;           ///< Torques that the limits cut off (n), N m; empty for ideal motors.
};

/// Converts the torques that are sent into the torques that motors deliver, in this order; each part is
/// absent unless the options have it:
///
///   delay      torques of `delay` ago; a fraction of a step mixes two of them
///   step       whole multiples of torque_step
///   gain       times 1 + gain_error
///   lag        1 / (1 + lag s); the delivered torque is its mean over the step, so that the impulse is right
///   limit      not above the motor's
///   backlash   nothing while the rotor, of the joint's armature, crosses the play
///   friction   less (coulomb + stribeck exp(-(w / stribeck_velocity)^2)) sign(w)
///
/// sign(w) is w / w_0 below w_0 = dt (coulomb + stribeck) / armature: an explicit force that is steeper makes
/// a sampled joint rattle. Nothing allocates after construction. Two drives of the same options return the
/// same torques for the same inputs: a check makes its own.
class MotorDrive {
 public:
  /// @throws InputError when the options name a motor that is not there, or state friction or backlash for a
  /// joint without armature.
  MotorDrive(std::span<const Motor> motors, const ActuationOptions& options, const PartContext& context);

  /// Requires torques that can be delivered, then drives. Called once at each step.
  /// @param xi velocities of the plant (n). @param output its effort is set before anything is thrown.
  /// @throws RunFailure when a torque is not finite, or a motor is at its limit and may not saturate.
  void Apply(const VectorXd& tau, const VectorXd& xi, DriveOutput* output);
  /// Drives without any requirement.
  void Drive(const VectorXd& tau, const VectorXd& xi, VectorXd* delivered);

  /// Largest |tau'| / limit over the motors, and the motor.
  [[nodiscard]] double CalcEffort(const VectorXd& tau, int* busiest) const;

 private:
  void Delay(VectorXd* tau);
  double Play(Eigen::Index i, double tau, double rate);
  [[nodiscard]] double CalcFriction(Eigen::Index i, double rate) const;
  void ReadRates(const VectorXd& xi);

  std::vector<Motor> motors_;
  ActuationOptions options_;
  bool is_exact_;
  Base base_;
  double time_step_;
  VectorXd step_, gain_, lag_, coulomb_, stribeck_, backlash_, armature_;  // n
  std::vector<VectorXd> sent_;                                             // ring
  double fraction_ = 0.0;  // fraction of a step in the delay, beyond whole steps
  VectorXd rates_;         // n, of wheels and joints, rad/s
  VectorXd lagging_;       // n, state of the lag, N m
  VectorXd play_;          // n, rotor against joint, rad
  VectorXd rotor_;         // n, its rate, rad/s
  VectorXd cut_;           // n, of the last Drive
  std::uint64_t k_ = 0;
};

}  // namespace dexcheck
