#include "harness/checks/tolerance.h"

#include <algorithm>
#include <cmath>

namespace dexcheck {
namespace {

constexpr int kMostDigits = 16;

void Judge(double tolerance, std::vector<CheckRecord>* records) {
  for (CheckRecord& record : *records) {
    record.bound = std::max(record.bound, tolerance);
    record.failed = !(record.worst <= record.bound);
    // Where the narrower bound was left first says nothing now.
    if (record.failed) record.first_failure = record.where;
  }
}

}  // namespace

int CountDigits(double error) {
  for (int digits = kMostDigits; digits > 0; --digits) {
    if (error <= std::pow(10.0, -digits)) return digits;
  }
  return 0;
}

int CountDigits(const ConsistencyResult& result) {
  int digits = kMostDigits;
  for (const std::vector<CheckRecord>* records : {&result.gate.records, &result.terms}) {
    for (const CheckRecord& record : *records) {
      if (record.failed) digits = std::min(digits, CountDigits(record.worst));
    }
  }
  return digits;
}

void JudgeByTolerance(double tolerance, ConsistencyResult* result) {
  Judge(tolerance, &result->gate.records);
  Judge(tolerance, &result->terms);
  std::erase_if(result->gate.findings, [&](const GateFinding& finding) {
    const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
    const bool is_within = std::abs(finding.model - finding.engine) <= tolerance * size;
    const bool check_holds = std::any_of(
        result->gate.records.begin(), result->gate.records.end(),
        [&](const CheckRecord& record) { return record.name == finding.check && !record.failed; });
    return is_within || check_holds;
  });
}

}  // namespace dexcheck
