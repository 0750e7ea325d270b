#include "harness/plant/motor_drive.h"

#include <cmath>

#include "controller/common/text.h"

namespace dexcheck {

void MotorDrive::Apply(const VectorXd& tau, DriveOutput* output) const {
  output->tau = tau;
  if (!tau.allFinite()) throw RunFailure("a torque is not a number");
  output->effort = CalcEffort(tau, &output->busiest_motor);
  if (output->effort <= 1.0) return;
  const Motor& motor = motors_[static_cast<size_t>(output->busiest_motor)];
  throw RunFailure("motor " + Quote(motor.name) + " is at its limit, " + FormatNumber(motor.limit) + " N m");
}

double MotorDrive::CalcEffort(const VectorXd& tau, int* busiest) const {
  double largest = 0.0;
  for (size_t i = 0; i < motors_.size(); ++i) {
    const double effort = std::abs(tau[static_cast<Eigen::Index>(i)]) / motors_[i].limit;
    if (effort <= largest) continue;
    largest = effort;
    *busiest = static_cast<int>(i);
  }
  return largest;
}

}  // namespace dexcheck
