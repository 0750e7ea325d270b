#pragma once

#include <string>

#include "harness/study/study_store.h"

namespace dexcheck {

/// One HTML page that loads nothing else: outcomes and metrics over the varied keys, the measured
/// boundary of stability beside the theoretical one, error against effort, the best trials, and the command
/// that repeats each.
/// @param renew seconds after which a browser loads the page again; 0 for never.
std::string MakeStudyReport(const StudyStore& store, double renew = 0.0);

/// The command that repeats a trial, with its video.
std::string MakeReplayCommand(const Study& study, const Trial& trial);

}  // namespace dexcheck
