// Laws whose torques are not those that they should be: of all joints, or of one joint, wheel or finger.

#include <algorithm>

#include "harness/injection/fault_kinds.h"
#include "harness/injection/faulty_law.h"

namespace dexcheck {

namespace law_faults {
namespace {

double DrawFactor(const FaultContext& context) {
  constexpr double kWhole[] = {0.0, -1.0, 2.0};
  const size_t which = context.draw->Index(6);
  return which < std::size(kWhole) ? kWhole[which] : 1.0 + context.draw->Size(1e-3, 0.3);
}

bool IsPaperLaw(const FaultContext& context) {
  return context.setup.scenario().joint_task() == nullptr &&
         context.setup.scenario().control.law == ControlLaw::kComputedTorque;
}
bool KnowsMotion(const FaultContext& context) {
  return context.setup.scenario().control.law != ControlLaw::kPdGravity;
}

using IsWanted = bool (*)(const FaultContext& context, const LawEntry& entry);

/// A place in the list of those entries that a kind is of.
size_t DrawEntry(const FaultContext& context, const ScenarioLaw& law, IsWanted is_wanted) {
  std::vector<size_t> wanted;
  for (size_t i = 0; i < law.entries.size(); ++i)
    if (is_wanted(context, law.entries[i])) wanted.push_back(i);
  return wanted[context.draw->Index(wanted.size())];
}

/// Factors of the law's parts; of laws other than the paper's those that all of them have.
bool IsPart(const FaultContext& context, const LawEntry& entry) {
  if (entry.parts == 0) return false;
  if (IsPaperLaw(context)) return true;
  const auto begins = [&](const char* name) { return entry.fault.starts_with(name); };
  if (begins("compensation of friction")) return KnowsMotion(context);
  if (begins("compensation of Coulomb friction"))
    return context.setup.joints() != nullptr && context.setup.joints()->gains.coulomb.size() > 0;
  return begins("gravity (") || begins("position feedback") || begins("velocity feedback");
}

/// Whether a part is several: at one joint all but one of them may vanish, and then it is that one.
bool IsSum(const ScenarioLaw& law, const LawEntry& entry) {
  return std::ranges::any_of(law.entries, [&](const LawEntry& other) {
    return other.parts != 0 && other.parts != entry.parts && (other.parts & entry.parts) == other.parts;
  });
}

/// Places that are drawn from: a robot that stands has its whole law once.
LawPlace DrawPlace(const FaultContext& context) {
  std::vector<LawPlace> places = ListLawPlaces(context.setup);
  std::erase_if(places, [](const LawPlace& one) { return one.is_balanced; });
  return context.draw->Index(3) == 0 ? places.front() : places[context.draw->Index(places.size())];
}

InjectedFault Part(const FaultContext& context) {
  const ScenarioLaw law(context.setup);
  const LawPlace place = DrawPlace(context);
  const bool is_of_one = place.name != "law";
  size_t part = DrawEntry(context, law, IsPart);
  while (is_of_one && IsSum(law, law.entries[part])) part = DrawEntry(context, law, IsPart);
  return MakeLawFault(law.entries[part], part, DrawFactor(context) - 1.0,
                      is_of_one ? std::optional(place) : std::nullopt);
}

bool IsGain(const FaultContext& /*context*/, const LawEntry& entry) {
  return entry.fault.starts_with("gain ");
}
InjectedFault Gain(const FaultContext& context) {
  const ScenarioLaw law(context.setup);
  const size_t gain = DrawEntry(context, law, IsGain);
  return MakeLawFault(law.entries[gain], gain, context.draw->Size(1e-3, 0.3), std::nullopt);
}

/// Whether the law has gains of its own. The ground would balance what the base has of another one.
bool HasGains(const FaultContext& context) {
  return context.model().base().type != BaseType::kFloating &&
         !ScenarioLaw(context.setup).law->gains().empty();
}

bool IsTorque(const FaultContext& /*context*/, const LawEntry& entry) { return entry.fault == "torque"; }
bool IsFriction(const FaultContext& /*context*/, const LawEntry& entry) {
  return entry.fault == "viscous friction";
}
/// Draws a torque that the law adds at one joint; where the law has friction, more of it is a part of that.
InjectedFault Torque(const FaultContext& context) {
  const ScenarioLaw law(context.setup);
  const bool is_friction = !KnowsMotion(context) && context.draw->Index(2) == 0;
  const size_t torque = DrawEntry(context, law, is_friction ? IsFriction : IsTorque);
  const double size = is_friction ? context.draw->Positive(1e-2, 1.0) : context.draw->Size(1e-3, 0.1);
  return MakeLawFault(law.entries[torque], torque, size, std::nullopt);
}

constexpr const char* kLaw = "law";
constexpr FaultKind kKinds[] = {
    {kLaw, "part", Part},
    {kLaw, "gain", Gain, HasGains},
    {kLaw, "torque", Torque},
};

}  // namespace
}  // namespace law_faults

std::span<const FaultKind> ListLawFaultKinds() { return law_faults::kKinds; }

}  // namespace dexcheck
