#include "harness/checks/tolerance.h"

#include <algorithm>
#include <cmath>

namespace dexcheck {
namespace {

constexpr int kMostDigits = 16;

}  // namespace

int CountDigits(double error) {
  for (int digits = kMostDigits; digits > 0; --digits) {
    if (error <= std::pow(10.0, -digits)) return digits;
  }
  return 0;
}

int CountDigits(const ConsistencyResult& result) {
  int digits = kMostDigits;
  for (const std::vector<CheckRecord>* records : {&result.constants.records, &result.terms}) {
    for (const CheckRecord& record : *records) {
      if (record.failed) digits = std::min(digits, CountDigits(record.worst));
    }
  }
  return digits;
}

void JudgeByTolerance(double tolerance, ConsistencyResult* result) {
  JudgeByTolerance(tolerance, &result->constants);
  JudgeByTolerance(tolerance, &result->terms);
}

}  // namespace dexcheck
