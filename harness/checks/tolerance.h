#pragma once

// Agreement of published numbers, which are rounded when printed.

#include "harness/checks/consistency.h"

namespace dexcheck {

/// Decimal digits to which two numbers agree whose difference relative to their term's scale is `error`: the
/// largest n with error <= 10^-n, at most 16.
int CountDigits(double error);

/// The fewest digits to which a failed check agrees; 16 when none failed.
int CountDigits(const ConsistencyResult& result);

/// Judges every check by a relative tolerance where that is wider than its bound: bounds, failures and
/// findings are those of the tolerance afterwards.
void JudgeByTolerance(double tolerance, ConsistencyResult* result);

}  // namespace dexcheck
