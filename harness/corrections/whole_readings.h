#pragma once

// Conventions of a whole file, each of which is another reading of all its rows or bodies.

#include <vector>

#include "harness/corrections/correction.h"

namespace dexcheck {

struct WholeReading {
  FileFault fault;
  PrintedRobot robot;  ///< The file with this fault undone.
};

/// Lists rows of Denavit-Hartenberg parameters read by the other convention, or with alpha and a of their
/// neighbours, all lengths in another unit, and bodies that are shifted by one in their list.
std::vector<WholeReading> ListWholeReadings(const PrintedRobot& robot);

}  // namespace dexcheck
