#include "harness/report/thinning.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace dexcheck {

Thinning::Thinning(const VectorXd& time, long most) {
  const long rows = time.size();
  if (rows <= most) {
    times_.assign(time.data(), time.data() + rows);
    return;
  }
  const long intervals = std::max(most / 2, 1L);
  for (long i = 0; i <= intervals; ++i) starts_.push_back(i * rows / intervals);
  for (size_t i = 0; i + 1 < starts_.size(); ++i) {
    times_.push_back(time[starts_[i]]);
    times_.push_back(time[starts_[i + 1] - 1]);
  }
}

std::vector<double> Thinning::Apply(const VectorXd& values) const {
  if (keeps_all()) return {values.data(), values.data() + values.size()};
  std::vector<double> kept;
  kept.reserve(times_.size());
  for (size_t i = 0; i + 1 < starts_.size(); ++i) {
    long least = -1;
    long largest = -1;
    for (long row = starts_[i]; row < starts_[i + 1]; ++row) {
      if (!std::isfinite(values[row])) continue;
      if (least < 0 || values[row] < values[least]) least = row;
      if (largest < 0 || values[row] > values[largest]) largest = row;
    }
    if (least < 0) {
      kept.insert(kept.end(), 2, std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    if (least > largest) std::swap(least, largest);
    kept.push_back(values[least]);
    kept.push_back(values[largest]);
  }
  return kept;
}

}  // namespace dexcheck
