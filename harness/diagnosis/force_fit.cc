#include "harness/diagnosis/force_fit.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

// Residuals are relative to their own sizes. Rounding leaves some 1e-12 of a finger's forces.
constexpr double kRounding = 1e-10;

/// The robot with larger inertias, in which the forces are linear: one that is possible whichever number
/// changes.
RobotSpec Pad(RobotSpec spec) {
  constexpr double kSmall = 1e-4;  // m^2
  const auto pad = [](MassProperties* body) {
    const double trace = body->inertia.trace();
    body->inertia += (trace > 0.0 ? trace : kSmall * body->mass) * Matrix3d::Identity();
  };
  pad(&spec.base.body);
  for (Joint& joint : spec.joints) pad(&joint.body);
  return spec;
}

/// For the difference quotient: any of what the forces are linear in, small for centres of mass.
double CalcStep(const RobotSpec& spec, const Parameter& number) {
  constexpr double kLinear = 1e-3;
  constexpr double kQuadratic = 1e-6;  // m
  if (number.kind == Kind::kCom) return kQuadratic;
  if (number.kind == Kind::kInertia) return kLinear * BodyOf(spec, number.index).inertia.trace();
  return kLinear * GetScale(spec, number);
}

VectorXd GetScales(const RobotSpec& spec, const std::vector<Parameter>& numbers) {
  VectorXd scales(static_cast<Eigen::Index>(numbers.size()));
  for (size_t i = 0; i < numbers.size(); ++i)
    scales[static_cast<Eigen::Index>(i)] = GetScale(spec, numbers[i]);
  return scales;
}

}  // namespace

ForceFit::ForceFit(const RobotSpec& written, const FileTerms& terms, const EngineEvidence& evidence)
    : spec_(written), terms_(terms), evidence_(evidence) {
  residual_ = evidence.CalcForceResidual(RobotModel(terms.Read(written)));
  for (const Parameter& number : ListParameters(written)) {
    const bool needs_mass = number.kind == Kind::kCom || number.kind == Kind::kInertia;
    if (IsDynamic(number.kind) && (!needs_mass || BodyOf(written, number.index).mass > 0.0))
      candidates_.push_back(number);
  }
  if (!IsSolved(residual_)) columns_ = CalcColumns(written, candidates_);
}

bool ForceFit::IsSolved(const VectorXd& residual) const {
  return residual.cwiseAbs().maxCoeff() <= evidence_.Widen(kRounding);
}

MatrixXd ForceFit::CalcColumns(const RobotSpec& at, const Numbers& numbers) const {
  MatrixXd columns = MatrixXd::Zero(residual_.size(), static_cast<Eigen::Index>(numbers.size()));
  RobotSpec trial = Pad(at);
  const std::optional<RobotModel> here = TryModel(terms_.Read(trial));
  if (!here) return columns;
  const VectorXd forces = evidence_.CalcForces(*here);
  for (size_t i = 0; i < numbers.size(); ++i) {
    const double value = GetValue(trial, numbers[i]);
    const double step = CalcStep(trial, numbers[i]);
    SetValue(&trial, numbers[i], value + step);
    if (const std::optional<RobotModel> there = TryModel(terms_.Read(trial)))
      columns.col(static_cast<Eigen::Index>(i)) =
          (evidence_.CalcForces(*there) - forces) * (GetScale(spec_, numbers[i]) / step);
    SetValue(&trial, numbers[i], value);
  }
  return columns;
}

std::vector<std::pair<double, size_t>> ForceFit::SortByGain() const {
  std::vector<std::pair<double, size_t>> gains;
  for (Eigen::Index i = 0; i < columns_.cols(); ++i) {
    const double size = columns_.col(i).norm();
    if (size > 0.0)
      gains.emplace_back(std::abs(columns_.col(i).dot(residual_)) / size, static_cast<size_t>(i));
  }
  std::stable_sort(gains.begin(), gains.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  return gains;
}

std::vector<std::pair<Repair, double>> ForceFit::Rank() const {
  constexpr size_t kRanked = 5;
  std::vector<std::pair<Repair, double>> ranking;
  for (const auto& [gain, candidate] : SortByGain()) {
    if (!(gain > 0.0) || ranking.size() == kRanked) break;
    Repair cause;
    cause.Add(candidates_[candidate], GetValue(spec_, candidates_[candidate]));
    ranking.emplace_back(cause, gain * gain / residual_.squaredNorm());
  }
  return ranking;
}

ForceFit::Solution ForceFit::Solve(const Numbers& numbers) const {
  constexpr int kMaxIterations = 8;
  constexpr double kConverged = 1e-13;
  constexpr double kNothing = 1e-9;  // what should be zero must not become a negative mass
  const VectorXd scales = GetScales(spec_, numbers);
  Solution solution{numbers, spec_, residual_};
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const VectorXd step =
        CalcColumns(solution.repaired, numbers).completeOrthogonalDecomposition().solve(solution.residual);
    RobotSpec next = solution.repaired;
    for (size_t i = 0; i < numbers.size(); ++i) {
      const double scale = scales[static_cast<Eigen::Index>(i)];
      const double value = GetValue(next, numbers[i]) + step[static_cast<Eigen::Index>(i)] * scale;
      SetValue(&next, numbers[i], std::abs(value) < kNothing * scale ? 0.0 : value);
    }
    const std::optional<RobotModel> model = TryModel(terms_.Read(next));
    if (!model) break;
    const VectorXd residual = evidence_.CalcForceResidual(*model);
    if (!(residual.squaredNorm() <= solution.residual.squaredNorm())) break;
    solution.repaired = std::move(next);
    solution.residual = residual;
    if (step.cwiseAbs().maxCoeff() < kConverged) break;
  }
  // Numbers that stay as they were.
  const double few = evidence_.Widen(1e-9);
  std::erase_if(solution.numbers, [&](const Parameter& number) {
    const double change = GetValue(solution.repaired, number) - GetValue(spec_, number);
    const double size =
        number.kind == Kind::kInertia ? BodyOf(spec_, number.index).inertia.trace() : GetScale(spec_, number);
    return std::abs(change) <= few * size;
  });
  return solution;
}

std::vector<ForceFit::Solution> ForceFit::SolveSingly() const {
  constexpr size_t kTried = 8;
  std::vector<Solution> solved;
  const std::vector<std::pair<double, size_t>> gains = SortByGain();
  for (size_t i = 0; i < std::min(kTried, gains.size()); ++i) {
    Solution solution = Solve({candidates_[gains[i].second]});
    if (IsSolved(solution.residual) && !solution.numbers.empty()) solved.push_back(std::move(solution));
  }
  return solved;
}

/// Numbers, vectors and tensors by the estimator, which is asked again where the columns are others.
ForceFit::Solution ForceFit::Select() const {
  constexpr int kRounds = 4;
  CauseOptions options;
  options.most_terms = 8;
  options.restarts = 0;
  Solution solution{{}, spec_, residual_};
  for (int round = 0; round < kRounds && !IsSolved(solution.residual); ++round) {
    const MatrixXd columns = round == 0 ? columns_ : CalcColumns(solution.repaired, candidates_);
    std::vector<Candidate> candidates;
    std::vector<Numbers> numbers;
    for (size_t i = 0; i < candidates_.size();) {
      Numbers whole;
      const size_t first = i;
      for (; i < candidates_.size() && candidates_[i].IsBeside(candidates_[first]); ++i) {
        whole.push_back(candidates_[i]);
        candidates.emplace_back().columns = columns.col(static_cast<Eigen::Index>(i));
        numbers.push_back({candidates_[i]});
      }
      if (whole.size() == 1) continue;
      candidates.emplace_back().columns =
          columns.middleCols(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(whole.size()));
      numbers.push_back(whole);
    }
    const CauseSelection selection =
        SelectCauses(solution.residual / evidence_.Widen(kRounding), candidates, options);
    Numbers chosen = solution.numbers;
    for (const CauseTerm& term : selection.terms) {
      for (const Parameter& number : numbers[term.candidate]) {
        if (std::find(chosen.begin(), chosen.end(), number) == chosen.end()) chosen.push_back(number);
      }
    }
    if (chosen.size() == solution.numbers.size()) break;
    solution = Solve(chosen);
  }
  return solution;
}

Repair ForceFit::ToCause(const Solution& solution) const {
  Repair cause;
  for (const Parameter& number : solution.numbers)
    cause.Add(number,
              RoundWithin(spec_, number, GetValue(solution.repaired, number), evidence_.CalcSolvedDigits()));
  return cause;
}

std::vector<Repair> ForceFit::Run() const {
  if (columns_.size() == 0) return {};
  std::vector<Repair> whole;
  for (const Solution& solution : SolveSingly()) whole.push_back(ToCause(solution));
  if (whole.empty()) {
    const Solution solution = Select();
    if (!IsSolved(solution.residual) || solution.numbers.empty()) return {};
    whole.push_back(ToCause(solution));
  }
  std::stable_sort(whole.begin(), whole.end(),
                   [&](const Repair& a, const Repair& b) { return IsLikelier(a, b, spec_); });
  std::vector<Repair> causes = SplitByVector(whole.front());
  MergeScaledBodies(spec_, evidence_.Widen(1e-8), &causes);
  if (causes.size() == 1) causes.front().equivalents.assign(whole.begin() + 1, whole.end());
  return causes;
}

}  // namespace dexcheck
