#pragma once

// Which joints move a frame. Internal to controller/grasp.

#include <span>
#include <vector>

#include "controller/model/robot_model.h"

namespace dexcheck::grasp_internal {

/// Joints on the chain from the base to a frame, the base's side first.
std::vector<int> ListChain(const RobotModel& model, int frame);

/// For each fingertip the joints that move it and no other one of them, the fingertip's side first.
/// @throws std::invalid_argument when one has none.
std::vector<std::vector<int>> ListOwnJoints(const RobotModel& model, std::span<const int> fingertips);

}  // namespace dexcheck::grasp_internal
