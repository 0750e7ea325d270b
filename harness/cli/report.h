#pragma once

// The result of a command: one value, which is rendered as text, as JSON, as JUnit's XML and as a page.

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "controller/common/types.h"
#include "harness/base/answer.h"
#include "harness/base/bounded_json.h"
#include "harness/base/check_record.h"
#include "harness/base/files.h"
#include "harness/cli/commands.h"

namespace dexcheck::cli {

// Standard output and standard error: whether they are terminals, how wide, and whether they take colours.

/// Columns of the terminal that a descriptor leads to, now; 0 when it is none or does not report them.
int CountColumns(int descriptor);

/// Most columns of a line of a table, and of text without long paths.
inline constexpr size_t kColumns = 80;

/// Lines of at most kColumns, broken at blanks; those after the first of each are indented. A word that is
/// longer stays whole.
std::string Wrap(std::string_view text, size_t indent);

using Tone = Answer::Tone;

/// The text in a colour when standard output is a terminal and the environment has no NO_COLOR (no-color.org)
/// and no TERM=dumb; otherwise as it is.
std::string Paint(Tone tone, std::string_view text);

/// A line on standard error that shows how far long work has come, never wider than the terminal; silent when
/// standard error is no terminal.
class ProgressBar {
 public:
  /// @param total 0 where it is not known: what is done is counted then.
  ProgressBar(std::string label, long total, bool quiet);
  ~ProgressBar() { Finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Update(long done);
  /// Update. @returns whether to go on: not once the program was interrupted.
  bool GoOn(long done);
  /// Clears the line.
  void Finish();

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] std::string MakeLine(long done, Clock::time_point now) const;

  std::string label_;
  long total_;
  bool visible_;
  bool drawn_ = false;
  // The first update: what came before, such as coming to rest, says nothing of the speed.
  std::optional<Clock::time_point> first_time_;
  long first_done_ = 0;
  Clock::time_point last_drawn_{};
};

// Files of results, as JSON or of any text.

using Json = nlohmann::ordered_json;

/// A file that appears whole or not at all. Make it before long work starts, so that a bad path is known at
/// once. Devices and pipes, which cannot be replaced, are written to in place; "-" is standard output.
class OutputFile {
 public:
  /// @param path empty for no file: nothing is written then. @throws InputError "PATH: cannot be written:
  /// reason".
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();

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
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
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

/// A line of a table.
struct TableRow {
  std::vector<std::string> cells;  ///< None for an empty line.
  std::string note = {};           ///< What is said below it, wrapped.
};

/// One check as a test case of JUnit's.
struct JUnitCase {
  std::string group;         ///< "constant", "term", "inverse_dynamics": its class.
  std::string name;          ///< "M_bar"
  std::string failure = {};  ///< What is wrong, in one or more lines; empty when nothing is.
  std::string output = {};   ///< What is worth knowing anyway.
};

/// The result of a command.
struct Report {
  Answer answer;                      ///< Its word is empty where there is no verdict.
  std::string details;                ///< Stands below the answer, unless only the verdict is wanted.
  std::string last;                   ///< Stands below the details, always.
  Json data;                          ///< For programs.
  std::function<std::string()> page;  ///< Makes the page; empty where the command has none.
  std::string suite;                  ///< Name of the test cases together.
  std::vector<JUnitCase> cases;
  double seconds = 0.0;  ///< That the cases took.
  ExitCode code = kSuccess;
  std::string failure;  ///< What kept the command from its end; its code is then kFailure, unless it is bad.

  /// Adds a paragraph to the details. @param indent of its lines after the first.
  void Add(const std::string& text, size_t indent = 2) { details += Wrap(text, indent) + "\n"; }
  /// Adds columns as wide as their widest cells, two blanks apart. @param align of each column: '<' to the
  /// left, '>' to the right.
  void AddTable(std::string_view align, const std::vector<TableRow>& rows);
  /// Adds a check that has run to the cases. @param where the worst number belongs to.
  void AddCase(const std::string& group, const CheckRecord& record, const std::string& where);
  /// Says that the work was interrupted. @param what is counted: "states were compared".
  void SetIncomplete(long done, long total, const std::string& what);
};

/// The files that a report goes to, besides standard output.
class ReportOutput {
 public:
  /// Make it before long work starts, so that a bad path is known at once. @throws InputError.
  explicit ReportOutput(const Outputs& outputs);

  /// Whether the report is printed: no file of it takes standard output.
  [[nodiscard]] bool prints() const { return !json_.is_stdout() && !page_.is_stdout(); }
  /// Renders the report into its files, and on standard output unless another result takes it.
  /// @returns its exit code; a failure has its line on standard error.
  ExitCode Write(const Report& report, bool is_printed = true);

 private:
  bool quiet_;
  OutputFile json_, junit_, page_;
};

}  // namespace dexcheck::cli
