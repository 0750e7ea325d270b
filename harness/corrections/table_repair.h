#pragma once

#include <string>

#include "harness/corrections/printed_robot.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// Returns the text of a parameter file with the numbers of `after` where they are not those of `before`.
/// @throws InputError "FILE: cannot be repaired: why" for what the file has no key for.
std::string WriteTable(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after);

}  // namespace dexcheck
