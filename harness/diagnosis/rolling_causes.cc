#include <algorithm>
#include <cmath>
#include <tuple>

#include "harness/checks/step_analysis.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

using Eigen::Index;

// Part of the residual, squared, that wheels explain: those that slip do so with the load. One that is 1 %
// too large in scenario curve explains 0.976.
constexpr double kExplains = 0.95;
// A wheel that is off by more of its size is none of this platform.
constexpr double kLargestError = 0.5;
// Noise is taken for this many times what the explanation leaves.
constexpr double kLevel = 5.0;

/// Two wheels that are off by different amounts are two faults, not one that both have and another of one.
/// One that explains hardly anything beside another is made by a platform that tilts.
CauseSelection SelectWheels(const VectorXd& y, std::vector<Candidate>* candidates,
                            const CauseOptions& options) {
  constexpr double kLeast = 0.05;  // of the fraction that the first explains
  CauseSelection selection = SelectCauses(y, *candidates, options);
  const auto count = std::ranges::count_if(selection.terms, [&](const CauseTerm& term) {
    return (*candidates)[term.candidate].fault == candidates->front().fault;
  });
  if (count > 1 && candidates->front().place == "wheels") {
    candidates->erase(candidates->begin());
    selection = SelectCauses(y, *candidates, options);
  }
  std::vector<Candidate> kept;
  for (const CauseTerm& term : selection.terms)
    if (term.fraction >= kLeast * selection.terms.front().fraction)
      kept.push_back((*candidates)[term.candidate]);
  if (kept.size() == selection.terms.size()) return selection;
  *candidates = kept;
  return SelectCauses(y, *candidates, options);
}

}  // namespace

Causes ExplainRolling(const StepStore& store) {
  const Base& base = store.setup().model().base();
  if (base.type != BaseType::kDifferentialDrive) return {};
  const auto mismatch = store.Get(StepStore::kWheelMismatch);
  const auto rates = store.Get(StepStore::kWheelRates);
  const auto noise = store.Get(StepStore::kWheelNoise);
  std::vector<Index> steps;
  for (Index i = 0; i < store.size(); ++i)
    if (noise(0, i) > 0.0 && noise(1, i) > 0.0) steps.push_back(i);
  if (steps.empty()) return {};
  const auto count = static_cast<Index>(steps.size());
  VectorXd y(2 * count);
  bool fails = false;  // the check
  std::vector<Candidate> candidates;
  for (const auto& [fault, place, nominal] : {std::tuple{"radius", "wheels", base.wheel_radius},
                                              {"distance", "wheels", base.wheel_distance},
                                              {"radius", base.wheel_joint_right.c_str(), base.wheel_radius},
                                              {"radius", base.wheel_joint_left.c_str(), base.wheel_radius}}) {
    const bool is_one = std::string_view(place) != "wheels";
    candidates.push_back({.fault = fault,
                          .place = is_one ? std::string("wheel ") + place : place,
                          .unit = "m",
                          .nominal = nominal,
                          .columns = MatrixXd::Zero(2 * count, 1),
                          .scale = VectorXd::Constant(1, nominal),
                          .is_possible = [nominal = nominal](const VectorXd& a) {
                            return std::abs(a[0]) <= kLargestError * nominal;
                          }});
  }
  for (Index k = 0; k < count; ++k) {
    const Index step = steps[static_cast<size_t>(k)];
    const double turn = CalcRollingTwist(base, store.Get(StepStore::kVelocity).col(step))[1];
    for (const Index wheel : {0, 1}) {
      const Index row = 2 * k + wheel;
      const double unit = 1.0 / noise(wheel, step);
      const double rate = rates(wheel, step) * unit;
      y[row] = mismatch(wheel, step) * unit;
      fails = fails || std::abs(mismatch(wheel, step)) > noise(wheel, step) + store.rolling_bound();
      candidates[0].columns(row, 0) = rate;
      candidates[1].columns(row, 0) = (wheel == 0 ? -0.5 : 0.5) * turn * unit;
      candidates[static_cast<size_t>(2 + wheel)].columns(row, 0) = rate;
    }
  }
  // Slip changes with the load, in some steps.
  constexpr double kAlike = 8.0;
  if (y.squaredNorm() <= static_cast<double>(y.size())) return {};
  const CauseOptions options{.most_terms = 3,
                             .noise_block_size = std::min(kAlike, static_cast<double>(count))};
  CauseSelection selection = SelectWheels(y, &candidates, options);
  const bool explained = selection.fraction >= kExplains;
  if (!explained && !fails) return {};
  if (const double level = kLevel * selection.left; explained && level < 1.0) {
    y /= level;
    for (Candidate& one : candidates) one.columns /= level;
    selection = SelectWheels(y, &candidates, options);
  }
  return DescribeSelection(StartExplanation(store, CauseChannel::kRolling, steps), selection, candidates,
                           DescribeNumber, explained);
}

}  // namespace dexcheck
