#pragma once

#include <string>

#include "controller/common/toml_reader.h"
#include "harness/plant/imperfections.h"

namespace dexcheck {

/// Reads a number, or a table of numbers by name; leaves `target` alone when the key is missing.
void ReadByName(TomlTable& table, const std::string& key, double (TomlValue::*read)() const, ByName* target);

/// Reads [sensing], [actuation], [[disturbance]] and [mismatch], all of which may be missing.
/// @param time_step of the plant, s: delays are kept in steps.
/// @throws InputError as TomlValue. Names of joints and bodies are looked up where the robot is known.
Imperfections ReadImperfections(TomlTable* root, double time_step);

}  // namespace dexcheck
