#pragma once

#include <vector>

#include "controller/common/toml_reader.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// Most joints, and most frames, that a file may describe: templates make it easy to describe millions.
inline constexpr size_t kMaxJoints = 1000;

/// Reads the keys `chain`, `template` and `frame` of a parameter file into the specification's joints and
/// frames. Its base must have been read. @return the rows as they are written, by joint. @throws InputError.
std::vector<WrittenRow> ReadTree(TomlTable& root, RobotSpec& spec);

}  // namespace dexcheck
