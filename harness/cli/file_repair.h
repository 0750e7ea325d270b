#pragma once

// Repairs of one of two files, as they are offered and written.

#include <filesystem>
#include <string>

#include "harness/cli/consistency_report.h"
#include "harness/corrections/write_repaired.h"

namespace dexcheck::cli {

/// Returns the text of `file` with the causes corrected by which it differs from `other`.
/// @param folder in which the text will stand. @throws InputError for what its format has no place for.
RepairedFile Repair(const ConsistencyRequest& request, const DescriptionFile& file,
                    const DescriptionFile& other, const std::filesystem::path& folder);

/// Repairs the file in which the causes are in memory, and compares it again.
RepairTrial TryRepair(const ConsistencyRequest& request, const Comparison& comparison);

}  // namespace dexcheck::cli
