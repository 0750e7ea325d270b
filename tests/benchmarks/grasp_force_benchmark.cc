// Time of one grasp-force solution, certificate included, on random grasps of the torus; beside it csdp's on
// the same problems.
//
// Cold: problem after problem, unrelated. Warm: one grasp in motion, a millisecond from problem to problem.
// Each counter is the median over single solutions, in microseconds; the benchmark's own time is the mean.
// Feasible problems only, except where named infeasible.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "controller/grasp/force_closure.h"
#include "controller/grasp/grasp_force.h"
#include "tests/controller/grasp/random_grasp.h"
#include "tests/controller/grasp/sdp_oracle.h"

namespace dexcheck {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kProblems = 1000;

GraspForceOptions MakeOptions(bool warm_start) {
  GraspForceOptions options;
  options.warm_start = warm_start;
  return options;
}

std::vector<GraspForceProblem> MakeProblems(int num_contacts, GraspForceStatus status, int count) {
  std::mt19937_64 random(1);
  GraspForceSolver solver(num_contacts, MakeOptions(false));
  std::vector<GraspForceProblem> problems;
  while (static_cast<int>(problems.size()) < count) {
    const GraspForceProblem problem = testing::MakeRandomGraspForceProblem(random, num_contacts);
    if (solver.Solve(problem).status == status) problems.push_back(problem);
  }
  return problems;
}

// `count` problems a millisecond apart, all feasible.
std::vector<GraspForceProblem> MakeMotion(int num_contacts, int count) {
  GraspForceSolver solver(num_contacts, MakeOptions(false));
  for (const GraspForceProblem& start : MakeProblems(num_contacts, GraspForceStatus::kOptimal, 50)) {
    std::mt19937_64 random(2);
    std::vector<GraspForceProblem> problems{start};
    while (static_cast<int>(problems.size()) < count) {
      GraspForceProblem next = problems.back();
      testing::MoveGrasp(random, next);
      if (solver.Solve(next).status != GraspForceStatus::kOptimal) break;
      problems.push_back(next);
    }
    if (static_cast<int>(problems.size()) == count) return problems;
  }
  throw std::runtime_error("no grasp stays feasible");
}

void RunSolver(benchmark::State& state, const std::vector<GraspForceProblem>& problems,
               const GraspForceOptions& options) {
  GraspForceSolver solver(problems[0].num_contacts(), options);
  std::vector<double> times;
  double iterations = 0.0;
  std::size_t next = 0;
  solver.Solve(problems[0]);
  for (auto _ : state) {
    // There and back, so that a motion never jumps.
    const std::size_t phase = ++next % (2 * problems.size() - 2);
    const GraspForceProblem& problem = problems[std::min(phase, 2 * problems.size() - 2 - phase)];
    const Clock::time_point start = Clock::now();
    const GraspForceResult& result = solver.Solve(problem);
    times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
    iterations += result.iterations;
    if (result.status == GraspForceStatus::kNotConverged) state.SkipWithError("not converged");
  }
  iterations /= static_cast<double>(times.size());
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  state.counters["median_us"] = times[times.size() / 2];
  state.counters["iterations"] = iterations;
}

// Whole runs of the csdp program on prepared files; `idle` runs it without a problem, for the time of its
// start.
void RunCsdp(benchmark::State& state, bool idle) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("dexcheck_benchmark_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::vector<std::filesystem::path> files;
  for (const GraspForceProblem& problem : MakeProblems(4, GraspForceStatus::kOptimal, 20)) {
    files.push_back(folder / (std::to_string(files.size()) + ".dat-s"));
    if (!idle) testing::WriteSdp(problem, files.back());
  }
  std::vector<double> times;
  for (auto _ : state) {
    const Clock::time_point start = Clock::now();
    testing::RunCsdp(files[times.size() % files.size()]);
    times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  state.counters["median_us"] = times[times.size() / 2];
  std::filesystem::remove_all(folder);
}

void RunForceClosure(benchmark::State& state) {
  const std::vector<GraspForceProblem> problems = MakeProblems(4, GraspForceStatus::kOptimal, 50);
  std::size_t next = 0;
  for (auto _ : state) {
    const GraspForceProblem& problem = problems[++next % problems.size()];
    benchmark::DoNotOptimize(CalcForceClosure(problem.G, problem.mu));
  }
}

void Register() {
  using Problems = std::vector<GraspForceProblem>;
  const auto Add = [](const std::string& name, const Problems& problems, const GraspForceOptions& options) {
    benchmark::RegisterBenchmark(name.c_str(),
                                 [=](benchmark::State& state) { RunSolver(state, problems, options); });
  };
  for (const int n : {4, 8, 12}) {
    const std::string contacts = "barrier/" + std::to_string(n) + "_contacts/";
    Add(contacts + "cold", MakeProblems(n, GraspForceStatus::kOptimal, kProblems), MakeOptions(false));
    Add(contacts + "warm", MakeMotion(n, kProblems), MakeOptions(true));
  }
  Add("barrier/4_contacts/infeasible", MakeProblems(4, GraspForceStatus::kInfeasible, kProblems),
      MakeOptions(false));
  benchmark::RegisterBenchmark("csdp/4_contacts", [](benchmark::State& state) { RunCsdp(state, false); });
  benchmark::RegisterBenchmark("csdp/start_alone", [](benchmark::State& state) { RunCsdp(state, true); });
  benchmark::RegisterBenchmark("force_closure", RunForceClosure);
}

}  // namespace
}  // namespace dexcheck

int main(int argc, char** argv) {
  dexcheck::Register();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
