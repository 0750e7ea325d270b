#pragma once

// Random robots for the tests, described twice: as the analytic model's specification and as MJCF text.

#include <random>
#include <string>

#include "controller/model/robot_model.h"

namespace dexcheck::testing {

struct RandomRobotOptions {
  BaseType base = BaseType::kDifferentialDrive;
  DriveVelocity velocity = DriveVelocity::kTwist;
  int joints = 20;
  double branching = 0.3;  ///< Probability that a joint hangs on a random earlier link, not on the last.
  double prismatic = 0.2;  ///< Probability that a joint is prismatic.
  double ball = 0.0;       ///< Probability that a joint is a ball.
  double offset = 0.3;     ///< Probability that an MDH row starts at a displaced frame.
  bool planar_by_free_joint =
      true;  ///< A planar base moves by a free joint in the MJCF, or by slides and a hinge.
};

/// Draws a robot whose links all have different generic mass properties. Frames "tip_<joint>" stand on every
/// leaf.
RobotSpec MakeRandomRobot(const RandomRobotOptions& options, std::mt19937* random);

/// Writes a robot in MJCF: bodies with explicit inertias, joints about z, one site per frame.
/// @param X_0b frame of the base's body in Sigma_0.
std::string WriteMjcf(const RobotSpec& spec, bool planar_by_free_joint = true,
                      const Pose& X_0b = Pose::Identity());

/// q' inside the joint ranges, the base within 2 m and any heading; velocities up to 5 rad/s and 2 m/s.
VectorXd DrawPositions(const RobotModel& model, std::mt19937* random);
VectorXd DrawVelocities(int size, std::mt19937* random);

}  // namespace dexcheck::testing
