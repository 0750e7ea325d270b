#pragma once

// Which frame the second file has on each link, in the first one's.

#include <vector>

#include "harness/corrections/printed_pair.h"

namespace dexcheck {

/// Frames by link, and bits of those that are not the first file's.
struct ChosenFrames {
  std::vector<Pose> X_ab;
  double bits = 0.0;
  double each = 0.0;  ///< Bits of one of them.
};

/// The cheapest choices of frames, from the base outward, the cheapest first. A frame is the first
/// file's; or such that the first file's origin is right, as it is or with a convention undone; or such that
/// what the link carries (its axis, its body, the axes on it) is where the first file has it. Bits of what is
/// then wrong of the origin, of the body and of axes decide, and bits of another frame: few where most links
/// have one.
std::vector<ChosenFrames> ChooseFrames(const PrintedPair& pair);

/// Choices in which one link has another frame than in `chosen`, each with the cheapest frames of the links
/// that it carries. All other links keep theirs.
std::vector<ChosenFrames> ChangeFrame(const PrintedPair& pair, const ChosenFrames& chosen, int link);

}  // namespace dexcheck
