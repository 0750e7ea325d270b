#include "harness/scenario/scenario_imperfections.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

using Read = double (TomlValue::*)() const;

constexpr Read kNumber = &TomlValue::AsNumber;
constexpr Read kPositive = &TomlValue::AsPositive;
constexpr Read kNotNegative = &TomlValue::AsNotNegative;

/// Of a model's tilted gravity: a robot on wheels holds no steeper floor.
constexpr double kLargestSlope = DegToRad(30.0);
/// A factor drawn from 1 -+ this or less stays positive.
constexpr double kLargestSpread = 0.99;

void ReadTo(TomlTable& table, std::string_view key, Read read, double* target) {
  if (const auto value = table.Find(key)) *target = ((*value).*read)();
}

void ReadFlag(TomlTable& table, std::string_view key, bool* target) {
  if (const auto value = table.Find(key)) *target = value->AsFlag();
}

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

VelocitySource ReadSource(const TomlValue& value) {
  return value.AsChoice<VelocitySource>({{"measured", VelocitySource::kMeasured},
                                         {"differenced", VelocitySource::kDifferenced},
                                         {"kalman", VelocitySource::kKalman}});
}

void ReadSensing(const TomlValue& value, double time_step, SensingOptions* sensing) {
  TomlTable table = value.AsTable();
  ReadByName(table, "joint_counts", kNotNegative, &sensing->joint_counts);
  ReadByName(table, "joint_noise", kNotNegative, &sensing->joint_noise);
  ReadByName(table, "velocity_noise", kNotNegative, &sensing->velocity_noise);
  if (const auto source = table.Find("velocity")) sensing->velocity = ReadSource(*source);
  ReadTo(table, "velocity_cutoff", kNotNegative, &sensing->velocity_cutoff);
  ReadTo(table, "kalman_acceleration", kPositive, &sensing->kalman_acceleration);
  if (sensing->velocity == VelocitySource::kKalman) (void)table.Get("kalman_acceleration");
  ReadFlag(table, "odometry", &sensing->odometry);
  ReadTo(table, "object_position_noise", kNotNegative, &sensing->object_position_noise);
  ReadTo(table, "object_orientation_noise", kNotNegative, &sensing->object_orientation_noise);
  ReadTo(table, "object_rate", kNotNegative, &sensing->object_rate);
  if (sensing->object_rate > 0.0) {
    const double steps = 1.0 / (sensing->object_rate * time_step);
    if (steps < 1.0 - 1e-9) table.Get("object_rate").Fail("must be at most one pose a time step");
    if (steps > static_cast<double>(kMaxDelaySteps)) {
      table.Get("object_rate")
          .Fail("must be at least one pose in " + std::to_string(kMaxDelaySteps) + " time steps");
    }
  }
  ReadDelay(table, "object_latency", time_step, /*whole=*/true, &sensing->object_latency);
  if (const auto source = table.Find("object_velocity")) sensing->object_velocity = ReadSource(*source);
  ReadTo(table, "object_velocity_cutoff", kNotNegative, &sensing->object_velocity_cutoff);
  ReadTo(table, "object_acceleration", kPositive, &sensing->object_acceleration);
  if (sensing->object_velocity == VelocitySource::kKalman) (void)table.Get("object_acceleration");
  ReadTo(table, "contact_force_noise", kNotNegative, &sensing->contact_force_noise);
  ReadDelay(table, "latency", time_step, /*whole=*/true, &sensing->latency);
  table.RejectUnused();
}

void ReadActuation(const TomlValue& value, double time_step, ActuationOptions* actuation) {
  TomlTable table = value.AsTable();
  ReadByName(table, "torque_step", kNotNegative, &actuation->torque_step);
  ReadByName(table, "gain_error", kNumber, &actuation->gain_error);
  ReadByName(table, "lag", kNotNegative, &actuation->lag);
  ReadByName(table, "coulomb", kNotNegative, &actuation->coulomb);
  ReadByName(table, "stribeck", kNotNegative, &actuation->stribeck);
  ReadTo(table, "stribeck_velocity", kPositive, &actuation->stribeck_velocity);
  ReadByName(table, "backlash", kNotNegative, &actuation->backlash);
  ReadDelay(table, "delay", time_step, /*whole=*/false, &actuation->delay);
  ReadFlag(table, "saturate", &actuation->saturate);
  table.RejectUnused();
}

void ReadWrench(TomlTable& table, DisturbanceOptions::Kind kind, double time_step, DisturbanceOptions* one) {
  one->kind = kind;
  one->body = table.Get("body").AsName();
  if (const auto force = table.Find("force")) one->force = force->AsVector<3>();
  if (const auto torque = table.Find("torque")) one->torque = torque->AsVector<3>();
  if (const auto at = table.Find("at")) one->at = at->AsVector<3>();
  if (const auto frame = table.Find("frame")) {
    one->in_body_frame = frame->AsChoice<bool>({{"world", false}, {"body", true}});
  }
  ReadTo(table, "begin", kNotNegative, &one->begin);
  ReadTo(table, "duration", kPositive, &one->duration);
  using Kind = DisturbanceOptions::Kind;
  if (kind == Kind::kPulse) (void)table.Get("duration");
  if (kind == Kind::kSine || kind == Kind::kNoise) {
    one->frequency = table.Get("frequency").AsPositive();
    if (one->frequency * time_step > 0.5) {
      table.Get("frequency").Fail("must be at most half a period in a time step");
    }
  }
  ReadTo(table, "period", kPositive, &one->period);
  if (one->period > 0.0) {
    if (one->duration <= 0.0) (void)table.Get("duration");
    if (one->period < one->duration) table.Get("period").Fail("must not be shorter than the duration");
  }
  ReadTo(table, "begin_within", kNotNegative, &one->begin_within);
  if (one->period > 0.0 && one->begin_within + one->duration > one->period) {
    table.Get("begin_within").Fail("must leave the duration room in the period");
  }
  ReadTo(table, "size_within", kNotNegative, &one->size_within);
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
    Payload payload{.body = table.Get("body").AsName(), .mass = table.Get("mass").AsPositive(), .key = key};
    if (const auto at = table.Find("at")) payload.at = at->AsVector<3>();
    all->mismatch.payloads.push_back(payload);
  } else {
    constexpr Kind kKinds[] = {Kind::kPulse, Kind::kStep, Kind::kSine, Kind::kNoise};
    DisturbanceOptions one;
    one.key = key;
    ReadWrench(table, kKinds[static_cast<size_t>(type)], time_step, &one);
    all->disturbances.push_back(one);
  }
  table.RejectUnused();
}

void ReadMismatch(const TomlValue& value, MismatchOptions* mismatch) {
  TomlTable table = value.AsTable();
  ReadByName(table, "mass", kPositive, &mismatch->mass);
  ReadByName(table, "mass_within", kNotNegative, &mismatch->mass_within);
  const ByName& within = mismatch->mass_within;
  const bool too_wide = within.all > kLargestSpread ||
                        std::any_of(within.groups.begin(), within.groups.end(),
                                    [](const auto& group) { return group.second > kLargestSpread; });
  if (too_wide) table.Get("mass_within").Fail("must be at most 0.99");
  ReadByName(table, "damping", kNotNegative, &mismatch->damping);
  ReadByName(table, "armature", kNotNegative, &mismatch->armature);
  if (const auto com = table.Find("com")) {
    for (const auto& [name, shift] : com->AsTable().GetEntries()) {
      mismatch->com.emplace_back(name, shift.AsVector<3>());
    }
  }
  table.RejectUnused();
}

/// "sensing.latency = 0.002" for each key that the scenario has.
void ListKeys(const TomlValue& value, std::vector<std::string>* asked) {
  for (const auto& [name, entry] : value.AsTable().GetEntries()) {
    asked->push_back(entry.path() + " = " + entry.Show());
  }
}

}  // namespace

void ReadByName(TomlTable& table, const std::string& key, double (TomlValue::*read)() const, ByName* target) {
  const auto value = table.Find(key);
  if (!value) return;
  target->key = value->path();
  if (!value->IsTable()) {
    target->all = ((*value).*read)();
    return;
  }
  for (const auto& [name, entry] : value->AsTable().GetEntries()) {
    target->groups.emplace_back(name, (entry.*read)());
  }
}

Imperfections ReadImperfections(TomlTable* root, double time_step) {
  Imperfections all;
  if (const auto sensing = root->Find("sensing")) {
    ReadSensing(*sensing, time_step, &all.sensing);
    ListKeys(*sensing, &all.asked);
  }
  if (const auto actuation = root->Find("actuation")) {
    ReadActuation(*actuation, time_step, &all.actuation);
    ListKeys(*actuation, &all.asked);
  }
  if (const auto disturbances = root->Find("disturbance")) {
    size_t number = 0;
    for (const TomlValue& entry : disturbances->AsList()) {
      ReadDisturbance(entry, number++, time_step, &all);
      all.asked.push_back(entry.path() + " = " + entry.Show());
    }
  }
  if (const auto mismatch = root->Find("mismatch")) {
    ReadMismatch(*mismatch, &all.mismatch);
    ListKeys(*mismatch, &all.asked);
  }
  return all;
}

}  // namespace dexcheck
