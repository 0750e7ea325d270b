#include <algorithm>
#include <utility>

#include "controller/control/trajectory_controller.h"
#include "harness/diagnosis/equation_faults.h"
#include "harness/diagnosis/parameters.h"
#include "harness/injection/drawn_faults.h"
#include "harness/injection/faulty_law.h"

namespace dexcheck {

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
    const bool is_of_coordinates = std::holds_alternative<ObjectChange>(equation.change);
    if (equation.check == nullptr || (is_of_coordinates && !has_coordinates)) continue;
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
