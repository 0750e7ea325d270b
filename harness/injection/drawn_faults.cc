#include "harness/injection/drawn_faults.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/control/trajectory_controller.h"
#include "harness/diagnosis/equation_faults.h"
#include "harness/diagnosis/parameters.h"
#include "harness/injection/faulty_law.h"

namespace dexcheck {
namespace {

/// Makes a generator for one set.
Draw MakeDraw(const DrawOptions& options, size_t set) { return Draw(options.seed * 1000003 + set); }

/// Whether both name the same place, are both of a law, or one is of a wheel and the other of both wheels.
bool IsSamePlace(const InjectedFault& a, const InjectedFault& b) {
  if ((a.controller && b.controller) || (a.model && b.model)) return true;
  const auto is_of_both = [](const Fault& fault) {
    return fault.fault == "radius" && fault.place == "wheels";
  };
  return std::any_of(a.truth.begin(), a.truth.end(), [&](const Fault& one) {
    return std::any_of(b.truth.begin(), b.truth.end(), [&](const Fault& other) {
      const bool is_of_one = one.fault == other.fault && (is_of_both(one) || is_of_both(other));
      return other.place == one.place || is_of_one;
    });
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
      const bool is_known = setup.scenario().knows_law() || kind.kind != std::string_view("law");
      if (!is_wanted || !is_known || (kind.applies != nullptr && !kind.applies(context))) continue;
      kind.cause = cause;
      kinds.push_back(kind);
    }
  }
  for (const std::string& wanted : options.kinds) {
    const bool is_there =
        std::any_of(kinds.begin(), kinds.end(), [&](const FaultKind& kind) { return kind.kind == wanted; });
    if (!is_there) throw InputError("--kinds: no fault " + Quote(wanted) + " can be made in this scenario");
  }
  return kinds;
}

std::vector<FaultSet> DrawFaults(const Setup& setup, const DrawOptions& options) {
  const std::vector<FaultKind> kinds = ListFaultKinds(setup, options);
  std::vector<FaultSet> sets;
  for (size_t i = 0; i < options.count; ++i) {
    Draw draw = MakeDraw(options, i);
    const FaultContext context{setup, options.duration, options.tau, &draw};
    FaultSet& set = sets.emplace_back();
    constexpr int kTries = 100, kMost = 100 * kTries;
    for (int tries = 1; set.size() < options.together; ++tries) {
      // Nothing may go with what was drawn first.
      if (tries % kTries == 0) set.clear();
      if (tries == kMost)
        throw InputError(setup.scenario().source + ": --together: must be fewer, no " +
                         std::to_string(options.together) + " of these faults are of different places");
      // A fault without a size is no part of a set: nothing of it could be named.
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

namespace {

constexpr double kNear = 0.05;

/// Whether the value is right: an error that is infinite or no number says nothing of it.
bool HasValue(const Fault& named, const Fault& truth) {
  return std::abs(named.value - truth.value) <= std::max(kNear * truth.error, 3.0 * named.error);
}

/// A fault of all is a fault of each.
bool IsOfAll(const Fault& fault) {
  return fault.place.starts_with("all ") || fault.place.starts_with("everything ");
}

bool NamesInClass(const Explanation& one, const Fault& truth) {
  const bool is_class = one.outcome == CauseOutcome::kNamedClass || !std::isfinite(one.faults.front().error);
  return is_class && std::any_of(one.faults.begin(), one.faults.end(),
                                 [&](const Fault& fault) { return truth.IsLike(fault); });
}

}  // namespace

NamingScore ScoreNames(const std::vector<Fault>& truth, const std::vector<Fault>& all, const Causes& causes) {
  NamingScore score;
  std::string wrong;  // one of them
  for (const Explanation& one : causes) {
    if (one.outcome != CauseOutcome::kNamed) continue;
    const Fault& first = one.faults.front();
    const auto is_so = [&](const Fault& fault) {
      const bool is_of_it = fault.IsLike(first) || (fault.fault == first.fault && IsOfAll(fault));
      return is_of_it && HasValue(first, fault);
    };
    if (std::any_of(all.begin(), all.end(), is_so)) continue;
    ++score.wrong;
    const auto is_like = [&](const Fault& fault) { return fault.IsLike(first); };
    wrong = std::any_of(all.begin(), all.end(), is_like) ? "another value" : first.fault;
  }
  for (const Fault& fault : truth) {
    bool is_right = false, is_in_class = false;
    for (const Explanation& one : causes) {
      if (one.outcome == CauseOutcome::kNotExplained) continue;
      const Fault& first = one.faults.front();
      is_right = is_right || (one.outcome == CauseOutcome::kNamed && fault.IsLike(first) &&
                              std::isfinite(first.error) && HasValue(first, fault));
      is_in_class = is_in_class || NamesInClass(one, fault);
    }
    ++(is_right ? score.right : is_in_class ? score.in_class : score.not_explained);
    score.outcomes.push_back(is_right      ? CauseOutcome::kNamed
                             : is_in_class ? CauseOutcome::kNamedClass
                                           : CauseOutcome::kNotExplained);
    score.named_as.push_back(is_right         ? fault.fault
                             : is_in_class    ? "a class"
                             : !wrong.empty() ? wrong
                                              : "nothing");
  }
  return score;
}

std::vector<FaultSet> ListNumberFaults(const Setup& setup, size_t count, double scale) {
  const RobotSpec& spec = setup.model().spec();
  const std::vector<Parameter> numbers = ListParameters(spec);
  count = std::min(count, numbers.size());
  std::vector<FaultSet> sets;
  for (size_t i = 0; i < count; ++i) {
    const Parameter& number = numbers[i * numbers.size() / count];
    InjectedFault fault =
        FaultAt(DescribePart(spec, number) + ": " + DescribeQuantity(number), Cause::kModel);
    fault.kind = "number";
    fault.model = [number, scale](const RobotModel& right) {
      return ChangeNumber(right.spec(), number, scale);
    };
    sets.push_back({fault});
  }
  return sets;
}

namespace {

/// A law whose internal forces are chosen by other numbers.
InjectedFault ChangeForces(const std::string& name, void (*change)(GraspControllerOptions*)) {
  InjectedFault fault = FaultAt(name, Cause::kControlLaw);
  fault.controller = [change](const Setup& own, std::unique_ptr<Controller> /*right*/,
                              const IsOn& /*is_on*/) {
    GraspControllerOptions options = own.MakeControllerOptions();
    change(&options);
    // Contacts are measured, as the judge takes them to be.
    Sampling sampling = own.MakeSampling();
    sampling.contacts.reset();
    return std::make_unique<TrajectoryController>(own.model(), own.fingertips(), own.object().body,
                                                  own.surface(), options, sampling);
  };
  return fault;
}

}  // namespace

std::vector<FaultSet> ListLawFaults(const Setup& setup) {
  std::vector<FaultSet> sets;
  const auto add = [&](InjectedFault fault, const char* kind) {
    fault.kind = kind;
    fault.cause = Cause::kControlLaw;
    fault.needs_error = true;
    sets.push_back({std::move(fault)});
  };
  const ScenarioLaw law(setup);
  for (size_t i = 0; i < law.entries.size(); ++i) {
    const LawEntry& entry = law.entries[i];
    // A thousandth too large, left out, and gravity upside down.
    constexpr double kSlightly = 1.001, kReversed = -1.0;
    for (const double factor : {kSlightly, 0.0, kReversed}) {
      const bool can_be = factor != kReversed || entry.fault.starts_with("gravity (");
      if (entry.parts != 0 && can_be)
        add(MakeLawFault(entry, i, factor - 1.0, std::nullopt), "law, one part");
    }
    if (!entry.is_whole || entry.is_variant) continue;
    InjectedFault whole = MakeLawFault(entry, i, 1.0, std::nullopt);
    whole.name = entry.fault;
    whole.truth.clear();
    add(std::move(whole), "law, otherwise");
  }
  add(ChangeForces("the friction counted on times 1.1", [](auto* options) { options->mu *= 1.1; }),
      "law, otherwise");
  add(ChangeForces("f_min halved", [](auto* options) { options->f_min *= 0.5; }), "law, otherwise");
  add(ChangeForces("the barrier's weight times 1.1",
                   [](auto* options) { options->force.barrier_weight *= 1.1; }),
      "law, otherwise");
  return sets;
}

std::vector<FaultSet> ListEquationFaults(const Setup& setup) {
  const bool has_coordinates = setup.scenario().control.orientation == OrientationFeedback::kAngles;
  std::vector<FaultSet> sets;
  for (const EquationFault& equation : ListEquationFaults(setup.model())) {
    if (equation.check == nullptr || (equation.change.object && !has_coordinates)) continue;
    InjectedFault fault = FaultAt(equation.name, Cause::kModel, equation.check);
    fault.kind = "equation";
    fault.controller = [equation](const Setup& own, std::unique_ptr<Controller> right, const IsOn& is_on) {
      return std::make_unique<FaultyLaw>(own, std::move(right), equation, is_on);
    };
    sets.push_back({fault});
  }
  return sets;
}

}  // namespace dexcheck
