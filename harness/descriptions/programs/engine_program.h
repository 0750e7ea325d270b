#pragma once

// A physics engine as a program of the protocol in harness/descriptions/README.md: ENGINE ROBOT.urdf

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/descriptions/programs/urdf_tree.h"

namespace dexcheck::engines {

/// What the first request says of the robot, beside its file.
struct RobotFacts {
  bool floats = false;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< m/s^2, world axes.
};

/// Terms at a state; what is empty is not provided. M includes no armature, since a URDF has none.
struct EngineTerms {
  Eigen::MatrixXd M;
  Eigen::VectorXd c;  ///< C v
  Eigen::VectorXd g;  ///< Forces that hold the robot still.
  std::optional<double> kinetic;
  std::optional<double> potential;
};

/// A robot in an engine. Coordinates are the base's, if it floats, then one for each body but the root, in
/// their order.
class EngineRobot {
 public:
  EngineRobot() = default;
  virtual ~EngineRobot() = default;
  EngineRobot(const EngineRobot&) = delete;
  EngineRobot& operator=(const EngineRobot&) = delete;

  /// @param q of a floating base qw qx qy qz x y z; joints. @param v of a floating base the angular velocity,
  /// then that of the root link's origin, both along the world's axes; joints.
  virtual EngineTerms Evaluate(const Eigen::VectorXd& q, const Eigen::VectorXd& v) = 0;
};

using MakeRobot =
    std::function<std::unique_ptr<EngineRobot>(const std::vector<UrdfBody>&, const RobotFacts&)>;

/// Serves requests from standard input until it ends. @return the program's exit code.
int RunEngine(int argc, char** argv, const std::string& name, const MakeRobot& make);

}  // namespace dexcheck::engines
