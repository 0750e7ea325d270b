#pragma once

// An MJCF that is changed and written again, in one piece.

#include <deque>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace dexcheck {

/// What was done with one word of a file.
struct MjcfChange {
  std::string file;
  int line = 0;
  std::string word;  ///< "<joint actuatorfrcrange>"
  std::string what;  ///< "left out: forces of actuators, since MuJoCo 3.0.0"
};

/// The elements of an MJCF and of the files that it includes, and where each stood.
class JoinedMjcf {
 public:
  /// What is included takes the place of its `include`.
  /// @throws InputError when a file cannot be read, is not XML, or is included twice.
  explicit JoinedMjcf(const std::filesystem::path& file);
  /// A text; its `include` elements stay. @param source its name in messages. @throws InputError.
  JoinedMjcf(std::string_view text, const std::string& source);
  ~JoinedMjcf();
  JoinedMjcf(const JoinedMjcf&) = delete;
  JoinedMjcf& operator=(const JoinedMjcf&) = delete;

  /// The element `mujoco`.
  [[nodiscard]] tinyxml2::XMLElement* root() { return root_; }
  /// Whether it has a `worldbody`: parts that are meant for `include` have none.
  [[nodiscard]] bool HasWorld() const;
  /// Whether it is no MJCF but a URDF, which the engine reads too.
  [[nodiscard]] bool IsUrdf() const;
  [[nodiscard]] const std::string& source() const { return source_; }
  /// "FILE:LINE" of an element; that of the root for one that was added since.
  [[nodiscard]] std::string FindPlace(const tinyxml2::XMLElement& element) const;
  /// Notes what was done with a word of this element.
  void Note(const tinyxml2::XMLElement& element, const std::string& word, const std::string& what);
  [[nodiscard]] const std::vector<MjcfChange>& changes() const { return changes_; }
  [[nodiscard]] std::string Print() const;

 private:
  struct Place {
    const std::string* file;
    int line;
  };

  void Parse(std::string_view text);
  void Join(const std::filesystem::path& folder);
  void Splice(tinyxml2::XMLElement* include, const std::filesystem::path& folder);
  /// A copy in this document of an element of another file.
  [[nodiscard]] tinyxml2::XMLElement* Clone(const tinyxml2::XMLElement& element, const std::string* file);
  [[nodiscard]] Place ReadPlace(const tinyxml2::XMLElement& element) const;

  std::string source_;
  std::unique_ptr<tinyxml2::XMLDocument> document_;
  tinyxml2::XMLElement* root_ = nullptr;
  std::deque<std::string> files_;  // that are included
  std::deque<Place> places_;       // of elements from there, which point here
  std::vector<MjcfChange> changes_;
};

}  // namespace dexcheck
