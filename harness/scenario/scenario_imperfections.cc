#include <algorithm>
#include <cmath>
#include <string_view>

#include "harness/scenario/scenario_reader.h"

namespace dexcheck {
namespace {

/// Largest tilt of a model's gravity: a robot on wheels holds no steeper floor.
constexpr double kLargestSlope = DegToRad(30.0);
/// A factor drawn from 1 -+ this or less stays positive.
constexpr double kLargestSpread = 0.99;

/// A time of at most kMaxDelaySteps steps.
void ReadDelay(TomlTable& table, std::string_view key, double time_step, bool whole, double* target) {
  const auto value = table.Find(key);
  if (!value) return;
  *target = value->AsNotNegative();
  const double steps = *target / time_step;
  if (steps > static_cast<double>(kMaxDelaySteps)) {
    value->Fail("must be at most " + std::to_string(kMaxDelaySteps) + " time steps, which the buffer holds");
  }
  // A quotient of decimal numbers is off a whole number by rounding alone.
  constexpr double kRounding = 1e-9;
  if (whole && std::abs(steps - std::round(steps)) > kRounding * std::max(1.0, steps)) {
    value->Fail("must be a whole number of time steps");
  }
}

/// Reads the source of velocities, and what a Kalman filter needs to know besides.
void ReadSource(TomlTable& table, const char* key, const char* acceleration, VelocitySource* source) {
  ReadChoice<VelocitySource>(table, key,
                             {{"measured", VelocitySource::kMeasured},
                              {"differenced", VelocitySource::kDifferenced},
                              {"kalman", VelocitySource::kKalman}},
                             source);
  if (*source == VelocitySource::kKalman) (void)table.Get(acceleration);
}

void ReadSensing(const TomlValue& value, double time_step, SensingOptions* sensing) {
  using Options = SensingOptions;
  TomlTable table = value.AsTable();
  ReadKeys<Options>(table,
                    {KEY(joint_counts), KEY(joint_noise), KEY(velocity_noise), KEY(velocity_cutoff),
                     POSITIVE_KEY(kalman_acceleration), KEY(odometry), KEY(object_position_noise),
                     KEY(object_orientation_noise), KEY(object_rate), KEY(object_velocity_cutoff),
                     POSITIVE_KEY(object_acceleration), KEY(contact_force_noise)},
                    sensing);
  ReadSource(table, "velocity", "kalman_acceleration", &sensing->velocity);
  ReadSource(table, "object_velocity", "object_acceleration", &sensing->object_velocity);
  if (sensing->object_rate > 0.0) {
    const TomlValue rate = table.Get("object_rate");
    const double steps = 1.0 / (sensing->object_rate * time_step);
    if (steps < 1.0 - 1e-9) rate.Fail("must be at most one pose a time step");
    if (steps > static_cast<double>(kMaxDelaySteps)) {
      rate.Fail("must be at least one pose in " + std::to_string(kMaxDelaySteps) + " time steps");
    }
  }
  ReadDelay(table, "object_latency", time_step, /*whole=*/true, &sensing->object_latency);
  ReadDelay(table, "latency", time_step, /*whole=*/true, &sensing->latency);
  table.RejectUnused();
}

void ReadActuation(const TomlValue& value, double time_step, ActuationOptions* actuation) {
  using Options = ActuationOptions;
  TomlTable table = value.AsTable();
  ReadKeys<Options>(table,
                    {KEY(torque_step), ANY_KEY(gain_error), KEY(lag), KEY(coulomb), KEY(stribeck),
                     POSITIVE_KEY(stribeck_velocity), KEY(backlash), KEY(saturate), KEY(limit)},
                    actuation);
  ReadDelay(table, "delay", time_step, /*whole=*/false, &actuation->delay);
  table.RejectUnused();
}

void ReadWrench(TomlTable& table, double time_step, DisturbanceOptions* one) {
  using Options = DisturbanceOptions;
  one->body = table.Get("body").AsPartName();
  ReadChoice<bool>(table, "frame", {{"world", false}, {"body", true}}, &one->in_body_frame);
  ReadKeys<Options>(table,
                    {KEY(force), KEY(torque), KEY(at), KEY(begin), POSITIVE_KEY(duration),
                     POSITIVE_KEY(period), KEY(begin_within), KEY(size_within)},
                    one);
  if (one->kind == Options::Kind::kPulse || (one->period > 0.0 && one->duration <= 0.0)) {
    (void)table.Get("duration");
  }
  if (one->kind == Options::Kind::kSine || one->kind == Options::Kind::kNoise) {
    one->frequency = table.Get("frequency").AsPositive();
    if (one->frequency * time_step > 0.5) {
      table.Get("frequency").Fail("must be at most half a period in a time step");
    }
  }
  if (one->period > 0.0) {
    if (one->period < one->duration) table.Get("period").Fail("must not be shorter than the duration");
    if (one->begin_within + one->duration > one->period) {
      table.Get("begin_within").Fail("must leave the duration room in the period");
    }
  }
}

/// A number or a list of two, in rad.
void ReadSlope(TomlTable& table, Vector2d* slope) {
  auto [value, unit] = table.FindWithAngleUnit("slope");
  if (!value) value = table.Miss("slope");
  *slope = unit * value->AsVector<2>();
  if (slope->cwiseAbs().maxCoeff() > kLargestSlope) value->Fail("must be at most 30 degrees");
}

void ReadDisturbance(const TomlValue& value, size_t number, double time_step, Imperfections* all) {
  using Kind = DisturbanceOptions::Kind;
  enum class Type { kPulse, kStep, kSine, kNoise, kSlope, kPayload };
  const std::string key = "disturbance." + std::to_string(number);
  TomlTable table = value.AsTable();
  const Type type = table.Get("type").AsChoice<Type>({{"pulse", Type::kPulse},
                                                      {"step", Type::kStep},
                                                      {"sine", Type::kSine},
                                                      {"noise", Type::kNoise},
                                                      {"slope", Type::kSlope},
                                                      {"payload", Type::kPayload}});
  if (type == Type::kSlope) {
    ReadSlope(table, &all->mismatch.slope);
  } else if (type == Type::kPayload) {
    Payload payload{
        .body = table.Get("body").AsPartName(), .mass = table.Get("mass").AsPositive(), .key = key};
    if (const auto at = table.Find("at")) payload.at = at->AsVector<3>();
    all->mismatch.payloads.push_back(payload);
  } else {
    constexpr Kind kKinds[] = {Kind::kPulse, Kind::kStep, Kind::kSine, Kind::kNoise};
    DisturbanceOptions one;
    one.key = key;
    one.kind = kKinds[static_cast<size_t>(type)];
    ReadWrench(table, time_step, &one);
    all->disturbances.push_back(one);
  }
  table.RejectUnused();
}

void ReadMismatch(const TomlValue& value, MismatchOptions* mismatch) {
  using Options = MismatchOptions;
  TomlTable table = value.AsTable();
  ReadKeys<Options>(
      table, {POSITIVE_KEY(mass), KEY(mass_within), KEY(damping), KEY(armature), POSITIVE_KEY(friction)},
      mismatch);
  const ByName& within = mismatch->mass_within;
  const bool too_wide = within.all > kLargestSpread ||
                        std::any_of(within.groups.begin(), within.groups.end(),
                                    [](const auto& group) { return group.second > kLargestSpread; });
  if (too_wide) table.Get("mass_within").Fail("must be at most 0.99");
  if (const auto com = table.Find("com")) {
    for (const auto& [name, shift] : com->AsTable().GetEntries()) {
      mismatch->com.emplace_back(name, shift.AsVector<3>());
    }
  }
  table.RejectUnused();
}

/// "sensing.latency = 0.002" for each key that the scenario has.
void ListKeys(const TomlValue& value, std::vector<std::string>* declared) {
  for (const auto& [name, entry] : value.AsTable().GetEntries()) {
    declared->push_back(entry.path() + " = " + entry.Show());
  }
}

}  // namespace

Imperfections ReadImperfections(TomlTable& root, double time_step) {
  Imperfections all;
  if (const auto sensing = root.Find("sensing")) {
    ReadSensing(*sensing, time_step, &all.sensing);
    ListKeys(*sensing, &all.declared);
  }
  if (const auto actuation = root.Find("actuation")) {
    ReadActuation(*actuation, time_step, &all.actuation);
    ListKeys(*actuation, &all.declared);
  }
  size_t number = 0;
  for (const TomlValue& entry : root.FindList("disturbance")) {
    ReadDisturbance(entry, number++, time_step, &all);
    all.declared.push_back(entry.path() + " = " + entry.Show());
  }
  if (const auto mismatch = root.Find("mismatch")) {
    ReadMismatch(*mismatch, &all.mismatch);
    ListKeys(*mismatch, &all.declared);
  }
  return all;
}

}  // namespace dexcheck
