#include "harness/checks/compared_term.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace dexcheck {

ZeroPattern::ZeroPattern(const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>& may_differ)
    : rows_(may_differ.rows()) {
  for (Eigen::Index i = 0; i < may_differ.size(); ++i) {
    if (may_differ.data()[i]) continue;
    ++count_;
    if (!runs_.empty() && runs_.back().begin + runs_.back().length == i) {
      ++runs_.back().length;
    } else {
      runs_.push_back({i, 1});
    }
  }
}

bool ZeroPattern::Holds(const double* data) const {
  double sum = 0.0;  // not zero when one of them is not, or is not a number
  for (const Run& run : runs_)
    sum += Eigen::Map<const Eigen::ArrayXd>(data + run.begin, run.length).abs().sum();
  return sum == 0.0;
}

ComparedTerm::ComparedTerm(CheckRecord* record, std::vector<Location> where, std::vector<ZeroPattern> zeros)
    : record_(record), where_(std::move(where)), zeros_(std::move(zeros)) {
  const auto size = static_cast<Eigen::Index>(where_.size());
  model.setZero(size);
  engine.setZero(size);
  weight.setOnes(size);
}

void ComparedTerm::Finish(double when) {
  double error = 0.0;
  if (size() > 0) error = ((model - engine).abs() * weight).maxCoeff<Eigen::PropagateNaN>();
  if (!(error < std::numeric_limits<double>::infinity())) error = std::numeric_limits<double>::infinity();
  const bool is_worst = error > record_->worst || record_->comparisons == 0;
  const bool fails_first = !(error <= record_->bound) && !record_->failed;
  if (is_worst || fails_first) {
    for (Eigen::Index i = 0; i < size(); ++i) {
      record_->CompareError(std::abs(model[i] - engine[i]) * weight[i], model[i], engine[i],
                            where_[static_cast<size_t>(i)], when);
    }
  } else {
    record_->comparisons += size();
  }
  record_->AddStep(std::max(error, zeros_error_));
  zeros_error_ = 0.0;
}

}  // namespace dexcheck
