#pragma once

// A study's rows for other programs.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "harness/study/study_store.h"

namespace dexcheck {

/// A key's value: a number, or the text that the number stands for.
nlohmann::ordered_json ShowValue(const Variation& variation, double value);

/// One trial, with the command that repeats it.
nlohmann::ordered_json ToJson(const Study& study, const TrialRow& row);

/// The command that repeats a trial, with its video.
std::string MakeReplayCommand(const Study& study, const Trial& trial);

/// Comma-separated values with a head: trial, seed, the keys, outcome, failure, the metrics, machine. Numbers
/// read back as the same doubles; what does not exist is empty.
/// @param write takes the text piece by piece.
void WriteStudyCsv(const StudyStore& store, const std::function<void(std::string_view)>& write);

}  // namespace dexcheck
