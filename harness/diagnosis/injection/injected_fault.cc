#include "harness/diagnosis/injection/injected_fault.h"

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

/// The same of what is made for each run.
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

FaultyPlant::FaultyPlant(const Setup& setup, std::unique_ptr<EnginePlant> plant, const InjectedFault& fault)
    : plant_(std::move(plant)), forces_(fault.forces) {
  if (fault.engine) plant_->simulation().Change([&](mjModel* m) { fault.engine(setup, m); });
  if (fault.motors) motors_ = fault.motors(setup);
}

void FaultyPlant::EndStep(const Eigen::Ref<const VectorXd>& tau) {
  EngineSimulation& simulation = plant_->simulation();
  tau_ = tau;
  if (motors_) motors_(time_, &tau_);
  const int size = 6 * simulation.model().nbody;
  mjtNum* const forces = simulation.data().xfrc_applied;
  const std::vector<mjtNum> declared(forces, forces + size);
  if (forces_) forces_(simulation.model(), time_, &simulation.data());
  plant_->EndStep(tau_);
  std::copy(declared.begin(), declared.end(), forces);
  time_ += time_step();
}

}  // namespace dexcheck
