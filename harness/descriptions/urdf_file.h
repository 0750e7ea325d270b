#pragma once

// A URDF as an XML document: its links and joints as a tree, each with its element, and their numbers.

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace dexcheck {

/// A link element.
struct UrdfLink {
  std::string name;
  tinyxml2::XMLElement* element;
  int line;
  int parent_joint = -1;          ///< Index in UrdfFile::joints; -1 for the root.
  std::vector<int> child_joints;  ///< In the file's order.
};

/// A joint element.
struct UrdfJoint {
  std::string name;  ///< "#" and its number in the file when it has none.
  tinyxml2::XMLElement* element;
  int line;
  std::string type;
  int parent = -1;  ///< Index in UrdfFile::links.
  int child = -1;
};

/// A tree of links, in the file's order, over the document that it was read from.
class UrdfFile {
 public:
  /// @throws InputError, one line "FILE:LINE: PART: what, got VALUE", for text that is not XML or no URDF,
  /// for names that are missing or used twice, links that do not exist or hang on two joints, cycles, two
  /// roots, and too many links.
  UrdfFile(std::string_view text, std::string source);
  ~UrdfFile();
  UrdfFile(const UrdfFile&) = delete;
  UrdfFile& operator=(const UrdfFile&) = delete;

  [[nodiscard]] tinyxml2::XMLElement* robot() const { return robot_; }
  [[nodiscard]] const std::vector<UrdfLink>& links() const { return links_; }
  [[nodiscard]] const std::vector<UrdfJoint>& joints() const { return joints_; }
  [[nodiscard]] const UrdfLink& link(int index) const { return links_[static_cast<size_t>(index)]; }
  [[nodiscard]] const UrdfJoint& joint(int index) const { return joints_[static_cast<size_t>(index)]; }
  [[nodiscard]] int root() const { return root_; }
  /// The document as it is now.
  [[nodiscard]] std::string Print() const;

  // Numbers of elements. @param key what messages begin with: "joint "elbow": ".
  // @throws InputError for an attribute that is missing or no such number.
  double ReadNumber(const tinyxml2::XMLElement& element, const std::string& key, const char* attribute) const;
  /// Reads an attribute that may be missing.
  double ReadNumber(const tinyxml2::XMLElement& element, const std::string& key, const char* attribute,
                    double otherwise) const;
  Vector3d ReadVector(const tinyxml2::XMLElement& element, const std::string& key, const char* attribute,
                      const Vector3d& otherwise) const;
  /// The pose that the child `origin` of an element gives; the identity without one.
  /// @param largest_angle raised to the largest of roll, pitch and yaw, rad.
  [[nodiscard]] Pose ReadOrigin(const tinyxml2::XMLElement& element, const std::string& key,
                                double* largest_angle = nullptr) const;

  /// Shapes of a link that can touch, or else those that are seen. Dynamics need none: nothing behind a
  /// broken one is read.
  [[nodiscard]] std::vector<DescribedShape> ReadShapes(const UrdfLink& link) const;
  /// Files of the meshes that are in none of the packages, each once. @param folder of the URDF.
  [[nodiscard]] std::vector<std::string> ListMissingMeshes(
      const std::filesystem::path& folder, const std::vector<std::filesystem::path>& packages) const;

  [[noreturn]] void Fail(int line, const std::string& problem) const;

 private:
  /// Volume and box of a primitive shape; a mesh has no volume here.
  [[nodiscard]] DescribedShape ReadShape(const tinyxml2::XMLElement& use) const;
  /// @throws InputError for an element of which there is more than one: readers of URDFs take the first.
  void RejectDoubles(const tinyxml2::XMLElement* element, const std::string& key,
                     std::initializer_list<const char*> names) const;
  void AddLink(tinyxml2::XMLElement* element);
  void AddJoint(tinyxml2::XMLElement* element);
  [[nodiscard]] int FindEnd(const UrdfJoint& joint, const char* end) const;
  void Connect();
  void FindRoot();
  void RejectCycles() const;
  [[noreturn]] void FailCycle(size_t link) const;

  std::string source_;
  std::unique_ptr<tinyxml2::XMLDocument> document_;
  tinyxml2::XMLElement* robot_ = nullptr;
  std::vector<UrdfLink> links_;
  std::vector<UrdfJoint> joints_;
  int root_ = -1;
};

}  // namespace dexcheck
