#pragma once

// Why two files of one robot differ: the cheapest list of corrections of one of them.

#include <optional>
#include <string>
#include <vector>

#include "harness/corrections/correction.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// A number of a file, and its value with the fault corrected.
struct FileChange {
  std::string place, quantity, unit;
  std::optional<double> value, repair;  ///< None where the file does not state it, or must not.
  double size = 0.0;                    ///< Largest number of its vector or tensor.
};

/// A fault at one place or several, and what would explain the same as well.
struct CorrectionItem {
  FileFault fault;
  std::string id;                   ///< A stable name of the kind: "inertia.about_origin", "number.mass".
  bool in_second = false;           ///< The second file has the fault.
  std::vector<std::string> places;  ///< "joint q1", "link l1"; "robot" of what is of all.
  std::vector<std::string>
      values;  ///< By place: "mass 1.9 kg here, 1.998 kg in the other file"; empty of a convention.
  std::vector<Site> sites;         ///< Sites that it puts right.
  double explained = 0.0;          ///< Their share of all sites that differ, 0 to 1.
  std::vector<LinkPatch> patches;  ///< Links with it undone.
  double bits = 0.0;
  std::vector<CorrectionItem> rivals;  ///< Within a factor of ten of its probability.
  std::string text;                    ///< "link forearm: mass in g"; with the changes set by FindCauses.
  std::vector<FileChange> changes;
};

struct FileCorrections {
  bool agrees = true;
  bool of_second = false;                ///< The second file is corrected.
  std::vector<CorrectionItem> items;     ///< The one that explains most first.
  std::vector<std::string> unexplained;  ///< "joint q1: position"
  double bits = 0.0;
};

/// Finds what makes the files differ by more than their digits allow. Corrections of the first file,
/// unless the second is put right by fewer.
FileCorrections FindCorrections(const PrintedRobot& a, const PrintedRobot& b);

/// Gives `link` what `right` has otherwise than `before`.
void TakeChanges(PrintedLink before, PrintedLink right, PrintedLink* link);

/// One line: "joints q1, q2: rotation with its angles in degrees". @param file that has the fault; may be
/// empty.
std::string DescribeItem(const CorrectionItem& item, const std::string& file = "");

}  // namespace dexcheck
