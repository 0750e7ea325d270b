// What a study's trial costs beyond its closed loop: the same run as a bare loop in this process, its models
// loaded before, and as a trial with all that belongs to it: process, models, metrics, database. In turns, so
// that others' work falls on both alike. Then how much faster two at a time are than one after the other.
//
// study_benchmark [REPETITIONS]

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <vector>

#include "controller/common/toml_reader.h"
#include "harness/run/closed_loop.h"
#include "harness/study/study_store.h"
#include "harness/study/trial_pool.h"
#include "tests/benchmarks/measured_time.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"

namespace dexcheck {
namespace {

const std::string kSource = testing::SourcePath();

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

StudyInputs MakeInputs() {
  StudyInputs inputs;
  inputs.study = ParseStudy(
      "name = \"s\"\nscenario = \"offset\"\nset = [\"duration=3\", \"start_error.xyz=[1e-5, 0, "
      "0]\"]\n[[vary]]\nkey = "
      "\"control.K_v\"\nfrom = 20\nto = 60\ncount = 1000\n",
      "study.toml");
  inputs.scenario_folder = kSource + "/harness/shipped/scenarios";
  inputs.scenario_text = ReadTextFile(inputs.scenario_folder / "offset.toml");
  inputs.scenario_source = "offset";
  inputs.robot = kSource + "/controller/parameters/assistant_robot.toml";
  inputs.mjcf = kSource + "/mjcf/scene.xml";
  return inputs;
}

void Compare(int repetitions) {
  StudyInputs inputs = MakeInputs();
  const std::vector<Trial> trials = ListTrials(inputs.study);
  CheckTrials(&inputs);
  const testing::TempFolder folder;
  StudyStore store =
      StudyStore::OpenOrCreate(folder.path() / "study.sqlite", IdentifyStudy(inputs), inputs.study);
  // The trials from `first` on, so many at a time.
  const auto run = [&](int jobs, size_t first, size_t count) {
    TrialPool pool(jobs, 0.0, [&](const Trial& trial) { return RunTrial(inputs, trial); });
    size_t next = first;
    while (next < first + count || !pool.IsEmpty()) {
      while (!pool.IsFull() && next < first + count) {
        store.Claim(trials[next].number);
        pool.Start(trials[next++]);
      }
      if (const auto ended = pool.Wait()) store.Add(ended->row);
    }
  };
  std::vector<double> wall;
  std::vector<double> processor;
  double bare_seconds = 0.0;
  for (int i = 0; i < repetitions; ++i) {
    const Trial& trial = trials[static_cast<size_t>(i)];
    const Setup setup(MakeTrialScenario(inputs, trial), inputs.robot, inputs.mjcf);
    const MeasuredTime bare = Measure([&] {
      ClosedLoop loop(setup, /*check=*/false);
      loop.Settle();
      while (!loop.is_finished()) loop.Step();
    });
    const MeasuredTime whole = Measure([&] { run(1, static_cast<size_t>(i), 1); });
    wall.push_back(whole.wall / bare.wall);
    processor.push_back(whole.processor / bare.processor);
    bare_seconds += bare.processor / repetitions;
  }
  fmt::print("bare closed loop of 3 s: {:.0f} ms of processor time\n", 1e3 * bare_seconds);
  fmt::print("trial / bare loop, medians of {}: {:.3f} of processor time, {:.3f} of wall time\n", repetitions,
             Median(processor), Median(wall));
  constexpr size_t kCount = 8;
  std::vector<double> ratios;
  auto next = static_cast<size_t>(repetitions);
  for (int i = 0; i < repetitions / 3 + 1; ++i, next += 2 * kCount) {
    const double one = Measure([&] { run(1, next, kCount); }).wall;
    ratios.push_back(Measure([&] { run(2, next + kCount, kCount); }).wall / one);
  }
  fmt::print("two at a time / one at a time, {} trials, median of {}: {:.3f} of wall time\n", kCount,
             ratios.size(), Median(ratios));
}

}  // namespace
}  // namespace dexcheck

int main(int argc, char** argv) {
  dexcheck::Compare(argc > 1 ? std::clamp(std::atoi(argv[1]), 1, 100) : 15);
  return 0;
}
