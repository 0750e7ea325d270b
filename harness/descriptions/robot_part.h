#pragma once

// Part of a robot: joints that are held, bodies that only one of two files has, a base that one of them
// welds.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// The part of two robots that is compared. Names are those of either file.
struct RobotPart {
  std::string only;  ///< Link or joint: what it does not move is held, and the base does not move.
  std::map<std::string, double> held;  ///< Joints that do not move, and where they are held, rad or m.
  std::vector<std::string> left_out;   ///< Links, with the joints that they hang on and all that they carry.
  bool fixes_base = false;             ///< A base that floats does not.

  [[nodiscard]] bool empty() const { return only.empty() && held.empty() && left_out.empty() && !fixes_base; }
};

/// "JOINT" or "JOINT=VALUE", where it is held at 0 or there. @throws InputError "--lock: ...".
void AddHeldJoint(const std::string& text, RobotPart* part);

/// Takes the part of both robots. What hangs on a held joint is welded to what carries it.
/// @return notes, one line each; how many joints were held is added to `held`.
/// @throws InputError for names that neither of the two has, and where nothing is left that moves.
std::vector<std::string> TakePart(const RobotPart& part, RobotDescription* a, RobotDescription* b, int* held);

}  // namespace dexcheck
