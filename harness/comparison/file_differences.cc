#include "harness/comparison/file_differences.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/worst.h"

namespace dexcheck {

namespace {

constexpr double kExact = 1e9;  // times the printed precision, which is rounding then

/// Returns "Ixx: 0.0002 kg m^2 in a.urdf, 0.0001 kg m^2 in b.urdf".
std::string DescribeNumbers(const ConstantFinding& finding, const Comparison& comparison) {
  const std::string component = NameComponent(finding);
  const std::string name = UnitOf(finding, &*comparison.model);
  const std::string unit = name.empty() ? "" : " " + name;
  return fmt::format("{}{}{:.12g}{} in {}, {:.12g}{} in {}", component, component.empty() ? "" : ": ",
                     finding.model, unit, comparison.first.filename().string(), finding.engine, unit,
                     comparison.second.filename().string());
}

/// Returns the check, the place and the numbers of a finding, and its effect.
std::string DescribeFinding(const ConstantFinding& finding, const Comparison& comparison) {
  return fmt::format("{}: {}: {}{}{}", NameQuantity(finding.check), finding.where,
                     DescribeNumbers(finding, comparison), finding.effect.empty() ? "" : "; ",
                     finding.effect);
}

/// The values of a number that differs, and by how much.
std::string DescribeValues(const ConstantFinding& excess, const Comparison& comparison) {
  const std::string text = DescribeNumbers(excess, comparison);
  if (!excess.effect.empty()) return text + "; " + excess.effect;
  if (excess.too_loose > 0.0)
    return text + fmt::format("; the printed digits give it to {:.2g} % only", 100.0 * excess.too_loose);
  if (excess.units >= kExact) return text;
  return text + fmt::format("; {:.3g} times the printed precision", excess.units);
}

/// Lists the numbers that exceed the printed precision, the worst first.
Differences ListExcesses(const Comparison& comparison) {
  Differences differences;
  std::vector<std::string>& lines = differences.real;
  std::vector<std::string> following;
  std::map<std::string, std::pair<size_t, int>> repeated;  // its line, and at how many more places it is
  double most = 0.0;
  for (const ConstantFinding& excess : comparison.digits->excesses) {
    if (!excess.is_cause) {
      if (!Contains(following, excess.check)) following.push_back(excess.check);
      most = Worst(most, excess.units);
      continue;
    }
    const std::string values = DescribeValues(excess, comparison);
    // One line stands for all joints with the same two numbers, or with a constant that one file leaves out:
    // the worst. They are one fault of many joints.
    const bool is_left_out = excess.effect.find(" states it") != std::string::npos;
    const auto [line, is_new] =
        repeated.emplace(excess.check + (is_left_out ? "" : values), std::pair(lines.size(), 0));
    line->second.second += is_new ? 0 : 1;
    if (is_new) lines.push_back(NameQuantity(excess.check) + ": " + excess.where + ": " + values);
  }
  for (const auto& [key, line] : repeated) {
    if (line.second > 0) lines[line.first] += fmt::format("; and so at {} more", line.second);
  }
  if (!following.empty())
    differences.following =
        fmt::format("terms that follow{}: {}",
                    most < kExact ? fmt::format(", up to {:.3g} times the printed precision", most) : "",
                    JoinNames(following));
  return differences;
}

}  // namespace

Differences SortDifferences(const Comparison& comparison) {
  const RobotModel& model = *comparison.model;
  const int base = model.num_base_velocities();
  const std::vector<CheckRecord>& checks = comparison.result.constants.records;
  if (comparison.digits) return ListExcesses(comparison);
  Differences differences;
  const auto add = [&](double error, std::string line) {
    const int digits = CountDigits(error);
    const bool is_rounded = digits >= kDigitsOfRoundedInput;
    if (is_rounded) differences.digits = std::min(differences.digits, digits);
    (is_rounded ? differences.rounded : differences.real).push_back(std::move(line));
  };
  for (const ConstantFinding& finding : comparison.result.constants.findings) {
    // The scale of a check may differ from the larger of the two numbers, where zero is a valid value.
    const double size = Worst(std::abs(finding.model), std::abs(finding.engine));
    const CheckRecord* const check = FindIn(checks, finding.check, &CheckRecord::name);
    const double worst = check == nullptr ? 1.0 : check->worst;
    add(std::min(std::abs(finding.model - finding.engine) / size, worst),
        DescribeFinding(finding, comparison));
  }
  for (const CheckRecord& record : comparison.result.terms) {
    if (!record.failed) continue;
    const int digits = std::clamp(CountDigits(record.worst) + 3, 6, 16);
    add(record.worst, fmt::format("{}: first at {}; largest at {}: {:.{}g} in {}, {:.{}g} in {} (sample {})",
                                  record.name, Describe(record.first_failure, model, base),
                                  Describe(record.where, model, base), record.model_value, digits,
                                  comparison.with_engine ? "the model" : comparison.first.filename().string(),
                                  record.engine_value, digits,
                                  comparison.with_engine ? "MuJoCo" : comparison.second.filename().string(),
                                  static_cast<long>(record.at)));
  }
  return differences;
}

std::vector<std::string> ListOtherDifferences(const Comparison& comparison) {
  std::vector<std::string> lines;
  const auto is_explained = [&](const std::string& check) {
    return comparison.causes && IsExplained(check, *comparison.causes);
  };
  const RobotModel& model = *comparison.model;
  for (const ConstantFinding& finding : comparison.result.constants.findings) {
    if (!is_explained(finding.check)) lines.push_back(DescribeFinding(finding, comparison));
  }
  for (const CheckRecord& record : comparison.result.terms) {
    constexpr const char* kOfNumbers[] = {"joint_axis", "frame_pose", "link_com", "link_inertia"};
    if (record.failed && Contains(kOfNumbers, record.name) && !is_explained(record.name))
      lines.push_back(record.name + ": " +
                      Describe(record.first_failure, model, model.num_base_velocities()));
  }
  return lines;
}

std::vector<std::string> ListDifferences(const Comparison& comparison) {
  if (comparison.causes && !comparison.causes->agrees) {
    std::vector<std::string> lines = ListLines(*comparison.causes);
    for (const std::string& line : ListOtherDifferences(comparison))
      lines.push_back("not explained: " + line);
    return lines;
  }
  Differences differences = SortDifferences(comparison);
  std::vector<std::string> lines = std::move(differences.real);
  Append(differences.rounded, &lines);
  if (!differences.following.empty()) lines.push_back(differences.following);
  return lines;
}

}  // namespace dexcheck
