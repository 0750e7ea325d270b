#pragma once

// A description against what a program answers, or has answered.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "harness/checks/file_comparison.h"
#include "harness/checks/side_comparison.h"
#include "harness/descriptions/function_side.h"

namespace dexcheck {

/// The description, or the engine with its model, as the side that answers are compared with.
/// @param path of the description; of an MJCF the engine answers.
std::unique_ptr<TermSide> MakeReferenceSide(const RobotDescription& robot, const std::string& path);

/// Compares at all states of a feed. Of a floating base whose terms disagree, the other conventions are
/// tried.
/// @param make_feed makes a feed that begins with the first state. @param notes gets what is worth knowing.
ConsistencyResult CompareAnswers(const RobotDescription& robot, TermSide* reference, AnsweringSide* side,
                                 const std::function<StateFeed()>& make_feed,
                                 const std::function<bool(long)>& progress, std::vector<std::string>* notes,
                                 std::vector<std::string>* not_compared);

/// Compares functions with a parameter file, a URDF, or an MJCF, of which the engine is asked.
Comparison CompareFunctions(const std::filesystem::path& file, const TermFunctions& functions,
                            const UrdfOptions& urdf, const ConsistencyOptions& options);

}  // namespace dexcheck
