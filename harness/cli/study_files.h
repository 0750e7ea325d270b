#pragma once

#include <string>

#include "harness/study/trial.h"

namespace dexcheck::cli {

/// A shipped study by name, or a TOML file, with its scenario. @throws InputError.
StudyInputs FindStudy(const std::string& name_or_file);

}  // namespace dexcheck::cli
