#include <string_view>

#include "harness/engine/mjcf_passes.h"
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

}  // namespace

void KeepMechanism(MjcfFile* mjcf) {
  DeleteSections("equality", mjcf);
  DeleteSections("tendon", mjcf);
  DeleteUsers(mjcf);
  DeleteControls(mjcf->root());
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    const std::string_view kind = element->Name();
    if (kind == "joint") {
      DeleteWord(element, "stiffness", mjcf);
      DeleteWord(element, "springdamper", mjcf);
    } else if (kind == "body") {
      DeleteWord(element, "gravcomp", mjcf);
    } else if (kind == "flag") {
      DeleteWord(element, "multiccd", mjcf);
    }
  });
}

void RequireExactSolver(MjcfFile* mjcf) {
  XMLElement* const option = RequireSection(mjcf->root(), "option");
  option->SetAttribute("solver", "Newton");
  option->SetAttribute("iterations", "100");
  option->SetAttribute("tolerance", "1e-14");
}

}  // namespace dexcheck
