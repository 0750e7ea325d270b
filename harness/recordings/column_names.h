#pragma once

// The meaning of the names of a recording's columns: words that logs use, joints, units.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/recordings/channels.h"

namespace dexcheck {

struct Unit {
  std::string_view name;
  RecordedQuantity quantity;
  double scale;  ///< What one of it is in rad, m, s, N m, N or A.
};
std::span<const Unit> ListUnits();

/// The unit of a quantity; positions' units serve their rates, too. Null where there is none of such a name.
const Unit* FindUnit(std::string name, RecordedQuantity quantity);

/// Columns by their names alone; those that are not known are left out.
std::vector<Channel> GuessChannels(const RobotModel& model, const std::vector<std::string>& names);

/// Forces of the ground on frames of the robot, as a run's log has them: "foot/force.FRAME.x".
void GuessFeet(const RobotModel& model, const std::vector<std::string>& names, Recording* recording);

}  // namespace dexcheck
