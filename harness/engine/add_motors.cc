#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "controller/common/text.h"
#include "harness/base/files.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/robot_tree.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

/// Returns the force limit of a joint's strongest actuator, N m or N; none where no actuator has one.
std::optional<double> FindJointLimit(const mjModel& m, int joint) {
  std::optional<double> largest;
  for (int i = 0; i < m.nu; ++i) {
    if (m.actuator_trntype[i] != mjTRN_JOINT || m.actuator_trnid[2 * i] != joint) continue;
    const std::optional<std::pair<double, double>> limits = FindForceLimits(m, i);
    if (limits)
      largest = std::max({largest.value_or(0.0), std::abs(limits->first), std::abs(limits->second)});
  }
  return largest;
}

/// Deletes all actuators, and the sensors and controls that name them.
void DeleteActuators(XMLElement* root) {
  DeleteChildren(root, "actuator", [](const XMLElement&) { return true; });
  DeleteInSections(root, {"sensor"},
                   [](const XMLElement& sensor) { return sensor.Attribute("actuator") != nullptr; });
  DeleteControls(root);
}

void ReadForceRanges(const XMLElement& body, std::string child_class, const DefaultClasses& classes,
                     std::map<std::string, double>* limits) {
  child_class = ReadAttribute(body, "childclass", child_class);
  for (const XMLElement* joint : ListChildren(&body, "joint")) {
    const char* const range = classes.Find(*joint, child_class, "actuatorfrcrange");
    std::istringstream numbers(range == nullptr ? "" : range);
    double low = 0.0, high = 0.0;
    if (numbers >> low >> high) (*limits)[ReadAttribute(*joint, "name")] = std::min(-low, high);
  }
  for (const XMLElement* inner : ListChildren(&body, "body"))
    ReadForceRanges(*inner, child_class, classes, limits);
}

}  // namespace

std::optional<std::pair<double, double>> FindForceLimits(const mjModel& m, int actuator) {
  std::optional<std::pair<double, double>> limits;
  const auto cut = [&](const mjtNum* range, double factor) {
    const std::pair<double, double> cut = std::minmax({factor * range[0], factor * range[1]});
    if (!limits) limits = cut;
    limits = {std::max(limits->first, cut.first), std::min(limits->second, cut.second)};
  };
  const double gear = m.actuator_gear[6 * actuator];
  if (m.actuator_forcelimited[actuator] != 0) cut(m.actuator_forcerange + 2 * actuator, gear);
  const bool is_motor = m.actuator_gaintype[actuator] == mjGAIN_FIXED &&
                        m.actuator_biastype[actuator] == mjBIAS_NONE &&
                        m.actuator_dyntype[actuator] == mjDYN_NONE;
  if (is_motor && m.actuator_ctrllimited[actuator] != 0)
    cut(m.actuator_ctrlrange + 2 * actuator, gear * m.actuator_gainprm[mjNGAIN * actuator]);
  return limits;
}

void DeleteControls(XMLElement* root) {
  for (XMLElement* section : ListChildren(root, "keyframe")) {
    for (XMLElement* key : ListChildren(section)) {
      for (const char* name : {"ctrl", "act"}) key->DeleteAttribute(name);
    }
  }
}

std::map<std::string, double> FindForceRanges(const MjcfFile& mjcf) {
  std::map<std::string, double> limits;
  const XMLElement* const root = mjcf.root();
  for (const XMLElement* world : ListChildren(root, "worldbody"))
    ReadForceRanges(*world, "", DefaultClasses(root), &limits);
  std::erase_if(limits, [](const auto& limit) { return !(limit.second > 0.0); });
  return limits;
}

void AddMotors(MjcfFile* mjcf, const std::map<std::string, double>& limits) {
  const std::string& source = mjcf->source();
  const MjModelPtr model = LoadMjcfText(mjcf->PrintFor(CurrentFolder()), source);
  const mjModel& m = *model;
  const int tree = FindRobotTree(m, source).floating_body;
  XMLElement* const root = mjcf->root();
  DeleteActuators(root);
  XMLElement* const actuators = root->InsertNewChildElement("actuator");
  int motors = 0;
  for (int joint = 0; joint < m.njnt; ++joint) {
    if (m.jnt_type[joint] != mjJNT_HINGE && m.jnt_type[joint] != mjJNT_SLIDE) continue;
    if (FindTree(m, joint) != tree) continue;
    const char* const name = mj_id2name(&m, mjOBJ_JOINT, joint);
    if (name == nullptr || *name == '\0') {
      throw InputError(source + ": joint " + NameOf(m, mjOBJ_JOINT, joint) +
                       ": must have a name, so that it can have a motor");
    }
    // Defaults belong to the file: all attributes that a motor could take from them are stated.
    XMLElement* const motor = actuators->InsertNewChildElement("motor");
    motor->SetAttribute("name", name);
    motor->SetAttribute("joint", name);
    motor->SetAttribute("gear", "1 0 0 0 0 0");
    motor->SetAttribute("forcelimited", "false");
    std::optional<double> limit = FindJointLimit(m, joint);
    if (const auto stated = limits.find(name); !limit && stated != limits.end()) limit = stated->second;
    motor->SetAttribute("ctrllimited", limit ? "true" : "false");
    const std::string number = FormatNumber(limit.value_or(0.0));
    if (limit) motor->SetAttribute("ctrlrange", fmt::format("-{0} {0}", number).c_str());
    ++motors;
  }
  mjcf->Note(*root, "<actuator>",
             std::to_string(m.nu) + (m.nu == 1 ? " actuator" : " actuators") + " replaced by " +
                 std::to_string(motors) + (motors == 1 ? " motor" : " motors"));
}

std::vector<XMLElement*> ListBodies(const MjcfFile& mjcf) {
  // The engine numbers bodies from the root on, each before its children.
  std::vector<XMLElement*> bodies = {nullptr};
  for (XMLElement* world : ListChildren(mjcf.root(), "worldbody")) {
    for (XMLElement* body : ListElements(world, "body")) bodies.push_back(body);
  }
  return bodies;
}

void NameParts(MjcfFile* mjcf) {
  const auto name = [](XMLElement* element, int number) {
    if (ReadAttribute(*element, "name").empty())
      element->SetAttribute("name", fmt::format("#{}", number).c_str());
  };
  int joint = 0, number = 0;
  for (XMLElement* body : ListBodies(*mjcf)) {
    if (body != nullptr) name(body, number);
    ++number;
    for (XMLElement* own : ListChildren(body)) {
      const std::string_view kind = own->Name();
      if (kind == "joint" || kind == "freejoint") name(own, joint++);
    }
  }
}

}  // namespace dexcheck
