#pragma once

// The result of a command: one value, which is rendered as text, as JSON, as JUnit's XML and as a page.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/answer.h"
#include "harness/base/check_record.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/cli/terminal.h"

namespace dexcheck::cli {

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
