#pragma once

// The result of a campaign of faults that were made on purpose: one table and one JSON, whether the faults
// are of descriptions or of a run.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "harness/cli/report.h"
#include "harness/diagnosis/mutation.h"

namespace dexcheck::cli {

/// A fault that was made, as the JSON has it. @param kind what the table sums up by. @param cause_right
/// whether the first cause that is named is the fault. @param remark in a line; empty when all went well.
Json MakeFaultResult(const std::string& kind, const std::string& name, MutantOutcome outcome,
                     bool cause_right, const std::string& remark);

/// A campaign so far.
struct Campaign {
  /// That were made, as MakeFaultResult has them; with "part_named" where one has a part that may be named.
  std::vector<Json> faults;
  size_t total = 0;          ///< To be made.
  bool names_causes = true;  ///< Whether causes were looked for.

  Json head = Json::object();  ///< Of the JSON: what the campaign was asked for.

  /// Takes what an interrupted campaign of this program that was asked for the same left in a file, and says
  /// so on standard error; nothing where there is none. @param inputs files whose texts have to be the same.
  void Resume(const std::string& json_file, const std::vector<std::filesystem::path>& inputs);
  /// Makes the others, so many at a time as CountJobs says, with a progress bar, until the user interrupts.
  /// @param make makes one in a process of its own. @throws Error when such a process dies.
  void Make(std::uint64_t jobs, bool quiet, const std::function<Json(size_t fault)>& make);
  /// Returns the verdict, a line for each kind of fault and the exceptions. The data are `head`, "complete",
  /// "kinds" and "faults", from which Resume goes on.
  [[nodiscard]] Report MakeReport() const;
};

}  // namespace dexcheck::cli
