#pragma once

// A URDF as a list of links with numbers, for engines that read none themselves. It shares nothing with the
// reader of dexcheck, so that a fault of that one shows.

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace dexcheck::engines {

/// How a link moves against its parent.
enum class Motion { kRoot, kFixed, kTurns, kSlides };

/// A link and the joint that carries it; lengths in m, masses in kg.
struct UrdfBody {
  std::string name;
  int parent = -1;  ///< Index; -1 for the root.
  std::string joint;
  Motion motion = Motion::kRoot;
  Eigen::Isometry3d X_PL = Eigen::Isometry3d::Identity();  ///< The link's frame in its parent's, at q = 0.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();         ///< In the link's frame, of length 1.
  double mass = 0.0;
  Eigen::Isometry3d X_LC = Eigen::Isometry3d::Identity();  ///< The inertial's frame, at the centre of mass.
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();       ///< About the centre of mass, along axes of C.

  /// Inertia about the centre of mass along the link's axes.
  [[nodiscard]] Eigen::Matrix3d CalcInertiaInLink() const {
    return X_LC.linear() * inertia * X_LC.linear().transpose();
  }
};

/// Links, parents before children. The root is the URDF's, or what hangs on it when the only joint there is
/// of the type "floating".
/// @throws std::runtime_error "FILE: what is wrong".
std::vector<UrdfBody> ReadUrdfTree(const std::string& path);

/// Names of the joints that move, in the order of the links.
std::vector<std::string> ListJoints(const std::vector<UrdfBody>& bodies);

/// The same robot with each link on a fixed joint counted in the link that it stands on: for engines that
/// judge every inertia by itself, and refuse the small parts of published robots that no body can be.
std::vector<UrdfBody> FuseFixedLinks(const std::vector<UrdfBody>& bodies);

}  // namespace dexcheck::engines
