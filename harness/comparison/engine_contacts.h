#pragma once

// Contacts of an engine's model, and settings of its steps. Most of them belong to the plant of a run, which
// overrides or judges them.

#include <string>
#include <vector>

#include "harness/comparison/engine_parts.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// Adds explicit contact pairs, and the places of the wheels' shapes and of the floor; notes on everything
/// that can touch, on the solver, and on settings that a run overrides.
void AddContacts(const Adapter& adapter, EngineParts* list);

/// Names shapes, pairs and parameters of contacts that differ, by the notes of both models. @return a line
/// for each kind.
std::vector<std::string> CompareContacts(const std::vector<ConstantNote>& first,
                                         const std::vector<ConstantNote>& second);

/// Compares options that act on steps, contacts and solvers alone. @return a line on each that differs.
std::vector<std::string> CompareOptions(const mjOption& first, const mjOption& second,
                                        const std::string& first_file, const std::string& second_file);

/// Compares, by name, how soft limits, friction and equalities are, and sensors and keyframes: no term at a
/// given state depends on them. @return a line on each kind that differs.
std::vector<std::string> CompareRunElements(const mjModel& first, const mjModel& second);

}  // namespace dexcheck
