#pragma once

// Two descriptions of one robot are brought to the same statements.

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Whether a word of kIgnorable is among them.
bool Ignores(const std::string& word, const std::vector<std::string>& ignore);

/// Constants that one of two descriptions took from the other.
struct Completion {
  std::vector<std::string> notes;         ///< One line each: what was done.
  std::vector<std::string> not_compared;  ///< One line each: what only one of them states, or is ignored.
};

/// The other way round, for a robot that more than two share: the engine takes over what is ignored.
void TakeIgnored(const RobotSpec& robot, const std::vector<std::string>& ignore, mjModel* engine);

/// Takes out of a description what need not agree, as if its file did not state it.
void LeaveOutIgnored(const std::vector<std::string>& ignore, RobotDescription* robot);

/// Gives the joints of `b` the names of `a` when they are similar, and completes either description by what
/// only the other one states: gravity, constants of joints, names of links whose joints have one name; frames
/// that only one has are dropped.
/// @param ignore what need not agree, of kIgnorable: `b` takes those of `a`.
/// @throws InputError that lists the joints that one lacks, or names one whose kind or parent differs.
Completion CompleteEachOther(RobotDescription* a, RobotDescription* b,
                             const std::vector<std::string>& ignore = {});

/// Completes a description by an engine's model, whose names it takes; `a` is the description.
/// @param is_table a parameter file states all: only what is ignored is taken over.
Completion CompleteFromEngine(const mjModel& engine, const std::string& source, RobotDescription* robot,
                              const std::vector<std::string>& ignore = {}, bool is_table = false);

}  // namespace dexcheck
