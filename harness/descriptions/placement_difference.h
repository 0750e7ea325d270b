#pragma once

// How two descriptions place one joint or one frame, in words and in the frames of their links.

#include <optional>
#include <string>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Two descriptions as CompleteEachOther left them, and how their files are called in messages.
struct DescribedPair {
  const RobotDescription& a;
  const RobotDescription& b;
  std::string first;
  std::string second;
};

/// Returns how a joint's origin or axis differs, each in the link frames of its own file: "origin is turned
/// by 34.4 deg about z; position and axis agree". Where the two files choose other link frames, the joint's
/// axis with all joints at zero is compared.
/// @param joint of `a`. @return nothing where the joint itself agrees and only what carries it differs.
std::optional<std::string> DescribeJointDifference(const DescribedPair& pair, int joint);

/// Returns how a frame differs on its link: "is turned by 90 deg about z; its position agrees".
/// @return nothing where the frame agrees on its link, and for a link's own frame.
std::optional<std::string> DescribeFrameDifference(const DescribedPair& pair, const std::string& frame);

}  // namespace dexcheck
