// What a study and its rows are, so that rows of different ones never meet.

#include <algorithm>
#include <bit>
#include <cmath>

#include "controller/common/toml_reader.h"
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
    all += file + "\n" + HashBytes(ReadBytes(mjcf.parent_path() / file)) + "\n";
  }
  return HashBytes(all);
}

bool IsSameNumber(double a, double b) {
  return (std::isnan(a) && std::isnan(b)) ||
         std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

Metric FindErrorMetric(const std::vector<TrialRow>& rows) {
  const bool of_joints = std::any_of(rows.begin(), rows.end(), [](const TrialRow& row) {
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
          {"robot", ReadTextFile(inputs.robot.string())},
          {"mjcf_hash", HashMjcf(inputs.mjcf)},
          {"dexcheck_version", Version()},
          {"git_revision", kGitRevision},
          {"mujoco_version", mj_versionString()}};
}

}  // namespace dexcheck
