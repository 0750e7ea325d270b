#include "harness/descriptions/urdf_outline.h"

#include <tinyxml2.h>
#include <urdf_model/pose.h>
#include <urdf_model/utils.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

// Far more than robots have; it also keeps what follows within seconds and megabytes.
constexpr size_t kMaxLinks = 2000;

using Element = tinyxml2::XMLElement;

class OutlineReader {
 public:
  explicit OutlineReader(std::string source) : source_(std::move(source)) {}

  UrdfOutline Read(std::string_view text) {
    tinyxml2::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      Fail(document.ErrorLineNum(), std::string("is not XML, ") + document.ErrorName());
    }
    const Element* robot = document.RootElement();
    if (robot == nullptr || std::string_view(robot->Name()) != "robot") {
      Fail(robot == nullptr ? 1 : robot->GetLineNum(),
           "must have the root element <robot>, got " +
               (robot == nullptr ? std::string("none") : Quote("<" + std::string(robot->Name()) + ">")));
    }
    for (const Element* child = robot->FirstChildElement(); child != nullptr;
         child = child->NextSiblingElement()) {
      const std::string_view kind = child->Name();
      if (kind.starts_with("xacro:")) {
        Fail(child->GetLineNum(), "is a template, got " + Quote("<" + std::string(kind) + ">") +
                                      ": write the URDF with the program xacro first");
      }
      if (kind == "link") AddLink(*child);
      if (kind == "joint") AddJoint(*child);
    }
    Connect();
    FindRoot();
    RejectCycles();
    return std::move(outline_);
  }

 private:
  [[noreturn]] void Fail(int line, const std::string& problem) const {
    throw InputError(source_ + ":" + std::to_string(std::max(line, 1)) + ": " + problem);
  }

  std::string ReadLinkName(const Element& element) const {
    const char* name = element.Attribute("name");
    if (name == nullptr || *name == '\0') Fail(element.GetLineNum(), "link: must have a name");
    return name;
  }

  void AddLink(const Element& element) {
    const std::string name = ReadLinkName(element);
    const auto [known, is_new] = link_of_.emplace(name, static_cast<int>(outline_.links.size()));
    if (!is_new) {
      Fail(element.GetLineNum(), "link " + Quote(name) + ": names must be unique, taken on line " +
                                     std::to_string(outline_.links[static_cast<size_t>(known->second)].line));
    }
    if (outline_.links.size() == kMaxLinks) {
      Fail(element.GetLineNum(), "link " + Quote(name) + ": a robot must have at most " +
                                     std::to_string(kMaxLinks) + " links, got more");
    }
    const Element* inertial = element.FirstChildElement("inertial");
    if (inertial != nullptr) CheckInertial(*inertial, name);
    outline_.links.push_back({name, element.GetLineNum(), inertial != nullptr, -1, {}});
    AddMeshes(element);
  }

  void CheckInertial(const Element& inertial, const std::string& link) const {
    const auto check = [&](const char* child_name, const char* attribute) {
      const std::string key = "link " + Quote(link) + ": " + child_name + ": " + attribute;
      const Element* child = inertial.FirstChildElement(child_name);
      if (child == nullptr) Fail(inertial.GetLineNum(), key + ": missing");
      const char* value = child->Attribute(attribute);
      if (value == nullptr) Fail(child->GetLineNum(), key + ": missing");
      try {
        urdf::strToDouble(value);
      } catch (const std::runtime_error&) {
        Fail(child->GetLineNum(), key + ": must be a number, got " + Quote(value));
      }
    };
    // urdfdom drops an inertial whose origin it cannot read, and goes on.
    if (const Element* origin = inertial.FirstChildElement("origin")) {
      for (const char* attribute : {"xyz", "rpy"}) {
        const char* value = origin->Attribute(attribute);
        if (value == nullptr) continue;
        try {
          urdf::Vector3().init(value);
        } catch (const urdf::ParseError&) {
          Fail(origin->GetLineNum(), "link " + Quote(link) + ": origin: " + attribute +
                                         ": must be three numbers, got " + Quote(value));
        }
      }
    }
    check("mass", "value");
    for (const char* entry : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) check("inertia", entry);
  }

  void AddMeshes(const Element& link) {
    for (const char* use : {"visual", "collision"}) {
      for (const Element* shape = link.FirstChildElement(use); shape != nullptr;
           shape = shape->NextSiblingElement(use)) {
        const Element* geometry = shape->FirstChildElement("geometry");
        const Element* mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
        const char* file = mesh == nullptr ? nullptr : mesh->Attribute("filename");
        if (file != nullptr && meshes_.insert(file).second) outline_.meshes.emplace_back(file);
      }
    }
  }

  void AddJoint(const Element& element) {
    const char* const given = element.Attribute("name");
    const bool has_name = given != nullptr && *given != '\0';
    const std::string name = has_name ? given : "#" + std::to_string(outline_.joints.size());
    outline_.has_nameless_joints |= !has_name;
    if (!joint_names_.insert(name).second) {
      Fail(element.GetLineNum(), "joint " + Quote(name) + ": names must be unique");
    }
    outline_.joints.push_back({name, element.GetLineNum(), -1, -1});
    const auto read_end = [&](const char* end) {
      const Element* child = element.FirstChildElement(end);
      const char* link = child == nullptr ? nullptr : child->Attribute("link");
      if (link == nullptr) {
        Fail(element.GetLineNum(), "joint " + Quote(name) + ": " + end + ": missing, must name a link");
      }
      return std::string(link);
    };
    ends_.emplace_back(read_end("parent"), read_end("child"));
  }

  int FindLink(const UrdfJoint& joint, const char* end, const std::string& name) const {
    const auto found = link_of_.find(name);
    if (found != link_of_.end()) return found->second;
    std::vector<std::string> names;
    for (const UrdfLink& link : outline_.links) names.push_back(link.name);
    const std::string nearest = FindNearest(name, names);
    Fail(joint.line, "joint " + Quote(joint.name) + ": " + end + ": must be a link" +
                         (nearest.empty() ? "" : " (did you mean " + Quote(nearest) + "?)") + ", got " +
                         Quote(name));
  }

  void Connect() {
    if (outline_.links.empty()) Fail(1, "must have links, got none");
    for (size_t i = 0; i < outline_.joints.size(); ++i) {
      UrdfJoint& joint = outline_.joints[i];
      joint.parent = FindLink(joint, "parent", ends_[i].first);
      joint.child = FindLink(joint, "child", ends_[i].second);
      UrdfLink& child = outline_.links[static_cast<size_t>(joint.child)];
      if (child.parent_joint >= 0) {
        Fail(joint.line, "joint " + Quote(joint.name) + ": child: must hang on one joint only, " +
                             Quote(child.name) + " hangs on " +
                             Quote(outline_.joints[static_cast<size_t>(child.parent_joint)].name) +
                             " too: loops cannot be described by a tree");
      }
      child.parent_joint = static_cast<int>(i);
      outline_.links[static_cast<size_t>(joint.parent)].child_joints.push_back(static_cast<int>(i));
    }
  }

  void FindRoot() {
    for (size_t i = 0; i < outline_.links.size(); ++i) {
      const UrdfLink& link = outline_.links[i];
      if (link.parent_joint >= 0) continue;
      if (outline_.root >= 0) {
        Fail(link.line, "link " + Quote(link.name) + ": must hang on a joint, since " +
                            Quote(outline_.links[static_cast<size_t>(outline_.root)].name) +
                            " is the root already");
      }
      outline_.root = static_cast<int>(i);
    }
    if (outline_.root < 0) FailCycle(0);
  }

  /// Every link must be reached from the root.
  void RejectCycles() const {
    std::vector<bool> reached(outline_.links.size(), false);
    std::vector<int> open = {outline_.root};
    while (!open.empty()) {
      const auto link = static_cast<size_t>(open.back());
      open.pop_back();
      reached[link] = true;
      for (const int joint : outline_.links[link].child_joints) {
        open.push_back(outline_.joints[static_cast<size_t>(joint)].child);
      }
    }
    const auto lost = std::find(reached.begin(), reached.end(), false);
    if (lost != reached.end()) FailCycle(static_cast<size_t>(lost - reached.begin()));
  }

  /// Follows the parents of a link that no root carries until one comes again.
  [[noreturn]] void FailCycle(size_t link) const {
    std::vector<size_t> path;
    while (std::find(path.begin(), path.end(), link) == path.end()) {
      path.push_back(link);
      const auto joint = static_cast<size_t>(outline_.links[link].parent_joint);
      link = static_cast<size_t>(outline_.joints[joint].parent);
    }
    std::string text = outline_.links[link].name;
    for (auto at = path.rbegin(); *at != link; ++at) text += " -> " + outline_.links[*at].name;
    text += " -> " + outline_.links[link].name;
    Fail(outline_.links[link].line, "links must not be cyclic, got " + Quote(text));
  }

  std::string source_;
  UrdfOutline outline_;
  std::map<std::string, int> link_of_;
  std::set<std::string> joint_names_;
  std::set<std::string> meshes_;
  std::vector<std::pair<std::string, std::string>> ends_;  // parent and child of each joint
};

}  // namespace

UrdfOutline ReadUrdfOutline(std::string_view text, const std::string& source) {
  return OutlineReader(source).Read(text);
}

}  // namespace dexcheck
