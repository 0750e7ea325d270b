#pragma once

// What was found of a difference, before it is put into words, in bodies and in rows.

#include <string>
#include <vector>

#include "harness/descriptions/hypotheses.h"
#include "harness/descriptions/row_search.h"

namespace dexcheck {

/// A hypothesis, but for its text and what it explains.
struct Finding : Hypothesis {
  std::vector<std::string> one;   ///< By id: "inertia looks halved". Whole sentences when `what` is empty.
  std::vector<std::string> many;  ///< By id: "inertias look halved".
  std::string what;               ///< "link" or "joint", or empty.
  size_t total = 0;               ///< How many such parts the robot has.
  bool is_all = false;            ///< All that are wrong in what it is about, and most there are.
  size_t cells = 0;               ///< Quantities of parts that it explains.
};

/// Conventions that many links share first, then bodies that are exchanged or shifted by one in the list,
/// then what single links have; at last the numbers that nothing explains.
/// @param bodies have all but these numbers undone afterwards.
std::vector<Finding> SearchBodies(const Closeness& close, std::vector<LinkBody>* bodies);

std::vector<Finding> ReportRows(const RobotDescription& robot, const std::vector<RowFinding>& rows);

/// Adds what the row of another joint explains as well. @param joint -1: the base.
void AddElsewhere(const RobotDescription& robot, const RowFinding& row, int joint, Finding* finding);

}  // namespace dexcheck
