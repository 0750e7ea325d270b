#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>

#include "harness/base/answer.h"
#include "harness/base/check_record.h"

namespace dexcheck {

/// Returns a run's verdict with its causes, numbered in the order of the summary, and the evidence.
/// @param summary as summary.json has it, of this or an older version. @param checks all that were made; none
/// of a run that was not checked.
Answer MakeRunAnswer(const nlohmann::ordered_json& summary, std::span<const CheckRecord> checks);

}  // namespace dexcheck
