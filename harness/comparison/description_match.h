#pragma once

// Two descriptions of one robot are brought to the same statements.

#include <mujoco/mujoco.h>

#include <array>
#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/descriptions/robot_part.h"

namespace dexcheck {

/// Constants that one of two descriptions took from the other.
struct Completion {
  std::vector<std::string> notes;         ///< One line each: what was done.
  std::vector<std::string> not_compared;  ///< One line each: what only one of them states, or is ignored.
  bool has_link_frames = false;           ///< Whether frames of links were added.
  int held = 0;                           ///< Number of joints that were held.
};

/// The other way round, for a robot that more than two share: the engine takes over what is ignored.
void TakeIgnored(const RobotSpec& robot, const std::vector<std::string>& ignore, mjModel* engine);

/// Gives the joints of `b` the names of `a` when they are similar, and completes either description by what
/// only the other one states: gravity, constants of joints, names of links whose joints have one name; frames
/// that only one has are dropped.
/// @param ignore what need not agree, of kIgnorable: `b` takes those of `a`.
/// @throws InputError that lists the joints that one lacks, or names one whose kind or parent differs.
Completion CompleteEachOther(RobotDescription* a, RobotDescription* b,
                             const std::vector<std::string>& ignore = {});

/// Completes a description by an engine's model, whose names it takes.
Completion CompleteFromEngine(const mjModel& engine, const std::string& source, RobotDescription* robot,
                              const std::vector<std::string>& ignore = {});

/// Gives a table, which states all, the engine's numbers of what is ignored.
Completion CompleteTable(const mjModel& engine, const std::string& source, RobotDescription* robot,
                         const std::vector<std::string>& ignore);

/// Brings two descriptions, or parts of both, to the same statements, names and frames of links. Joints are
/// called as in an MJCF that stands second.
/// @throws InputError when they are of two mechanisms.
Completion CompletePair(const std::vector<std::string>& ignore, const RobotPart& part,
                        std::array<RobotDescription, 2>* sides);

}  // namespace dexcheck
