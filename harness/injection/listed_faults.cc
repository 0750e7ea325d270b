#include <algorithm>

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

std::vector<FaultSet> ListLawFaults(const Setup& setup) {
  std::vector<FaultSet> sets;
  for (const LawFault& law : ListLawFaults(!setup.adapter().wheels().empty())) {
    const bool is_part = law.part != SIZE_MAX;
    InjectedFault fault = FaultAt(law.name, Cause::kControlLaw);
    fault.kind = is_part ? "law, one part" : "law, otherwise";
    if (is_part) {
      const LawPartName& part = ListLawParts()[law.part];
      fault.truth = {{std::string(part.name) + " (" + part.symbol + "), factor", "law", law.factor,
                      std::abs(law.factor - 1.0), "", ""}};
    }
    fault.needs_error = true;
    fault.controller = [law](const Setup& own, std::unique_ptr<Controller> /*right*/, const IsOn& is_on) {
      return std::make_unique<FaultyLaw>(own, law, is_on);
    };
    sets.push_back({fault});
  }
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
    fault.controller = [equation](const Setup& own, std::unique_ptr<Controller> /*right*/,
                                  const IsOn& is_on) {
      return std::make_unique<FaultyLaw>(own, equation, is_on);
    };
    sets.push_back({fault});
  }
  return sets;
}

}  // namespace dexcheck
