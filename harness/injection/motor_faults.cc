// Motors whose torques are not what they were sent.

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "harness/injection/fault_kinds.h"

namespace dexcheck {
namespace motor_faults {
namespace {

/// The torque of a motor that is sent u at time t.
using Transmit = std::function<double(double u, double t)>;

/// Entry of tau' of a motor that is drawn.
int DrawEntry(const FaultContext& context) {
  const int offset = context.model().num_base_velocities();
  const size_t wheels = context.rolls() ? 2 : 0;
  const size_t drawn = context.draw->Index(static_cast<size_t>(context.model().num_dofs()) + wheels);
  return static_cast<int>(drawn) + (context.rolls() ? 0 : offset);
}

std::string NameMotor(const FaultContext& context, int entry) {
  const int offset = context.model().num_base_velocities();
  const Base& base = context.model().base();
  return "motor " + (entry >= offset ? context.model().dof_name(entry - offset)
                     : entry == 0    ? base.wheel_joint_right
                                     : base.wheel_joint_left);
}

double TorqueOf(const FaultContext& context, int entry) {
  return std::max(std::abs(context.tau[entry]), 1e-6);
}

/// Changes one motor, or all for no entry. @param transmit a transmission that remembers nothing yet, of
/// which each motor gets a copy.
InjectedFault ChangeMotors(const FaultContext& context, std::optional<int> entry, const std::string& name,
                           double value, double change, const Transmit& transmit) {
  InjectedFault fault = FaultAt(entry ? NameMotor(context, *entry) : "all motors", name, value, change);
  fault.motors = [entry, transmit](const Setup&) -> MotorFault {
    return [entry, transmit, all = std::vector<Transmit>()](double t, VectorXd* tau) mutable {
      all.resize(static_cast<size_t>(tau->size()), transmit);
      for (int i = entry.value_or(0); i < (entry ? *entry + 1 : tau->size()); ++i)
        (*tau)[i] = all[static_cast<size_t>(i)]((*tau)[i], t);
    };
  };
  return fault;
}

// Transmissions.

Transmit Late(size_t steps) {
  return [steps, sent = std::deque<double>()](double u, double) mutable {
    sent.push_back(u);
    if (sent.size() > steps + 1) sent.pop_front();
    return sent.front();
  };
}

/// a' = (u - a) / time.
Transmit Lag(double time, double time_step) {
  return [time, time_step, output = std::nan("")](double u, double t) mutable {
    // Until it begins it keeps up.
    if (std::isnan(output) || t < 0.0) output = u;
    output += (1.0 - std::exp(-time_step / time)) * (u - output);
    return output;
  };
}

Transmit Noise(double size) {
  return [size, random = std::mt19937_64(7)](double u, double) mutable {
    // The sum of twelve uniform numbers has variance 1.
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += DrawUnit(&random);
    return u + size * sum;
  };
}

// Kinds.

/// One motor, or all.
std::optional<int> DrawEntry(const FaultContext& context, bool all) {
  return all ? std::nullopt : std::optional(DrawEntry(context));
}

template <bool kAll>
InjectedFault Gain(const FaultContext& context) {
  const double gain = 1.0 + (kAll ? context.draw->Size(1e-4, 1e-2) : context.draw->Size(0.005, 0.2));
  return ChangeMotors(context, DrawEntry(context, kAll), "gain", gain, gain - 1.0,
                      [gain](double u, double) { return gain * u; });
}

/// Changes the gain of the engine's own actuator.
InjectedFault EngineGain(const FaultContext& context) {
  const double gain = 1.0 + context.draw->Size(0.005, 0.2);
  const std::string joint = context.DrawJoint().name;
  InjectedFault fault = FaultAt("motor " + joint, "gain", gain, gain - 1.0);
  fault.engine = [joint, gain](const Setup&, mjModel* m) {
    const int id = FindId(*m, mjOBJ_JOINT, joint);
    for (int i = 0; i < m->nu; ++i)
      if (m->actuator_trntype[i] == mjTRN_JOINT && m->actuator_trnid[2 * i] == id)
        m->actuator_gainprm[mjNGAIN * i] *= gain;
  };
  return fault;
}

template <bool kForAWhile>
InjectedFault Offset(const FaultContext& context) {
  const double offset = context.draw->Size(1e-3, 0.1);
  const double begin = kForAWhile ? context.draw->Uniform(0.0, 0.5 * context.duration) : 0.0;
  const double end = kForAWhile ? begin + 0.3 * context.duration : HUGE_VAL;
  return ChangeMotors(context, DrawEntry(context), "offset", offset, offset,
                      [=](double u, double t) { return begin <= t && t < end ? u + offset : u; });
}

InjectedFault Drift(const FaultContext& context) {
  const double rate = context.draw->Size(0.01, 1.0);
  const double begin = context.draw->Uniform(0.0, 0.3 * context.duration);
  return ChangeMotors(context, DrawEntry(context), "drift", rate, rate,
                      [=](double u, double t) { return u + rate * std::max(0.0, t - begin); });
}

InjectedFault Ripple(const FaultContext& context) {
  const double size = context.draw->Positive(1e-3, 0.1);
  const double frequency = context.draw->Uniform(3.0, 15.0) / context.duration;
  return ChangeMotors(context, DrawEntry(context), "ripple", size, size,
                      [=](double u, double t) { return u + size * std::sin(2.0 * kPi * frequency * t); });
}

template <bool kAll>
InjectedFault Delay(const FaultContext& context) {
  const size_t steps = 1 + context.draw->Index(kAll ? 4 : 8);
  const auto value = static_cast<double>(steps);
  return ChangeMotors(context, DrawEntry(context, kAll), "delay", value, value, Late(steps));
}

template <bool kAll>
InjectedFault LagOf(const FaultContext& context) {
  const double time = context.draw->Uniform(1.0, kAll ? 10.0 : 20.0) * context.time_step();
  return ChangeMotors(context, DrawEntry(context, kAll), "lag", time, time, Lag(time, context.time_step()));
}

InjectedFault DeadZone(const FaultContext& context) {
  const int entry = DrawEntry(context);
  const double zone = context.draw->Positive(0.02, 0.8) * TorqueOf(context, entry);
  return ChangeMotors(context, entry, "dead zone", zone, zone, [zone](double u, double) {
    return std::abs(u) > zone ? u - std::copysign(zone, u) : 0.0;
  });
}

template <bool kAll>
InjectedFault Rounding(const FaultContext& context) {
  const std::optional<int> entry = DrawEntry(context, kAll);
  const double step = kAll ? context.draw->Positive(1e-3, 1e-2)
                           : context.draw->Positive(1e-3, 0.2) * TorqueOf(context, *entry);
  return ChangeMotors(context, entry, "rounding to steps of", step, step,
                      [step](double u, double) { return step * std::round(u / step); });
}

InjectedFault Limit(const FaultContext& context) {
  const int entry = DrawEntry(context);
  const double most = context.draw->Uniform(0.3, 0.95) * TorqueOf(context, entry);
  return ChangeMotors(context, entry, "limit", most, TorqueOf(context, entry) - most,
                      [most](double u, double) { return std::clamp(u, -most, most); });
}

InjectedFault Stuck(const FaultContext& context) {
  const int entry = DrawEntry(context);
  const double torque = context.draw->Uniform(-0.9, 0.9) * context.tau[entry];
  return ChangeMotors(context, entry, "stuck at", torque, torque - context.tau[entry],
                      [torque](double, double) { return torque; });
}

InjectedFault NoiseOfOne(const FaultContext& context) {
  const double size = context.draw->Positive(1e-4, 1e-2);
  // A sample's standard deviation scatters.
  return ChangeMotors(context, DrawEntry(context), "noise, standard deviation", size, 5.0 * size,
                      Noise(size));
}

InjectedFault Exchange(const FaultContext& context) {
  const int a = DrawEntry(context);
  int b = DrawEntry(context);
  while (b == a) b = DrawEntry(context);
  InjectedFault fault;
  for (const auto& [i, j] : {std::pair{a, b}, std::pair{b, a}}) {
    const InjectedFault one =
        FaultAt(NameMotor(context, i), "signal of " + NameMotor(context, j) + ", gain", 1.0, 1.0);
    fault.truth.push_back(one.truth.front());
  }
  fault.name = NameMotor(context, a) + " and " + NameMotor(context, b) + " exchanged";
  fault.motors = [a, b](const Setup&) -> MotorFault {
    return [a, b](double, VectorXd* tau) { std::swap((*tau)[a], (*tau)[b]); };
  };
  return fault;
}

constexpr const char* kMotor = "motor";
constexpr FaultKind kKinds[] = {
    {kMotor, "gain", Gain<false>},
    {kMotor, "gain in the engine", EngineGain},
    {kMotor, "offset", Offset<false>},
    {kMotor, "offset for a while", Offset<true>},
    {kMotor, "drift", Drift},
    {kMotor, "ripple", Ripple},
    {kMotor, "delay", Delay<false>},
    {kMotor, "lag", LagOf<false>},
    {kMotor, "dead zone", DeadZone},
    {kMotor, "rounding", Rounding<false>},
    {kMotor, "limit", Limit},
    {kMotor, "stuck", Stuck},
    {kMotor, "noise", NoiseOfOne},
    {kMotor, "exchange", Exchange},
    {kMotor, "gain of all", Gain<true>},
    {kMotor, "delay of all", Delay<true>},
    {kMotor, "lag of all", LagOf<true>},
    {kMotor, "rounding of all", Rounding<true>},
};

}  // namespace
}  // namespace motor_faults

std::span<const FaultKind> ListMotorFaultKinds() { return motor_faults::kKinds; }

}  // namespace dexcheck
