#pragma once

// A URDF as a list of bodies with numbers, for engines that read none themselves. It shares nothing with the
// reader of dexcheck, so that a fault of that one shows.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace dexcheck::engines {

/// How a body moves against its parent.
enum class Motion { kRoot, kTurns, kSlides };

/// The links that one moving joint carries, each on fixed joints counted in the link that it stands on; or
/// those that the root carries. Engines that judge every inertia by itself refuse the small parts of
/// published robots that no body can be.
struct UrdfBody {
  std::string name;  ///< Of the link at the joint.
  int parent = -1;   ///< Index; -1 for the root.
  std::string joint;
  Motion motion = Motion::kRoot;
  Eigen::Isometry3d X_PL = Eigen::Isometry3d::Identity();  ///< The link's frame in its parent's, at q = 0, m.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();         ///< In the link's frame, of length 1.
  double mass = 0.0;                                       ///< kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();           ///< In the link's frame, m.
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();       ///< About the com, along the link's axes, kg m^2.
};

/// Bodies, parents before children. The root is the URDF's, or what hangs on it when the only joint there is
/// of the type "floating".
/// @throws std::runtime_error "FILE: what is wrong".
std::vector<UrdfBody> ReadUrdfTree(const std::string& path);

// A physics engine as a program of the protocol in harness/descriptions/README.md: ENGINE ROBOT.urdf

/// Facts about the robot in the first request, beside its file.
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
