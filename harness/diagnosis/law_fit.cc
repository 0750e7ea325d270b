#include "harness/diagnosis/law_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/checks/check_table.h"

namespace dexcheck {

using Eigen::Index;

LawProblem::LawProblem(const StepStore& store, double noise)
    : model_(store.setup().model()),
      actuation_(model_),
      law_([law = store.law()](const LawInputs& inputs) { return law->CalcForce(inputs); }) {
  ChooseSteps(store.law()->history().snapshots());
  for (const LawSnapshot* const step : steps_) {
    factors_.emplace_back(model_).Compute(step->inputs.M);
    right_.emplace_back(*step, step->inputs, law_);
  }
  FindWeights(noise);
}

/// The first steps, and others evenly; those with a past, if there are any. Of these every third is set
/// aside.
void LawProblem::ChooseSteps(const std::vector<LawSnapshot>& all) {
  constexpr size_t kMost = 32, kFirst = 12, kPast = 16, kAside = 3, kFew = 8;
  std::vector<const LawSnapshot*> usable;
  for (const LawSnapshot& step : all)
    if (step.before.size() >= kPast) usable.push_back(&step);
  if (usable.empty())
    for (const LawSnapshot& step : all) usable.push_back(&step);
  for (size_t i = 0; i < std::min(kFirst, usable.size()); ++i) steps_.push_back(usable[i]);
  const size_t rest = usable.size() - steps_.size(), more = std::min(rest, kMost - kFirst);
  for (size_t i = 1; i <= more; ++i) steps_.push_back(usable[kFirst - 1 + rest * i / more]);
  for (size_t i = 0; i < steps_.size(); ++i) (i % kAside == kAside - 1 ? aside_ : fitted_).push_back(i);
  const size_t few = std::min(kFew, fitted_.size());
  for (size_t i = 1; i <= few; ++i) few_.push_back(fitted_[fitted_.size() * i / few - 1]);
}

/// Torques of few digits make a difference of their own, and summands agree with what a wrong law has of them
/// to a fraction of the difference.
void LawProblem::FindWeights(double noise) {
  bool has_few = true;  // as 0 and 0.5 have
  is_single_ = std::ranges::all_of(steps_, [&](const LawSnapshot* step) {
    VectorXd tau(step->difference.size());
    actuation_.CalcTorque(step->inputs.now.force + step->difference, tau);
    constexpr double kSplit = 1.0 + 0x1p41;  // leaves 12 binary digits
    has_few = has_few && kSplit * tau - (kSplit * tau - tau) == tau;
    return tau.cast<float>().cast<double>() == tau;
  });
  is_single_ = is_single_ && !has_few;
  constexpr double kSingle = 8.0 * std::numeric_limits<float>::epsilon();  // of a few operations
  if (is_single_) noise = std::max(noise, kSingle / kLawTorqueBound);
  constexpr double kAccuracy = 1e-9;
  const double root =
      std::sqrt(static_cast<double>(model_.num_velocities()));  // the bound is one of the norm
  weights_.resize(static_cast<Index>(steps_.size()));
  for (size_t k = 0; k < steps_.size(); ++k) {
    double& weight = weights_[static_cast<Index>(k)];
    weight = root / (noise * steps_[k]->noise);
    weight /= std::hypot(1.0, kAccuracy * Whiten(k, steps_[k]->difference).norm() / root);
  }
}

VectorXd LawProblem::Whiten(size_t step, VectorXd force) const {
  factors_[step].SolveTransposed(force);
  return force * weights_[static_cast<Index>(step)];
}

VectorXd LawProblem::GetDifferences(const Steps& steps) const {
  const Index n = model_.num_velocities();
  VectorXd all(n * static_cast<Index>(steps.size()));
  for (size_t k = 0; k < steps.size(); ++k)
    all.segment(n * static_cast<Index>(k), n) = Whiten(steps[k], steps_[steps[k]]->difference);
  return all;
}

MatrixXd LawProblem::CalcColumns(const LawPlace* place, const Steps& steps,
                                 const std::vector<MatrixXd>& forces) const {
  const Index n = model_.num_velocities();
  MatrixXd columns(n * static_cast<Index>(steps.size()), forces.front().cols());
  for (size_t k = 0; k < steps.size(); ++k)
    for (Index i = 0; i < columns.cols(); ++i) {
      const VectorXd force = forces[k].col(i);
      columns.col(i).segment(n * static_cast<Index>(k), n) =
          Whiten(steps[k], place != nullptr ? KeepAt(actuation_, *place, force) : force);
    }
  return columns;
}

VectorXd LawProblem::CalcChanges(const std::vector<LawTerm>& faults, const Steps& steps) const {
  const Index n = model_.num_velocities();
  VectorXd all(n * static_cast<Index>(steps.size()));
  for (size_t k = 0; k < steps.size(); ++k) {
    At(steps[k], faults, [&](const LawAtStep& at) {
      all.segment(n * static_cast<Index>(k), n) = Whiten(steps[k], at.force - at.inputs.now.force);
    });
  }
  return all;
}

MatrixXd LawProblem::CalcSlopes(std::vector<LawTerm> faults, const Steps& steps,
                                const VectorXd& changes) const {
  constexpr double kRelative = 1e-4, kLeast = 1e-4;
  std::vector<VectorXd> slopes;
  for (LawTerm& fault : faults) {
    for (Index i = 0; i < fault.CountNumbers(); ++i) {
      const double size = fault.sizes[i], by = std::max(kRelative * std::abs(size), kLeast);
      fault.sizes[i] = size + by;
      slopes.emplace_back((CalcChanges(faults, steps) - changes) / by);
      fault.sizes[i] = size;
    }
  }
  MatrixXd all(changes.size(), static_cast<Index>(slopes.size()));
  for (Index i = 0; i < all.cols(); ++i) all.col(i) = slopes[static_cast<size_t>(i)];
  return all;
}

VectorXd LawProblem::CalcScale(const LawTerm& fault, const MatrixXd& columns) {
  VectorXd scale = columns.colwise().norm().cwiseMax(std::numeric_limits<double>::min());
  // A direction of a vector that shows no more than rounding stays as it is.
  if (fault.entry->plausible > 0.0 && scale.size() > 0) scale.setConstant(scale.maxCoeff());
  return scale;
}

VectorXd LawProblem::Solve(const MatrixXd& columns, const VectorXd& scale, const VectorXd& y,
                           double independent) {
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
  solver.setThreshold(independent);
  return solver.compute(columns * scale.cwiseInverse().asDiagonal()).solve(y).cwiseQuotient(scale);
}

double LawProblem::Fit(const Steps& steps, int iterations, std::vector<LawTerm>* faults) const {
  const VectorXd y = GetDifferences(steps);
  VectorXd changes = CalcChanges(*faults, steps), left = y - changes;
  constexpr double kEnough = 1e-3;  // of less than that nothing is left to gain
  for (int k = 0; k < iterations && left.squaredNorm() > kEnough * static_cast<double>(y.size()); ++k) {
    const MatrixXd slopes = CalcSlopes(*faults, steps, changes);
    if (slopes.cols() == 0) break;
    VectorXd scale(slopes.cols());
    Index first = 0;
    for (const LawTerm& fault : *faults) {
      const Index numbers = fault.CountNumbers();
      scale.segment(first, numbers) = CalcScale(fault, slopes.middleCols(first, numbers));
      first += numbers;
    }
    constexpr double kIndependent = 1e-10;  // less is rounding
    VectorXd step = Solve(slopes, scale, left, kIndependent);
    bool is_better = false;
    constexpr int kHalvings = 4;
    for (int half = 0; half < kHalvings && !is_better; ++half, step *= 0.5) {
      std::vector<LawTerm> moved = *faults;
      Index at = 0;
      for (LawTerm& fault : moved) {
        const Index numbers = fault.CountNumbers();
        fault.sizes.head(numbers) += step.segment(at, numbers);
        at += numbers;
      }
      const VectorXd others = CalcChanges(moved, steps);
      if (!((y - others).squaredNorm() < left.squaredNorm())) continue;
      is_better = true;
      *faults = std::move(moved);
      changes = others;
      left = y - changes;
    }
    if (!is_better) break;
  }
  return left.squaredNorm() / static_cast<double>(y.size());
}

}  // namespace dexcheck
