#pragma once

// Why two files differ: one list of causes for every command, the Python module and tests.

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/corrections/corrections.h"

namespace dexcheck {

/// The causes by which two files differ, the one that explains most first.
struct FileCauses : FileCorrections {
  std::string file;       ///< Name of the file that is to be corrected,
  std::string reference;  ///< and of the other one.
};

/// Takes out of a robot the constants of joints that two files need not share (kIgnorable), and numbers that
/// state nothing: a limit of effort or velocity of 0.
void LeaveOutUnstated(const std::vector<std::string>& ignore, PrintedRobot* robot);

/// Makes frames of links that are frames in the other robot, and takes out of both what says nothing beside
/// the other one: beside a table ranges of half a turn to both sides, which a table states of a
/// joint without a range.
void LeaveOutUnshared(PrintedRobot* a, PrintedRobot* b);

/// Whether a constant or term that differs (ConstantFinding::check) follows from a cause.
bool IsExplained(const std::string& check, const CorrectionItem& cause);
inline bool IsExplained(const std::string& check, const FileCauses& causes) {
  return std::ranges::any_of(causes.items,
                             [&](const CorrectionItem& item) { return IsExplained(check, item); });
}

/// Explains how two robots differ beyond their printed precision.
FileCauses FindCauses(PrintedRobot a, PrintedRobot b);

/// Drops causes that change numbers by no more than this fraction of their size, and those of quantities that
/// agree otherwise. @param differs whether a quantity does not.
void LeaveOutWithin(double tolerance, const std::function<bool(SiteKind)>& differs, FileCauses* causes);

/// One line for each cause, "1. link forearm: mass in g; explains 100 %", one for what explains the same, and
/// one for what is not explained.
std::vector<std::string> ListLines(const FileCauses& causes);

}  // namespace dexcheck
