#include "harness/study/objective.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "controller/common/expression.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

SymbolTable MakeSymbols(const TrialResult& result) {
  SymbolTable symbols;
  for (size_t i = 0; i < kMetrics.size(); ++i) symbols[kMetrics[i].name] = result.metrics[i];
  return symbols;
}

Outcome ParseOutcome(const std::string& name) {
  if (const auto outcome = FindOutcome(name)) return *outcome;
  std::vector<std::string> known;
  for (const OutcomeInfo& outcome : kOutcomes) known.emplace_back(outcome.name);
  throw std::invalid_argument("no outcome is called " + Quote(name) + SuggestNearest(name, known));
}

/// Violation of trials that were not held, the earlier the larger: from 1 to 2.
double CalcEarliness(const TrialResult& result) {
  const double time = result.metrics[kSimulatedTime];
  return 1.0 + 1.0 / (1.0 + (std::isfinite(time) ? std::max(time, 0.0) : 0.0));
}

double Combine(const Objective& objective, std::vector<double> values) {
  std::ranges::sort(values);
  switch (objective.aggregate) {
    case Aggregate::kWorst:
      return values.back();
    case Aggregate::kQuantile: {
      // The least value that at least this fraction of the trials does not exceed.
      const double rank = std::ceil(objective.quantile * static_cast<double>(values.size()));
      return values[static_cast<size_t>(std::max(rank, 1.0)) - 1];
    }
    case Aggregate::kMean:
      break;
  }
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

}  // namespace

std::string Describe(const Objective& objective) {
  const std::string which = objective.aggregate == Aggregate::kMean ? ""
                            : objective.aggregate == Aggregate::kWorst
                                ? ", worst of its trials"
                                : ", quantile " + FormatNumber(objective.quantile) + " of its trials";
  return objective.expression + which;
}

std::string ShowUnit(const std::string& expression) {
  const std::optional<Metric> metric = FindMetric(expression);
  const std::string unit = metric ? kMetrics[*metric].unit : "1";
  return unit == "1" ? "" : " " + unit;
}

Constraint ParseConstraint(const std::string& text) {
  Constraint constraint;
  constraint.text = std::string(Trim(text));
  if (constraint.text == "held") return constraint;
  // Longer signs first, so that "<=" is not taken for "<".
  for (const char* sign : {"<=", ">=", "==", "!=", "<", ">"}) {
    const size_t at = constraint.text.find(sign);
    if (at == std::string::npos) continue;
    const std::string left(Trim(std::string_view(constraint.text).substr(0, at)));
    const std::string right(
        Trim(std::string_view(constraint.text).substr(at + std::string_view(sign).size())));
    const bool equal = sign[0] == '=';
    if (equal || sign[0] == '!') {
      constraint.kind = equal ? Constraint::Kind::kOutcomeIs : Constraint::Kind::kOutcomeIsNot;
      if (left == "outcome") {
        constraint.outcome = ParseOutcome(right);
      } else if (left != "verdict" || right != "pass") {
        throw std::invalid_argument(Quote(sign) +
                                    " compares \"outcome\" with its name, or \"verdict\" with \"pass\"");
      }
      return constraint;
    }
    constraint.kind = Constraint::Kind::kLess;
    constraint.less = sign[0] == '<' ? left : right;
    constraint.more = sign[0] == '<' ? right : left;
    RequireMetricExpression(constraint.less);
    RequireMetricExpression(constraint.more);
    return constraint;
  }
  throw std::invalid_argument(
      "must be a comparison, such as \"peak_effort < 0.8\" or \"outcome == tracked\", or \"held\"");
}

void RequireMetricExpression(const std::string& expression) {
  TrialResult ones;
  ones.metrics.fill(1.0);
  EvaluateExpression(expression, MakeSymbols(ones));
}

double EvaluateMetrics(const std::string& expression, const TrialResult& result) {
  if (const auto metric = FindMetric(expression)) return result.metrics[*metric];  // as most are
  return EvaluateExpression(expression, MakeSymbols(result));
}

double CalcViolation(const Constraint& constraint, const TrialResult& result) {
  if (!IsHeld(result.outcome)) return CalcEarliness(result);
  switch (constraint.kind) {
    case Constraint::Kind::kHeld:
      return 0.0;
    case Constraint::Kind::kOutcomeIs:
      return result.outcome == constraint.outcome ? 0.0 : 1.0;
    case Constraint::Kind::kOutcomeIsNot:
      return result.outcome != constraint.outcome ? 0.0 : 1.0;
    case Constraint::Kind::kLess:
      break;
  }
  const double less = EvaluateMetrics(constraint.less, result);
  const double more = EvaluateMetrics(constraint.more, result);
  if (less <= more) return 0.0;
  if (!std::isfinite(less) || !std::isfinite(more)) return 1.0;
  return std::min((less - more) / std::max(std::abs(less), std::abs(more)), 1.0);
}

Judgement JudgePoint(const std::vector<Objective>& objectives, const std::vector<Constraint>& constraints,
                     std::span<const TrialResult> results) {
  const auto count = static_cast<double>(results.size());
  Judgement judgement;
  std::vector<Constraint> all = constraints;
  if (std::ranges::none_of(all, [](const Constraint& c) { return c.kind == Constraint::Kind::kHeld; })) {
    all.emplace_back();
  }
  for (const Constraint& constraint : all) {
    double sum = 0.0;
    long good = 0;
    for (const TrialResult& result : results) {
      const double violation = CalcViolation(constraint, result);
      if (violation > 0.0)
        sum += violation;
      else
        ++good;
    }
    constexpr double kRounding = 1e-9;  // of fraction * count, which is whole where a user means it to be
    if (static_cast<double>(good) < constraint.fraction * count - kRounding)
      judgement.violation += sum / count;
  }
  for (const Objective& objective : objectives) {
    std::vector<double> values;
    for (const TrialResult& result : results) {
      const double value =
          IsHeld(result.outcome) ? EvaluateMetrics(objective.expression, result) : std::nan("");
      const double signed_value = objective.maximize ? -value : value;
      values.push_back(std::isnan(signed_value) ? kInfinite : signed_value);
    }
    judgement.objectives.push_back(Combine(objective, values));
    // A value that does not exist is as bad as a constraint that does not hold.
    if (!std::isfinite(judgement.objectives.back()) && judgement.is_feasible()) judgement.violation = 1.0;
  }
  return judgement;
}

bool IsBetter(const Judgement& a, const Judgement& b) {
  if (a.violation != b.violation) return a.violation < b.violation;
  return !a.objectives.empty() && a.is_feasible() && a.objectives.front() < b.objectives.front();
}

bool Dominates(const Judgement& a, const Judgement& b) {
  if (!a.is_feasible()) return false;
  if (!b.is_feasible()) return true;
  bool better = false;
  for (size_t i = 0; i < a.objectives.size(); ++i) {
    if (a.objectives[i] > b.objectives[i]) return false;
    better = better || a.objectives[i] < b.objectives[i];
  }
  return better;
}

}  // namespace dexcheck
