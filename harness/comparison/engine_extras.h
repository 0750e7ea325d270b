#pragma once

// Parts of an MJCF besides the mechanism that a description states: motors, springs, tendons,
// constraints, flags, a fluid, and whatever acts on the joint that carries a floating base.

#include <mujoco/mujoco.h>

#include <optional>
#include <string>
#include <vector>

#include "harness/comparison/constant_checks.h"
#include "harness/descriptions/robot_description.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"

namespace dexcheck {

/// Takes motors that are no plain torques (servos, muscles) out of an engine's model that is compared with a
/// description that has no place for them, as a URDF. What they exert is an input and in no term.
/// @return a line for the report; none when there are no such motors.
std::optional<std::string> SetAsideMotors(const std::string& source, mjModel* engine);

/// The parts of two MJCFs besides the mechanism, compared with each other.
struct Extras {
  ConstantChecks differences;               ///< Parts of one name that both have, whose numbers differ.
  ConstantChecks of_first;                  ///< Findings of the first one's constant checks besides them.
  std::vector<std::string> without_effect;  ///< Options that differ and act on no compared term, a line each.
  std::vector<std::string> not_compared;    ///< Plain motors that only one of them has, a line each.
};

/// Compares part by part of the same name, and takes such parts out of the second model, so that the constant
/// checks finds there what the first one lacks. Couplings of joints (equality/joint) stay.
/// @param first as it is read from `file`, whose model is `first_engine`, before names are taken over.
/// @param second of the same joints in the same order; `engine` is its model, read from `other`.
Extras CompareExtras(const RobotDescription& first, MjModelPtr first_engine, const std::string& file,
                     const Adapter& second, mjModel* engine, const std::string& other);

/// Puts them into the second one's constant checks: what both constant checks find equal is taken back, what
/// only the first one's finds is a difference the other way round.
void AddExtras(const Extras& extras, ConstantChecks* constants);

/// Shapes, pairs and parameters of contacts that differ, by the notes of both sides' constant checks.
std::vector<std::string> CompareContacts(const ConstantChecks& first, const ConstantChecks& second);

/// Adds to `result` what the MJCF has and the analytic model has no number for: tendons' forces, equality
/// constraints, motors that are no plain torque sources, flags, contacts with friction, distance or a floor
/// that the model does not know. Anything but the neutral value is a finding. What a run of the plant
/// overrides or judges (contacts, solver, motors' limits) becomes a note.
void FindEngineOnly(const Adapter& adapter, ConstantChecks* result);

}  // namespace dexcheck
