#include "harness/view/save_scenario.h"

#include <filesystem>

#include "controller/common/text.h"
#include "controller/common/toml_overrides.h"

namespace dexcheck {

std::string MakeScenarioText(const Scenario& scenario, const std::vector<std::string>& overrides,
                             const std::string& name) {
  constexpr std::string_view kModel = "model.";
  std::vector<std::string> assignments = {"name=" + Quote(name)};
  for (const std::string& assignment : overrides) {
    const bool own = assignment.starts_with("model.file=") || assignment.starts_with("model.overrides");
    if (assignment.starts_with(kModel) && !own) {
      // Of the parameter file; the list of a scenario takes them as they are.
      assignments.push_back("model.overrides+='''" + assignment.substr(kModel.size()) + "'''");
    } else {
      assignments.push_back(assignment);
    }
  }
  const auto add_file = [&](const char* key, const std::string& file) {
    if (!file.empty())
      assignments.push_back(key + std::string("=") + Quote(std::filesystem::absolute(file).string()));
  };
  add_file("model.file", scenario.model_file);
  add_file("plant.mjcf", scenario.mjcf_file);
  std::string text =
      "# Saved by dexcheck view.\n" + ApplyOverrides(scenario.text, scenario.source, assignments);
  (void)ParseScenario(text, name + ".toml", "", {});
  return text;
}

}  // namespace dexcheck
