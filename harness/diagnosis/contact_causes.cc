#include "harness/diagnosis/contact_causes.h"

#include <algorithm>

#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {
namespace {

using Eigen::Index;

// Of a distance, m, and of how the point that is nearest moves when a radius changes.
constexpr double kDistanceNoise = 1e-12;
constexpr double kRadiusAccuracy = 1e-4;
// What is left may be this fraction of what there was.
constexpr double kExplainsDistance = 0.99;

Fault MakeShapeFault(const Candidate& one, double amplitude, double error) {
  return {one.fault, one.place, one.nominal + amplitude, error, one.unit, ""};
}

/// What is nearer by d when it is larger by d: a fingertip, or the object for all of them.
std::vector<Candidate> ListShapes(const Setup& setup, Index tips, Index steps, double noise) {
  std::vector<Candidate> candidates;
  for (Index i = 0; i < tips; ++i) {
    const int tip = setup.fingertips()[static_cast<size_t>(i)];
    MatrixXd column = MatrixXd::Zero(tips, steps);
    column.row(i).setConstant(-1.0 / noise);
    candidates.push_back({.fault = "radius",
                          .place = "fingertip " + setup.model().frames()[static_cast<size_t>(tip)].name,
                          .unit = "m",
                          .nominal = setup.model().tip_radius(tip),
                          .columns = column.reshaped()});
  }
  candidates.push_back({.fault = "surface further out by",
                        .place = "object " + setup.object().name,
                        .unit = "m",
                        .columns = VectorXd::Constant(tips * steps, -1.0 / noise)});
  return candidates;
}

}  // namespace

Causes ExplainContacts(const StepStore& store) {
  const auto mismatch = store.Get(StepStore::kContactMismatch);
  const Index tips = mismatch.rows(), steps = mismatch.cols();
  const double size = mismatch.size() == 0 ? 0.0 : mismatch.cwiseAbs().maxCoeff();
  if (!(size > 1e2 * kDistanceNoise)) return {};
  const double noise = kDistanceNoise + kRadiusAccuracy * size;
  const std::vector<Candidate> candidates = ListShapes(store.setup(), tips, steps, noise);
  const VectorXd y = (mismatch / noise).reshaped();
  const CauseSelection selection = SelectCauses(y, candidates, {.alike = static_cast<double>(steps)});
  Causes causes;
  for (const CauseTerm& term : selection.terms) {
    Explanation one;
    one.channel = CauseChannel::kContact;
    one.from = store.Get(StepStore::kTime)(0, 0);
    one.to = store.Get(StepStore::kTime)(0, steps - 1);
    one.fraction = term.fraction;
    one.left = selection.left;
    one.faults.push_back(MakeShapeFault(candidates[term.candidate], term.amplitude[0], term.error[0]));
    for (const auto& [same, amplitude] : term.same)
      one.faults.push_back(MakeShapeFault(candidates[same], amplitude[0], 0.0));
    one.SetOutcome();
    if (selection.left > 1.0 && selection.fraction < kExplainsDistance)
      one.outcome = CauseOutcome::kNotExplained;
    if (term.rival != SIZE_MAX) one.SetRival(candidates[term.rival], term.log_odds);
    causes.push_back(one);
  }
  return causes;
}

}  // namespace dexcheck
