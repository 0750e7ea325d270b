#pragma once

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <type_traits>

#include "harness/base/bounded_json.h"
#include "harness/base/files.h"

namespace dexcheck::cli {

/// A file that appears whole or not at all. Make it before long work starts, so that a bad path is known at
/// once. Devices and pipes, which cannot be replaced, are written to in place; "-" is standard output.
class OutputFile {
 public:
  /// @throws InputError "PATH: cannot be written: reason".
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Writes the whole content, once.
  /// @throws InputError like the constructor; what stood under the path before is then untouched.
  void Write(const std::string& text);

  /// Write in pieces: Append any number of times, then Finish, without which no file appears.
  void Append(const std::string& text);
  void Finish();

  [[nodiscard]] bool is_stdout() const { return file_ == stdout; }

 private:
  [[noreturn]] void Fail(int error) const;

  std::filesystem::path path_;          // as given, for messages
  std::optional<PartialFile> partial_;  // none when written in place
  std::FILE* file_ = nullptr;
};

/// The file of an option such as --json, made before long work starts; none when the option is not given.
class ResultFile {
 public:
  /// @param path empty for none. @throws InputError as OutputFile.
  explicit ResultFile(const std::string& path) {
    if (!path.empty()) file_.emplace(path);
  }
  /// Writes the text or the JSON that a function makes, if there is a file.
  template <typename Make>
  void Write(const Make& make) {
    if (!file_) return;
    if constexpr (std::is_same_v<decltype(make()), std::string>) {
      file_->Write(make());
    } else {
      file_->Write(FormatJson(make()));
    }
  }
  /// The results take standard output: other text would spoil them.
  [[nodiscard]] bool TakesStdout() const { return file_ && file_->is_stdout(); }

 private:
  std::optional<OutputFile> file_;
};

/// @throws InputError when the name says that the file is something else than an HTML page, such as
/// "page.pdf".
void RequirePageName(const std::filesystem::path& path);

}  // namespace dexcheck::cli
