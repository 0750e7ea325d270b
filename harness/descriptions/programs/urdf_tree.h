#pragma once

// A URDF as a list of bodies with numbers, for engines that read none themselves. It shares nothing with the
// reader of dexcheck, so that a fault of that one shows.

#include <Eigen/Geometry>
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

}  // namespace dexcheck::engines
