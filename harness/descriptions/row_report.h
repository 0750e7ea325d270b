#pragma once

// What was found of rows: those that share a convention, or a number, are one finding.

#include <vector>

#include "harness/descriptions/finding.h"
#include "harness/descriptions/row_search.h"

namespace dexcheck {

std::vector<Finding> ReportRows(const RobotDescription& robot, const std::vector<RowFinding>& rows);

/// Adds what the row of another joint explains as well. @param joint -1: the base.
void AddElsewhere(const RobotDescription& robot, const RowFinding& row, int joint, Finding* finding);

}  // namespace dexcheck
