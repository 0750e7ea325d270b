#pragma once

// The result of a campaign of faults that were made on purpose: one table and one JSON, whether the faults
// are of descriptions or of a run.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/cli/report.h"
#include "harness/diagnosis/mutation.h"

namespace dexcheck::cli {

/// A fault that was made.
struct CampaignFault {
  std::string kind;  ///< What the table sums up by.
  std::string name;
  MutantOutcome outcome = MutantOutcome::kSurvived;
  bool cause_right = false;        ///< The first cause that is named is the fault.
  std::optional<bool> part_named;  ///< Whether its part is named, too; none without a part.
  std::string exception;           ///< What is said of it besides, in a line; empty when all went well.
  Json details = Json::object();   ///< In the JSON, besides the above.
};

/// A campaign so far.
struct Campaign {
  std::vector<CampaignFault> faults;  ///< That were made.
  size_t total = 0;                   ///< To be made.
  bool names_causes = true;           ///< Whether causes were looked for.

  Json head = Json::object();  ///< Of the JSON: what the campaign was asked for.

  /// Takes what an interrupted campaign of this program that was asked for the same left in a file, and says
  /// so on standard error; nothing where there is none. @param inputs files whose texts have to be the same.
  void Resume(const std::string& json_file, const std::vector<std::filesystem::path>& inputs);
  /// Makes the others, so many at a time as CountJobs says, with a progress bar, until the user interrupts.
  /// @param make makes one in a process of its own. @throws Error when such a process dies.
  void Make(std::uint64_t jobs, bool quiet, const std::function<CampaignFault(size_t fault)>& make);
  /// Returns the verdict, a line for each kind of fault and the exceptions. The data are `head`, "complete",
  /// "kinds" and "faults", from which Resume goes on.
  [[nodiscard]] Report MakeReport() const;
};

}  // namespace dexcheck::cli
