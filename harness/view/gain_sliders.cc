#include "harness/view/gain_sliders.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "controller/common/text.h"
#include "controller/common/toml_reader.h"

namespace dexcheck {

namespace {

/// Ten digits: 0.6 for 3 times 0.2, and not 0.6000000000000001.
std::string Print(double number) { return FormatNumber(number, 10); }

std::string Print(const Vector6d& v) {
  return fmt::format("[{}, {}, {}, {}, {}, {}]", Print(v[0]), Print(v[1]), Print(v[2]), Print(v[3]),
                     Print(v[4]), Print(v[5]));
}

/// A key with numbers by joint, each times a factor; nothing when the scenario does not have it.
void Multiply(const ByName& numbers, double factor, std::vector<std::string>* overrides) {
  if (numbers.key.empty() || factor == 1.0) return;
  std::string text = std::isnan(numbers.all) ? "" : ", all = " + Print(factor * numbers.all);
  for (const auto& [name, number] : numbers.groups) {
    text += ", " + Quote(name) + " = " + Print(factor * number);
  }
  overrides->push_back(numbers.key + "={" + text.substr(1) + " }");
}

}  // namespace

std::vector<Slider> MakeGainSliders(const Scenario& scenario) {
  std::vector<Slider> sliders = {{"stiffness K_p"}, {"damping K_v"}};
  if (scenario.joint_task() == nullptr) sliders.push_back({"internal force f_min"});
  return sliders;
}

std::vector<std::string> MakeGainOverrides(const Scenario& scenario, const std::vector<Slider>& sliders) {
  std::vector<std::string> overrides;
  const double stiffness = sliders[0].factor;
  const double damping = sliders[1].factor;
  if (scenario.joint_task() != nullptr) {
    const JointTask& joints = *scenario.joint_task();
    Multiply(joints.natural_frequency, std::sqrt(stiffness), &overrides);
    Multiply(joints.damping_ratio, damping / std::sqrt(stiffness), &overrides);
    Multiply(joints.stiffness, stiffness, &overrides);
    Multiply(joints.damping, damping, &overrides);
    return overrides;
  }
  const ObjectGains& gains = scenario.control.gains;
  if (stiffness != 1.0 || damping != 1.0) {
    const Vector6d K_p = stiffness * gains.K_p;
    const Vector6d K_v = damping * gains.K_v;
    const bool has_frequency = scenario.text.find("natural_frequency") != std::string::npos;
    if (has_frequency) {
      const Vector6d omega = K_p.cwiseSqrt();
      overrides.push_back("control.natural_frequency=" + Print(omega));
      overrides.push_back("control.damping_ratio=" + Print(0.5 * K_v.cwiseQuotient(omega)));
    } else {
      overrides.push_back("control.K_p=" + Print(K_p));
      overrides.push_back("control.K_v=" + Print(K_v));
    }
  }
  if (sliders[2].factor != 1.0) {
    overrides.push_back("control.f_min=" + Print(sliders[2].factor * scenario.control.f_min));
  }
  return overrides;
}

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
