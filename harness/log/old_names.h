#pragma once

// Names in logs that this version no longer writes.

#include <array>
#include <string_view>

namespace dexcheck {

/// A signal of logs written before, and those that came in its place. They are other quantities: what a
/// replay records now cannot be compared with it.
struct ReplacedSignal {
  std::string_view name;
  std::string_view by;
};

inline constexpr std::array kReplacedSignals = {
    ReplacedSignal{"check/grasp_force",
                   "check/grasp_null_space, check/grasp_cone and check/grasp_optimality"},
};

}  // namespace dexcheck
