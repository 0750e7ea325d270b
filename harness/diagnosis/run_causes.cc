#include "harness/diagnosis/run_causes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "harness/diagnosis/force_steps.h"
#include "harness/diagnosis/model_causes.h"
#include "harness/diagnosis/search_limit.h"
#include "harness/diagnosis/signal_causes.h"

namespace dexcheck {
namespace {

/// The largest that a fault of each unit can be in this robot.
class PlausibleSizes {
 public:
  explicit PlausibleSizes(const StepStore& store) {
    const RobotModel& model = store.setup().model();
    double mass = model.base_with_wheels().mass, reach = 0.0, effort = 0.0;
    for (const Joint& joint : model.joints()) {
      mass += joint.body.mass;
      reach += joint.X_PB.translation().norm() + std::abs(joint.mdh.a) + std::abs(joint.mdh.d);
    }
    const mjModel& engine = store.setup().engine();
    for (int i = 0; i < engine.nu; ++i)
      if (engine.actuator_ctrllimited[i] != 0)
        effort =
            std::max(effort, std::abs(engine.actuator_ctrlrange[2 * i + 1] * engine.actuator_gear[6 * i]));
    if (store.setup().has_object()) mass += store.setup().declared_object().body.mass;
    constexpr double kMany = 10.0, kEarth = 10.0;  // of anything; m/s^2
    const double weight = mass * kEarth;
    const double torque = kMany * std::max(effort, weight * reach), force = kMany * std::max(effort, weight);
    // Friction that takes all torque at a hundredth of a radian or metre a second.
    constexpr double kSlow = 1e-2;
    most_ = {{"N m", torque},
             {"N", force},
             {"N m s/rad", torque / kSlow},
             {"N s/m", force / kSlow},
             {"kg", kMany * mass},
             {"m/s^2", 2.0 * kEarth},
             {"deg", 90.0},
             {"s", 1.0}};
  }

  /// Whether such a fault can be. What is no size, and what motion does not show, is none.
  [[nodiscard]] bool CanBe(const Fault& fault) const {
    if (fault.fault == kUnknownFault || std::isnan(fault.value)) return true;
    const bool is_factor = fault.unit.empty();
    const bool has_no_size =
        fault.value == 0.0 && !is_factor && (!(fault.error < kNever) || fault.error > 0.0);
    if (!std::isfinite(fault.value) || has_no_size) return false;
    // No time, mass, friction and size of a step is negative.
    for (const char* kind :
         {"delay", "lag", "dead zone", "backlash", "noise", "rounding", "mass", "friction"})
      if (fault.value < 0.0 && !is_factor && fault.fault.find(kind) != std::string::npos) return false;
    const auto most = most_.find(fault.unit);
    return most == most_.end() || std::abs(fault.value) <= most->second;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  std::map<std::string, double> most_;
};

/// Impossible faults are left out; a residual that only they would explain is not explained.
void DropImpossible(const StepStore& store, Causes* causes) {
  const PlausibleSizes sizes(store);
  for (Explanation& one : *causes) {
    // A law can ask for anything.
    if (one.faults.empty() || one.channel == CauseChannel::kLaw) continue;
    const std::string place = one.faults.front().place;
    const auto dropped = std::erase_if(one.faults, [&](const Fault& fault) { return !sizes.CanBe(fault); });
    if (dropped == 0) continue;
    if (one.faults.empty()) {
      one.faults.push_back({kUnknownFault, place, 0.0, 0.0, "", ""});
      one.outcome = CauseOutcome::kNotExplained;
      one.rival.clear();
    } else if (one.outcome != CauseOutcome::kNotExplained) {
      one.SetOutcome();
    }
  }
}

/// Adds a balance that does not hold, and that the search had no time for.
void AddUnsearched(const StepStore& store, Causes* causes) {
  const auto is_balance = [](const Explanation& one) { return one.channel == CauseChannel::kBalance; };
  if (store.has_misplaced_link() || std::ranges::any_of(*causes, is_balance)) return;
  const ForceSteps steps = ListForceSteps(store);
  if (steps.all.empty()) return;
  Explanation one{.channel = CauseChannel::kBalance, .outcome = CauseOutcome::kNotExplained};
  one.from = store.Row(steps.all.front())[0];
  one.to = store.Row(steps.all.back())[0];
  causes->push_back(one);
}

}  // namespace

Causes ExplainRun(const StepStore& store, double void_from, const SearchOptions& options, bool* stopped) {
  const SearchLimit limit(options.seconds);
  Causes causes;
  const auto add = [&](Causes (*explain)(const StepStore&), const StepStore& from) {
    if (SearchLimit::IsOver()) return;
    Causes found = explain(from);
    std::move(found.begin(), found.end(), std::back_inserter(causes));
  };
  const Setup& setup = store.setup();
  const bool has_other_numbers = !setup.constants().findings.empty();
  if (options.model_fails && !has_other_numbers) causes = ListModelCauses(setup.model(), setup.engine());
  const bool is_other_model = has_other_numbers || !causes.empty();
  add(ExplainGeometry, store);
  add(ExplainSignals, store);
  // The law is judged at contacts that are elsewhere, too.
  if (!is_other_model && (!store.has_misplaced_link() || setup.fingertips().empty())) add(ExplainLaw, store);
  if (!is_other_model) {
    add(ExplainContacts, store);
    add(ExplainRolling, store.GetBefore(void_from));
  }
  // A wheel of another size stands higher or lower, too.
  const auto rolls_otherwise = [](const Explanation& one) {
    return one.channel == CauseChannel::kRolling && one.outcome != CauseOutcome::kNotExplained;
  };
  if (std::ranges::any_of(causes, rolls_otherwise))
    std::erase_if(causes, [](const Explanation& one) {
      return one.channel == CauseChannel::kGeometry && one.faults.front().place.starts_with("wheel ");
    });
  if (!is_other_model && !store.has_misplaced_link()) add(ExplainForces, store);
  if (limit.has_ended() && !is_other_model) AddUnsearched(store, &causes);
  if (stopped != nullptr) *stopped = limit.has_ended();
  DropImpossible(store, &causes);
  std::stable_sort(causes.begin(), causes.end(),
                   [](const Explanation& a, const Explanation& b) { return a.channel < b.channel; });
  return causes;
}

}  // namespace dexcheck
