#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/common/text.h"
#include "controller/dynamics/tree_factor.h"
#include "harness/checks/check_table.h"
#include "harness/diagnosis/law_entries.h"
#include "harness/diagnosis/line_search.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

using Eigen::Index;

// Summands agree with what a wrong law has of them to this fraction: it is computed from the same numbers.
constexpr double kLawAccuracy = 1e-9;
// A residual of this many times the noise is explained all the same.
constexpr double kMostLeft = 3.0;
constexpr double kPlausible = 300.0;  // of factors, which are units mistaken at the most
constexpr double kMostTurned = 3.0;   // of factors of the other sign
constexpr double kWhole = 1e-3;       // that the amplitude of what is there as a whole may be off
constexpr double kZero = 1e-6;        // a factor nearer to zero than this is one of a part that is missing

/// A sum of which all but one summand vanish, and friction that the law has anyway, are no candidates besides
/// those. @param parts of each candidate, bits by summand; 0 for what is added.
void DropRepeated(std::vector<unsigned>* parts_of, std::vector<Candidate>* candidates) {
  std::vector<unsigned>& parts = *parts_of;
  const auto repeats = [&](size_t i, size_t of) {
    const Candidate &a = (*candidates)[of], &b = (*candidates)[i];
    const bool is_sum = parts[of] != 0 && (parts[i] & parts[of]) == parts[of];
    const bool is_friction =
        b.fault.ends_with("viscous friction") && a.fault.starts_with("compensation of friction");
    if (a.place != b.place || !(is_sum || is_friction)) return false;
    constexpr double kSame = 1e-10;
    const double product = a.columns.col(0).dot(b.columns.col(0));
    return product * product > (1.0 - kSame) * a.columns.squaredNorm() * b.columns.squaredNorm();
  };
  std::vector<size_t> kept;
  for (size_t i = 0; i < candidates->size(); ++i) {
    if (!((*candidates)[i].columns.squaredNorm() > 0.0)) continue;
    if (std::none_of(kept.begin(), kept.end(), [&](size_t of) { return repeats(i, of); })) kept.push_back(i);
  }
  for (size_t k = 0; k < kept.size(); ++k) {
    if (kept[k] == k) continue;
    (*candidates)[k] = std::move((*candidates)[kept[k]]);
    parts[k] = parts[kept[k]];
  }
  candidates->resize(kept.size());
  parts.resize(kept.size());
}

/// Factors of parts of the law, of which several may act on one torque: all torques' and one joint's, that of
/// a sum and that of one of its summands.
class LawFactors {
 public:
  LawFactors(std::span<const LawPartName> names, const std::vector<unsigned>& parts,
             std::span<const Candidate> candidates)
      : names_(names), parts_(parts), candidates_(candidates) {}

  /// A factor that several have in common is no alternative to one of them.
  void DropAlternatives(CauseSelection* selection) const {
    const auto is_friction = [&](size_t one, bool is_part) {
      return (parts_[one] != 0) == is_part && candidates_[one].fault.find("friction") != std::string::npos;
    };
    for (CauseTerm& term : selection->terms) {
      // The friction that the law has, more or less of it, is no other friction.
      for (auto& [same, amplitude] : term.same) {
        if (!is_friction(term.candidate, /*is_part=*/false) || !is_friction(same, /*is_part=*/true)) continue;
        term.error *= std::abs(amplitude[0] / term.amplitude[0]);
        std::swap(term.candidate, same);
        std::swap(term.amplitude, amplitude);
      }
      std::erase_if(term.same, [&](const auto& same) {
        if (is_friction(term.candidate, /*is_part=*/true) && is_friction(same.first, /*is_part=*/false))
          return true;
        return std::ranges::any_of(selection->terms, [&](const CauseTerm& other) {
          return &other != &term &&
                 (Holds(other.candidate, same.first) || Holds(same.first, other.candidate));
        });
      });
    }
  }

  /// The candidate's whole factor, and what it is of: what others of the selection have of it apart is
  /// theirs.
  void MakeWhole(const Candidate& one, const CauseSelection& selection, Fault* fault) const {
    const auto index = static_cast<size_t>(&one - candidates_.data());
    unsigned rest = parts_[index];
    std::string joints;
    for (const CauseTerm& term : selection.terms) {
      const size_t other = term.candidate;
      if (other == index) continue;
      if (Holds(other, index)) fault->value += term.amplitude[0];
      if (!Holds(index, other)) continue;
      const Candidate& apart = candidates_[other];
      if (apart.place == one.place) {
        rest &= ~parts_[other];
      } else if (parts_[other] == parts_[index]) {
        joints += (joints.empty() ? "" : ", ") + apart.place.substr(kOf.size());
      } else {
        fault->detail += (fault->detail.empty() ? "but for " : ", ") + apart.place + ": " + apart.fault;
      }
    }
    if (!joints.empty()) fault->place += " of all but " + joints;
    const auto name = std::ranges::find(names_, rest, &LawPartName::parts);
    if (rest != parts_[index] && name != names_.end()) fault->fault = NameFactor(*name);
    if (std::abs(fault->value) < kZero) fault->value = 0.0;
  }

  static std::string NameFactor(const LawPartName& name) {
    return std::string(name.name) + " (" + name.symbol + "), factor";
  }

 private:
  static constexpr std::string_view kAll = "law", kOf = "law of ";
  /// Whether one factor acts on all that the other one acts on.
  [[nodiscard]] bool Holds(size_t one, size_t other) const {
    const bool is_there =
        candidates_[one].place == candidates_[other].place || candidates_[one].place == kAll;
    return one != other && is_there && parts_[other] != 0 && (parts_[other] & parts_[one]) == parts_[other];
  }

  std::span<const LawPartName> names_;
  const std::vector<unsigned>& parts_;
  std::span<const Candidate> candidates_;
};

/// Steps at which the torques were not the law's, and what the explanation of their difference needs.
class LawProblem {
 public:
  explicit LawProblem(const StepStore& store) : model_(store.setup().model()), actuation_(model_) {
    ChooseSteps(store.law()->history().snapshots());
    for (const LawSnapshot* const step : steps_) factors_.emplace_back(model_).Compute(step->inputs.M);
    y_.resize(model_.num_velocities() * count());
    const auto differences = CalcForces([](const LawSnapshot& step) -> MatrixXd { return step.difference; });
    y_ = CalcColumns(1, differences);
    // Numbers that files print with few digits make a difference of their own beside a larger one.
    const double tolerated = CalcBound(*FindCheck("law_torque"), store.setup().scenario()) / kLawTorqueBound;
    const auto by_step = y_.reshaped(model_.num_velocities(), count()).colwise().norm();
    constexpr double kMuch = 10.0;
    if (!(by_step.maxCoeff() > kMuch * tolerated * std::sqrt(static_cast<double>(model_.num_velocities()))))
      return;
    noise_ = tolerated;
    y_ = CalcColumns(1, differences);
  }

  [[nodiscard]] const std::vector<const LawSnapshot*>& steps() const { return steps_; }
  [[nodiscard]] Index count() const { return static_cast<Index>(steps_.size()); }
  /// Differences at all steps. An explanation is fitted to the first rows and has to hold in the others.
  [[nodiscard]] const VectorXd& y() const { return y_; }
  [[nodiscard]] Index rows() const { return model_.num_velocities() * fitted_; }

  /// A force at each step (n x p).
  template <typename Force>
  [[nodiscard]] std::vector<MatrixXd> CalcForces(const Force& force) const {
    std::vector<MatrixXd> forces;
    for (const LawSnapshot* const step : steps_) forces.push_back(force(*step));
    return forces;
  }

  /// Whitened columns of all steps (n count x p). @param forces of each step (n x p).
  [[nodiscard]] MatrixXd CalcColumns(Index p, const std::vector<MatrixXd>& forces) const {
    const Index n = model_.num_velocities();
    MatrixXd columns(n * count(), p);
    for (Index k = 0; k < count(); ++k) {
      const auto step = static_cast<size_t>(k);
      for (Index i = 0; i < p; ++i) {
        VectorXd column = forces[step].col(i);
        factors_[step].SolveTransposed(column);
        // The bound is one of the norm.
        columns.col(i).segment(k * n, n) =
            column * (std::sqrt(static_cast<double>(n)) / (noise_ * steps_[step]->noise));
      }
    }
    return columns;
  }

  [[nodiscard]] const ActuationMap& actuation() const { return actuation_; }

 private:
  /// The first steps, and others evenly; those with a past, if there are any. Of these every third is set
  /// aside.
  void ChooseSteps(const std::vector<LawSnapshot>& all) {
    constexpr size_t kMost = 32, kFirst = 12, kPast = 16, kAside = 3;
    std::vector<const LawSnapshot*> usable;
    for (const LawSnapshot& step : all)
      if (step.before.size() >= kPast) usable.push_back(&step);
    if (usable.empty())
      for (const LawSnapshot& step : all) usable.push_back(&step);
    for (size_t i = 0; i < std::min(kFirst, usable.size()); ++i) steps_.push_back(usable[i]);
    const size_t rest = usable.size() - steps_.size(), more = std::min(rest, kMost - kFirst);
    for (size_t i = 1; i <= more; ++i) steps_.push_back(usable[kFirst - 1 + rest * i / more]);
    std::vector<const LawSnapshot*> aside;
    for (size_t i = 0; i < steps_.size(); ++i)
      if (i % kAside == kAside - 1) aside.push_back(steps_[i]);
    std::erase_if(steps_,
                  [&](const LawSnapshot* step) { return std::ranges::find(aside, step) != aside.end(); });
    fitted_ = static_cast<Index>(steps_.size());
    steps_.insert(steps_.end(), aside.begin(), aside.end());
  }

  const RobotModel& model_;
  ActuationMap actuation_;
  std::vector<TreeFactor> factors_;        // by step
  std::vector<const LawSnapshot*> steps_;  // those that are fitted, then the others
  Index fitted_ = 0;
  double noise_ = 1.0;  // of the steps' noise
  VectorXd y_;
};

/// The candidates of a law, with the summands that each is a factor of.
class LawCandidates {
 public:
  LawCandidates(const StepStore& store, LawProblem* problem)
      : problem_(*problem), places_(ListLawPlaces(store.setup())) {
    JudgedLaw* const law = store.law();
    for (const LawEntry& entry : ListLawEntries(store.setup(), law)) Add(entry);
    std::vector<std::string> names;
    for (const SignalName& motor : store.motors())
      names.push_back("law of " + motor.place.substr(sizeof("motor ") - 1));
    for (const LawEntry& entry : ListTorqueEntries(store.setup().model(), names, problem_.steps()))
      Add(entry);
    for (const FittedLawEntry& entry : ListFittedLawEntries(store.setup(), law)) AddFitted(entry);
    DropRepeated(&parts_, &candidates_);
  }

  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }
  /// Takes the rows that are not fitted out of the columns. @return them, by candidate.
  std::vector<MatrixXd> SetAside() {
    std::vector<MatrixXd> rows;
    const Index fitted = problem_.rows();
    for (Candidate& one : candidates_) {
      rows.emplace_back(one.columns.bottomRows(one.columns.rows() - fitted));
      one.columns.conservativeResize(fitted, Eigen::NoChange);
    }
    return rows;
  }
  [[nodiscard]] const std::vector<unsigned>& parts() const { return parts_; }

 private:
  Candidate& Add(const std::string& fault, const std::string& place, unsigned parts, MatrixXd columns) {
    parts_.push_back(parts);
    candidates_.push_back({.fault = fault, .place = place, .columns = std::move(columns)});
    return candidates_.back();
  }

  void Add(const LawEntry& entry) {
    const std::vector<MatrixXd> forces = problem_.CalcForces(entry.force);
    const Index p = forces.front().cols();
    if (2 * p > problem_.rows()) return;  // it would explain anything
    if (!entry.at_places) {
      Limit(entry, &Add(entry.fault, entry.place, entry.parts, problem_.CalcColumns(p, forces)));
      return;
    }
    for (const LawPlace& place : places_) {
      std::vector<MatrixXd> own;
      own.reserve(forces.size());
      for (const MatrixXd& force : forces) own.emplace_back(KeepAt(problem_.actuation(), place, force));
      Limit(entry, &Add(entry.fault, place.name, entry.parts, problem_.CalcColumns(1, own)));
    }
  }

  /// Says what the amplitude can be.
  static void Limit(const LawEntry& entry, Candidate* one) {
    one->unit = entry.unit;
    one->nominal = entry.nominal;
    if (entry.is_whole) {
      one->is_possible = [](const VectorXd& a) { return std::abs(a[0] - 1.0) < kWhole; };
    } else if (entry.is_positive) {
      one->is_possible = [](const VectorXd& a) { return a[0] >= 0.0; };
    } else if (entry.nominal == 1.0 && entry.unit.empty()) {
      one->scale = VectorXd::Constant(1, kPlausible);
      one->is_possible = [](const VectorXd& a) {
        return std::abs(a[0]) < kPlausible && 1.0 + a[0] > -kMostTurned;
      };
    }
  }

  /// Adds the fault with the number that leaves least in the fitted rows.
  void AddFitted(const FittedLawEntry& entry) {
    const auto column = [&](double number) -> VectorXd {
      return problem_.CalcColumns(1, problem_.CalcForces([&](const LawSnapshot& step) -> MatrixXd {
        return entry.force(step, number);
      }));
    };
    const Index rows = problem_.rows();
    const VectorXd y = problem_.y().head(rows);
    const auto fitted = [&](double number) -> VectorXd { return column(number).head(rows); };
    const auto amplitude = [&](const VectorXd& c) {
      return entry.is_whole || c.squaredNorm() == 0.0 ? 1.0 : c.dot(y) / c.squaredNorm();
    };
    const auto left = [&](double log_number) {
      const VectorXd c = fitted(std::exp(log_number));
      return (y - amplitude(c) * c).squaredNorm();
    };
    constexpr int kGrid = 24;
    constexpr double kExplains = 0.5;  // of the difference
    const double low = std::log(entry.least), high = std::log(entry.most), whole = y.squaredNorm();
    const double best = FindMost([&](double log_number) { return -left(log_number); }, low, high,
                                 (high - low) / kGrid, -whole);
    if (left(best) > kExplains * whole) return;
    // The sum of squares knows the number to half its digits alone: the rest by Gauss and Newton.
    double number = std::clamp(std::exp(best), entry.least, entry.most);
    constexpr int kIterations = 4;
    constexpr double kChange = 1e-6;
    for (int k = 0; k < kIterations; ++k) {
      const VectorXd c = fitted(number);
      const double size = amplitude(c), change = kChange * number;
      MatrixXd slopes(y.size(), 2);
      slopes << (fitted(number + change) - fitted(number - change)) * (size / (2.0 * change)), c;
      const Index free = entry.is_whole ? 1 : 2;
      const VectorXd step = slopes.leftCols(free).colPivHouseholderQr().solve(y - size * c);
      number = std::clamp(number + step[0], entry.least, entry.most);
    }
    Candidate& one =
        Add(entry.fault + " " + FormatNumber(number, 6) + (entry.unit.empty() ? "" : " " + entry.unit), "law",
            0, column(number));
    one.parameters = 1;
    if (entry.is_whole)
      one.is_possible = [](const VectorXd& size) { return std::abs(size[0] - 1.0) < kWhole; };
  }

  LawProblem& problem_;
  std::vector<LawPlace> places_;
  std::vector<Candidate> candidates_;
  std::vector<unsigned> parts_;
};

/// A fault of several numbers without a unit has no size, and neither has one that is there as a whole.
Fault DescribeLaw(const Candidate& one, const VectorXd& amplitude, const VectorXd& error) {
  const bool is_whole = one.is_possible && !one.is_possible(VectorXd::Constant(1, 2.0));
  Fault fault = DescribeNumber(one, amplitude, error);
  if (one.unit.empty() && (amplitude.size() > 1 || is_whole)) fault.value = kNaN;
  if (is_whole) fault.error = 0.0;
  return fault;
}

}  // namespace

Causes ExplainLaw(const StepStore& store) {
  Causes causes;
  if (store.size() == 0 || store.law() == nullptr || store.law()->history().snapshots().empty())
    return causes;
  const auto differs = store.Get(StepStore::kLawDiffers);
  std::vector<Index> steps;
  for (Index i = 0; i < store.size(); ++i)
    if (differs(0, i) > 0.0) steps.push_back(i);
  if (steps.empty()) return causes;

  LawProblem problem(store);
  LawCandidates all(store, &problem);
  const std::vector<MatrixXd> others = all.SetAside();
  const std::vector<Candidate>& candidates = all.candidates();
  const VectorXd y = problem.y().head(problem.rows());
  const double floor = 1.0 + kLawAccuracy * kLawAccuracy * y.squaredNorm() / static_cast<double>(y.size());
  CauseSelection selection = SelectCauses(y, candidates, {.most_terms = 4, .restarts = 0, .floor = floor});
  VectorXd left = problem.y().tail(problem.y().size() - y.size());
  for (const CauseTerm& term : selection.terms) left -= others[term.candidate] * term.amplitude;
  const double most = kMostLeft * std::sqrt(floor);
  // An explanation with as many numbers as there are rows explains anything.
  constexpr Index kRowsPerNumber = 3;
  Index numbers = 0;
  for (const CauseTerm& term : selection.terms)
    numbers += term.amplitude.size() + candidates[term.candidate].parameters;
  const bool is_sure = numbers == 1 || kRowsPerNumber * numbers <= problem.rows();
  const bool holds = is_sure && left.squaredNorm() <= most * most * static_cast<double>(left.size());
  const LawFactors factors(store.law()->ListParts(), all.parts(), candidates);
  factors.DropAlternatives(&selection);
  causes = DescribeSelection(StartExplanation(store, CauseChannel::kLaw, steps), selection, candidates,
                             [&](const Candidate& one, const VectorXd& amplitude, const VectorXd& error) {
                               Fault fault = DescribeLaw(one, amplitude, error);
                               if (one.nominal == 1.0 && one.unit.empty())
                                 factors.MakeWhole(one, selection, &fault);
                               return fault;
                             });
  if (selection.left <= most && holds) return causes;
  // The nearest stands for all.
  causes.resize(1, StartExplanation(store, CauseChannel::kLaw, steps));
  causes.front().outcome = CauseOutcome::kNotExplained;
  causes.front().faults.resize(std::min<size_t>(causes.front().faults.size(), 1));
  causes.front().rival.clear();
  causes.front().fraction = selection.fraction;
  causes.front().left = selection.left;
  return causes;
}

}  // namespace dexcheck
