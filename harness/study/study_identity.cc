#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "harness/base/files.h"
#include "harness/base/version.h"
#include "harness/engine/engine.h"
#include "harness/engine/machine.h"
#include "harness/engine/mjcf_file.h"
#include "harness/study/study_store.h"

namespace dexcheck {
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

std::string FindDifference(const Study& before, const Study& now) {
  if (before.scenario != now.scenario) return "scenario";
  if (before.controller != now.controller) return "controller";
  if (before.overrides != now.overrides) return "set";
  if (before.variations != now.variations) return "vary";
  if (before.sample != now.sample) return "sample";
  if (before.search != now.search) return "search";
  if (before.seeds != now.seeds) return "seeds";
  if (before.check != now.check) return "check";
  if (before.stop_error != now.stop_error) return "stop_error";
  const bool lack_margins = NeedsMargins(now) && !NeedsMargins(before);
  if (lack_margins && before.metrics != now.metrics) return "metrics";
  if (!lack_margins && !now.is_search()) return "";
  if (before.objectives != now.objectives) return "objective";
  return before.constraints != now.constraints ? "constraints" : "";
}

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
