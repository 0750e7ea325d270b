#pragma once

// Ask and tell the other way round: another program's optimiser says which points, the study what they come
// to.

#include <iosfwd>

#include "harness/study/study_runner.h"

namespace dexcheck {

/// Reads lines, each a JSON list of points, and each point a list with a value for every key of the study:
/// numbers, and texts for keys that have texts. The points of one line are made side by side. Answers each
/// line with a list of
///   {"point": 0, "trials": [0, 1], "objectives": [..], "violation": 0.0, "feasible": true, "outcomes":
///   ["tracked", ..]}
/// or with {"error": "what is wrong"}, and then goes on. Objectives have the sign that the study gives them.
/// Points are numbered in the order in which they come; one that the database has under its number is
/// answered from there, so that an optimiser that is begun anew with the same seed goes on where it was.
/// @throws InputError when the database has another point under a number.
void ServePoints(const StudyInputs& inputs, const RunOptions& options, StudyStore* store, std::istream& in,
                 std::ostream& out);

}  // namespace dexcheck
