#pragma once

// Runs of shipped scenarios.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "harness/run/runner.h"
#include "tests/common/paths.h"

namespace dexcheck::testing {

inline Scenario ReadShippedScenario(const std::string& name, const std::vector<std::string>& overrides = {}) {
  const std::filesystem::path folder = testing::SourcePath("/harness/shipped/scenarios");
  const std::string file = (folder / (name + ".toml")).string();
  return ParseScenario(ReadTextFile(file), file, folder, overrides);
}

/// Success when a run passed; else why not.
inline ::testing::AssertionResult Passes(const RunResult& result) {
  if (result.verdict == Verdict::kPass) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << result.failure << result.attribution.evidence;
}

/// A scenario's setup and runner.
class ShippedRun {
 public:
  explicit ShippedRun(const std::string& name, const std::vector<std::string>& overrides = {},
                      std::uint64_t seed = 0) {
    Scenario scenario = ReadShippedScenario(name, overrides);
    scenario.seed = seed;
    setup_ = std::make_unique<Setup>(
        scenario,
        scenario.model_file.empty() ? testing::SourcePath("/controller/parameters/assistant_robot.toml")
                                    : scenario.model_file,
        scenario.mjcf_file.empty() ? testing::SourcePath("/mjcf/scene.xml") : scenario.mjcf_file);
    runner_ = std::make_unique<Runner>(*setup_, /*check=*/true);
  }

  const RunResult& Run() {
    return runner_->Run([](const StepRecord&) {}, [] { return false; });
  }
  template <typename AfterStep>
  const RunResult& Run(const AfterStep& after_step) {
    return runner_->Run([&](const StepRecord&) { after_step(); }, [] { return false; });
  }

  [[nodiscard]] const Setup& setup() const { return *setup_; }
  [[nodiscard]] const ClosedLoop& loop() const { return runner_->loop(); }
  /// The last step.
  [[nodiscard]] const StepRecord& step() const { return loop().record(); }
  [[nodiscard]] double Worst(std::string_view check) const { return loop().checks().Find(check).worst; }

 private:
  std::unique_ptr<Setup> setup_;
  std::unique_ptr<Runner> runner_;
};

}  // namespace dexcheck::testing
