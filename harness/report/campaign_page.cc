#include "harness/report/campaign_page.h"

#include <nlohmann/json.hpp>

#include "harness/report/page_assets.h"
#include "harness/report/page_frame.h"

namespace dexcheck {

std::string MakeCampaignPage(const nlohmann::ordered_json& campaign) {
  return AssemblePage({.title = "faults made on purpose",
                       .styles = {},
                       .markup = {kPageHtml},
                       .data = EmbedJson("campaign-data", campaign),
                       .scripts = {kCampaignJs}});
}

}  // namespace dexcheck
