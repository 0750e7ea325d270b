#include "harness/diagnosis/model_causes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "controller/common/errors.h"
#include "harness/comparison/file_causes.h"
#include "harness/corrections/read_printed.h"
#include "harness/descriptions/mjcf_reader.h"

namespace dexcheck {
namespace {

/// Numbers of two descriptions that are at hand, and not only printed, are known to what the engine's
/// diagonalisation of inertias leaves.
void KnowNumbers(PrintedRobot* robot) {
  constexpr double kKnown = 1e-6;  // of a number
  const auto know = [](double value, double* half) {
    *half = std::min(*half, kKnown * std::abs(value) + 1e-12);
  };
  for (PrintedLink& link : robot->links) {
    for (const LinkNumber& number : ListNumbers(&link.origin)) know(*number.value, number.half);
    if (!link.inertial) continue;
    for (const LinkNumber& number : ListNumbers(&*link.inertial)) know(*number.value, number.half);
  }
}

void Replace(std::string_view from, std::string_view to, std::string* text) {
  for (size_t at = 0; (at = text->find(from, at)) != std::string::npos; at += to.size())
    text->replace(at, from.size(), to);
}

}  // namespace

Causes ListModelCauses(const RobotModel& model, const mjModel& engine) {
  RobotDescription ours{.spec = model.spec()};
  ours.joints.resize(ours.spec.joints.size());
  FileCauses found;
  try {
    PrintedRobot a = PrintDescription(ours);
    PrintedRobot b = PrintDescription(ReadMjcfDescription(engine, "the MJCF"));
    KnowNumbers(&a);
    KnowNumbers(&b);
    found = FindCauses(std::move(a), std::move(b));
  } catch (const InputError&) {
    return {};  // a scene of several robots
  }
  if (found.agrees || !found.unexplained.empty()) return {};
  Causes causes;
  for (const CorrectionItem& item : found.items) {
    Explanation& one = causes.emplace_back();
    one.channel = CauseChannel::kGeometry;
    one.outcome = CauseOutcome::kObserved;
    one.from = -std::numeric_limits<double>::infinity();
    std::string text = item.text;
    Replace(" here", found.of_second ? " in the MJCF" : " in the model", &text);
    Replace("the other file", found.of_second ? "the model" : "the MJCF", &text);
    one.faults.push_back({kUnknownFault, std::move(text), 0.0, 0.0, "", ""});
  }
  return causes;
}

}  // namespace dexcheck
