#include "harness/descriptions/engine_urdf.h"

#include <tinyxml2.h>

#include <set>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

void RemoveChildren(XMLElement* parent, const std::set<std::string>& names) {
  for (XMLElement* child = parent->FirstChildElement(); child != nullptr;) {
    XMLElement* const next = child->NextSiblingElement();
    if (names.contains(child->Name())) parent->DeleteChild(child);
    child = next;
  }
}

/// The link that no joint carries.
std::string FindRoot(XMLElement* robot) {
  std::set<std::string> carried;
  for (XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const XMLElement* child = joint->FirstChildElement("child");
    const char* link = child == nullptr ? nullptr : child->Attribute("link");
    if (link != nullptr) carried.insert(link);
  }
  for (XMLElement* link = robot->FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const char* name = link->Attribute("name");
    if (name != nullptr && !carried.contains(name)) return name;
  }
  return {};
}

/// Removes the inertials of what never moves: published robots have such that the engine refuses.
void RemoveFixedInertials(XMLElement* robot) {
  std::set<std::string> standing = {FindRoot(robot)};
  for (bool is_resized = true; is_resized;) {
    is_resized = false;
    for (XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
         joint = joint->NextSiblingElement("joint")) {
      const XMLElement* parent = joint->FirstChildElement("parent");
      const XMLElement* child = joint->FirstChildElement("child");
      if (parent == nullptr || child == nullptr || joint->Attribute("type", "fixed") == nullptr) continue;
      const char* carrier = parent->Attribute("link");
      const char* carried = child->Attribute("link");
      if (carrier == nullptr || carried == nullptr || !standing.contains(carrier)) continue;
      is_resized = standing.insert(carried).second || is_resized;
    }
  }
  for (XMLElement* link = robot->FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const char* name = link->Attribute("name");
    if (name != nullptr && standing.contains(name)) RemoveChildren(link, {"inertial"});
  }
}

/// MuJoCo lets move freely only what hangs on a link called "world".
void LetFloat(XMLElement* robot) {
  const std::string root = FindRoot(robot);
  for (XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    XMLElement* const parent = joint->FirstChildElement("parent");
    if (parent == nullptr || joint->Attribute("type", "floating") == nullptr) continue;
    if (parent->Attribute("link", root.c_str()) == nullptr) continue;
    parent->SetAttribute("link", "world");
    for (XMLElement* link = robot->FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      if (link->Attribute("name", root.c_str()) != nullptr) link->SetAttribute("name", "world");
    }
    return;
  }
  robot->InsertNewChildElement("link")->SetAttribute("name", "world");
  XMLElement* const joint = robot->InsertNewChildElement("joint");
  joint->SetAttribute("name", "dexcheck_floating_base");
  joint->SetAttribute("type", "floating");
  joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
  joint->InsertNewChildElement("child")->SetAttribute("link", root.c_str());
}

XMLElement* ParseRobot(std::string_view text, const std::string& source, tinyxml2::XMLDocument* document) {
  document->Parse(text.data(), text.size());
  XMLElement* const robot = document->Error() ? nullptr : document->FirstChildElement("robot");
  if (robot == nullptr) throw InputError(source + ": must be a URDF");
  return robot;
}

std::string Print(const tinyxml2::XMLDocument& document) {
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace

std::string RemoveMaterials(std::string_view text, const std::string& source) {
  tinyxml2::XMLDocument document;
  RemoveChildren(ParseRobot(text, source, &document), {"material"});
  return Print(document);
}

std::string NameJoints(std::string_view text, const std::string& source) {
  tinyxml2::XMLDocument document;
  int number = 0;
  for (XMLElement* joint = ParseRobot(text, source, &document)->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint"), ++number) {
    const char* const name = joint->Attribute("name");
    if (name == nullptr || *name == '\0') joint->SetAttribute("name", ("#" + std::to_string(number)).c_str());
  }
  return Print(document);
}

std::string WriteEngineUrdf(std::string_view text, const std::string& source, bool floats) {
  tinyxml2::XMLDocument document;
  XMLElement* const robot = ParseRobot(text, source, &document);
  RemoveChildren(robot, {"gazebo", "transmission", "material", "mujoco", "sensor"});
  for (XMLElement* link = robot->FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    RemoveChildren(link, {"visual", "collision"});
  }
  XMLElement* const compiler = document.NewElement("mujoco")->InsertNewChildElement("compiler");
  compiler->SetAttribute("fusestatic", "false");
  compiler->SetAttribute("discardvisual", "true");
  robot->InsertFirstChild(compiler->Parent());
  floats ? LetFloat(robot) : RemoveFixedInertials(robot);
  return Print(document);
}

}  // namespace dexcheck
