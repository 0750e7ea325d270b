#pragma once

// The links and joints of a URDF with their places in the file, and whether they form a tree.

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace dexcheck {

/// A link element.
struct UrdfLink {
  std::string name;
  int line = 0;
  bool has_inertial = false;
  int parent_joint = -1;          ///< Index in UrdfOutline::joints; -1 for the root.
  std::vector<int> child_joints;  ///< In the file's order.
};

/// A joint element.
struct UrdfJoint {
  std::string name;  ///< "#" and its number in the file when it has none.
  int line = 0;
  int parent = -1;  ///< Index in UrdfOutline::links.
  int child = -1;
};

/// A tree of links, in the file's order.
struct UrdfOutline {
  std::vector<UrdfLink> links;
  std::vector<UrdfJoint> joints;
  int root = -1;
  bool has_nameless_joints = false;
  std::vector<std::string> meshes;  ///< File names, each once.
};

/// Reads the outline of a URDF.
/// @throws InputError, one line "FILE:LINE: PART: what, got VALUE", for text that is not XML or no URDF, for
/// names that are missing or used twice, links that do not exist or hang on two joints, cycles, two roots,
/// too many links, and inertials whose numbers are none.
UrdfOutline ReadUrdfOutline(std::string_view text, const std::string& source);

}  // namespace dexcheck
