// ParseScenario: any text with any overrides is a scenario or an InputError that names the file or the
// override. Lines that begin with "#!" are overrides, as --set takes them.

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "harness/scenario/scenario.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

constexpr std::string_view kOverride = "#!";

std::vector<std::string> ListOverrides(const std::string& text) {
  std::vector<std::string> overrides;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(kOverride)) overrides.push_back(line.substr(kOverride.size()));
  }
  return overrides;
}

void UseScenario(const Scenario& scenario) {
  Expect(scenario.duration > 0.0 && std::isfinite(scenario.duration), "duration");
  Expect(scenario.plant.time_step > 0.0 && scenario.duration >= scenario.plant.time_step, "time_step");
  Expect(scenario.grasp.fingertips.size() == scenario.grasp.contacts.size(), "contacts");
  Expect(scenario.grasp.fingertips.size() >= 3, "fingertips");
  Expect(scenario.control.gains.K_p.allFinite() && scenario.control.gains.K_v.allFinite(), "gains");
  Expect(scenario.grasp.X_FO.matrix().allFinite() && scenario.start_error().allFinite(), "places");
  Expect(scenario.control.f_max > scenario.control.f_min && scenario.control.f_min >= 0.0, "forces");
  const DesiredMotion start = scenario.trajectory_task()->trajectory(Vector6d::Ones())->Evaluate(0.0);
  Expect(start.X_d == Vector6d::Ones(), "the trajectory does not start where the object is");
}

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  const std::string text(AsText(data, size));
  try {
    UseScenario(dexcheck::ParseScenario(text, "scenario.toml", "folder", ListOverrides(text)));
  } catch (const dexcheck::InputError& error) {
    const std::string_view message = error.what();
    ExpectGoodMessage(message, message.starts_with("--set ") ? "--set " : "scenario.toml:");
  }
  return 0;
}
