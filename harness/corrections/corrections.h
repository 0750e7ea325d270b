#pragma once

// Why two files of one robot differ: the cheapest list of corrections of one of them.

#include <string>
#include <vector>

#include "harness/corrections/correction.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// A fault at one place or several, and what would explain the same as well.
struct CorrectionItem {
  FileFault fault;
  std::vector<std::string> places;  ///< "joint q1", "link l1".
  std::vector<std::string> values;  ///< By place: "mass 1.9, 1.998 would be right"; empty of a convention.
  std::vector<Site> sites;          ///< That it puts right.
  std::vector<LinkPatch> patches;   ///< That do it.
  double bits = 0.0;
  std::vector<CorrectionItem> rivals;  ///< Within a factor of ten of its probability.
};

struct FileCorrections {
  bool agrees = true;
  bool of_second = false;                ///< The second file is corrected.
  std::vector<CorrectionItem> items;     ///< The one that explains most first.
  std::vector<std::string> unexplained;  ///< "joint q1: position"
  double bits = 0.0;
};

/// Finds what makes the files differ by more than their digits leave open. Corrections of the first file,
/// unless the second is put right by fewer.
FileCorrections FindCorrections(const PrintedRobot& a, const PrintedRobot& b);
FileCorrections FindCorrections(const DescriptionFile& a, const DescriptionFile& b);

/// One line: "joints q1, q2: rotation with its angles in degrees".
std::string DescribeItem(const CorrectionItem& item, bool of_second);

}  // namespace dexcheck
