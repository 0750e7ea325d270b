#pragma once

// How engines read or treat one robot differently: settings that explain why one of them stands apart.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/comparison/consistency.h"

namespace dexcheck {

/// Another description of the robot, which one engine may have read.
struct OtherDescription {
  std::string text;  ///< "as with what only robot.xml states".
  RobotDescription robot;
};

/// The setting under which the analytic model of the description has the terms of a provider that disagrees
/// with it: a changed description, for example one without armature, agrees in all terms.
/// @param provider answers in the coordinates of `robot`. @param tolerance relative, at which terms agree.
/// @param others tried first.
/// @return "as with no gravity"; nothing when no setting explains it.
std::optional<std::string> FindSetting(const RobotDescription& robot, DynamicsProvider* provider,
                                       const std::function<StateFeed()>& make_feed, double tolerance,
                                       const std::vector<OtherDescription>& others = {});

}  // namespace dexcheck
