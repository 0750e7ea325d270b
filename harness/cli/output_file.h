#pragma once

// Files of results, as JSON or of any text.

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>

#include "controller/common/types.h"
#include "harness/base/bounded_json.h"
#include "harness/base/files.h"

namespace dexcheck::cli {

using Json = nlohmann::ordered_json;

/// A file that appears whole or not at all. Make it before long work starts, so that a bad path is known at
/// once. Devices and pipes, which cannot be replaced, are written to in place; "-" is standard output.
class OutputFile {
 public:
  /// @param path empty for no file: nothing is written then. @throws InputError "PATH: cannot be written:
  /// reason".
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Writes the whole content, once. @param content a text, JSON, or a function that makes one of them, which
  /// is called if there is a file.
  /// @throws InputError like the constructor; what stood under the path before is then untouched.
  template <typename Content>
  void Write(const Content& content) {
    if constexpr (std::is_invocable_v<Content>) {
      if (exists()) Write(content());
    } else if constexpr (std::is_same_v<Content, Json>) {
      Write(FormatJson(content));
    } else {
      Append(content);
      Finish();
    }
  }

  /// Write in pieces: Append any number of times, then Finish, without which no file appears.
  void Append(const std::string& text);
  void Finish();

  [[nodiscard]] bool exists() const { return file_ != nullptr; }
  /// The results take standard output: other text would spoil them.
  [[nodiscard]] bool is_stdout() const { return file_ == stdout; }

 private:
  [[noreturn]] void Fail(int error) const;

  std::filesystem::path path_;          // as given, for messages
  std::optional<PartialFile> partial_;  // none when written in place
  std::FILE* file_ = nullptr;
};

/// @returns the path of a page. @throws InputError when the name says that the file is something else than an
/// HTML page, such as "page.pdf".
const std::filesystem::path& RequirePageName(const std::filesystem::path& path);

/// A vector as a list.
inline Json ToList(const Eigen::Ref<const VectorXd>& vector) {
  return std::vector<double>(vector.begin(), vector.end());
}

/// A matrix as a list of rows.
inline Json ToRows(const Eigen::Ref<const MatrixXd>& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) rows.push_back(ToList(matrix.row(i).transpose()));
  return rows;
}

}  // namespace dexcheck::cli
