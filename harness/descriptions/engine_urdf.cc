#include <set>

#include "harness/descriptions/mjcf_writer.h"
#include "harness/descriptions/urdf_file.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

void RemoveChildren(XMLElement* parent, const std::set<std::string>& names) {
  for (XMLElement* child : ListChildren(parent)) {
    if (names.contains(child->Name())) parent->DeleteChild(child);
  }
}

/// Removes the inertials of what never moves: published robots have such that the engine refuses.
void RemoveFixedInertials(const UrdfFile& file, int link) {
  RemoveChildren(file.link(link).element, {"inertial"});
  for (const int joint : file.link(link).child_joints) {
    if (file.joint(joint).type == "fixed") RemoveFixedInertials(file, file.joint(joint).child);
  }
}

/// MuJoCo lets move freely only what hangs on a link called "world".
void LetFloat(const UrdfFile& file) {
  const UrdfLink& root = file.link(file.root());
  for (const int index : root.child_joints) {
    const UrdfJoint& joint = file.joint(index);
    if (joint.type != "floating") continue;
    joint.element->FirstChildElement("parent")->SetAttribute("link", "world");
    root.element->SetAttribute("name", "world");
    return;
  }
  file.robot()->InsertNewChildElement("link")->SetAttribute("name", "world");
  XMLElement* const joint = file.robot()->InsertNewChildElement("joint");
  joint->SetAttribute("name", "dexcheck_floating_base");
  joint->SetAttribute("type", "floating");
  joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
  joint->InsertNewChildElement("child")->SetAttribute("link", root.name.c_str());
}

}  // namespace

std::string WriteEngineUrdf(std::string_view text, const std::string& source, bool floats) {
  const UrdfFile file(text, source);
  XMLElement* const robot = file.robot();
  RemoveChildren(robot, {"gazebo", "transmission", "material", "mujoco", "sensor"});
  for (const UrdfLink& link : file.links()) RemoveChildren(link.element, {"visual", "collision"});
  XMLElement* const compiler = robot->GetDocument()->NewElement("mujoco")->InsertNewChildElement("compiler");
  compiler->SetAttribute("fusestatic", "false");
  compiler->SetAttribute("discardvisual", "true");
  robot->InsertFirstChild(compiler->Parent());
  floats ? LetFloat(file) : RemoveFixedInertials(file, file.root());
  return file.Print();
}

}  // namespace dexcheck
