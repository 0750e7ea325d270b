#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/checks/file_comparison.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/fault_search.h"

namespace dexcheck {
namespace {

constexpr int kDraws = 24;
constexpr size_t kLeastDraws = 4;
constexpr long kStates = 20;
constexpr Term kCauses[] = {Term::kJointAxis, Term::kLinkCom, Term::kLinkInertia, Term::kFramePose};

bool IsCause(Term term) { return std::ranges::find(kCauses, term) != std::end(kCauses); }

/// Which number of which part a constant check compares.
using ConstantKey = std::tuple<std::string, Location::Kind, std::string, int>;

ConstantKey KeyOf(const ConstantFinding& finding, const RobotSpec& spec) {
  const int first = finding.location.first;
  const bool is_of_base = first < 0 || first >= static_cast<int>(spec.joints.size());
  return {finding.check, finding.location.kind,
          is_of_base ? "" : spec.joints[static_cast<size_t>(first)].name, finding.entry};
}

/// Both files' descriptions brought to the same statements, one of them with its numbers moved.
class MovedPair {
 public:
  MovedPair(RobotDescription first, RobotDescription second, const std::vector<std::string>& ignore,
            const RobotPart& part)
      : sides{std::move(first), std::move(second)} {
    int held = 0;
    if (!part.empty()) TakePart(part, &sides[0], &sides[1], &held);
    // As the comparison does it: joints are called as in an MJCF.
    const size_t named = sides[1].format == RobotFormat::kMjcf && part.empty() ? 1 : 0;
    CompleteEachOther(&sides[named], &sides[1 - named], ignore);
    AddLinkFrames(&sides[0], &sides[1]);
  }
  std::array<RobotDescription, 2> sides;
};

/// One file's numbers, moved: its terms by a provider each, and how far its constants move.
class MovedFile {
 public:
  MovedFile(const PrintedSpread& own, const RobotDescription& other, size_t side,
            const std::vector<std::string>& ignore, const RobotPart& part, const RobotModel& model)
      : side_(side), other_(other), ignore_(ignore), part_(part), model_(model) {
    const MovedPair nominal = Complete(own.nominal);
    spread_.nominal = MakeCopy(nominal);
    for (const RobotDescription& draw : own.draws) {
      const MovedPair moved = Complete(draw);
      const std::optional<TermComparison::Copy> copy = TryToCopy(moved);
      if (!copy) continue;
      spread_.draws.push_back(*copy);
      for (const ConstantFinding& finding :
           CheckConstants(nominal.sides[side_], moved.sides[side_]).findings) {
        double& open = constants_[KeyOf(finding, nominal.sides[side_].spec)];
        open = std::max(open, std::abs(finding.model - finding.engine));
      }
    }
    if (own.undiagonalized) spread_.others.push_back(MakeCopy(Complete(*own.undiagonalized)));
  }

  [[nodiscard]] const TermComparison::Spread& spread() const { return spread_; }
  [[nodiscard]] double FindOpen(const ConstantKey& key) const {
    const auto found = constants_.find(key);
    return found == constants_.end() ? 0.0 : found->second;
  }

 private:
  [[nodiscard]] MovedPair Complete(const RobotDescription& own) const {
    return side_ == 0 ? MovedPair(own, other_, ignore_, part_) : MovedPair(other_, own, ignore_, part_);
  }

  TermComparison::Copy MakeCopy(const MovedPair& pair) {
    DynamicsProvider* const first = MakeProvider(pair.sides[0]);
    return {first, MakeProvider(pair.sides[1])};
  }

  /// Nothing where a moved tensor, of few digits, has negative moments.
  std::optional<TermComparison::Copy> TryToCopy(const MovedPair& pair) {
    try {
      return MakeCopy(pair);
    } catch (const InputError&) {
      return std::nullopt;
    }
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
  std::vector<std::unique_ptr<RobotModel>> models_;
  std::vector<std::unique_ptr<AnalyticProvider>> providers_;
  TermComparison::Spread spread_{};
  std::map<ConstantKey, double> constants_;
};

void RaiseTo(double value, double* largest) { *largest = std::max(*largest, value); }

/// Constants: what is left are the findings that exceed what both files leave open.
void JudgeConstants(const MovedFile& a, const MovedFile& b, const RobotSpec& spec, ConstantChecks* constants,
                    DigitVerdict* verdict) {
  constexpr double kTie = 1e-6;  // of two numbers that are half a unit apart to their last digit
  std::erase_if(constants->findings, [&](const ConstantFinding& finding) {
    const ConstantKey key = KeyOf(finding, spec);
    const double open = a.FindOpen(key) + b.FindOpen(key);
    const double units = std::abs(finding.model - finding.engine) / open;
    RaiseTo(units, &verdict->units[finding.check]);
    if (units <= 1.0 + kTie) return true;
    verdict->excesses.push_back(
        {finding.check, finding.where, units, finding.model, finding.engine, finding.effect, true});
    return false;
  });
  for (CheckRecord& record : constants->records) {
    if (!record.failed) continue;
    record.failed = std::ranges::any_of(
        constants->findings, [&](const ConstantFinding& finding) { return finding.check == record.name; });
    if (!record.failed) RaiseTo(record.worst, &verdict->largest_within);
  }
}

void JudgeTerms(const TermComparison& comparison, std::vector<CheckRecord>* terms, DigitVerdict* verdict) {
  const RobotModel& model = comparison.model();
  for (size_t i = 0; i < comparison.records().size(); ++i) {
    const CheckRecord& judged = comparison.records()[i];
    const auto record = std::ranges::find(*terms, judged.name, &CheckRecord::name);
    if (record == terms->end() || !record->failed) continue;
    verdict->units[record->name] = judged.worst;
    record->failed = judged.failed;
    if (!judged.failed) {
      RaiseTo(record->worst, &verdict->largest_within);
      continue;
    }
    record->where = judged.where;
    record->first_failure = judged.first_failure;
    record->part = judged.part;
    record->at = judged.at;
    record->model_value = judged.model_value;
    record->engine_value = judged.engine_value;
    const bool is_cause = IsCause(comparison.entry(i).term);
    if (!is_cause) {
      const std::string where = Describe(judged.where, model, model.num_base_velocities());
      verdict->excesses.push_back(
          {judged.name, where, judged.worst, judged.model_value, judged.engine_value, "", false});
      continue;
    }
    for (const Excess& excess : comparison.excesses()) {
      if (excess.term != i) continue;
      verdict->excesses.push_back({judged.name, Describe(excess.where, model, model.num_base_velocities()),
                                   excess.units, excess.first, excess.second, "", true});
    }
  }
}

}  // namespace

bool DigitVerdict::Concerns(const std::vector<std::string>& ids,
                            const std::vector<std::string>& parts) const {
  if (std::ranges::any_of(ids, [](const std::string& id) { return !id.starts_with("number."); })) return true;
  return std::ranges::any_of(parts, [&](const std::string& part) {
    return std::ranges::any_of(excesses, [&](const DigitExcess& excess) {
      return excess.is_cause && (" " + excess.where + " ").find(" " + part + " ") != std::string::npos;
    });
  });
}

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
    comparison.CompareWithin({moved_a.spread(), moved_b.spread()});
    DigitVerdict verdict;
    verdict.files = {first.digits, second.digits};
    verdict.states = CompareAtStates(
        FeedRandomStates(model, std::min(kStates, options.samples), options.range, options.seed,
                         comparison.needs_second_velocity()),
        [](long) { return true; }, &comparison);
    JudgeConstants(moved_a, moved_b, model.spec(), &result->constants, &verdict);
    JudgeTerms(comparison, &result->terms, &verdict);
    std::ranges::stable_sort(verdict.excesses, [](const DigitExcess& x, const DigitExcess& y) {
      return x.is_cause != y.is_cause ? x.is_cause : x.units > y.units;
    });
    return verdict;
  } catch (const InputError&) {
    return std::nullopt;  // with its numbers moved, one of the two is another mechanism
  }
}

std::vector<std::string> ListExcesses(const DigitVerdict& verdict, const std::string& first,
                                      const std::string& second) {
  constexpr double kNothingOpen = 1e9;  // the unit is rounding then
  std::vector<std::string> lines;
  std::vector<std::string> following;
  std::map<std::string, std::pair<size_t, int>> alike;  // its line, and how many more there are
  double most = 0.0;
  for (const DigitExcess& excess : verdict.excesses) {
    if (!excess.is_cause) {
      following.push_back(excess.check);
      RaiseTo(excess.units, &most);
      continue;
    }
    const std::string values =
        fmt::format("{:.12g} in {}, {:.12g} in {}; ", excess.first, first, excess.second, second);
    // The same two numbers, or what one file leaves out, are one fault of many joints: the worst stands for
    // all.
    const auto [line, is_new] =
        alike.emplace(excess.check + (excess.effect.empty() ? values : ""), std::pair(lines.size(), 0));
    line->second.second += is_new ? 0 : 1;
    if (!is_new) continue;
    lines.push_back(excess.check + ": " + excess.where + ": " + values);
    lines.back() += !excess.effect.empty() ? excess.effect
                    : excess.units < kNothingOpen
                        ? fmt::format("{:.3g} times what their digits leave open", excess.units)
                        : "their digits leave nothing open";
  }
  for (const auto& [key, line] : alike) {
    if (line.second > 0) lines[line.first] += fmt::format("; and so at {} more", line.second);
  }
  if (!following.empty())
    lines.push_back(fmt::format(
        "terms{}: {}",
        most < kNothingOpen ? fmt::format(" up to {:.3g} times what the digits leave open", most) : "",
        JoinNames(following)));
  return lines;
}

}  // namespace dexcheck
