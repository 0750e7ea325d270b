#pragma once

// Which conventions explain that bodies and constants of joints differ.

#include <vector>

#include "harness/descriptions/finding.h"
#include "harness/descriptions/link_body.h"

namespace dexcheck {

/// Conventions that many links share first, then bodies that are exchanged or shifted by one in the list,
/// then what single links have; at last the numbers that nothing explains.
std::vector<Finding> SearchBodies(std::vector<LinkBody> bodies, const Closeness& close);

}  // namespace dexcheck
