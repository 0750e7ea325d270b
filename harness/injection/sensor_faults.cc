// Measured states that are not what is so.

#include <cmath>

#include "harness/injection/fault_kinds.h"

namespace dexcheck {
namespace sensor_faults {
namespace {

/// A joint's entries of the measured state.
struct JointEntry {
  std::string name;  ///< "joint r_elbow".
  int q, xi;
};

JointEntry DrawEntry(const FaultContext& context) {
  const RobotModel& model = context.model();
  const auto joint = static_cast<int>(context.draw->Index(static_cast<size_t>(model.num_joints())));
  return {"joint " + model.joints()[static_cast<size_t>(joint)].name, model.position_index(joint),
          model.num_base_velocities() + model.dof(joint)};
}

/// @param change_state remembers nothing yet: each run gets a copy.
InjectedFault Sensor(const std::string& place, const std::string& name, double value, double change,
                     const SensorFault& change_state) {
  InjectedFault fault = FaultAt(place, name, value, change);
  fault.sensors = [change_state](const Setup&) { return change_state; };
  return fault;
}

/// Draws an offset of an encoder, rad or m.
double DrawOffset(const FaultContext& context) { return context.draw->Size(1e-5, 1e-3); }

InjectedFault Offset(const FaultContext& context) {
  const JointEntry joint = DrawEntry(context);
  const double offset = DrawOffset(context);
  return Sensor(joint.name + ", position", "offset", offset, offset,
                [i = joint.q, offset](double, MeasuredState* state) { state->q[i] += offset; });
}

template <bool kRate>
InjectedFault Gain(const FaultContext& context) {
  const JointEntry joint = DrawEntry(context);
  const double gain = 1.0 + context.draw->Size(1e-3, 2e-2);
  return Sensor(joint.name + (kRate ? ", rate" : ", position"), "gain", gain, gain - 1.0,
                [joint, gain](double, MeasuredState* state) {
                  (kRate ? state->xi[joint.xi] : state->q[joint.q]) *= gain;
                });
}

InjectedFault Drift(const FaultContext& context) {
  const JointEntry joint = DrawEntry(context);
  const double rate = DrawOffset(context) / context.duration;
  return Sensor(joint.name + ", position", "drift", rate, rate,
                [i = joint.q, rate](double t, MeasuredState* state) { state->q[i] += rate * t; });
}

InjectedFault Noise(const FaultContext& context) {
  const JointEntry joint = DrawEntry(context);
  const double most = context.draw->Positive(1e-6, 1e-4);
  const double deviation = most / std::sqrt(3.0);
  return Sensor(joint.name + ", position", "noise, standard deviation", deviation, 5.0 * deviation,
                [i = joint.q, most, random = std::mt19937_64(5)](double, MeasuredState* state) mutable {
                  state->q[i] += most * (2.0 * DrawUnit(&random) - 1.0);
                });
}

InjectedFault Rounding(const FaultContext& context) {
  const JointEntry joint = DrawEntry(context);
  const double step = context.draw->Positive(1e-5, 1e-3);
  return Sensor(joint.name + ", position", "rounding to steps of", step, step,
                [i = joint.q, step](double, MeasuredState* state) {
                  state->q[i] = step * std::round(state->q[i] / step);
                });
}

InjectedFault Stuck(const FaultContext& context) {
  const JointEntry joint = DrawEntry(context);
  const double value = context.setup.start().q[joint.q] + DrawOffset(context);
  return Sensor(joint.name + ", position", "stuck at", value, DrawOffset(context),
                [i = joint.q, value](double, MeasuredState* state) { state->q[i] = value; });
}

InjectedFault DelayOfAll(const FaultContext& context) {
  const size_t steps = 1 + context.draw->Index(3);
  const auto value = static_cast<double>(steps);
  return Sensor("everything that is measured", "delay", value, value,
                [steps, before = std::vector<MeasuredState>()](double, MeasuredState* state) mutable {
                  before.push_back(*state);
                  if (before.size() > steps + 1) before.erase(before.begin());
                  *state = before.front();
                });
}

InjectedFault Heading(const FaultContext& context) {
  const double offset = DrawOffset(context);
  return Sensor("base " + context.model().base().link + ", heading", "offset", offset, offset,
                [offset](double, MeasuredState* state) { state->q[2] += offset; });
}

/// One entry of its position or velocity.
template <bool kPosition>
InjectedFault ObjectEntry(const FaultContext& context) {
  const double offset = DrawOffset(context);
  const auto axis = static_cast<Eigen::Index>(context.draw->Index(3));
  return Sensor(
      "object " + context.setup.object().name + ", " + (kPosition ? "position " : "velocity ") + "xyz"[axis],
      "offset", offset, offset, [=](double, MeasuredState* state) {
        (kPosition ? state->X_Bo.translation()[axis] : state->V_Bo[axis]) += offset;
      });
}

/// Changes one measured number of a fingertip's contact.
InjectedFault Contact(const FaultContext& context) {
  const double offset = DrawOffset(context);
  const size_t tip = context.draw->Index(context.setup.fingertips().size());
  const Frame& frame = context.model().frames()[static_cast<size_t>(context.setup.fingertips()[tip])];
  const size_t which = context.draw->Index(3);
  constexpr const char* kEntries[] = {", contact u on the object", ", contact u on the fingertip",
                                      ", contact angle psi"};
  return Sensor("fingertip " + frame.name + kEntries[which], "offset", offset, offset,
                [=](double, MeasuredState* state) {
                  ContactCoordinates& kappa = state->kappa[tip];
                  (which == 0 ? kappa.alpha_o.u : which == 1 ? kappa.alpha_f.u : kappa.psi) += offset;
                });
}

bool Holds(const FaultContext& context) { return context.holds(); }

constexpr const char* kSensor = "sensor";
constexpr FaultKind kKinds[] = {
    {kSensor, "offset", Offset},
    {kSensor, "gain", Gain<false>},
    {kSensor, "gain of a rate", Gain<true>},
    {kSensor, "drift", Drift},
    {kSensor, "noise", Noise},
    {kSensor, "rounding", Rounding},
    {kSensor, "stuck", Stuck},
    {kSensor, "delay of all", DelayOfAll},
    {kSensor, "heading", Heading, [](const FaultContext& context) { return context.rolls(); }},
    {kSensor, "object's position", ObjectEntry<true>, Holds},
    {kSensor, "object's velocity", ObjectEntry<false>, Holds},
    {kSensor, "contact coordinates", Contact, Holds},
};

}  // namespace
}  // namespace sensor_faults

std::span<const FaultKind> ListSensorFaultKinds() { return sensor_faults::kKinds; }

}  // namespace dexcheck
