#include "harness/diagnosis/injection/drawn_faults.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

/// Of each set a generator of its own.
Draw MakeDraw(const DrawOptions& options, size_t set) { return Draw(options.seed * 1000003 + set); }

/// Whether both name the same place, or are both of a law.
bool IsSamePlace(const InjectedFault& a, const InjectedFault& b) {
  if ((a.controller && b.controller) || (a.model && b.model)) return true;
  return std::any_of(a.truth.begin(), a.truth.end(), [&](const Fault& one) {
    return std::any_of(b.truth.begin(), b.truth.end(),
                       [&](const Fault& other) { return other.place == one.place; });
  });
}

InjectedFault MakeOne(const FaultKind& kind, const FaultContext& context) {
  InjectedFault fault = kind.make(context);
  fault.kind = kind.kind;
  if (fault.cause == Cause::kNone) fault.cause = kind.cause;
  return fault;
}

}  // namespace

InjectedFault FaultAt(const std::string& place, const std::string& name, double value, double change) {
  return {.name = place + ": " + name + " " + FormatNumber(value, 4),
          .kind = {},
          .truth = {{name, place, value, std::abs(change), "", ""}}};
}

InjectedFault FaultAt(const std::string& name, Cause cause, const std::string& part) {
  return {.name = name, .kind = {}, .cause = cause, .part = part};
}

int FindId(const mjModel& m, mjtObj kind, const std::string& name) {
  const int id = mj_name2id(&m, kind, name.c_str());
  if (id < 0) throw InputError("the plant has nothing called " + Quote(name) + " to make a fault with");
  return id;
}

std::vector<FaultKind> ListFaultKinds(const Setup& setup, const DrawOptions& options) {
  Draw draw(options.seed);
  const FaultContext context{setup, options.duration, options.tau, &draw};
  std::vector<FaultKind> kinds;
  for (const auto& [list, cause] : {std::pair{ListMotorFaultKinds(), Cause::kActuator},
                                    {ListSensorFaultKinds(), Cause::kSensing},
                                    {ListBodyFaultKinds(), Cause::kUnmodelledForce},
                                    {ListWorldFaultKinds(), Cause::kUnmodelledForce},
                                    {ListLawFaultKinds(), Cause::kControlLaw}}) {
    for (FaultKind kind : list) {
      const bool is_wanted = options.kinds.empty() || std::find(options.kinds.begin(), options.kinds.end(),
                                                                kind.kind) != options.kinds.end();
      if (!is_wanted || (kind.applies != nullptr && !kind.applies(context))) continue;
      kind.cause = cause;
      kinds.push_back(kind);
    }
  }
  if (kinds.empty()) throw InputError("--kinds: no fault of these kinds can be made in this scenario");
  return kinds;
}

std::vector<FaultSet> DrawFaults(const Setup& setup, const DrawOptions& options) {
  const std::vector<FaultKind> kinds = ListFaultKinds(setup, options);
  std::vector<FaultSet> sets;
  for (size_t i = 0; i < options.count; ++i) {
    Draw draw = MakeDraw(options, i);
    const FaultContext context{setup, options.duration, options.tau, &draw};
    FaultSet& set = sets.emplace_back();
    while (set.size() < options.together) {
      // What has no size is no part of a set: what would be named of it?
      InjectedFault one = MakeOne(kinds[draw.Index(kinds.size())], context);
      if (options.together > 1 && one.truth.empty()) continue;
      const bool is_taken = std::any_of(set.begin(), set.end(),
                                        [&](const InjectedFault& other) { return IsSamePlace(one, other); });
      if (!is_taken) set.push_back(std::move(one));
    }
  }
  return sets;
}

std::vector<FaultSet> DrawEachKind(const Setup& setup, const DrawOptions& options) {
  std::vector<FaultSet> sets;
  for (const FaultKind& kind : ListFaultKinds(setup, options)) {
    for (size_t i = 0; i < options.count; ++i) {
      Draw draw = MakeDraw(options, sets.size());
      sets.push_back({MakeOne(kind, {setup, options.duration, options.tau, &draw})});
    }
  }
  return sets;
}

NamingScore ScoreNames(const std::vector<Fault>& truth, const std::vector<Fault>& all, const Causes& causes) {
  constexpr double kNear = 0.05;
  NamingScore score;
  for (const Fault& one : truth) {
    bool right = false, in_class = false;
    for (const Explanation& explanation : causes) {
      if (explanation.outcome == CauseOutcome::kNotExplained) continue;
      const Fault& first = explanation.faults.front();
      right = right || (explanation.outcome == CauseOutcome::kNamed && one.IsLike(first) &&
                        std::isfinite(first.error) &&
                        std::abs(first.value - one.value) <= std::max(kNear * one.error, 3.0 * first.error));
      in_class = in_class || ((explanation.outcome == CauseOutcome::kNamedClass || std::isinf(first.error)) &&
                              std::any_of(explanation.faults.begin(), explanation.faults.end(),
                                          [&](const Fault& fault) { return one.IsLike(fault); }));
    }
    ++(right ? score.right : in_class ? score.in_class : score.not_explained);
  }
  for (const Explanation& explanation : causes) {
    if (explanation.outcome != CauseOutcome::kNamed) continue;
    const Fault& first = explanation.faults.front();
    const auto of = std::find_if(all.begin(), all.end(), [&](const Fault& one) { return one.IsLike(first); });
    if (of == all.end() || std::abs(first.value - of->value) > std::max(kNear * of->error, 3.0 * first.error))
      ++score.wrong;
  }
  return score;
}

}  // namespace dexcheck
