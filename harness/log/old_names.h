#pragma once

// The names in logs of format 1 that are others today. Whoever renames a signal, a check, a key of the
// summary or of a scenario adds a row to the table.

#include <string>
#include <string_view>
#include <vector>

namespace dexcheck {

struct OldName {
  enum class Of {
    kCheck,     ///< A check: "check/OLD" among the signals, OLD in the summary.
    kSignal,    ///< Any other signal.
    kWord,      ///< A key of the summary, or a text in it that is this word alone.
    kKey,       ///< Of a scenario or a robot, also in overrides.
    kReplaced,  ///< A signal in whose place others came: they are other quantities and are not compared.
  };
  Of of;
  std::string_view old;
  std::string_view now;
};

/// The table.
const std::vector<OldName>& ListOldNames();

/// Today's name of a signal; the same for one that has not changed.
std::string RenameSignal(const std::string& name);

/// A summary with today's keys and words. Text that is no JSON stays as it is.
std::string RenameSummary(const std::string& summary);

/// A scenario, a robot, or overrides with today's keys.
std::string RenameKeys(const std::string& toml);

}  // namespace dexcheck
