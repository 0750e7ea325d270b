#pragma once

// The page of a campaign of faults.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace dexcheck {

/// A whole HTML document that loads nothing: what was found, a matrix of the faults that were made and the
/// names that they got, and each of them. @param campaign as `mutate --json` writes it.
std::string MakeCampaignPage(const nlohmann::ordered_json& campaign);

}  // namespace dexcheck
