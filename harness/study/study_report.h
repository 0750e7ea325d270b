#pragma once

#include <string>

#include "harness/study/study_store.h"

namespace dexcheck {

/// One HTML page without scripts or other files: outcomes and metrics over the varied keys, the measured
/// boundary of stability beside the theoretical one, error against effort, the best trials, and the command
/// that repeats each.
std::string MakeStudyReport(const StudyStore& store);

/// The command that repeats a trial, with its video.
std::string MakeReplayCommand(const Study& study, const Trial& trial);

}  // namespace dexcheck
