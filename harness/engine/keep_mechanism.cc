#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "controller/common/types.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/robot_tree.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

constexpr const char* kActs = "left out, which acts on the motion beside motors";

void DeleteSections(const char* name, MjcfFile* mjcf) {
  for (XMLElement* section : ListChildren(mjcf->root(), name)) {
    for (const XMLElement* part : ListChildren(section))
      mjcf->Note(*part, std::string("<") + name + " " + part->Name() + ">", kActs);
    mjcf->root()->DeleteChild(section);
  }
}

/// Actuators and sensors of tendons, and what constraints touch: the sections themselves are gone.
void DeleteUsers(MjcfFile* mjcf) {
  for (const char* name : {"actuator", "sensor"}) {
    for (XMLElement* section : ListChildren(mjcf->root(), name)) {
      for (XMLElement* part : ListChildren(section)) {
        const std::string_view kind = part->Name();
        if (part->Attribute("tendon") != nullptr || kind.starts_with("tendon")) section->DeleteChild(part);
      }
    }
  }
}

void DeleteWord(XMLElement* element, const char* attribute, MjcfFile* mjcf) {
  if (element->Attribute(attribute) == nullptr) return;
  mjcf->Note(*element, std::string("<") + element->Name() + " " + attribute + ">", kActs);
  element->DeleteAttribute(attribute);
}

/// With it go the key frames, whose numbers are those of all joints, and its sensors.
void DeleteJoint(XMLElement* joint, MjcfFile* mjcf) {
  const std::string name = ReadAttribute(*joint, "name");
  for (XMLElement* section : ListChildren(mjcf->root(), "sensor")) {
    for (XMLElement* part : ListChildren(section)) {
      if (!name.empty() && ReadAttribute(*part, "joint") == name) section->DeleteChild(part);
    }
  }
  for (XMLElement* section : ListChildren(mjcf->root(), "keyframe")) mjcf->root()->DeleteChild(section);
  joint->Parent()->DeleteChild(joint);
}

}  // namespace

void KeepMechanism(MjcfFile* mjcf) {
  DeleteSections("equality", mjcf);
  DeleteSections("tendon", mjcf);
  DeleteUsers(mjcf);
  DeleteControls(mjcf->root());
  std::vector<XMLElement*> balls;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    const std::string_view kind = element->Name();
    if (kind == "joint" && ReadAttribute(*element, "type") == "ball") {
      balls.push_back(element);
    } else if (kind == "joint") {
      DeleteWord(element, "stiffness", mjcf);
      DeleteWord(element, "springdamper", mjcf);
      DeleteWord(element, "margin", mjcf);
    } else if (kind == "body") {
      DeleteWord(element, "gravcomp", mjcf);
    } else if (kind == "flag") {
      DeleteWord(element, "multiccd", mjcf);
    }
  });
  for (XMLElement* ball : balls) {
    mjcf->Note(*ball, "<joint type=\"ball\">", "held, of which a run's law has no number");
    DeleteJoint(ball, mjcf);
  }
}

namespace {

/// What names an element that is gone.
void DeleteNaming(const std::set<std::string>& names, MjcfFile* mjcf) {
  for (const char* kind : {"actuator", "sensor", "contact"}) {
    for (XMLElement* section : ListChildren(mjcf->root(), kind)) {
      for (XMLElement* part : ListChildren(section)) {
        bool is_user = false;
        for (const auto* word = part->FirstAttribute(); word != nullptr; word = word->Next())
          is_user |= std::string_view(word->Name()) != "name" && names.contains(word->Value());
        if (is_user) section->DeleteChild(part);
      }
    }
  }
}

}  // namespace

void LeaveOutOthers(const mjModel& engine, MjcfFile* mjcf) {
  const RobotTree robot = FindRobotTree(engine, mjcf->source());
  std::vector<XMLElement*> others, free_joints;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    const std::string_view kind = element->Name();
    if (kind == "body" &&
        std::ranges::find(robot.others, ReadAttribute(*element, "name")) != robot.others.end())
      others.push_back(element);
    if (kind == "joint" && ReadAttribute(*element, "type") == "free") free_joints.push_back(element);
  });
  const int dof = robot.floating_body == 0 ? -1 : engine.body_dofadr[robot.floating_body];
  if (dof >= 0 && (engine.dof_damping[dof] != 0.0 || engine.dof_armature[dof] != 0.0 ||
                   engine.dof_frictionloss[dof] != 0.0)) {
    for (XMLElement* joint : free_joints) {
      mjcf->Note(*joint, "<joint type=\"free\">", "without the damping, armature and friction of a joint");
      for (const char* word : {"damping", "armature", "frictionloss"}) joint->SetAttribute(word, "0");
    }
  }
  std::set<std::string> names;
  for (XMLElement* body : others) {
    VisitElements(body, [&](XMLElement* part) { names.insert(ReadAttribute(*part, "name")); });
    mjcf->Note(*body, "<body name=\"" + ReadAttribute(*body, "name") + "\">",
               "left out, no part of the robot");
    body->Parent()->DeleteChild(body);
  }
  if (others.empty()) return;
  DeleteNaming(names, mjcf);
  for (XMLElement* section : ListChildren(mjcf->root(), "keyframe")) mjcf->root()->DeleteChild(section);
}

void HoldBase(double lift, MjcfFile* mjcf) {
  std::vector<XMLElement*> joints;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    const std::string_view kind = element->Name();
    if (kind == "freejoint" || (kind == "joint" && ReadAttribute(*element, "type") == "free"))
      joints.push_back(element);
  });
  for (XMLElement* joint : joints) {
    XMLElement* const body = joint->Parent()->ToElement();
    Vector3d p = Vector3d::Zero();
    std::istringstream(ReadAttribute(*body, "pos", "0 0 0")) >> p[0] >> p[1] >> p[2];
    body->SetAttribute("pos", fmt::format("{} {} {}", p[0], p[1], p[2] + lift).c_str());
    DeleteJoint(joint, mjcf);
  }
}

void RequireExactSolver(MjcfFile* mjcf) {
  XMLElement* const option = RequireSection(mjcf->root(), "option");
  option->SetAttribute("solver", "Newton");
  option->SetAttribute("iterations", "100");
  option->SetAttribute("tolerance", "1e-14");
}

}  // namespace dexcheck
