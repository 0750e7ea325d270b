#include "harness/injection/faulty_law.h"

#include <algorithm>
#include <utility>

#include "harness/injection/fault_kinds.h"

namespace dexcheck {
ScenarioLaw::ScenarioLaw(const Setup& setup)
    : law(setup.joints() != nullptr ? MakeJointLaw(setup) : MakeObjectLaw(setup)),
      entries(ListLawEntries(setup, law.get())) {}

FaultyLaw::FaultyLaw(const Setup& setup, std::unique_ptr<Controller> right, IsOn is_on)
    : right_(std::move(right)),
      is_on_(is_on ? std::move(is_on) : [this] { return has_begun_; }),
      law_(setup),
      actuation_(setup.model()),
      terms_(setup.model().num_positions(), setup.model().num_velocities(),
             3 * static_cast<int>(setup.fingertips().size())),
      snapshot_{.inputs = {.terms = terms_},
                .difference = VectorXd::Zero(setup.model().num_velocities()),
                .error_sum = VectorXd::Zero(setup.model().num_velocities())} {}

FaultyLaw::FaultyLaw(const Setup& setup, std::unique_ptr<Controller> right, LawFault fault, IsOn is_on)
    : FaultyLaw(setup, std::move(right), std::move(is_on)) {
  fault_ = std::move(fault);
}

FaultyLaw::FaultyLaw(const Setup& setup, std::unique_ptr<Controller> right, const EquationFault& fault,
                     IsOn is_on)
    : FaultyLaw(setup, std::move(right), std::move(is_on)) {
  change_ = fault.change;
  model_.emplace(setup.model(), setup.fingertips(), setup.object().body, setup.surface(),
                 setup.MakeControllerOptions());
}

void FaultyLaw::Begin(double t, const Reading& reading) {
  right_->Begin(t, reading);
  has_begun_ = true;
}

void FaultyLaw::Step(const Reading& reading, double t, Command* command) {
  right_->Step(reading, t, command);
  const bool is_on = is_on_();
  if (model_) model_->SetState(reading.state);
  if (model_ && is_on) MakeFault(*change_, reading.state, &*model_);
  if (!law_.law->IsComputed(*command)) return;
  step_.time = t;
  step_.command = *command;
  step_.model = &right_->model();
  ReadTerms(right_->model(), reading.state.q, reading.state.xi, &terms_);
  snapshot_.inputs = law_.law->MakeInputs(step_, terms_);
  const VectorXd change = is_on ? CalcChange(reading.state) : VectorXd();
  if (change.size() > 0) {
    VectorXd tau(change.size());
    actuation_.CalcTorque(change, tau);
    command->tau += tau;
  }
  snapshot_.inputs.now.sent = snapshot_.inputs.now.force;
  if (change.size() > 0) snapshot_.inputs.now.sent += change;
  constexpr size_t kMemory = 16;  // steps, more than the oldest signal of an entry
  snapshot_.before.push_front(snapshot_.inputs.now);
  if (snapshot_.before.size() > kMemory) snapshot_.before.pop_back();
}

VectorXd FaultyLaw::CalcChange(const MeasuredState& state) {
  if (snapshot_.inputs.now.force.size() == 0) return {};
  if (fault_) {
    const LawForce right = [this](const LawInputs& inputs) { return law_.law->CalcForce(inputs); };
    const LawAtStep at(snapshot_, snapshot_.inputs, right, snapshot_.inputs.now.force);
    const LawTerm term{&law_.entries[fault_->entry], fault_->place ? &*fault_->place : nullptr,
                       VectorXd::Constant(1, fault_->amplitude)};
    return term.CalcChange(actuation_, at);
  }
  LawInputs wrong = snapshot_.inputs;
  ReadTerms(*model_, state.q, state.xi, &wrong.terms);
  wrong.M = model_->robot().M();
  wrong.C = model_->robot().C();
  wrong.J_dot = model_->grasp().J_B_dot();
  wrong.G_dot = model_->grasp().G_dot();
  const VectorXd force = law_.law->CalcForce(wrong);
  if (force.size() == 0) return {};
  return force - snapshot_.inputs.now.force;
}

InjectedFault MakeLawFault(const LawEntry& entry, size_t index, double amplitude,
                           const std::optional<LawPlace>& place) {
  InjectedFault one =
      FaultAt(place ? place->name : entry.place, entry.fault, entry.nominal + amplitude, amplitude);
  one.needs_error = true;
  one.controller = [fault = LawFault{index, amplitude, place}](
                       const Setup& setup, std::unique_ptr<Controller> right, const IsOn& is_on) {
    return std::make_unique<FaultyLaw>(setup, std::move(right), fault, is_on);
  };
  return one;
}

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
