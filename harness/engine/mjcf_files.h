#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace tinyxml2 {
class XMLElement;
}  // namespace tinyxml2

namespace dexcheck {

/// Where an MJCF's assets are, as its `compiler` elements say.
struct AssetFolders {
  std::string meshes;  ///< Height fields and skins too.
  std::string textures;
  bool strips_paths = false;  ///< The engine then takes a file's name only, without its folder.

  void Read(const tinyxml2::XMLElement& compiler);
  /// A file of that name, from the MJCF's folder.
  [[nodiscard]] std::filesystem::path Find(const std::string& folder, const std::string& name) const;
};

/// Calls visit for an element and all below it, in the order of the file, without recursion: the depth is the
/// file's choice. What visit adds below an element is visited too.
void VisitElements(tinyxml2::XMLElement* root, const std::function<void(tinyxml2::XMLElement*)>& visit);

/// Files of an MJCF model: the file itself, what it includes, and those of its meshes, height fields and
/// textures that exist, as paths relative to its folder; itself first.
/// @throws InputError when one cannot be read or lies outside that folder.
std::vector<std::string> ListMjcfFiles(const std::filesystem::path& mjcf);

/// An MJCF's text for another folder, `to` instead of `from`: what it includes, and the folders of its meshes
/// and textures, are found from there. Folders that an included file states stay as they are.
/// @param source in messages. @throws InputError when it is not well-formed.
std::string MoveMjcf(const std::string& text, const std::string& source, const std::filesystem::path& from,
                     const std::filesystem::path& to);

}  // namespace dexcheck
