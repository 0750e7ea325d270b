#pragma once

// The page of two files of one robot: what differs, in words and in a view of both robots.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "harness/corrections/printed_robot.h"

namespace dexcheck {

/// Returns a whole HTML document that loads nothing: the verdict, the causes with their numbers, the terms
/// that were compared, and both robots one over the other. Each link is drawn by what its file states: rods
/// to the links that it carries, the axis of its joint, its centre of mass, and the ellipsoid that has its
/// mass and inertia. What a cause is about has the colour of its file.
/// @param result what `consistency --json` writes of the two.
std::string MakeFilesPage(const PrintedRobot& first, const PrintedRobot& second,
                          const nlohmann::ordered_json& result);

}  // namespace dexcheck
