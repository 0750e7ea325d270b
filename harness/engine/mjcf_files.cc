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
  AssetFolders folders;
};

/// Reads an XML document as the engine does, with the same parser.
/// @param shown the file in messages. @throws InputError.
void ParseXml(const std::string& text, const std::string& shown, tinyxml2::XMLDocument* document) {
  if (document->Parse(text.data(), text.size()) == tinyxml2::XML_SUCCESS) return;
  throw InputError(shown + ": line " + std::to_string(document->ErrorLineNum()) +
                   ": is not well-formed XML: " + document->ErrorName());
}

void ReadXml(const std::filesystem::path& path, const std::string& shown, tinyxml2::XMLDocument* document) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(shown + ": cannot be read: is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(shown + ": cannot be read");
  ParseXml({std::istreambuf_iterator<char>(file), {}}, shown, document);
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
  if (kind == "compiler") found->folders.Read(element);
}

bool LiesInside(const std::filesystem::path& file) {
  return !file.is_absolute() && (file.empty() || *file.begin() != "..");
}

}  // namespace

void AssetFolders::Read(const XMLElement& compiler) {
  if (const char* folder = compiler.Attribute("meshdir")) meshes = folder;
  if (const char* folder = compiler.Attribute("texturedir")) textures = folder;
  if (const char* strip = compiler.Attribute("strippath")) strips_paths = std::string(strip) == "true";
}

std::filesystem::path AssetFolders::Find(const std::string& folder, const std::string& name) const {
  const std::filesystem::path path(name);
  return std::filesystem::path(folder) / (strips_paths ? path.filename() : path);
}

void VisitElements(XMLElement* root, const std::function<void(XMLElement*)>& visit) {
  XMLElement* element = root;
  while (element != nullptr) {
    visit(element);
    if (XMLElement* child = element->FirstChildElement()) {
      element = child;
      continue;
    }
    while (element != root && element->NextSiblingElement() == nullptr) {
      element = element->Parent()->ToElement();
    }
    element = element == root ? nullptr : element->NextSiblingElement();
  }
}

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
    VisitElements(document.RootElement(), [&](const XMLElement* element) { ReadElement(*element, &found); });
  }
  const auto add_assets = [&](const std::vector<std::string>& names, const std::string& asset_folder) {
    for (const std::string& name : names) {
      const std::filesystem::path file = found.folders.Find(asset_folder, name);
      std::error_code error;
      if (!LiesInside(file.lexically_normal()) || std::filesystem::exists(folder / file, error)) add(file);
    }
  };
  add_assets(found.meshes, found.folders.meshes);
  add_assets(found.textures, found.folders.textures);
  std::sort(files.begin() + 1, files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

std::string MoveMjcf(const std::string& text, const std::string& source, const std::filesystem::path& from,
                     const std::filesystem::path& to) {
  tinyxml2::XMLDocument document;
  ParseXml(text, source, &document);
  XMLElement* const root = document.RootElement();
  if (root == nullptr) throw InputError(source + ": must be an MJCF");
  const auto move = [&](const char* name, XMLElement* element, const char* otherwise) {
    const char* const given = element->Attribute(name);
    if (given == nullptr && otherwise == nullptr) return false;
    const std::filesystem::path old(given != nullptr ? given : otherwise);
    if (!old.is_absolute()) {
      std::error_code error;
      const std::filesystem::path moved = std::filesystem::proximate(from / old, to, error);
      element->SetAttribute(name, moved.string().c_str());
    }
    return true;
  };
  bool has_mesh_folder = false;
  bool has_texture_folder = false;
  VisitElements(root, [&](XMLElement* element) {
    const std::string_view kind = element->Name();
    if (kind == "include") move("file", element, nullptr);
    if (kind != "compiler") return;
    has_mesh_folder |= move("meshdir", element, nullptr);
    has_texture_folder |= move("texturedir", element, nullptr);
  });
  // Without such folders, files are looked for in the MJCF's own.
  XMLElement* compiler = root->FirstChildElement("compiler");
  if (compiler == nullptr) compiler = root->InsertFirstChild(document.NewElement("compiler"))->ToElement();
  if (!has_mesh_folder) move("meshdir", compiler, "");
  if (!has_texture_folder) move("texturedir", compiler, "");
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace dexcheck
