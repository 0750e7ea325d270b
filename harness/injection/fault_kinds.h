#pragma once

// The kinds of faults that a campaign makes in a run, each with a function that draws its place, size and
// time. Another kind is one more entry of one of the lists.

#include <cstdint>
#include <random>
#include <span>
#include <string>

#include "harness/injection/injected_fault.h"
#include "harness/plant/random_stream.h"

namespace dexcheck {

/// Random draws, the same on every machine.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double Uniform(double low, double high) { return low + (high - low) * DrawUnit(&random_); }
  /// Evenly over decades, with either sign.
  double Size(double low, double high) {
    const double size = Positive(low, high);
    return random_() % 2 == 0 ? size : -size;
  }
  double Positive(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }
  size_t Index(size_t count) { return static_cast<size_t>(random_() % count); }
  Vector3d Direction() {
    const double z = Uniform(-1.0, 1.0), angle = Uniform(0.0, 2.0 * kPi), r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  std::mt19937_64 random_;
};

/// The run that a fault is drawn for.
struct FaultContext {
  const Setup& setup;
  double duration;      ///< Of the run, s.
  const VectorXd& tau;  ///< tau' (n) of the right run, which dead zones and steps are relative to.
  Draw* draw;

  [[nodiscard]] const RobotModel& model() const { return setup.model(); }
  [[nodiscard]] double time_step() const { return setup.scenario().plant.time_step; }
  [[nodiscard]] bool rolls() const { return model().base().type == BaseType::kDifferentialDrive; }
  [[nodiscard]] bool holds() const { return !setup.fingertips().empty(); }
  /// "joint r_elbow" of a drawn joint.
  [[nodiscard]] const Joint& DrawJoint() const {
    return model().joints()[draw->Index(static_cast<size_t>(model().num_joints()))];
  }
};

/// One kind of fault.
struct FaultKind {
  const char* kind;  ///< "motor": what a table sums up by.
  const char* name;  ///< "gain".
  InjectedFault (*make)(const FaultContext& context);
  bool (*applies)(const FaultContext& context) = nullptr;  ///< To which runs; null for all.
  Cause cause = Cause::kNone;  ///< That the verdict should have, where the fault itself does not say it.
};

std::span<const FaultKind> ListMotorFaultKinds();
std::span<const FaultKind> ListSensorFaultKinds();
/// Lists faults of joints, links and object.
std::span<const FaultKind> ListBodyFaultKinds();
/// Lists faults of floor, wheels, contacts and solver.
std::span<const FaultKind> ListWorldFaultKinds();
/// Lists faults of laws of every kind.
std::span<const FaultKind> ListLawFaultKinds();

/// A fault with a size. @param change by which it changes its value.
InjectedFault FaultAt(const std::string& place, const std::string& name, double value, double change);
/// A fault that is no number. @param part that the evidence should name; empty for nothing.
InjectedFault FaultAt(const std::string& name, Cause cause, const std::string& part = "");

/// Id in the engine's model. @throws InputError when it has no such thing.
int FindId(const mjModel& m, mjtObj kind, const std::string& name);

}  // namespace dexcheck
