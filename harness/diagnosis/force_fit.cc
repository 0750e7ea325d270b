#include <algorithm>
#include <cmath>

#include "controller/common/linear_algebra.h"
#include "harness/diagnosis/cause_estimator.h"
#include "harness/diagnosis/repair_trial.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;
using Numbers = std::vector<Parameter>;

// Residuals are relative to their own sizes. Rounding leaves some 1e-12 of a finger's forces.
constexpr double kForceRounding = 1e-10;

/// For the difference quotient: any of what the forces are linear in, small for centres of mass.
double CalcStep(const RobotSpec& spec, const Parameter& number) {
  constexpr double kLinear = 1e-3;
  constexpr double kQuadratic = 1e-6;  // m
  if (number.kind == Kind::kCom) return kQuadratic;
  const double trace = number.kind == Kind::kInertia ? BodyOf(spec, number.index).inertia.trace() : 0.0;
  return kLinear * (trace > 0.0 ? trace : GetScale(spec, number));
}

class ForceFit {
 public:
  explicit ForceFit(const RepairTrial& trial)
      : trial_(trial), evidence_(trial.evidence()), start_{{}, trial.written(), CalcResidual(trial.model())} {
    for (const Parameter& number : ListParameters(spec())) {
      const bool needs_mass = number.kind == Kind::kCom || number.kind == Kind::kInertia;
      if (IsDynamic(number.kind) && (!needs_mass || BodyOf(spec(), number.index).mass > 0.0))
        candidates_.push_back(number);
    }
  }

  [[nodiscard]] std::vector<Repair> Run() const {
    if (IsSolved(start_)) return {};
    std::vector<Repair> whole;
    const auto add_solved = [&](const Solution& solution) {
      if (IsSolved(solution) && !solution.numbers.empty()) whole.push_back(ToCause(solution));
    };
    for (const Parameter& number : ListLikeliest()) add_solved(Solve({number}));
    if (whole.empty()) add_solved(Select());
    if (whole.empty()) return {};
    std::stable_sort(whole.begin(), whole.end(),
                     [&](const Repair& a, const Repair& b) { return IsLikelier(a, b, spec()); });
    std::vector<Repair> causes = SplitByVector(whole.front());
    MergeScaledBodies(spec(), evidence_.Widen(1e-8), &causes);
    if (causes.size() == 1) causes.front().equivalents.assign(whole.begin() + 1, whole.end());
    return causes;
  }

 private:
  /// The file when only these numbers change.
  struct Solution {
    Numbers numbers;
    RobotSpec repaired;
    VectorXd residual;
  };
  [[nodiscard]] const RobotSpec& spec() const { return trial_.written(); }
  [[nodiscard]] VectorXd CalcResidual(const RobotModel& model) const {
    return evidence_.CalcForceResidual(model);
  }
  [[nodiscard]] bool IsSolved(const Solution& solution) const {
    return solution.residual.cwiseAbs().maxCoeff() <= evidence_.Widen(kForceRounding);
  }

  /// What each number does to the forces, by its scale.
  [[nodiscard]] MatrixXd CalcColumns(const Solution& at, const Numbers& numbers) const {
    MatrixXd columns = MatrixXd::Zero(at.residual.size(), static_cast<Eigen::Index>(numbers.size()));
    const auto make = [&](const RobotSpec& written) { return trial_.setup().TryModel(written); };
    for (size_t i = 0; i < numbers.size(); ++i) {
      double step = CalcStep(at.repaired, numbers[i]);
      if (const std::optional<RobotModel> there = TryChange(at.repaired, numbers[i], &step, make))
        columns.col(static_cast<Eigen::Index>(i)) =
            (at.residual - CalcResidual(*there)) * (GetScale(spec(), numbers[i]) / step);
    }
    return columns;
  }

  /// Numbers that explain most by themselves.
  [[nodiscard]] Numbers ListLikeliest() const {
    constexpr size_t kLikeliest = 8;
    const MatrixXd columns = CalcColumns(start_, candidates_);
    std::vector<std::pair<double, Parameter>> gains;
    for (size_t i = 0; i < candidates_.size(); ++i) {
      const VectorXd column = columns.col(static_cast<Eigen::Index>(i));
      if (column.norm() > 0.0)
        gains.emplace_back(std::abs(column.dot(start_.residual)) / column.norm(), candidates_[i]);
    }
    std::stable_sort(gains.begin(), gains.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    Numbers likeliest;
    for (size_t i = 0; i < std::min(kLikeliest, gains.size()); ++i) likeliest.push_back(gains[i].second);
    return likeliest;
  }

  /// By Gauss-Newton steps; without numbers that stay as they were.
  [[nodiscard]] Solution Solve(const Numbers& numbers) const {
    constexpr int kMaxIterations = 8;
    constexpr double kConverged = 1e-13;
    constexpr double kNothing = 1e-9;  // what should be zero must not become a negative mass
    Solution solution = start_;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      const VectorXd step = SolveLeastSquares(CalcColumns(solution, numbers), solution.residual);
      RobotSpec next = solution.repaired;
      for (size_t i = 0; i < numbers.size(); ++i) {
        const double scale = GetScale(spec(), numbers[i]);
        const double value = GetValue(next, numbers[i]) + step[static_cast<Eigen::Index>(i)] * scale;
        SetValue(&next, numbers[i], std::abs(value) < kNothing * scale ? 0.0 : value);
      }
      const std::optional<RobotModel> model = trial_.setup().TryModel(next);
      if (!model) break;
      const VectorXd residual = CalcResidual(*model);
      if (!(residual.squaredNorm() <= solution.residual.squaredNorm())) break;
      solution = {{}, std::move(next), residual};
      if (step.cwiseAbs().maxCoeff() < kConverged) break;
    }
    const double few = evidence_.Widen(1e-9);
    for (const Parameter& number : numbers) {
      const double change = GetValue(solution.repaired, number) - GetValue(spec(), number);
      const double size = number.kind == Kind::kInertia ? BodyOf(spec(), number.index).inertia.trace()
                                                        : GetScale(spec(), number);
      if (std::abs(change) > few * size) solution.numbers.push_back(number);
    }
    return solution;
  }

  /// Numbers, vectors and tensors by the estimator, which is asked again where the columns are others.
  [[nodiscard]] Solution Select() const {
    constexpr int kRounds = 4;
    CauseOptions options;
    options.most_terms = 8;
    options.restarts = 0;
    Solution solution = start_;
    for (int round = 0; round < kRounds && !IsSolved(solution); ++round) {
      const MatrixXd columns = CalcColumns(solution, candidates_);
      std::vector<Candidate> candidates;
      std::vector<Numbers> sets;
      const auto add = [&](size_t begin, size_t end) {
        sets.emplace_back(candidates_.begin() + static_cast<std::ptrdiff_t>(begin),
                          candidates_.begin() + static_cast<std::ptrdiff_t>(end));
        candidates.emplace_back().columns =
            columns.middleCols(static_cast<Eigen::Index>(begin), static_cast<Eigen::Index>(end - begin));
      };
      for (size_t begin = 0, i = 0; i < candidates_.size(); ++i) {
        add(i, i + 1);
        const bool ends = i + 1 == candidates_.size() || !candidates_[i + 1].IsBeside(candidates_[i]);
        if (ends && begin < i) add(begin, i + 1);
        if (ends) begin = i + 1;
      }
      Numbers chosen = solution.numbers;
      const CauseSelection selection =
          SelectCauses(solution.residual / evidence_.Widen(kForceRounding), candidates, options);
      for (const CauseTerm& term : selection.terms) {
        for (const Parameter& number : sets[term.candidate]) {
          if (std::find(chosen.begin(), chosen.end(), number) == chosen.end()) chosen.push_back(number);
        }
      }
      if (chosen.size() == solution.numbers.size()) break;
      solution = Solve(chosen);
    }
    return solution;
  }

  [[nodiscard]] Repair ToCause(const Solution& solution) const {
    Repair cause;
    for (const Parameter& number : solution.numbers) {
      const double value = GetValue(solution.repaired, number);
      cause.Add(number, RoundWithin(spec(), number, value, evidence_.CalcSolvedDigits()));
    }
    return cause;
  }

  const RepairTrial& trial_;
  const EngineEvidence& evidence_;
  Solution start_;
  Numbers candidates_;
};

}  // namespace

std::vector<Repair> FitForces(const RepairTrial& trial) { return ForceFit(trial).Run(); }

}  // namespace dexcheck
