#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "controller/common/toml_reader.h"
#include "harness/base/files.h"
#include "harness/base/version.h"
#include "harness/engine/engine.h"
#include "harness/engine/machine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/study/study_store.h"

namespace dexcheck {
namespace {

/// A trial's seed and its overrides, whatever the order of the keys.
using TrialName = std::pair<std::uint64_t, std::vector<std::string>>;

TrialName NameTrial(const Study& study, const Trial& trial) {
  TrialName name{trial.seed, ListOverrides(study, trial)};
  std::ranges::sort(name.second);
  return name;
}

std::string FindSearchDifference(const Study& before, const Study& now) {
  Search search = now.search;
  search.count = before.search.count;
  if (search != before.search) return "search";
  if (!now.is_search()) return {};
  if (before.objectives != now.objectives) return "objective";
  if (before.constraints != now.constraints) return "constraints";
  if (before.variations != now.variations) return "vary";
  if (before.nested != now.nested || before.num_nested != now.num_nested) return "nested";
  return before.seeds != now.seeds ? "seeds" : "";
}

/// Of a row that does not belong to the study any more: its values by the keys' order now; none where a text
/// is not a value any more.
std::optional<std::vector<double>> ReorderValues(const Study& before, const Study& now,
                                                 const std::vector<double>& values) {
  std::vector<double> reordered;
  for (const Variation& variation : now.variations) {
    for (size_t i = 0; i < values.size(); ++i) {
      const Variation& was = before.variations[i];
      if (was.key != variation.key) continue;
      const auto label = std::ranges::find(variation.labels, FormatValue(was, values[i]));
      if (was.labels.empty() && variation.labels.empty()) {
        reordered.push_back(values[i]);
      } else if (label != variation.labels.end()) {
        reordered.push_back(static_cast<double>(label - variation.labels.begin()));
      }
    }
  }
  return reordered.size() == values.size() ? std::optional(reordered) : std::nullopt;
}

std::vector<std::string> ListKeys(const Study& study) {
  std::vector<std::string> keys;
  for (const Variation& variation : study.variations) keys.push_back(variation.key);
  std::ranges::sort(keys);
  return keys;
}

}  // namespace

std::string FindDifference(const Study& before, const Study& now) {
  if (before.scenario != now.scenario) return "scenario";
  if (before.controller != now.controller) return "controller";
  if (before.overrides != now.overrides) return "set";
  if (before.check != now.check) return "check";
  if (before.stop_error != now.stop_error) return "stop_error";
  if (NeedsMargins(now) && !NeedsMargins(before)) return "margins";  // which its trials do not have
  if (ListKeys(before) != ListKeys(now)) return "keys of vary";
  return FindSearchDifference(before, now);
}

bool HasSameTrials(const Study& before, const Study& now) {
  return FindDifference(before, now).empty() && before.seeds == now.seeds &&
         before.num_nested == now.num_nested && before.search.count == now.search.count &&
         before.sample == now.sample && before.nested == now.nested && before.variations == now.variations;
}

StudyChange ChangeStudy(const Study& before, const Study& now, std::vector<TrialRow> rows) {
  StudyChange change;
  if (now.is_search()) {  // of which only the number of points may differ
    change.kept = static_cast<long>(rows.size());
    change.rows = std::move(rows);
    return change;
  }
  std::map<TrialName, Trial> wanted;
  for (Trial& trial : ListTrials(now)) {
    TrialName name = NameTrial(now, trial);
    wanted.emplace(std::move(name), std::move(trial));  // of two that are the same the first is made
  }
  long aside = 0;
  for (TrialRow& row : rows) {
    const bool belonged = row.trial.number >= 0;
    const auto found = wanted.find(NameTrial(before, row.trial));
    if (found == wanted.end()) {
      if (belonged) ++change.set_aside;
      const auto values = ReorderValues(before, now, row.trial.parameters);
      if (!values) continue;
      row.trial.parameters = *values;
      row.trial.number = --aside;
    } else {
      ++(belonged ? change.kept : change.brought_back);
      row.trial = found->second;
      wanted.erase(found);
    }
    change.rows.push_back(std::move(row));
  }
  return change;
}

std::string Describe(const StudyChange& change) {
  std::string text = fmt::format("{} trials are kept", change.kept);
  if (change.brought_back > 0) text += fmt::format(", {} are brought back", change.brought_back);
  if (change.set_aside > 0) text += fmt::format(", {} are set aside", change.set_aside);
  return text;
}

namespace {

std::string HashMjcf(const std::filesystem::path& mjcf) {
  std::string all;
  for (const std::string& file : ListMjcfFiles(mjcf)) {
    all += file + "\n" + HashBytes(ReadBytes(mjcf.parent_path() / file, kMostData)) + "\n";
  }
  return HashBytes(all);
}

bool IsSameNumber(double a, double b) {
  return (std::isnan(a) && std::isnan(b)) ||
         std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

Metric FindErrorMetric(const std::vector<TrialRow>& rows) {
  const bool of_joints = std::ranges::any_of(rows, [](const TrialRow& row) {
    return std::isfinite(row.result.metrics[kJointErrorRms]) &&
           !std::isfinite(row.result.metrics[kPositionErrorRms]);
  });
  return of_joints ? kJointErrorRms : kPositionErrorRms;
}

bool IsSame(const TrialRow& a, const TrialRow& b) {
  if (a.trial.seed != b.trial.seed || a.trial.parameters != b.trial.parameters ||
      a.result.outcome != b.result.outcome) {
    return false;
  }
  const bool exactly = a.machine == b.machine;
  if (exactly && a.result.failure != b.result.failure) return false;
  if (!exactly && !a.result.failure.empty() && !b.result.failure.empty()) return true;
  for (size_t i = 0; i < a.result.metrics.size(); ++i) {
    const double x = a.result.metrics[i];
    const double y = b.result.metrics[i];
    if (exactly ? !IsSameNumber(x, y)
                : !IsSameWithin(kMetricTolerance, x, y, std::max(std::abs(x), std::abs(y)))) {
      return false;
    }
  }
  return a.result.failure == b.result.failure;
}

StudyIdentity IdentifyStudy(const StudyInputs& inputs) {
  return {{"layout", kStudyLayout},
          {"name", inputs.study.name},
          {"study", inputs.study.text},
          {"scenario", inputs.scenario_text},
          {"robot", ReadBytes(inputs.robot.string())},
          {"mjcf_hash", HashMjcf(inputs.mjcf)},
          {"controller_hash", inputs.controller_hash},
          {"dexcheck_version", Version()},
          {"git_revision", kGitRevision},
          {"mujoco_version", mj_versionString()}};
}

}  // namespace dexcheck
