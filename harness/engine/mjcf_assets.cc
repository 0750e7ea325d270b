#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <system_error>

#include "controller/common/text.h"
#include "harness/base/files.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

constexpr const char* kTextureFiles[] = {"file",     "fileright", "fileleft", "fileup",
                                         "filedown", "filefront", "fileback"};

bool Is(const XMLElement& element, std::string_view name) { return name == element.Name(); }

/// Body and classes that contain a geom.
struct Surroundings {
  std::string body;
  std::string child_class;
  bool moves = false;
  bool has_inertial = false;
};

class AssetSieve {
 public:
  explicit AssetSieve(MjcfFile* mjcf) : mjcf_(*mjcf), defaults_(mjcf->root()) {}

  void Run() {
    VisitElements(mjcf_.root(), [&](XMLElement* element) { ReadSettings(*element); });
    for (XMLElement* section : ListChildren(mjcf_.root(), "asset")) SieveAssets(section);
    for (XMLElement* section : ListChildren(mjcf_.root(), "worldbody")) SieveBody(section, {});
    VisitElements(mjcf_.root(), [&](XMLElement* element) { DropLooks(element); });
    DeleteInSections(mjcf_.root(), {"contact", "sensor", "tendon", "equality", "custom"},
                     [&](const XMLElement& child) { return RefersToRemoved(child); });
  }

 private:
  void ReadSettings(const XMLElement& element) {
    if (Is(element, "material")) materials_.insert(ReadAttribute(element, "name"));
    if (!Is(element, "compiler")) return;
    folders_.Read(element);
    inertia_from_geom_ = ReadAttribute(element, "inertiafromgeom", inertia_from_geom_);
    if (const char* range = element.Attribute("inertiagrouprange")) {
      char* rest = nullptr;
      first_group_ = std::strtol(range, &rest, 10);
      last_group_ = std::strtol(rest, nullptr, 10);
    }
  }

  /// Returns the name that the engine gives an asset: the file's where the asset states none.
  static std::string NameOf(const XMLElement& asset) {
    const std::filesystem::path file = ReadAttribute(asset, "file");
    return ReadAttribute(asset, "name", file.stem().string());
  }

  [[nodiscard]] std::string FindFault(const XMLElement& asset, const std::string& folder, const char* file) {
    const std::filesystem::path path = mjcf_.folder() / folders_.Find(folder, file);
    if (Is(asset, "mesh")) return FindMeshFault(path);
    return Exists(path) ? "" : "does not exist";
  }

  void SieveAssets(XMLElement* section) {
    for (XMLElement* asset : ListChildren(section)) {
      const bool is_shape = Is(*asset, "mesh") || Is(*asset, "hfield");
      if (Is(*asset, "texture")) SieveTexture(asset);
      if (!is_shape && !Is(*asset, "skin")) continue;
      const char* const file = asset->Attribute("file");
      const std::string fault = file != nullptr ? FindFault(*asset, folders_.meshes, file) : "";
      if (is_shape) shapes_[asset->Name()][NameOf(*asset)] = {file != nullptr ? file : "", fault};
      if (fault.empty()) continue;
      if (!is_shape) NoteFile(*asset, file, "left out", fault);
      section->DeleteChild(asset);
    }
  }

  /// Replaces a texture whose files are at fault by one colour in its place.
  void SieveTexture(XMLElement* texture) {
    textures_.insert(NameOf(*texture));
    for (const char* side : kTextureFiles) {
      const char* const file = texture->Attribute(side);
      if (file == nullptr) continue;
      const std::string fault = FindFault(*texture, folders_.textures, file);
      if (fault.empty()) continue;
      NoteFile(*texture, file, "its texture left out", fault);
      texture->SetAttribute("name", NameOf(*texture).c_str());
      for (const char* other : kTextureFiles) texture->DeleteAttribute(other);
      texture->SetAttribute("builtin", "flat");
      for (const char* size : {"width", "height"}) texture->SetAttribute(size, "1");
      if (texture->Attribute("rgb1") == nullptr) texture->SetAttribute("rgb1", "1 1 1");
      return;
    }
  }

  void NoteFile(const XMLElement& element, const std::string& file, const std::string& loss,
                const std::string& fault) {
    mjcf_.Note(element, Abbreviate(std::filesystem::path(file).filename().string()), loss + ": " + fault);
  }

  void SieveBody(XMLElement* body, Surroundings around) {
    if (Is(*body, "body")) around.body = ReadAttribute(*body, "name");
    around.child_class = ReadAttribute(*body, "childclass", around.child_class);
    around.moves |=
        body->FirstChildElement("joint") != nullptr || body->FirstChildElement("freejoint") != nullptr;
    around.has_inertial = body->FirstChildElement("inertial") != nullptr;
    for (XMLElement* child : ListChildren(body)) {
      if (Is(*child, "body")) SieveBody(child, around);
      if (Is(*child, "geom") && SieveGeom(*child, around)) body->DeleteChild(child);
    }
  }

  /// @return whether the geom must go.
  bool SieveGeom(const XMLElement& geom, const Surroundings& around) {
    const auto find = [&](const char* attribute) {
      return defaults_.Find(geom, around.child_class, attribute);
    };
    for (const char* kind : {"mesh", "hfield"}) {
      const char* const name = find(kind);
      if (name == nullptr) continue;
      const auto known = shapes_[kind].find(name);
      const Shape shape = known != shapes_[kind].end()
                              ? known->second
                              : Shape{name, "is no " + std::string(kind) + " of the file"};
      if (shape.fault.empty()) continue;
      if (HasMass(find, around)) {
        throw InputError(mjcf_.FindPlace(geom) + ": " + kind + " " + Quote(shape.file) + ": " + shape.fault +
                         "; the mass of body " + Quote(around.body) +
                         " follows from it: give the body an inertial");
      }
      const char* const own = geom.Attribute("name");
      if (own != nullptr) removed_.insert(own);
      const auto is_zero = [](const char* mask) { return mask != nullptr && std::atol(mask) == 0; };
      const bool is_looked_at = is_zero(find("contype")) && is_zero(find("conaffinity"));
      NoteFile(geom, shape.file, is_looked_at ? "left out" : "left out with its contacts", shape.fault);
      return true;
    }
    return false;
  }

  template <typename Find>
  [[nodiscard]] bool HasMass(const Find& find, const Surroundings& around) const {
    if (!around.moves || inertia_from_geom_ == "false") return false;
    if (inertia_from_geom_ == "auto" && around.has_inertial) return false;
    const char* const group_text = find("group");
    const long group = group_text != nullptr ? std::atol(group_text) : 0;
    if (group < first_group_ || group > last_group_) return false;
    const char* const mass = find("mass");
    const char* const density = find("density");
    if (mass != nullptr) return std::strtod(mass, nullptr) != 0.0;
    return density == nullptr || std::strtod(density, nullptr) != 0.0;
  }

  /// Deletes references to materials and textures that no asset defines.
  void DropLooks(XMLElement* element) {
    const auto drop = [&](const char* attribute, const std::set<std::string>& known) {
      const char* const name = element->Attribute(attribute);
      if (name == nullptr || known.contains(name)) return;
      mjcf_.Note(*element, Abbreviate(name), "left out: no " + std::string(attribute) + " of the file");
      element->DeleteAttribute(attribute);
    };
    drop("material", materials_);
    if (Is(*element, "material")) drop("texture", textures_);
  }

  /// Whether a pair, sensor or other element refers to a geom that is gone, which it then notes.
  [[nodiscard]] bool RefersToRemoved(const XMLElement& child) {
    const auto refers = [&](const char* attribute) {
      return removed_.contains(ReadAttribute(child, attribute));
    };
    constexpr const char* kReferences[] = {"geom", "geom1", "geom2", "objname", "refname"};
    if (std::ranges::none_of(kReferences, refers)) return false;
    mjcf_.Note(child, "<" + std::string(child.Name()) + ">", "left out with its geom");
    return true;
  }

  struct Shape {
    std::string file;
    std::string fault;
  };

  MjcfFile& mjcf_;
  AssetFolders folders_;
  DefaultClasses defaults_;
  std::string inertia_from_geom_ = "auto";
  long first_group_ = 0;
  long last_group_ = 5;
  std::map<std::string, std::map<std::string, Shape>> shapes_;  // meshes and height fields
  std::set<std::string> materials_;
  std::set<std::string> textures_;
  std::set<std::string> removed_;  // names of geoms
};

}  // namespace

void LeaveOutAssets(MjcfFile* mjcf) { AssetSieve(mjcf).Run(); }

void AdaptMjcf(MjcfFile* mjcf) {
  for (const auto& pass : {CheckNumbers, LeaveOutNewerWords, LeaveOutAssets}) pass(mjcf);
}

std::vector<AssetFile> ListAssetFiles(XMLElement* root) {
  AssetFolders folders;
  for (const XMLElement* compiler : ListElements(root, "compiler")) folders.Read(*compiler);
  std::vector<AssetFile> files;
  const auto add = [&](XMLElement* element, const char* attribute, const std::string& folder) {
    if (const char* const name = element->Attribute(attribute))
      files.push_back({element, attribute, folder, folders.Find(folder, name)});
  };
  VisitElements(root, [&](XMLElement* element) {
    if (Is(*element, "texture"))
      for (const char* attribute : kTextureFiles) add(element, attribute, folders.textures);
    if (Is(*element, "mesh") || Is(*element, "hfield") || Is(*element, "skin"))
      add(element, "file", folders.meshes);
  });
  return files;
}

}  // namespace dexcheck
