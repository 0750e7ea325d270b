#pragma once

// The numbers of a URDF as it states them, to be changed and written back: the text is otherwise as it was.

#include <memory>
#include <string>
#include <vector>

#include "tests/common/convention_faults.h"

namespace tinyxml2 {
class XMLDocument;
}

namespace dexcheck::testing {

/// A link, and the joint that places it.
struct UrdfPart {
  std::string link;
  std::string joint;       ///< Empty for the root.
  int parent = -1;         ///< Index in the list; -1 for the root.
  bool moves = false;      ///< Otherwise it is welded to its parent, or the root.
  bool slides = false;     ///< Its zero is a place, no angle.
  bool has_body = false;   ///< States an inertial.
  bool has_limit = false;  ///< States a range.
  StatedLink stated;
};

class StatedUrdf {
 public:
  explicit StatedUrdf(const std::string& text);
  ~StatedUrdf();

  /// In the file's order of joints, the root first. What is changed here is written.
  std::vector<UrdfPart> parts;

  /// Fixes the root to a world that has no inertial, by a joint placed so.
  void MountOn(const std::string& world, const Pose& X_WR);
  /// The joints of these names take each other's.
  void ExchangeJointNames(const std::string& a, const std::string& b);
  [[nodiscard]] std::string Write();

 private:
  std::unique_ptr<tinyxml2::XMLDocument> document_;
  std::vector<UrdfPart> read_;
};

}  // namespace dexcheck::testing
