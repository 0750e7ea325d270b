#include "harness/run/detectability.h"

#include <algorithm>
#include <cmath>

#include "harness/checks/check_table.h"
#include "harness/diagnosis/force_telling.h"
#include "harness/diagnosis/smallest_amplitudes.h"
#include "harness/diagnosis/step_forces.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// Fills in steps of the run. @returns whether it was not stopped.
bool TakeSteps(const Setup& setup, int states, const std::function<bool()>& should_stop, StepStore* store) {
  Runner runner(setup, /*check=*/true);
  const long every = std::max(1L, runner.loop().num_steps() / states);
  const RunResult& result = runner.Run(
      [&](const StepRecord& step) {
        if (step.step % every == 0) store->Add(step, runner.loop().checks().analysis(), /*differs=*/true);
      },
      should_stop);
  if (result.interrupted) return false;
  if (!result.failure.empty()) throw InputError(setup.scenario().source + ": " + result.failure);
  return true;
}

/// What faults would leave of the balances in all steps. @param residual what is left of them without one.
std::vector<Candidate> MakeCandidates(const StepStore& store, const Vector2d& level, StepForces* forces,
                                      VectorXd* residual) {
  forces->SetLevel(level);
  residual->resize(forces->rows() * store.size());
  std::vector<Candidate> candidates;
  for (Index i = 0; i < store.size(); ++i) {
    forces->SetStep(i);
    residual->segment(i * forces->rows(), forces->rows()) = forces->CalcResidual();
    forces->AddColumns(i * forces->rows(), store.size(), &candidates);
  }
  std::erase_if(candidates, [](const Candidate& one) { return one.columns.isZero(0.0); });
  return candidates;
}

/// Noise of robot and object in the run itself, in bounds of the checks.
Vector2d CalcLevel(const StepStore& store, const VectorXd& residual) {
  constexpr double kOfLeft = 5.0, kRounding = 1e-4;  // as ForceProblem
  const Index rows = residual.size() / store.size();
  const auto steps = residual.reshaped(rows, store.size());
  const Vector2d size(std::sqrt(steps.topRows(rows - 6).cwiseAbs2().mean()),
                      std::sqrt(steps.bottomRows(6).cwiseAbs2().mean()));
  return (kOfLeft * size).cwiseMax(kRounding).cwiseMin(1.0);
}

}  // namespace

std::vector<Detectability> FindDetectability(const Setup& setup, int states,
                                             const std::function<bool()>& should_stop) {
  if (setup.scenario().pick_task() != nullptr)
    throw InputError(setup.scenario().source + ": task: has no trajectory");
  StepStore store(setup, nullptr, CalcBound(*FindCheck("rolling"), setup.scenario()));
  std::vector<Detectability> all;
  if (!TakeSteps(setup, states, should_stop, &store)) return all;
  StepForces forces(store);
  VectorXd residual;
  std::vector<Candidate> candidates = MakeCandidates(store, Vector2d::Ones(), &forces, &residual);
  std::vector<Fault> faults;
  for (const Candidate& one : candidates)
    faults.push_back(MakeForceFault(one, VectorXd::Ones(one.columns.cols()), {}, setup.model().gravity()));
  const auto is_like = [&](size_t a, size_t b) { return faults[a].IsLike(faults[b]); };
  const CauseOptions options{.alike = static_cast<double>(store.size())};
  const std::vector<SmallestAmplitude> found = FindSmallestAmplitudes(candidates, options, is_like);
  candidates = MakeCandidates(store, CalcLevel(store, residual), &forces, &residual);
  const std::vector<SmallestAmplitude> named = FindSmallestAmplitudes(candidates, options, is_like);
  for (size_t i = 0; i < found.size(); ++i) {
    const size_t candidate = found[i].candidate;
    const auto is_told = [&](const Fault& other) { return other.IsLike(faults[candidate]); };
    const auto first = std::find_if(faults.begin(), faults.end(), is_told);
    if (first - faults.begin() != static_cast<std::ptrdiff_t>(candidate)) continue;
    const size_t rival = named[i].rival;
    all.push_back({faults[candidate].fault, faults[candidate].place, candidates[candidate].unit,
                   static_cast<int>(found[i].component), found[i].found,
                   std::max(found[i].found, named[i].named),
                   rival == SIZE_MAX ? "" : faults[rival].place + ": " + faults[rival].fault});
  }
  return all;
}

}  // namespace dexcheck
