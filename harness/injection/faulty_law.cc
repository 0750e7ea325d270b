#include "harness/injection/faulty_law.h"

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
  if (model_ && is_on) FaultyTerms(&*model_, reading.state).Make(*change_);
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
  const VectorXd force = law_.law->CalcForce(std::move(wrong));
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

}  // namespace dexcheck
