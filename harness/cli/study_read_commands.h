#pragma once

#include "harness/cli/command_line.h"

namespace dexcheck::cli {

/// Commands that read a study's database: report, show, export, watch.
void AddStudyReadCommands(Command study);

}  // namespace dexcheck::cli
