#pragma once

// An MJCF as one document: included files are joined, passes change it (mjcf_passes.h), and it is written.

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace dexcheck {

/// A change of one word of a file.
struct MjcfChange {
  std::string file;
  int line = 0;
  std::string word;  ///< "<joint actuatorfrcrange>"
  std::string what;  ///< "left out: forces of actuators, since MuJoCo 3.0.0"
};

/// Folders of an MJCF's assets, as its `compiler` elements state.
struct AssetFolders {
  std::string meshes;  ///< Height fields and skins too.
  std::string textures;
  bool strips_paths = false;  ///< Whether the engine takes a file's name only, without its folder.

  void Read(const tinyxml2::XMLElement& compiler);
  /// Returns the path of a file of that name, relative to the MJCF's folder.
  [[nodiscard]] std::filesystem::path Find(const std::string& folder, const std::string& name) const;
};

/// Attributes that elements take from their default class where they do not state them.
class DefaultClasses {
 public:
  /// @param root the element `mujoco`.
  explicit DefaultClasses(const tinyxml2::XMLElement* root);

  /// Returns the attribute of an element, its own or that of its class; nullptr without one.
  /// @param child_class of the bodies around it; empty for none.
  [[nodiscard]] const char* Find(const tinyxml2::XMLElement& element, const std::string& child_class,
                                 const char* attribute) const;

 private:
  struct Class {
    std::string parent;
    std::vector<const tinyxml2::XMLElement*> sections;
  };
  void Read(const tinyxml2::XMLElement& section, const std::string& parent);

  std::string top_ = "main";
  std::map<std::string, Class> classes_;
};

/// The elements of an MJCF and of the files that it includes, with the place of each.
class MjcfFile {
 public:
  /// Reads a file; an included file takes the place of its `include`.
  /// @param text of the file, where it was read already.
  /// @throws InputError when a file cannot be read, is not XML, or is included twice.
  explicit MjcfFile(const std::filesystem::path& file, const std::string* text = nullptr);
  /// Reads a text, whose files are found from the working directory; its `include` elements stay.
  /// @param source its name in messages. @throws InputError.
  MjcfFile(std::string_view text, const std::string& source);
  ~MjcfFile();
  MjcfFile(const MjcfFile&) = delete;
  MjcfFile& operator=(const MjcfFile&) = delete;

  /// The element `mujoco`.
  [[nodiscard]] tinyxml2::XMLElement* root() const { return root_; }
  /// Whether the document has a `worldbody`: parts for `include` have none.
  [[nodiscard]] bool HasWorld() const;
  /// Whether the document is a URDF, which the engine reads too.
  [[nodiscard]] bool IsUrdf() const;
  [[nodiscard]] const std::string& source() const { return source_; }
  /// Folder from which its files are found; absolute.
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// The files that it includes, relative to its folder.
  [[nodiscard]] const std::vector<std::string>& included() const { return included_; }
  /// Returns "FILE:LINE" of an element; the root's for one that was added since.
  [[nodiscard]] std::string FindPlace(const tinyxml2::XMLElement& element) const;
  /// Notes a change of a word of this element.
  void Note(const tinyxml2::XMLElement& element, const std::string& word, const std::string& what);
  [[nodiscard]] const std::vector<MjcfChange>& changes() const { return changes_; }
  /// "robot.xml: left out: forces of actuators: <joint kv> (7), ...; left out: ...": all changes in one line.
  [[nodiscard]] std::string SummarizeChanges() const;
  [[nodiscard]] std::string Print() const;
  /// Prints the document for a file in another folder: the paths of its meshes and textures start there.
  [[nodiscard]] std::string PrintFor(const std::filesystem::path& folder) const;

 private:
  struct Place {
    const std::string* file;
    int line;
  };

  void Parse(std::string_view text);
  void Splice(tinyxml2::XMLElement* include);
  /// Returns a copy in this document of an element of another file.
  [[nodiscard]] tinyxml2::XMLElement* Clone(const tinyxml2::XMLElement& element, const std::string* file);
  [[nodiscard]] Place ReadPlace(const tinyxml2::XMLElement& element) const;

  std::string source_;
  std::filesystem::path folder_;
  std::unique_ptr<tinyxml2::XMLDocument> document_;
  tinyxml2::XMLElement* root_ = nullptr;
  std::deque<std::string> files_;  // that are included, from the working directory
  std::vector<std::string> included_;
  std::deque<Place> places_;  // of elements from there, which point here
  std::vector<MjcfChange> changes_;
};

/// Lists the messages so far, on standard error, about the files that this process loaded (LoadMjcf): words
/// left out of them for this release of the engine, and the engine's own warnings.
std::vector<std::string> ListLoadNotes();

/// Lists the files of an MJCF model: the file itself first, included files, and those of its meshes, height
/// fields and textures that exist, as paths relative to its folder.
/// @throws InputError as MjcfFile, and when one lies outside that folder.
std::vector<std::string> ListMjcfFiles(const std::filesystem::path& mjcf);

}  // namespace dexcheck
