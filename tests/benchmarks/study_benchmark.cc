// Measures the cost of a study's trial beyond its closed loop: the same run as a bare loop in this process,
// its models loaded before, and as a trial with process, models, metrics and database. Both are run in turns,
// so that other programs' work affects both. Then it compares two trials at a time with one after the other.
//
// study_benchmark [REPETITIONS]
//
// With rows, it measures the cost of many rows: the page, a merge of four parts, and a resumption with
// nothing to do, each by the program itself; wall time, processor time and largest memory.
//
// study_benchmark rows N DEXCHECK

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <vector>

#include "controller/common/toml_reader.h"
#include "harness/run/closed_loop.h"
#include "harness/study/study_runner.h"
#include "harness/study/study_store.h"
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

StudyInputs MakeInputs(const std::string& more) {
  StudyInputs inputs;
  inputs.study = ParseStudy(
      "name = \"s\"\nscenario = \"offset\"\nset = [\"duration=3\", \"start_error.xyz=[1e-5, 0, 0]\"]\n" +
          more,
      "study.toml");
  inputs.scenario_folder = kSource + "/harness/shipped/scenarios";
  inputs.scenario_text = ReadTextFile(inputs.scenario_folder / "offset.toml");
  inputs.scenario_source = "offset";
  inputs.robot = kSource + "/controller/parameters/assistant_robot.toml";
  inputs.mjcf = kSource + "/mjcf/scene.xml";
  return inputs;
}

void Compare(int repetitions) {
  StudyInputs inputs = MakeInputs("[[vary]]\nkey = \"control.K_v\"\nfrom = 20\nto = 60\ncount = 1000\n");
  const std::vector<Trial> trials = ListTrials(inputs.study);
  CheckTrials(&inputs);
  const testing::TempFolder folder;
  StudyStore store =
      StudyStore::OpenOrCreate(folder.path() / "study.sqlite", IdentifyStudy(inputs), inputs.study);
  // The trials from `first` on, so many at a time.
  const auto run = [&](int jobs, size_t first, size_t count) {
    const auto begin = trials.begin() + static_cast<std::ptrdiff_t>(first);
    const RunOptions options{jobs, [] { return false; }, [](long) {}};
    RunTrials(inputs, {begin, begin + static_cast<std::ptrdiff_t>(count)}, options, &store);
  };
  // So many trials of one worker against as many bare loops.
  constexpr size_t kCount = 8;
  std::vector<double> wall, processor, overhead;
  double bare_seconds = 0.0;
  size_t next = 0;
  for (int i = 0; i < repetitions; ++i, next += kCount) {
    MeasuredTime bare{};
    for (size_t k = 0; k < kCount; ++k) {
      const Setup setup(MakeTrialScenario(inputs, trials[next + k]), inputs.robot, inputs.mjcf);
      const MeasuredTime one = Measure([&] {
        ClosedLoop loop(setup, /*check=*/false);
        loop.Settle();
        while (!loop.is_finished()) loop.Step();
      });
      bare.wall += one.wall;
      bare.processor += one.processor;
    }
    const MeasuredTime whole = Measure([&] { run(1, next, kCount); });
    wall.push_back(whole.wall / bare.wall);
    processor.push_back(whole.processor / bare.processor);
    overhead.push_back((whole.processor - bare.processor) / kCount);
    bare_seconds += bare.processor / kCount / repetitions;
  }
  fmt::print("bare closed loop of 3 s: {:.0f} ms of processor time\n", 1e3 * bare_seconds);
  fmt::print(
      "trial / bare loop, medians of {} times {}: {:.3f} of processor time, {:.3f} of wall time; {:.1f} ms "
      "of processor time more a trial\n",
      repetitions, kCount, Median(processor), Median(wall), 1e3 * Median(overhead));
  std::vector<double> ratios;
  for (int i = 0; i < repetitions / 3 + 1; ++i, next += 2 * kCount) {
    const double one = Measure([&] { run(1, next, kCount); }).wall;
    ratios.push_back(Measure([&] { run(2, next + kCount, kCount); }).wall / one);
  }
  fmt::print("two at a time / one at a time, {} trials, median of {}: {:.3f} of wall time\n", kCount,
             ratios.size(), Median(ratios));
}

/// Runs the program and prints what it took.
void Time(const std::string& what, std::vector<std::string> arguments) {
  const auto start = std::chrono::steady_clock::now();
  const pid_t child = ::fork();
  if (child == 0) {
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    ::execv(pointers.front(), pointers.data());
    ::_exit(127);
  }
  int status = 0;
  rusage usage{};
  ::wait4(child, &status, 0, &usage);
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double processor = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                           1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  fmt::print("{:<28}{:8.1f} s of wall time {:8.1f} s of processor time {:8.0f} MB of memory{}\n", what, wall,
             processor, static_cast<double>(usage.ru_maxrss) / 1024.0, status == 0 ? "" : ", FAILED");
  std::fflush(stdout);
}

/// Rows as trials would have left them: the numbers are made up.
void MakeParts(const std::filesystem::path& folder, const StudyInputs& inputs, long parts) {
  const StudyIdentity identity = IdentifyStudy(inputs);
  const std::vector<Trial> trials = ListTrials(inputs.study);
  for (long part = 0; part < parts; ++part) {
    StudyStore store =
        StudyStore::OpenOrCreate(folder / fmt::format("part-{}.sqlite", part), identity, inputs.study);
    std::vector<TrialRow> rows;
    for (auto i = static_cast<size_t>(part); i < trials.size(); i += static_cast<size_t>(parts)) {
      TrialRow row;
      row.trial = trials[i];
      row.machine = "a machine that made this row";
      for (size_t k = 0; k < row.result.metrics.size(); ++k)
        row.result.metrics[k] = 1.0 + std::sin(static_cast<double>(i * (k + 1)));
      rows.push_back(std::move(row));
      constexpr size_t kTogether = 10000;
      if (rows.size() < kTogether) continue;
      store.Add(rows);
      rows.clear();
    }
    store.Add(rows);
  }
}

void MeasureRows(long count, const std::string& program) {
  const long side = std::lround(std::sqrt(static_cast<double>(count)));
  const std::string text = fmt::format(
      "[[objective]]\nminimize = \"energy\"\n[[vary]]\nkey = \"control.K_p\"\nfrom = 100\nto = 1e4\n"
      "count = {0}\n[[vary]]\nkey = \"control.K_v\"\nfrom = 20\nto = 60\ncount = {0}\n",
      side);
  const StudyInputs inputs = MakeInputs(text);
  const testing::TempFolder folder;
  const auto file = [&](const std::string& name) { return (folder.path() / name).string(); };
  testing::WriteText(file("study.toml"), inputs.study.text);
  constexpr long kParts = 4;
  MakeParts(folder.path(), inputs, kParts);
  std::vector<std::string> merge = {program, "study", "merge", "--quiet", file("all.sqlite")};
  for (long part = 0; part < kParts; ++part) merge.push_back(file(fmt::format("part-{}.sqlite", part)));
  fmt::print("{} rows\n", side * side);
  Time("merge of 4 parts", merge);
  fmt::print("  database of {:.0f} MB\n",
             1e-6 * static_cast<double>(std::filesystem::file_size(file("all.sqlite"))));
  Time("resume with nothing to do",
       {program, "study", "run", file("study.toml"), "--db", file("all.sqlite"), "--quiet"});
  Time("page", {program, "study", "report", file("all.sqlite"), "--page", file("page.html")});
  fmt::print("  page of {:.1f} MB\n",
             1e-6 * static_cast<double>(std::filesystem::file_size(file("page.html"))));
}

}  // namespace
}  // namespace dexcheck

int main(int argc, char** argv) {
  if (argc == 4 && std::string_view(argv[1]) == "rows") {
    dexcheck::MeasureRows(std::clamp(std::atol(argv[2]), 4L, dexcheck::kMaxTrials), argv[3]);
    return 0;
  }
  dexcheck::Compare(argc > 1 ? std::clamp(std::atoi(argv[1]), 1, 50) : 4);
  return 0;
}
