#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string_view>
#include <vector>

#include "controller/common/text.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

// What later releases added: the schemas of MuJoCo from 2.3.0 to 3.12.0, compared with that of 2.2.2.

/// What a newer element or attribute acts on.
enum class MjcfEffect {
  kNone,       ///< Looks, sensors, memory, names.
  kContacts,   ///< Contacts, solver, integration in time: no term of the free robot.
  kActuators,  ///< Forces of motors.
  kDynamics,   ///< M, C v, gravity, friction, or the mechanism itself.
};

/// An element (`attribute` is empty) or an attribute that 2.2.2 does not have.
struct NewerWord {
  std::string_view element;  ///< Or "PARENT/ELEMENT".
  std::string_view attribute;
  std::string_view since;  ///< Release, "3.1.4".
  MjcfEffect effect;
  std::string_view neutral;  ///< Value with which it acts on nothing; empty: none is known.
  std::string_view advice;   ///< What to do, when it acts on the dynamics.
};
using enum MjcfEffect;

constexpr std::string_view kExpand =
    "load the file in the release that it was written for and save it compiled (mj_saveLastXML), which has "
    "no such element";
constexpr std::string_view kActuatorInertia = "give it to the joint, as armature or damping";

/// Of what acts on no term, or on motors and contacts alone: elements, or attributes that each of the
/// elements has.
struct PlainWords {
  std::string_view elements;    ///< Separated by blanks; "*" stands for all, "a/b" for b in a.
  std::string_view attributes;  ///< Empty for the elements themselves.
  std::string_view since;
  MjcfEffect effect;
};

constexpr PlainWords kPlainWords[] = {
    {"layer", "", "3.2.5", kNone},
    {"rgb", "", "3.2.1", kNone},
    {"dcmotor", "", "3.7.0", kActuators},
    {"orientation", "", "3.11.0", kActuators},
    {"pid", "", "3.12.0", kActuators},
    {"jointactuatorfrc", "", "2.3.7", kNone},
    {"tendonactuatorfrc", "", "3.3.1", kNone},
    {"camprojection", "", "3.0.0", kNone},
    {"distance normal fromto", "", "3.1.6", kNone},
    {"e_potential e_kinetic", "", "3.3.0", kNone},
    {"insidesite tactile sensor/contact", "", "3.3.5", kNone},
    {"extension sensor/plugin", "", "2.3.0", kNone},
    {"actuator/plugin", "", "2.3.0", kActuators},
    {"compiler", "saveinertial", "3.3.1", kNone},
    {"compiler", "conflict", "3.10.0", kNone},
    {"size", "memory", "2.3.0", kNone},
    {"scale rgba", "frustum", "3.0.1", kNone},
    {"rgba", "bv bvactive", "3.1.2", kNone},
    {"global", "realtime", "2.3.0", kNone},
    {"global", "ellipsoidinertia", "2.3.4", kNone},
    {"global", "bvactive", "3.1.2", kNone},
    {"global camera", "orthographic", "3.2.0", kNone},
    {"global", "cameraid", "3.3.4", kNone},
    {"material", "metallic roughness", "3.1.5", kNone},
    {"light", "bulbradius", "3.1.5", kNone},
    {"light", "intensity range texture type", "3.3.3", kNone},
    {"light", "softness", "3.12.0", kNone},
    {"camera", "focal focalpixel principal principalpixel resolution sensorsize", "3.0.0", kNone},
    {"camera", "output projection", "3.5.0", kNone},
    {"texture", "nchannel", "3.2.1", kNone},
    {"texture", "colorspace", "3.3.3", kNone},
    {"texture mesh hfield", "content_type", "2.3.7", kNone},
    {"mesh", "material", "3.3.6", kNone},
    {"mesh", "maxhullvert", "3.2.0", kContacts},
    {"hfield", "elevation", "3.1.2", kContacts},
    {"body flag", "sleep", "3.4.0", kContacts},
    {"body", "simple", "3.11.0", kNone},
    {"joint", "actuatorforcelimited actuatorforcerange", "2.3.7", kActuators},
    {"joint", "actuatorfrclimited actuatorfrcrange", "3.0.0", kActuators},
    {"joint", "actuatorgravcomp", "3.1.4", kActuators},
    {"geom", "adhesion surfacevel", "3.11.0", kContacts},
    {"pair", "adhesion", "3.11.0", kContacts},
    {"pair", "solreffriction", "2.3.6", kContacts},
    {"spatial fixed", "actuatorfrclimited actuatorfrcrange", "3.3.1", kActuators},
    {"flag", "midphase eulerdamp invdiscrete island", "3.0.0", kContacts},
    {"flag", "autoreset", "3.2.1", kContacts},
    {"flag", "nativeccd", "3.2.3", kContacts},
    {"flag", "diagexact", "3.9.0", kContacts},
    {"option", "ls_iterations ls_tolerance o_friction sdf_initpoints sdf_iterations", "3.0.0", kContacts},
    {"option", "actuatorgroupdisable", "3.0.1", kActuators},
    {"option", "ccd_iterations ccd_tolerance", "3.2.3", kContacts},
    {"option", "sleep_tolerance", "3.4.0", kContacts},
    {"lengthrange", "interval", "2.3.3", kActuators},
    {"*", "kv", "3.1.0", kActuators},
    {"*", "dampratio timeconst", "3.1.6", kActuators},
    {"*", "inheritrange", "3.1.3", kActuators},
    {"*", "actearly", "3.0.0", kActuators},
    {"*", "actdim", "2.3.1", kActuators},
    {"*", "actlimited input", "3.11.0", kActuators},
    {"*", "tausmooth", "2.3.6", kActuators},
    {"*", "ffrange velrange", "3.12.0", kActuators},
    {"*", "delay interp nsample", "3.5.0", kActuators},
    {"*", "interval", "3.5.0", kNone},
    {"rangefinder", "camera data", "3.5.0", kNone},
};

/// What acts on the dynamics, or on nothing with a certain value.
constexpr NewerWord kWords[] = {
    {"frame", "", "3.1.0", kDynamics, "", kExpand},
    {"replicate", "", "3.1.5", kDynamics, "", kExpand},
    {"attach", "", "3.2.0", kDynamics, "", kExpand},
    {"model", "", "3.2.0", kDynamics, "", kExpand},
    {"flexcomp", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"deformable", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flex", "", "3.0.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexvert", "", "3.5.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"flexstrain", "", "3.6.0", kDynamics, "", "deformable bodies are not in 2.2.2"},
    {"composite", "initial", "2.3.0", kDynamics, "", kExpand},
    {"composite", "curve", "2.3.0", kDynamics, "", kExpand},
    {"plugin", "", "2.3.0", kDynamics, "", "plugins may apply forces; remove them by hand"},
    {"compiler", "alignfree", "3.2.3", kDynamics, "false", "it moves frames of free bodies; set it to false"},
    {"freejoint", "align", "3.2.3", kDynamics, "false",
     "it moves the frame of the free body; set it to false"},
    {"mesh", "inertia", "3.2.5", kDynamics, "legacy",
     "give each body an inertial, or use compiler exactmeshinertia"},
    {"mesh", "builtin", "3.3.5", kDynamics, "", "save the mesh as a file"},
    {"mesh", "params", "3.3.5", kDynamics, "", "save the mesh as a file"},
    {"body", "gravcomp", "2.3.1", kDynamics, "0", "it holds a part of the weight; set it to 0"},
    {"connect", "site1", "3.2.3", kDynamics, "", "give the constraint bodies and an anchor"},
    {"connect", "site2", "3.2.3", kDynamics, "", "give the constraint bodies and an anchor"},
    {"weld", "site1", "3.2.3", kDynamics, "", "give the constraint bodies and a pose"},
    {"weld", "site2", "3.2.3", kDynamics, "", "give the constraint bodies and a pose"},
    {"spatial", "armature", "3.3.1", kDynamics, "0", "tendons have no inertia in 2.2.2"},
    {"fixed", "armature", "3.3.1", kDynamics, "0", "tendons have no inertia in 2.2.2"},
    {"flag", "spring", "3.3.6", kDynamics, "enable",
     "the flag passive switches springs and dampers together"},
    {"flag", "damper", "3.3.6", kDynamics, "enable",
     "the flag passive switches springs and dampers together"},
    {"*", "armature", "3.7.0", kDynamics, "0", kActuatorInertia},
    {"*", "damping", "3.7.0", kDynamics, "0", kActuatorInertia},
};

std::vector<std::string_view> Split(std::string_view list) {
  std::vector<std::string_view> words;
  while (!list.empty()) {
    const size_t end = std::min(list.find(' '), list.size());
    words.push_back(list.substr(0, end));
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return words.empty() ? std::vector<std::string_view>{""} : words;
}

const std::vector<NewerWord>& ListWords() {
  static const std::vector<NewerWord> all = [] {
    std::vector<NewerWord> list(std::begin(kWords), std::end(kWords));
    for (const PlainWords& words : kPlainWords) {
      for (const std::string_view element : Split(words.elements)) {
        for (const std::string_view attribute : Split(words.attributes))
          list.push_back({element, attribute, words.since, words.effect, "", ""});
      }
    }
    return list;
  }();
  return all;
}

/// "looks, sensors or memory", "contacts, solver or time steps", "forces of actuators", "dynamics".
const char* NameOf(MjcfEffect effect) {
  constexpr std::array<const char*, 4> kNames = {"looks, sensors or memory", "contacts, solver or time steps",
                                                 "forces of actuators", "dynamics"};
  return kNames.at(static_cast<size_t>(effect));
}

/// The word's entry; nullptr when it is not known. @param attribute empty for the element itself.
const NewerWord* FindNewerWord(std::string_view element, std::string_view attribute) {
  const auto find = [&](std::string_view name) -> const NewerWord* {
    const std::vector<NewerWord>& words = ListWords();
    const auto found = std::find_if(words.begin(), words.end(), [&](const NewerWord& word) {
      return word.element == name && word.attribute == attribute;
    });
    return found == words.end() ? nullptr : &*found;
  };
  const NewerWord* const own = find(element);
  return own != nullptr || attribute.empty() ? own : find("*");
}

using tinyxml2::XMLElement;

/// An element of the engine's own schema.
struct SchemaElement {
  std::set<std::string, std::less<>> attributes;
  std::map<std::string, SchemaElement*, std::less<>> children;
};

/// The schema of the engine that is linked, as mj_printSchema prints it: three blanks a level, the element's
/// name with how often it may stand there, and its attributes, which may take further lines.
class Schema {
 public:
  Schema() {
    std::vector<char> text(1 << 18);
    mj_printSchema(nullptr, text.data(), static_cast<int>(text.size()), /*flg_html=*/0, /*flg_pad=*/0);
    std::istringstream lines(text.data());
    std::vector<SchemaElement*> path;
    for (std::string line; std::getline(lines, line);) ReadLine(line, &path);
  }
  [[nodiscard]] const SchemaElement& root() const { return *elements_.front(); }

 private:
  void ReadLine(const std::string& line, std::vector<SchemaElement*>* path) {
    std::istringstream words(line);
    // " (?)", with one of !, ?, *, R between the brackets; "(world)body (R)" has others before.
    size_t kind = line.find(" (");
    while (kind != std::string::npos && !(kind + 3 < line.size() && line[kind + 3] == ')')) {
      kind = line.find(" (", kind + 1);
    }
    if (kind != std::string::npos) {
      const size_t indent = line.find_first_not_of(' ');
      std::string name;
      words >> name;
      std::string skipped;
      words >> skipped;
      Add(indent / 3, name, line[kind + 2] == 'R', path);
    }
    if (path->empty()) return;
    for (std::string attribute; words >> attribute;) path->back()->attributes.insert(attribute);
  }

  void Add(size_t level, std::string name, bool is_recursive, std::vector<SchemaElement*>* path) {
    const bool is_body = name == "(world)body";
    if (is_body) name = "body";
    SchemaElement* const element = elements_.emplace_back(std::make_unique<SchemaElement>()).get();
    if (path->size() > level) path->resize(level);
    if (!path->empty()) {
      path->back()->children[name] = element;
      if (is_body) path->back()->children["worldbody"] = element;
    }
    if (is_recursive) element->children[name] = element;
    // Understood by the reader before the schema.
    element->children["include"] = &include_;
    path->push_back(element);
  }

  std::vector<std::unique_ptr<SchemaElement>> elements_;
  SchemaElement include_{{"file"}, {}};
};

bool IsZero(std::string_view text) { return text.find_first_of("123456789") == std::string_view::npos; }

class Downgrade {
 public:
  explicit Downgrade(MjcfFile* mjcf) : mjcf_(*mjcf) {}

  void Run() {
    static const Schema schema;
    Check(mjcf_.root(), schema.root());
  }

 private:
  [[noreturn]] void Refuse(const XMLElement& element, const std::string& word, const NewerWord* known) const {
    std::string why = "is neither in " + std::string(mj_versionString()) + " nor known to be newer";
    if (known != nullptr) {
      why = "acts on the dynamics, since MuJoCo " + std::string(known->since) + ": " +
            std::string(known->advice);
    }
    throw InputError(mjcf_.FindPlace(element) + ": " + word + ": " + why);
  }

  static std::string DescribeLoss(const NewerWord& word) {
    return "left out: " + std::string(NameOf(word.effect)) + ", since MuJoCo " + std::string(word.since);
  }

  void Check(XMLElement* element, const SchemaElement& schema) {
    ReplaceValues(element);
    RemoveAttributes(element, schema);
    for (XMLElement* child : ListChildren(element)) {
      const std::string name = child->Name();
      const auto known = schema.children.find(name);
      if (known != schema.children.end()) {
        Check(child, *known->second);
        continue;
      }
      const NewerWord* newer = FindNewerWord(element->Name() + ("/" + name), "");
      if (newer == nullptr) newer = FindNewerWord(name, "");
      if (newer == nullptr || newer->effect == MjcfEffect::kDynamics) Refuse(*child, "<" + name + ">", newer);
      mjcf_.Note(*child, "<" + name + ">", DescribeLoss(*newer));
      element->DeleteChild(child);
    }
  }

  void RemoveAttributes(XMLElement* element, const SchemaElement& schema) {
    for (const tinyxml2::XMLAttribute* attribute = element->FirstAttribute(); attribute != nullptr;) {
      const tinyxml2::XMLAttribute* const next = attribute->Next();
      const std::string name = attribute->Name();
      if (!schema.attributes.contains(name)) {
        const std::string word = "<" + std::string(element->Name()) + " " + name + ">";
        const NewerWord* const newer = FindNewerWord(element->Name(), name);
        if (newer == nullptr) Refuse(*element, word, newer);
        const bool is_neutral =
            !newer->neutral.empty() &&
            (newer->neutral == attribute->Value() || (newer->neutral == "0" && IsZero(attribute->Value())));
        if (newer->effect == MjcfEffect::kDynamics && !is_neutral) Refuse(*element, word, newer);
        mjcf_.Note(*element, word, DescribeLoss(*newer));
        element->DeleteAttribute(name.c_str());
      }
      attribute = next;
    }
  }

  /// Values of attributes that 2.2.2 has with other meanings.
  void ReplaceValues(XMLElement* element) {
    const std::string_view name = element->Name();
    if (name == "compiler") {
      // Both directories at once.
      if (const char* folder = element->Attribute("assetdir")) {
        const std::string assets = folder;
        for (const char* each : {"meshdir", "texturedir"}) {
          if (element->Attribute(each) == nullptr) element->SetAttribute(each, assets.c_str());
        }
        element->DeleteAttribute("assetdir");
        mjcf_.Note(*element, "<compiler assetdir>", "written as meshdir and texturedir");
      }
    }
    if (name == "option") {
      for (const auto& [value, other] :
           {std::pair("implicitfast", "implicit"), std::pair("discrete", "Euler")}) {
        if (element->Attribute("integrator", value) == nullptr) continue;
        element->SetAttribute("integrator", other);
        mjcf_.Note(*element, "<option integrator>",
                   std::string(value) + " written as " + other + ", which no term depends on");
      }
    }
    if (name == "joint") {
      TakePolynomial(element, "damping");
      TakePolynomial(element, "stiffness");
    }
  }

  /// Forces that are polynomials of the velocity or position: 2.2.2 has the first coefficient.
  void TakePolynomial(XMLElement* joint, const char* attribute) {
    const char* const value = joint->Attribute(attribute);
    if (value == nullptr) return;
    std::istringstream numbers(value);
    std::string first;
    std::string rest;
    numbers >> first;
    std::getline(numbers, rest);
    if (rest.find_first_not_of(" \t") == std::string::npos) return;
    const std::string word = "<joint " + std::string(attribute) + ">";
    if (!IsZero(rest)) {
      throw InputError(mjcf_.FindPlace(*joint) + ": " + word +
                       ": acts on the dynamics: 2.2.2 has the first coefficient only, got " + Quote(value));
    }
    joint->SetAttribute(attribute, first.c_str());
    mjcf_.Note(*joint, word, "its zero coefficients left out");
  }

  MjcfFile& mjcf_;
};

}  // namespace

void LeaveOutNewerWords(MjcfFile* mjcf) { Downgrade(mjcf).Run(); }

XMLElement* RequireCompiler(XMLElement* root) {
  if (XMLElement* const compiler = root->FirstChildElement("compiler")) return compiler;
  return root->InsertFirstChild(root->GetDocument()->NewElement("compiler"))->ToElement();
}

void StateNewDefaults(MjcfFile* mjcf) {
  for (const XMLElement* compiler : ListChildren(mjcf->root(), "compiler")) {
    if (compiler->Attribute("autolimits") != nullptr) return;
  }
  XMLElement* const compiler = RequireCompiler(mjcf->root());
  compiler->SetAttribute("autolimits", "true");
  mjcf->Note(*compiler, "<compiler autolimits>", "stated: true by default since MuJoCo 3.0.0");
}

}  // namespace dexcheck
