#pragma once

#include <cstdint>
#include <string>

#include "controller/model/robot_model.h"

namespace dexcheck {

/// What every part of a loop is made with that must make the same numbers again.
struct PartContext {
  const RobotModel* model = nullptr;
  size_t num_contacts = 0;
  double time_step = 0.0;  ///< s.
  std::uint64_t seed = 0;
  std::string source;  ///< The scenario's file, for messages.
};

}  // namespace dexcheck
