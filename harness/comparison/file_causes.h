#pragma once

// Why two files differ: one list of causes for every command, the Python module and tests.

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/corrections/corrections.h"

namespace dexcheck {

/// A number of a file, and its value with the cause corrected.
struct FileChange {
  std::string place, quantity, unit;
  std::optional<double> value, repair;  ///< None where the file does not state it, or must not.
  double size = 0.0;                    ///< Largest number of its vector or tensor.
};

/// One cause, at one place or several.
struct FileCause {
  std::string text;  ///< "link forearm: mass in g".
  std::string id;    ///< "mass.g"
  std::vector<std::string> places;
  std::vector<FileChange> changes;
  double explained = 0.0;               ///< Fraction of the quantities that differ which it puts right.
  std::vector<FileCause> alternatives;  ///< Causes that explain the same, about as likely.
};

/// The causes by which two files differ.
struct FileCauses {
  bool agrees = true;
  bool of_second = false;                ///< The second file is to be corrected.
  std::string file;                      ///< Name of the file that is to be corrected,
  std::string reference;                 ///< and of the other one.
  std::vector<FileCause> causes;         ///< The one that explains most first.
  std::vector<std::string> unexplained;  ///< "joint q1: position"
  FileCorrections corrections;           ///< The causes as values, in the same order.
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
  return std::ranges::any_of(causes.corrections.items,
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
