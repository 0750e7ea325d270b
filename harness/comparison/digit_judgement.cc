#include "harness/comparison/digit_judgement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <tuple>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/comparison/constant_checks.h"
#include "harness/comparison/description_match.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {
namespace {

constexpr int kDraws = 24;
constexpr size_t kLeastDraws = 4;
constexpr long kStates = 20;
// Bodies are causes, too, and are judged in their links' frames (CompareBodies).
constexpr Term kCauses[] = {Term::kJointAxis, Term::kFramePose};
// The engine finds the principal moments of a tensor to this fraction of the largest.
constexpr double kDiagonalisation = 1e-6;

bool IsCause(Term term) { return Contains(kCauses, term); }

/// Check, kind of part, name and index of the number that a constant check compares.
using ConstantKey = std::tuple<std::string, Location::Kind, std::string, int>;

ConstantKey KeyOf(const ConstantFinding& finding, const RobotSpec& spec) {
  const int first = finding.location.first;
  const bool is_of_base = first < 0 || first >= static_cast<int>(spec.joints.size());
  return {finding.check, finding.location.kind,
          is_of_base ? "" : spec.joints[static_cast<size_t>(first)].name, finding.entry};
}

/// Lists the constants and bodies in which two descriptions differ.
std::vector<ConstantFinding> ListDifferentNumbers(const RobotDescription& a, const RobotDescription& b) {
  std::vector<ConstantFinding> findings = CheckConstants(a, b).findings;
  Append(CompareBodies(a, b).findings, &findings);
  return findings;
}

using Sides = std::array<RobotDescription, 2>;

/// One file with moved numbers: a provider for each draw, and the changes of its constants.
class MovedFile {
 public:
  MovedFile(const PrintedSpread& own, const RobotDescription& other, size_t side,
            const std::vector<std::string>& ignore, const RobotPart& part, const RobotModel& model)
      : side_(side), other_(other), ignore_(ignore), part_(part), model_(model) {
    nominal_ = Complete(own.nominal);
    spread_.nominal = MakeCopy(nominal_);
    const BodyDifferences placed = ComparePlaced(nominal_);
    for (const RobotDescription& draw : own.draws) {
      const Sides moved = Complete(draw);
      try {
        spread_.draws.push_back(MakeCopy(moved));
      } catch (const InputError&) {
        continue;  // a moved tensor of few digits has negative moments
      }
      for (const ConstantFinding& finding : ListDifferentNumbers(nominal_[side_], moved[side_])) {
        double& open = constants_[KeyOf(finding, nominal_[side_].spec)];
        open = Worst(open, std::abs(finding.model - finding.engine));
      }
      RaisePlaced(moved, placed);
    }
    if (own.undiagonalized) TakeDiagonalisation(*own.undiagonalized, placed);
  }

  [[nodiscard]] const TermComparison::Spread& spread() const { return spread_; }
  [[nodiscard]] const Sides& nominal() const { return nominal_; }
  /// @param is_placed whether both files' bodies stand in the link frames of the first.
  [[nodiscard]] double FindOpen(const ConstantKey& key, bool is_placed) const {
    const BodyDifferences& open = is_placed ? placed_ : constants_;
    const auto found = open.find(key);
    return found == open.end() ? 0.0 : found->second;
  }

 private:
  using BodyDifferences = std::map<ConstantKey, double>;

  /// Returns by how much bodies' numbers differ with the links' frames where they stand at zero.
  [[nodiscard]] BodyDifferences ComparePlaced(const Sides& sides) const {
    BodyDifferences differences;
    for (const ConstantFinding& finding :
         CompareBodies(sides[0], sides[1], PlaceLinkFrames(sides[0], sides[1])).findings)
      differences[KeyOf(finding, nominal_[0].spec)] = finding.model - finding.engine;
    return differences;
  }

  /// Raises the changes that bodies have in the links' frames to those of a draw.
  void RaisePlaced(const Sides& moved, const BodyDifferences& placed) {
    BodyDifferences there = ComparePlaced(moved);
    for (const auto& [key, difference] : placed) there[key] -= difference;
    for (const auto& [key, change] : there) placed_[key] = Worst(placed_[key], std::abs(change));
  }

  /// Both files' descriptions brought to the same statements, one of them with its numbers moved.
  [[nodiscard]] Sides Complete(const RobotDescription& own) const {
    Sides sides = side_ == 0 ? Sides{own, other_} : Sides{other_, own};
    CompletePair(ignore_, part_, &sides);
    return sides;
  }

  /// The engine's diagonalised tensor is as good as the file's. A larger change is no rounding.
  void TakeDiagonalisation(const RobotDescription& stated, const BodyDifferences& placed) {
    const Sides sides = Complete(stated);
    const ConstantChecks bodies = CompareBodies(nominal_[side_], sides[side_]);
    const bool is_small = std::ranges::all_of(
        bodies.records, [](const CheckRecord& record) { return record.worst <= kDiagonalisation; });
    if (!is_small) return;
    spread_.others.push_back(MakeCopy(sides));
    for (const ConstantFinding& finding : bodies.findings)
      constants_[KeyOf(finding, nominal_[side_].spec)] += std::abs(finding.model - finding.engine);
    RaisePlaced(sides, placed);
  }

  TermComparison::Copy MakeCopy(const Sides& sides) {
    return {MakeProvider(sides[0]), MakeProvider(sides[1])};
  }

  DynamicsProvider* MakeProvider(const RobotDescription& robot) {
    models_.push_back(std::make_unique<RobotModel>(robot.spec));
    for (const Frame& frame : model_.frames()) {
      if (models_.back()->FindFrame(frame.name) < 0)
        throw InputError(robot.spec.source + ": lacks " + frame.name);
    }
    providers_.push_back(std::make_unique<AnalyticProvider>(*models_.back(), robot.spec.source, model_));
    return providers_.back().get();
  }

  size_t side_;
  const RobotDescription& other_;
  const std::vector<std::string>& ignore_;
  const RobotPart& part_;
  const RobotModel& model_;
  Sides nominal_;
  std::vector<std::unique_ptr<RobotModel>> models_;
  std::vector<std::unique_ptr<AnalyticProvider>> providers_;
  TermComparison::Spread spread_{};
  BodyDifferences constants_, placed_;  // largest changes of a draw
};

void RaiseTo(double value, double* largest) { *largest = Worst(*largest, value); }

/// Judges numbers of two files by the precision to which both print them.
class DigitJudge {
 public:
  DigitJudge(const MovedFile& a, const MovedFile& b, const RobotModel& model, bool are_mjcfs,
             double precision, DigitVerdict* verdict)
      : a_(a), b_(b), model_(model), are_mjcfs_(are_mjcfs), precision_(precision), verdict_(*verdict) {}

  /// Keeps the findings that exceed the precision of both files.
  void JudgeConstants(ConstantChecks* constants) {
    std::erase_if(constants->findings, [&](const ConstantFinding& finding) {
      const double size = Worst(std::abs(finding.model), std::abs(finding.engine));
      return IsWithin(finding, size, FindOpen(finding));
    });
    for (CheckRecord& record : constants->records) {
      if (!record.failed) continue;
      record.failed = std::ranges::any_of(
          constants->findings, [&](const ConstantFinding& finding) { return finding.check == record.name; });
    }
  }

  /// Judges the numbers of bodies in their links' frames: as if the two files had the same frames, and as the
  /// frames stand with all joints at zero. Of each link the better one counts.
  void JudgeBodies() {
    const Sides& sides = a_.nominal();
    std::array<std::map<int, std::vector<ConstantFinding>>, 2> found;
    const std::vector<Pose> choices[] = {{}, PlaceLinkFrames(sides[0], sides[1])};
    for (size_t i = 0; i < 2; ++i) {
      for (const ConstantFinding& finding : CompareBodies(sides[0], sides[1], choices[i]).findings)
        found[i][finding.location.first].push_back(finding);
    }
    const auto find_open = [&](const ConstantFinding& one, bool is_placed) {
      return FindOpen(one, is_placed) + kChains * one.scale;
    };
    const auto find_worst = [&](const std::vector<ConstantFinding>& findings, bool is_placed) {
      double worst = 0.0;
      for (const ConstantFinding& one : findings) RaiseTo(CalcUnits(one, find_open(one, is_placed)), &worst);
      return worst;
    };
    for (const auto& [link, same] : found[0]) {
      const std::vector<ConstantFinding>& placed = found[1][link];
      const double worst = find_worst(same, false);
      const bool is_placed = worst > 1.0 && find_worst(placed, true) < worst;
      for (const ConstantFinding& finding : is_placed ? placed : same) {
        if (!IsWithin(finding, finding.scale, find_open(finding, is_placed)))
          failed_bodies_.insert(finding.check);
      }
    }
  }

  /// @param terms of the comparison by rounding; those that agree within the precision pass.
  void JudgeTerms(const TermComparison& comparison, std::vector<CheckRecord>* terms) {
    std::optional<size_t> too_loose;
    if (const std::optional<Excess>& loosest = comparison.loosest()) {
      ConstantFinding excess = MakeExcess(comparison, *loosest);
      excess.units = 1.0;
      if (IsTooLoose(std::move(excess), loosest->units)) too_loose = loosest->term;
    }
    for (size_t i = 0; i < comparison.records().size(); ++i) {
      const CheckRecord& judged = comparison.records()[i];
      CheckRecord* const record = FindIn(*terms, judged.name, &CheckRecord::name);
      if (record == nullptr || !record->failed) continue;
      RaiseTo(judged.worst, &verdict_.units[record->name]);
      record->failed = judged.failed || failed_bodies_.contains(record->name) || too_loose == i;
      if (!judged.failed) continue;
      record->where = judged.where;
      record->first_failure = judged.first_failure;
      record->part = judged.part;
      record->at = judged.at;
      record->model_value = judged.model_value;
      record->engine_value = judged.engine_value;
      AddExcesses(comparison, i);
    }
  }

 private:
  // The chains of both files place a link's frame, each with its roundings; relative to a body's numbers.
  static constexpr double kChains = 1e-10;

  [[nodiscard]] std::string WordsOf(const Location& where) const {
    return Describe(where, model_, model_.num_base_velocities());
  }

  /// The printed precision of both files.
  [[nodiscard]] double FindOpen(const ConstantFinding& finding, bool is_placed = false) const {
    const ConstantKey key = KeyOf(finding, model_.spec());
    const double open = a_.FindOpen(key, is_placed) + b_.FindOpen(key, is_placed);
    const bool is_of_motor = are_mjcfs_ && finding.check.starts_with("motor_");
    return is_of_motor ? FindHalf(finding.model) + FindHalf(finding.engine) : open;
  }
  /// Half a unit of the last digit of a motor's number, which no draw moves, if it has at least kFewest.
  static double FindHalf(double value) {
    constexpr int kFewest = 5;
    const std::optional<PrintedNumber> printed = ReadPrinted(FormatNumber(value, 12));
    return printed && printed->digits >= kFewest ? printed->half_unit : 0.0;
  }
  static double CalcUnits(const ConstantFinding& finding, double open) {
    return std::abs(finding.model - finding.engine) / open;
  }

  /// @param open what is allowed, of a number of this size.
  bool IsWithin(const ConstantFinding& finding, double size, double open) {
    constexpr double kTie = 1e-6;  // of two numbers that are half a unit apart to their last digit
    const double units = CalcUnits(finding, open);
    RaiseTo(units, &verdict_.units[finding.check]);
    ConstantFinding excess = finding;
    excess.units = units;
    excess.is_cause = true;
    if (units <= 1.0 + kTie) return units < kOneNumber || !IsTooLoose(excess, open / size);
    verdict_.excesses.push_back(std::move(excess));
    return false;
  }

  /// Notes the precision of a number that agrees. A number with too coarse a precision does not agree.
  bool IsTooLoose(ConstantFinding excess, double fraction) {
    if (fraction > verdict_.loosest.fraction)
      verdict_.loosest = {NameQuantity(excess.check) + " of " + excess.where, fraction};
    if (fraction <= precision_) return false;
    excess.too_loose = fraction;
    verdict_.excesses.push_back(std::move(excess));
    return true;
  }

  [[nodiscard]] ConstantFinding MakeExcess(const TermComparison& comparison, const Excess& entry) const {
    ConstantFinding excess = {comparison.records()[entry.term].name,
                              WordsOf(entry.where),
                              entry.first,
                              entry.second,
                              entry.where,
                              -1};
    excess.units = entry.units;
    excess.is_cause = IsCause(comparison.entry(entry.term).term);
    return excess;
  }

  void AddExcesses(const TermComparison& comparison, size_t term) {
    const CheckRecord& judged = comparison.records()[term];
    if (!IsCause(comparison.entry(term).term)) {
      const Excess worst{term, judged.where, judged.worst, judged.model_value, judged.engine_value};
      verdict_.excesses.push_back(MakeExcess(comparison, worst));
      return;
    }
    for (const Excess& entry : comparison.excesses()) {
      if (entry.term == term) verdict_.excesses.push_back(MakeExcess(comparison, entry));
    }
  }

  const MovedFile& a_;
  const MovedFile& b_;
  const RobotModel& model_;
  bool are_mjcfs_;
  double precision_;
  DigitVerdict& verdict_;
  std::set<std::string> failed_bodies_;
};

}  // namespace

std::optional<DigitVerdict> JudgeByDigits(const std::array<const DescriptionFile*, 2>& files,
                                          const UrdfOptions& urdf, const ConsistencyOptions& options,
                                          DynamicsProvider* a, DynamicsProvider* b, const RobotModel& model,
                                          const RobotPart& part, ConsistencyResult* result) {
  const bool is_mechanism = model.base().type == BaseType::kFixed || model.base().type == BaseType::kFloating;
  if (!options.within_digits || result->Agrees() || !is_mechanism || model.object()) return std::nullopt;
  const std::optional<std::array<PrintedSpread, 2>> spreads = DrawWithinDigits(files, urdf, kDraws);
  if (!spreads) return std::nullopt;
  const auto& [first, second] = *spreads;
  try {
    const MovedFile moved_a(first, second.nominal, 0, options.ignore, part, model);
    const MovedFile moved_b(second, first.nominal, 1, options.ignore, part, model);
    if (std::min(moved_a.spread().draws.size(), moved_b.spread().draws.size()) < kLeastDraws)
      return std::nullopt;
    TermComparison comparison(model, kAskedByConsistency, {a, b});
    comparison.CompareWithin({moved_a.spread(), moved_b.spread()}, kCauses);
    DigitVerdict verdict;
    verdict.files = {first.digits, second.digits};
    verdict.states = CompareAtStates(
        FeedRandomStates(model, std::min(kStates, options.samples), options.range, options.seed,
                         comparison.needs_second_velocity()),
        [](long) { return true; }, &comparison);
    const bool are_mjcfs = std::ranges::all_of(
        files, [](const DescriptionFile* file) { return file->format() == RobotFormat::kMjcf; });
    DigitJudge judge(moved_a, moved_b, model, are_mjcfs, options.precision, &verdict);
    judge.JudgeConstants(&result->constants);
    judge.JudgeBodies();
    judge.JudgeTerms(comparison, &result->terms);
    if (std::ranges::none_of(verdict.excesses, &ConstantFinding::is_cause)) {
      for (ConstantFinding& excess : verdict.excesses) excess.is_cause = true;
    }
    std::ranges::stable_sort(verdict.excesses, [](const ConstantFinding& x, const ConstantFinding& y) {
      return x.is_cause != y.is_cause ? x.is_cause : x.units > y.units;
    });
    return verdict;
  } catch (const InputError&) {
    return std::nullopt;  // with its numbers moved, one of the two is another mechanism
  }
}

}  // namespace dexcheck
