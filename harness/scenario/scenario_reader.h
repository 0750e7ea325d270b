#pragma once

// How a scenario is read: the keys of a table as a table of each key's name, where its value goes, what it
// may be; and the parts of a scenario.

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "controller/common/toml_reader.h"
#include "harness/plant/imperfections.h"
#include "harness/scenario/scenario.h"

namespace dexcheck {

/// Range of a number.
enum class Range { kAny, kNotNegative, kPositive };

/// One key. The type of the member says what the value is: a number, a flag, three numbers, numbers by name,
/// names.
template <typename Options>
struct Key {
  using Target = std::variant<double Options::*, std::optional<double> Options::*, bool Options::*,
                              ByName Options::*, Vector3d Options::*, std::vector<std::string> Options::*>;
  const char* name;
  Target target;
  Range range = Range::kNotNegative;
};

// Keys that are called as the members of Options where their values go: numbers that are not negative (also
// flags and lists), positive ones, any.
#define KEY(member) \
  { #member, &Options::member }
#define POSITIVE_KEY(member) \
  { #member, &Options::member, Range::kPositive }
#define ANY_KEY(member) \
  { #member, &Options::member, Range::kAny }

void ReadValue(const TomlValue& value, Range range, double* target);
void ReadValue(const TomlValue& value, Range range, std::optional<double>* target);
void ReadValue(const TomlValue& value, Range range, bool* target);
/// One number, or a table of numbers by name.
void ReadValue(const TomlValue& value, Range range, ByName* target);
void ReadValue(const TomlValue& value, Range range, Vector3d* target);
void ReadValue(const TomlValue& value, Range range, std::vector<std::string>* target);

/// Reads those of the keys that the table has. @throws InputError as TomlValue.
template <typename Options>
void ReadKeys(TomlTable& table, std::initializer_list<Key<Options>> keys, Options* options) {
  for (const Key<Options>& key : keys) {
    const std::optional<TomlValue> value = table.Find(key.name);
    if (!value) continue;
    std::visit([&](auto member) { ReadValue(*value, key.range, &(options->*member)); }, key.target);
  }
}

/// Reads one of some words, if the table has the key.
template <typename Choice>
void ReadChoice(TomlTable& table, const char* key,
                std::initializer_list<std::pair<std::string_view, Choice>> choices, Choice* target) {
  if (const std::optional<TomlValue> value = table.Find(key)) *target = value->AsChoice<Choice>(choices);
}

/// Reads the task, with the tables that belong to it: [task], or [joint_motion], or [trajectory]; [grasp],
/// [control] and [start_error]. Name, start and plant have been read.
/// @throws InputError as TomlValue, and when the rest of the scenario does not fit the task. Names of joints
/// are looked up where the robot is known.
void ReadTask(TomlTable& root, Scenario* scenario);

/// Reads [sensing], [actuation], [[disturbance]] and [mismatch], all of which may be missing.
/// @param time_step of the plant, s: delays are kept in steps.
/// @throws InputError as TomlValue. Names of joints and bodies are looked up where the robot is known.
Imperfections ReadImperfections(TomlTable& root, double time_step);

}  // namespace dexcheck
