#include "harness/injection/injected_fault.h"

#include <algorithm>
#include <utility>

namespace dexcheck {
namespace {

/// Both, one after the other, on the same arguments.
template <typename... Arguments>
std::function<void(Arguments...)> InTurn(std::function<void(Arguments...)> a,
                                         std::function<void(Arguments...)> b) {
  if (!a) return b;
  if (!b) return a;
  return [a = std::move(a), b = std::move(b)](Arguments... arguments) {
    a(arguments...);
    b(arguments...);
  };
}

/// InTurn for functions that are made for each run.
template <typename Change>
std::function<Change(const Setup&)> MakeInTurn(const std::function<Change(const Setup&)>& a,
                                               const std::function<Change(const Setup&)>& b) {
  if (!a) return b;
  if (!b) return a;
  return [a, b](const Setup& setup) { return InTurn(a(setup), b(setup)); };
}

}  // namespace

InjectedFault Join(const InjectedFault& first, const InjectedFault& second) {
  InjectedFault both = first;
  both.name += "; " + second.name;
  both.kind += " + " + second.kind;
  both.truth.insert(both.truth.end(), second.truth.begin(), second.truth.end());
  both.from_start = first.from_start || second.from_start;
  both.needs_error = first.needs_error || second.needs_error;
  both.engine = InTurn(first.engine, second.engine);
  both.forces = InTurn(first.forces, second.forces);
  both.motors = MakeInTurn(first.motors, second.motors);
  both.sensors = MakeInTurn(first.sensors, second.sensors);
  if (!both.controller) both.controller = second.controller;
  if (!both.model) both.model = second.model;
  return both;
}

FaultyPlant::FaultyPlant(const Setup& setup, std::unique_ptr<EnginePlant> plant, const InjectedFault& fault,
                         std::shared_ptr<const RunClock> clock, double begin)
    : plant_(std::move(plant)), clock_(std::move(clock)), begin_(begin), forces_(fault.forces) {
  if (fault.engine) change_ = [&setup, change = fault.engine](mjModel* m) { change(setup, m); };
  if (change_ && (fault.from_start || begin <= 0.0))
    plant_->simulation().Change(std::exchange(change_, nullptr));
  if (fault.motors) motors_ = fault.motors(setup);
}

void FaultyPlant::BeginStep() {
  // The time is that of the step before.
  if (change_ && clock_->Since(begin_, clock_->time + 1.5 * time_step()) >= 0.0)
    plant_->simulation().Change(std::exchange(change_, nullptr));
  plant_->BeginStep();
}

void FaultyPlant::EndStep(const Eigen::Ref<const VectorXd>& tau) {
  EngineSimulation& simulation = plant_->simulation();
  const double since = clock_->Since(begin_, clock_->time);
  // A fault with memory knows what was before it began.
  tau_ = tau;
  if (motors_) motors_(since, &tau_);
  if (!(since >= 0.0)) return plant_->EndStep(tau);
  const auto size = 6 * simulation.model().nbody;
  mjtNum* const forces = simulation.data().xfrc_applied;
  const std::vector<mjtNum> declared(forces, forces + size);
  if (forces_) forces_(simulation.model(), since, &simulation.data());
  plant_->EndStep(tau_);
  std::copy(declared.begin(), declared.end(), forces);
}

}  // namespace dexcheck
