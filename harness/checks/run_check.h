#pragma once

// A check that is made at every step of a run: what it was at worst, and when.

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "harness/checks/check_record.h"

namespace dexcheck {

/// One quantity that should stay below its bound over a whole run.
struct RunCheck {
  std::string name;
  CheckKind kind = CheckKind::kAssumption;
  std::string unit = "1";
  std::string description;
  double bound = 0.0;
  bool applies = true;  ///< Whether this run asks it at all.

  double last = 0.0;  ///< At the last step.
  double max = 0.0;
  double at_time = 0.0;  ///< Of the maximum, s.
  double sum_of_squares = 0.0;
  long count = 0;
  bool failed = false;
  double failed_at = 0.0;  ///< First time above the bound, s.
  std::string where;       ///< Part of the robot that was worst, when the check has parts.

  /// What is not a number counts as infinite, and fails whatever the bound is.
  void Add(double value, double time) {
    if (!applies) return;
    last = value;
    const double size = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
    if (size > max) {
      max = size;
      at_time = time;
    }
    sum_of_squares += size * size;
    ++count;
    if (!(value <= bound) && !failed) {
      failed = true;
      failed_at = time;
    }
  }
  /// Forgets all values.
  void Reset() {
    last = max = at_time = sum_of_squares = failed_at = 0.0;
    count = 0;
    failed = false;
    where.clear();
  }
  [[nodiscard]] double rms() const {
    return count > 0 ? std::sqrt(sum_of_squares / static_cast<double>(count)) : 0.0;
  }
};

}  // namespace dexcheck
