#include "harness/scenario/scenario_joints.h"

#include <cmath>
#include <limits>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/scenario/scenario_imperfections.h"

namespace dexcheck {
namespace {

/// Numbers by joint under `key` (rad, m) or `key`_deg; none when it is missing.
JointNumbers ReadNumbers(TomlTable& table, const std::string& key) {
  JointNumbers numbers;
  const auto [value, unit] = table.FindWithAngleUnit(key);
  if (!value) return numbers;
  numbers.key = value->path();
  numbers.in_degrees = unit != 1.0;
  for (const auto& [name, number] : value->AsTable().GetEntries()) {
    numbers.by_name.emplace_back(name, unit * number.AsNumber());
  }
  return numbers;
}

JointMotionOptions::Point ReadPoint(const TomlValue& value, double time_before) {
  TomlTable table = value.AsTable();
  JointMotionOptions::Point point;
  const TomlValue time = table.Get("time");
  point.time = time.AsPositive();
  if (point.time <= time_before) time.Fail("must be greater than the time before");
  point.where = ReadNumbers(table, "joints");
  if (point.where.key.empty()) table.Miss("joints_deg");
  table.RejectUnused();
  return point;
}

JointMotionOptions::Oscillation ReadOscillation(const TomlValue& value) {
  TomlTable table = value.AsTable();
  JointMotionOptions::Oscillation one;
  const TomlValue joint = table.Get("joint");
  one.joint = joint.AsName();
  one.key = value.path();
  auto [amplitude, unit] = table.FindWithAngleUnit("amplitude");
  if (!amplitude) amplitude = table.Miss("amplitude_deg");
  one.amplitude = unit * amplitude->AsNumber();
  one.in_degrees = unit != 1.0;
  const TomlValue frequency = table.Get("frequency");
  one.frequency = frequency.AsPositive();
  // The acceleration has the square of the rate 2 pi f.
  const double rate = 2.0 * kPi * one.frequency;
  if (!std::isfinite(one.amplitude * rate * rate)) frequency.Fail("must not be so large");
  if (const auto time = table.Find("ramp_time")) one.ramp_time = time->AsNotNegative();
  table.RejectUnused();
  return one;
}

}  // namespace

JointMotionOptions ReadJointMotion(const TomlValue& value) {
  TomlTable table = value.AsTable();
  JointMotionOptions motion;
  motion.start = ReadNumbers(table, "start");
  if (const auto points = table.Find("points")) {
    for (const TomlValue& entry : points->AsList()) {
      motion.points.push_back(ReadPoint(entry, motion.points.empty() ? 0.0 : motion.points.back().time));
    }
  }
  if (const auto oscillations = table.Find("oscillations")) {
    for (const TomlValue& entry : oscillations->AsList()) {
      motion.oscillations.push_back(ReadOscillation(entry));
    }
  }
  table.RejectUnused();
  return motion;
}

void ReadJointControl(const TomlValue& value, Scenario* scenario) {
  TomlTable table = value.AsTable();
  ControlOptions& control = scenario->control;
  JointControlOptions& joints = scenario->joint_control;
  if (const auto law = table.Find("law")) {
    control.law = law->AsChoice<ControlLaw>({{"computed_torque", ControlLaw::kComputedTorque},
                                             {"pd_gravity", ControlLaw::kPdGravity},
                                             {"feedforward_pd", ControlLaw::kFeedforwardPd}});
    control.names_law = true;
  }
  // Nothing is X_o here.
  control.orientation = OrientationFeedback::kRotation;
  // A joint that no name fits has no number, which the setup refuses.
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto read = [&](const char* key, ByName* numbers) {
    numbers->all = kNone;
    ReadByName(table, key, &TomlValue::AsNotNegative, numbers);
  };
  (void)table.Get("natural_frequency");
  (void)table.Get("damping_ratio");
  read("natural_frequency", &joints.natural_frequency);
  read("damping_ratio", &joints.damping_ratio);
  for (const auto& [key, numbers] :
       {std::pair("stiffness", &joints.stiffness), {"damping", &joints.damping}}) {
    const auto given = table.Find(key);
    if (!given) continue;
    if (control.law == ControlLaw::kComputedTorque) {
      given->Reject("has no meaning for the law " + Quote(NameOf(control.law)));
    }
    read(key, numbers);
  }
  table.RejectUnused();
}

void RequireJointMotion(const Scenario& scenario) {
  const auto require = [&](bool holds, const char* problem) {
    if (!holds) throw InputError(scenario.source + ": " + problem);
  };
  require(scenario.start == Start::kRest, "start: must be \"rest\" for a motion of joints");
  require(!scenario.plant.bonded, "plant.bonded: a motion of joints has no contacts");
}

}  // namespace dexcheck
