#pragma once

#include <cstdint>
#include <string>

#include "harness/study/trial.h"

namespace dexcheck::cli {

/// A shipped study by name, or a TOML file, with its scenario. @throws InputError.
StudyInputs FindStudy(const std::string& name_or_file);

/// The text of a batch script whose array of tasks makes the study, a shard each; killed and requeued tasks
/// go on where they were.
/// @param name_or_file as typed.
std::string MakeSlurmScript(const StudyInputs& inputs, const std::string& name_or_file, std::uint64_t tasks);

}  // namespace dexcheck::cli
