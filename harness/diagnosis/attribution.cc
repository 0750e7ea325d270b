#include "harness/diagnosis/attribution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "controller/common/text.h"
#include "harness/checks/check_table.h"

namespace dexcheck {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// A line of the list.
struct Entry {
  Explanation one;
  FailureMeaning meaning;
  double time = 0.0;                   // when it was first seen, s
  const CheckRecord* check = nullptr;  // of the steps, that says so; null for none
};

const CheckRecord* FindFailed(std::span<const CheckRecord> checks, std::string_view name) {
  for (const CheckRecord& check : checks)
    if (check.name == name && check.failed) return &check;
  return nullptr;
}

/// Returns the meaning of a check's failure; nothing for one that has no entry.
FailureMeaning MeaningOf(std::string_view check) {
  const CheckInfo* info = FindCheck(check);
  return info == nullptr ? FailureMeaning{} : info->meaning;
}

std::string Describe(const CheckRecord& check) {
  return check.name + " " + FormatNumber(check.worst, 3) + (check.unit == "1" ? "" : " " + check.unit) +
         " (bound " + FormatNumber(check.bound, 3) +
         "), first above it at t = " + FormatNumber(check.failed_at, 3) + " s" +
         (check.part.empty() ? "" : ", " + check.part);
}

/// Returns whether an entry comes before another one: by rank, then by time, then by cause.
bool ComesBefore(const Entry& a, const Entry& b) {
  if (a.meaning.rank != b.meaning.rank) return a.meaning.rank < b.meaning.rank;
  if (a.time != b.time) return a.time < b.time;
  return a.meaning.cause < b.meaning.cause;
}

Explanation Observe(const std::string& place, const Fault& what, double from) {
  Explanation one{.channel = CauseChannel::kObservation, .outcome = CauseOutcome::kObserved};
  one.faults.push_back(what);
  one.faults.front().place = place;
  one.from = from;
  return one;
}

Entry MakeFact(const CheckRecord& check, const FailureMeaning& meaning) {
  const std::string place = check.name + (check.part.empty() ? "" : ", " + check.part);
  const Fault what{NameOf(meaning.cause),
                   "",
                   check.worst,
                   0.0,
                   check.unit == "1" ? "" : check.unit,
                   "(bound " + FormatNumber(check.bound, 3) + ")"};
  return {Observe(place, what, check.failed_at), meaning, check.failed_at, &check};
}

/// Returns the meaning of an explanation of that channel.
FailureMeaning MeaningOf(CauseChannel channel) {
  static const FailureMeaning kMeanings[] = {
      {Cause::kSensing, Rank::kMeasurement},     {Cause::kActuator, Rank::kActuator},
      {Cause::kControlLaw, Rank::kLaw},          {Cause::kContactGeometry, Rank::kObjectBalance},
      {Cause::kModel, Rank::kMeasurement},       {Cause::kWheelGeometry, Rank::kDecisive},
      {Cause::kUnmodelledForce, Rank::kDecisive}};
  return kMeanings[static_cast<size_t>(channel)];
}

/// Explanations of the residuals, those of a channel in their order.
std::vector<Entry> ListFaults(const Causes& causes, std::span<const CheckRecord> steps) {
  std::vector<Entry> entries;
  for (const Explanation& one : causes) {
    Entry entry{one, MeaningOf(one.channel), one.from};
    for (const Explanation& other : causes)
      if (other.channel == one.channel) entry.time = std::min(entry.time, other.from);
    for (const CheckRecord& check : steps) {
      const Entry failed{{}, MeaningOf(check.name), check.failed_at, &check};
      const bool is_of_it = check.failed && failed.meaning.cause == entry.meaning.cause;
      if (!is_of_it || failed.meaning.rank > entry.meaning.rank) continue;
      if (entry.check != nullptr && !ComesBefore(failed, entry)) continue;
      entry.meaning = failed.meaning, entry.time = failed.time, entry.check = failed.check;
    }
    // A residual within its bounds need not be explained.
    if (entry.check == nullptr && one.outcome == CauseOutcome::kNotExplained)
      entry.meaning.rank = Rank::kResidual;
    entries.push_back(entry);
  }
  return entries;
}

/// Adds one fact of each cause that no fault explains; of two checks of one fact the sharper one states it.
/// Contacts of a link or wheel that is elsewhere are elsewhere, too.
void AddFacts(std::span<const CheckRecord> steps, std::vector<Entry>* entries) {
  const double void_from = FindVoid(steps);
  const bool is_misplaced = std::ranges::any_of(
      *entries, [](const Entry& entry) { return entry.one.channel == CauseChannel::kGeometry; });
  for (const CheckRecord& check : steps) {
    const FailureMeaning meaning = MeaningOf(check.name);
    if (!check.failed || meaning.cause == Cause::kNone || FindFailed(steps, meaning.sharper) != nullptr)
      continue;
    if (check.name == "rolling" && (is_misplaced || check.failed_at >= void_from)) continue;
    if (meaning.cause == Cause::kContactGeometry && is_misplaced) continue;
    const Entry fact = MakeFact(check, meaning);
    const auto same = std::find_if(entries->begin(), entries->end(),
                                   [&](const Entry& other) { return other.meaning.cause == meaning.cause; });
    if (same == entries->end()) {
      entries->push_back(fact);
    } else if (same->one.outcome == CauseOutcome::kObserved && ComesBefore(fact, *same)) {
      *same = fact;
    }
  }
}

/// Whether an entry is a consequence of those before it: what is predicted, and where that leads to; a
/// failure that is no fact by itself.
bool Follows(const Entry& entry) {
  const bool is_fact = entry.one.outcome != CauseOutcome::kObserved || entry.meaning.is_own;
  return entry.meaning.rank >= Rank::kPrediction || !is_fact;
}

/// Wheels of another size give other forces besides, which show before they have rolled far.
void PutWheelsBeforeForces(std::vector<Entry>* entries) {
  double first = kNever;
  for (const Entry& entry : *entries)
    if (entry.meaning.cause == Cause::kUnmodelledForce) first = std::min(first, entry.time);
  for (Entry& entry : *entries)
    if (entry.meaning.cause == Cause::kWheelGeometry) entry.time = std::min(entry.time, first);
}

/// Whether torques that were cut off explain the entry. Motions follow from them; forces that do not balance,
/// or are not the rigid model's, do not: what was delivered is known.
bool ComesFrom(const Entry& limit, const Entry& entry) {
  if (entry.check == nullptr) return false;
  const bool is_motion =
      entry.check->kind == CheckCategory::kLaw || entry.check->kind == CheckCategory::kAssumption;
  return is_motion && ComesBefore(limit, entry);
}

/// Returns the cause of an expectation that alone fails: the gains, if (57) by itself leaves most of the
/// error, and what drives it otherwise. By algebra that is what contacts give, or what the scenario asks for
/// of the plant.
Cause AttributeExpectation(const CheckRecord& check, const CheckContext& context, std::string* evidence) {
  const bool position = check.name == "expect_position";
  const double by_law = position ? context.position_by_law : context.orientation_by_law;
  const Cause other = context.is_ideal ? Cause::kControlLaw : Cause::kDeclared;
  if (!(by_law >= 0.0)) return other;
  *evidence += "; (57) by itself leaves " + FormatNumber(by_law, 3) + " " + check.unit;
  if (by_law >= 0.5 * check.worst) return Cause::kControlLaw;
  *evidence += context.is_ideal ? ", contacts that give the rest"
                                : ", contacts that give and what the scenario declares of the plant the rest";
  return context.is_ideal ? Cause::kContactSoftness : Cause::kDeclared;
}

Cause AttributeOne(const CheckRecord& check, Cause run, std::span<const CheckRecord> steps) {
  if (run == Cause::kModel || run == Cause::kSensing) return run;
  if (check.kind == CheckCategory::kModel) return Cause::kModel;
  const FailureMeaning meaning = MeaningOf(check.name);
  if (!meaning.is_own) return run;
  return FindFailed(steps, meaning.sharper) != nullptr ? MeaningOf(meaning.sharper).cause : meaning.cause;
}

/// Lists the numbers that differ between the two descriptions, those that differ most first. Places at which
/// one number has the same two values stand in one line.
Causes ListConstants(std::vector<ConstantFinding> findings) {
  const auto fraction = [](const ConstantFinding& one) {
    return std::abs(one.model - one.engine) / std::max(std::abs(one.model), std::abs(one.engine));
  };
  std::stable_sort(findings.begin(), findings.end(), [&](const ConstantFinding& a, const ConstantFinding& b) {
    return fraction(a) > fraction(b);
  });
  Causes causes;
  std::vector<bool> is_listed(findings.size(), false);
  for (size_t i = 0; i < findings.size(); ++i) {
    if (is_listed[i]) continue;
    const ConstantFinding& one = findings[i];
    std::vector<std::string> places;
    for (size_t k = i; k < findings.size(); ++k) {
      const ConstantFinding& other = findings[k];
      if (other.check != one.check || other.entry != one.entry || other.model != one.model ||
          other.engine != one.engine)
        continue;
      is_listed[k] = true;
      places.push_back(other.where);
    }
    const std::string component = NameComponent(one);
    const std::string unit = UnitOf(one, nullptr);
    const std::string after = unit.empty() ? "" : " " + unit;
    const std::string text = fmt::format("{}{}{} of {}: {:.12g}{} in the model, {:.12g}{} in the MJCF",
                                         NameQuantity(one.check), component.empty() ? "" : " ", component,
                                         JoinNames(places), one.model, after, one.engine, after);
    causes.push_back(Observe(text, {kUnknownFault, "", one.model, 0.0, unit, ""}, -kNever));
  }
  return causes;
}

/// Puts a wrong model before everything else.
bool AttributeModel(const ConstantChecks& constants, std::span<const CheckRecord> model,
                    std::span<const CheckRecord> steps, AttributionResult* result, Causes* causes) {
  if (!constants.findings.empty()) {
    const Causes facts = ListConstants(constants.findings);
    result->evidence = facts.front().Describe();
    causes->insert(causes->begin(), facts.begin(), facts.end());
  } else {
    const CheckRecord* first = nullptr;
    for (const CheckRecord& check : model)
      if (check.failed && (first == nullptr || check.failed_at < first->failed_at)) first = &check;
    if (first == nullptr || FindFailed(steps, "measurement") != nullptr) return false;
    result->evidence = Describe(*first);
    const auto explains = [](const Explanation& one) { return one.channel == CauseChannel::kGeometry; };
    if (std::stable_partition(causes->begin(), causes->end(), explains) == causes->begin())
      causes->insert(causes->begin(), MakeFact(*first, {.cause = Cause::kModel}).one);
  }
  // The law is judged by the engine's terms, and goes by the model's.
  std::erase_if(*causes, [](const Explanation& one) { return one.channel == CauseChannel::kLaw; });
  result->cause = Cause::kModel;
  return true;
}

/// All that checks observed and residuals are explained by, what explains the others first. @param steps one
/// of which failed.
std::vector<Entry> ListAll(std::span<const CheckRecord> steps, const CheckContext& context,
                           const Causes& causes) {
  std::vector<Entry> entries = ListFaults(causes, steps);
  AddFacts(steps, &entries);
  PutWheelsBeforeForces(&entries);
  std::stable_sort(entries.begin(), entries.end(), ComesBefore);
  if (entries.empty()) {
    const auto any = std::find_if(steps.begin(), steps.end(), [](const CheckRecord& c) { return c.failed; });
    entries.push_back(MakeFact(*any, {.cause = Cause::kUnexplained}));
  }
  entries.erase(std::remove_if(entries.begin() + 1, entries.end(), Follows), entries.end());
  if (context.limited && context.limited->failed) {
    const Entry limit = MakeFact(*context.limited, MeaningOf(context.limited->name));
    const bool is_unexplained = entries.front().meaning.cause == Cause::kUnexplained;
    if (is_unexplained || ComesFrom(limit, entries.front())) entries.insert(entries.begin(), limit);
  }
  return entries;
}

/// Adds which check shows the first entry, and what was measured there.
void AddEvidence(const Entry& first, std::span<const CheckRecord> steps, const CheckContext& context,
                 AttributionResult* result, Causes* causes) {
  const CheckRecord* check = first.check;
  for (const CheckRecord& other : steps)  // of a fault that bounds of its own check allow
    if (check == nullptr && other.failed) check = &other;
  result->cause = first.meaning.cause;
  if (result->cause == Cause::kUnmodelledForce && Names(*causes, "slope")) result->cause = Cause::kSlope;
  if (check == nullptr) return;
  result->evidence = Describe(*check);
  result->check = check->name;
  if (first.one.outcome != CauseOutcome::kObserved) {
    result->evidence += "; " + DescribeCauses(*causes, first.one.channel);
  } else if (first.meaning.rank == Rank::kResidual && first.meaning.cause == Cause::kControlLaw) {
    result->cause = AttributeExpectation(*check, context, &result->evidence);
    causes->front().faults.front().fault = NameOf(result->cause);
  }
}

}  // namespace

double FindVoid(std::span<const CheckRecord> steps) {
  double first = kNever;
  for (const char* name : {"traction_use", "solver", "collision"})
    if (const CheckRecord* check = FindFailed(steps, name)) first = std::min(first, check->failed_at);
  return first;
}

AttributionResult Attribute(const ConstantChecks& constants, std::span<const CheckRecord> model,
                            std::span<const CheckRecord> steps, const CheckContext& context, Causes* causes) {
  AttributionResult result;
  const bool any = std::any_of(steps.begin(), steps.end(), [](const CheckRecord& c) { return c.failed; });
  if (!AttributeModel(constants, model, steps, &result, causes) && any) {
    const std::vector<Entry> entries = ListAll(steps, context, *causes);
    causes->clear();
    for (const Entry& entry : entries) causes->push_back(entry.one);
    AddEvidence(entries.front(), steps, context, &result, causes);
  }
  for (const std::span<const CheckRecord> checks : {model, steps}) {
    for (const CheckRecord& check : checks)
      if (check.failed) result.attributions.push_back({check.name, AttributeOne(check, result.cause, steps)});
  }
  return result;
}

}  // namespace dexcheck
