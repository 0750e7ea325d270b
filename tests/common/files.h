#pragma once

// Files for tests that need real ones.

#include <filesystem>
#include <string>
#include <vector>

namespace dexcheck::testing {

/// A new empty folder, removed with all that is in it at the end.
class TempFolder {
 public:
  TempFolder();
  ~TempFolder();
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::string ReadText(const std::filesystem::path& path);
void WriteText(const std::filesystem::path& path, const std::string& text);

/// The text with its first occurrence of `from` replaced; where there is none the test fails.
std::string ReplaceFirst(std::string text, const std::string& from, const std::string& to);
/// Replaces the only occurrence; none or several fail the test.
std::string ReplaceOnce(const std::string& text, const std::string& from, const std::string& to);

/// One place of a text, and what stands there instead.
struct Edit {
  std::string from;
  std::string to;
};
/// The text with these places replaced, each by ReplaceOnce.
std::string ApplyEdits(std::string text, const std::vector<Edit>& edits);

}  // namespace dexcheck::testing
