#include "harness/engine/mjcf_files.h"

#include <tinyxml2.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;

/// What the files of one MJCF model name, as written.
struct MjcfReferences {
  std::vector<std::string> includes;
  std::vector<std::string> meshes;  ///< Height fields and skins too: they share the meshes' folder.
  std::vector<std::string> textures;
  std::string mesh_folder;
  std::string texture_folder;
  bool strips_paths = false;  ///< The engine then takes a file's name only, without its folder.
};

/// Reads an XML document as the engine does, with the same parser.
/// @param shown the file in messages. @throws InputError.
void ReadXml(const std::filesystem::path& path, const std::string& shown, tinyxml2::XMLDocument* document) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(shown + ": cannot be read: is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(shown + ": cannot be read");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (document->Parse(text.data(), text.size()) == tinyxml2::XML_SUCCESS) return;
  throw InputError(shown + ": line " + std::to_string(document->ErrorLineNum()) +
                   ": is not well-formed XML: " + document->ErrorName());
}

void AddAttribute(const XMLElement& element, const char* name, std::vector<std::string>* values) {
  if (const char* value = element.Attribute(name)) values->emplace_back(value);
}

void ReadElement(const XMLElement& element, MjcfReferences* found) {
  const std::string kind = element.Name();
  if (kind == "include") AddAttribute(element, "file", &found->includes);
  if (kind == "mesh" || kind == "hfield" || kind == "skin") AddAttribute(element, "file", &found->meshes);
  if (kind == "texture") {
    for (const char* side :
         {"file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"}) {
      AddAttribute(element, side, &found->textures);
    }
  }
  if (kind != "compiler") return;
  if (const char* folder = element.Attribute("meshdir")) found->mesh_folder = folder;
  if (const char* folder = element.Attribute("texturedir")) found->texture_folder = folder;
  if (const char* strip = element.Attribute("strippath")) found->strips_paths = std::string(strip) == "true";
}

/// All elements below the document, without recursion: the depth is the file's choice.
void ReadElements(const tinyxml2::XMLDocument& document, MjcfReferences* found) {
  const XMLElement* const root = document.RootElement();
  const XMLElement* element = root;
  while (element != nullptr) {
    ReadElement(*element, found);
    if (const XMLElement* child = element->FirstChildElement()) {
      element = child;
      continue;
    }
    while (element != root && element->NextSiblingElement() == nullptr) {
      element = element->Parent()->ToElement();
    }
    element = element == root ? nullptr : element->NextSiblingElement();
  }
}

bool LiesInside(const std::filesystem::path& file) {
  return !file.is_absolute() && (file.empty() || *file.begin() != "..");
}

}  // namespace

std::vector<std::string> ListMjcfFiles(const std::filesystem::path& mjcf) {
  const std::filesystem::path folder = mjcf.parent_path();
  std::vector<std::string> files;
  const auto add = [&](const std::filesystem::path& given) {
    const std::filesystem::path file = given.lexically_normal();
    if (!LiesInside(file)) {
      throw InputError(mjcf.string() + ": file " + Quote(file.string()) +
                       ": must lie in the MJCF's folder, so that the log can keep it");
    }
    files.push_back(file.string());
  };
  MjcfReferences found;
  found.includes = {mjcf.filename().string()};
  std::set<std::string> read;
  while (!found.includes.empty()) {
    const std::string name = std::filesystem::path(found.includes.back()).lexically_normal().string();
    found.includes.pop_back();
    if (!read.insert(name).second) continue;
    add(name);
    tinyxml2::XMLDocument document;
    const bool is_included = files.size() > 1;
    ReadXml(folder / name, is_included ? mjcf.string() + ": file " + Quote(name) : mjcf.string(), &document);
    ReadElements(document, &found);
  }
  const auto add_assets = [&](const std::vector<std::string>& names, const std::string& asset_folder) {
    for (const std::string& given : names) {
      const std::filesystem::path name(given);
      add(std::filesystem::path(asset_folder) / (found.strips_paths ? name.filename() : name));
    }
  };
  add_assets(found.meshes, found.mesh_folder);
  add_assets(found.textures, found.texture_folder);
  std::sort(files.begin() + 1, files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

}  // namespace dexcheck
