#pragma once

#include <string>

#include "harness/study/trial.h"

namespace dexcheck::cli {

/// A shipped study by name, or a TOML file, with its scenario. @throws InputError.
StudyInputs FindStudy(const std::string& name_or_file);

/// Whether a name is that of a file, and not of a shipped study.
bool IsStudyFile(const std::string& name);

}  // namespace dexcheck::cli
