#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <new>
#include <set>
#include <sstream>
#include <string_view>
#include <vector>

#include "controller/common/text.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/newer_words.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

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
    // 3.x prints through a stream, which is cut off, its last element first, where memory is short.
    if (elements_.empty() || !root().children.contains("keyframe")) throw std::bad_alloc();
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
    // These elements may stand wherever bodies may, but no printed schema has them.
    if (is_body && kHasFrames) element->children["frame"] = element->children["replicate"] = element;
    // The reader resolves `include` before the schema applies.
    element->children["include"] = &include_;
    path->push_back(element);
  }

  std::vector<std::unique_ptr<SchemaElement>> elements_;
  SchemaElement include_{{"file"}, {}};
};

/// Attributes of 2.2.2 that later releases lack, with their equivalents there, if any.
struct OlderWord {
  std::string_view element;
  const char* attribute;
  std::vector<const char*> now;
};
const OlderWord kOlderWords[] = {
    {"compiler", "convexhull", {}},
    {"lengthrange", "inteval", {"interval"}},
    {"option", "apirate", {}},
    {"option", "mpr_iterations", {"ccd_iterations"}},
    {"option", "mpr_tolerance", {"ccd_tolerance"}},
    {"flag", "passive", {"spring", "damper"}},
    {"flag", "sensornoise", {}},
};

/// "looks, sensors or memory", "contacts, solver or time steps", "forces of actuators", "dynamics".
const char* NameOf(MjcfEffect effect) {
  constexpr std::array<const char*, 4> kNames = {"looks, sensors or memory", "contacts, solver or time steps",
                                                 "forces of actuators", "dynamics"};
  return kNames.at(static_cast<size_t>(effect));
}

/// The word's entry; nullptr when it is not known. @param attribute empty for the element itself.
const NewerWord* FindNewerWord(std::string_view element, std::string_view attribute) {
  const auto find = [&](std::string_view name) -> const NewerWord* {
    const auto* const found = std::ranges::find_if(kNewerWords, [&](const NewerWord& word) {
      return IsAmong(word.elements, name) && IsAmong(word.attributes, attribute);
    });
    return found == std::end(kNewerWords) ? nullptr : found;
  };
  const NewerWord* const own = find(element);
  return own != nullptr || attribute.empty() ? own : find("*");
}

bool IsZero(std::string_view text) { return text.find_first_of("123456789") == std::string_view::npos; }

const SchemaElement& ReadSchema() {
  static const Schema schema;
  return schema.root();
}

class Downgrade {
 public:
  explicit Downgrade(MjcfFile* mjcf) : mjcf_(*mjcf) {}

  void Run() { Check(mjcf_.root(), ReadSchema()); }

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
    ReplaceOlderWords(element, schema);
    ReplaceValues(element);
    const std::string_view kind = element->Name();
    if (kind != "frame" && kind != "replicate") RemoveAttributes(element, schema);
    for (XMLElement* child : ListChildren(element)) {
      const std::string name = child->Name();
      const auto known = schema.children.find(name);
      const char* const plugin = child->Attribute("plugin");
      const bool is_missing = name == "plugin" && plugin != nullptr && !HasPlugin(plugin);
      if (known != schema.children.end() && !is_missing) {
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

  void ReplaceOlderWords(XMLElement* element, const SchemaElement& schema) {
    const auto is_gone = [&](const char* name, const char* attribute) {
      return std::string_view(element->Name()) == name && element->Attribute(attribute) != nullptr &&
             !schema.attributes.contains(attribute);
    };
    for (const auto& [name, attribute, now] : kOlderWords) {
      if (!is_gone(std::string(name).c_str(), attribute)) continue;
      const std::string value = element->Attribute(attribute);
      std::string what = now.empty() ? "left out: not in MuJoCo " + std::string(mj_versionString()) : "";
      for (const char* other : now) {
        element->SetAttribute(other, value.c_str());
        what += (what.empty() ? "written as " : ", ") + std::string(other);
      }
      mjcf_.Note(*element, "<" + std::string(name) + " " + attribute + ">", what);
      element->DeleteAttribute(attribute);
    }
    if (is_gone("option", "collision")) ReplaceCollision(element);
    if (is_gone("compiler", "exactmeshinertia")) ReplaceMeshInertia(element);
  }

  /// Applies the option `collision`, which says whether pairs, masks or both let geoms touch, and deletes it.
  void ReplaceCollision(XMLElement* option) {
    const std::string value = option->Attribute("collision");
    option->DeleteAttribute("collision");
    for (XMLElement* contact : ListElements(mjcf_.root(), "contact"))
      DeleteChildren(contact, "pair", [&](const XMLElement&) { return value == "dynamic"; });
    if (value != "predefined") return;
    for (XMLElement* world : ListElements(mjcf_.root(), "worldbody")) {
      for (XMLElement* geom : ListElements(world, "geom"))
        for (const char* mask : {"contype", "conaffinity"}) geom->SetAttribute(mask, "0");
    }
  }

  /// Each mesh says by itself how its inertia is computed.
  void ReplaceMeshInertia(XMLElement* compiler) {
    const bool is_exact = ReadAttribute(*compiler, "exactmeshinertia") == "true";
    compiler->DeleteAttribute("exactmeshinertia");
    for (XMLElement* asset : ListChildren(mjcf_.root(), "asset")) {
      for (XMLElement* mesh : ListChildren(asset, "mesh")) {
        if (is_exact && mesh->Attribute("inertia") == nullptr) mesh->SetAttribute("inertia", "exact");
      }
    }
  }

  /// Values of attributes that 2.2.2 has with other meanings.
  void ReplaceValues(XMLElement* element) {
    const std::string_view name = element->Name();
    if (name == "compiler") {
      // This attribute sets both directories.
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
        if (kHasImplicitFast || element->Attribute("integrator", value) == nullptr) continue;
        element->SetAttribute("integrator", other);
        mjcf_.Note(*element, "<option integrator>",
                   std::string(value) + " written as " + other + "; no term depends on it");
      }
    }
    if (!kHasImplicitFast && element->Attribute("dyntype", "filterexact") != nullptr) {
      element->SetAttribute("dyntype", "filter");
      mjcf_.Note(*element, "<" + std::string(name) + " dyntype>",
                 "filterexact written as filter; no term depends on it");
    }
    if (name == "joint" && !kHasPolynomials) {
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

std::vector<std::string> ListNewerForces(const MjcfFile& mjcf) {
  const SchemaElement& known = *ReadSchema().children.at("actuator");
  const XMLElement* const root = mjcf.root();
  const DefaultClasses classes(root);
  std::vector<std::string> attributes;
  for (const NewerWord& word : kNewerWords) {
    if (word.elements != "*" || word.effect != MjcfEffect::kActuators) continue;
    std::istringstream names{std::string(word.attributes)};
    for (std::string name; names >> name;) attributes.push_back(name);
  }
  std::vector<std::string> forces;
  for (const XMLElement* section : ListChildren(root, "actuator")) {
    for (const XMLElement* actuator : ListChildren(section)) {
      const auto kind_of = known.children.find(actuator->Name());
      if (kind_of == known.children.end()) continue;
      std::string place = "actuator " + ReadAttribute(*actuator, "name");
      for (const char* kind : {"joint", "jointinparent", "tendon"}) {
        const std::string name = ReadAttribute(*actuator, kind);
        if (!name.empty()) place = kind + (" " + name);
      }
      for (const std::string& attribute : attributes) {
        if (kind_of->second->attributes.contains(attribute)) continue;
        const char* const value = classes.Find(*actuator, "", attribute.c_str());
        const std::string_view text = value == nullptr ? "" : value;
        if (text.empty() || (IsZero(text) && text != "true")) continue;
        forces.push_back(fmt::format("{}: {} {}", place, attribute, text));
      }
    }
  }
  return forces;
}

void LeaveOutNewerWords(MjcfFile* mjcf) { Downgrade(mjcf).Run(); }

XMLElement* RequireSection(XMLElement* root, const char* name) {
  if (XMLElement* const section = root->LastChildElement(name)) return section;
  return root->InsertFirstChild(root->GetDocument()->NewElement(name))->ToElement();
}

void StateNewDefaults(MjcfFile* mjcf) {
  for (const XMLElement* compiler : ListChildren(mjcf->root(), "compiler")) {
    if (compiler->Attribute("autolimits") != nullptr) return;
  }
  XMLElement* const compiler = RequireSection(mjcf->root(), "compiler");
  compiler->SetAttribute("autolimits", "true");
  mjcf->Note(*compiler, "<compiler autolimits>", "set to true, default since MuJoCo 3");
}

}  // namespace dexcheck
