#pragma once

// Fewer points of a long series, with its extremes kept.

#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// Divides the rows of a run into intervals of nearly equal length and keeps of each series, in each
/// interval, the least and the largest value, in the order in which they occur. A line through what is kept
/// covers what the whole series would. When all rows fit, all are kept.
class Thinning {
 public:
  /// @param most points to keep of each series, at least 2.
  Thinning(const VectorXd& time, long most);

  /// First and last time of each interval, s.
  [[nodiscard]] const std::vector<double>& times() const { return times_; }
  /// As many numbers as times(). Where an interval has finite values, others are left out.
  /// @param values one for each row of the run.
  [[nodiscard]] std::vector<double> Apply(const VectorXd& values) const;
  [[nodiscard]] bool keeps_all() const { return starts_.empty(); }

 private:
  std::vector<long> starts_;  // of the intervals, and the end of the last; empty when all rows are kept
  std::vector<double> times_;
};

}  // namespace dexcheck
