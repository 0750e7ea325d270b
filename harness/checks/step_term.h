#pragma once

// One term of a step's cross-check: its numbers side by side, and what went worst over the run.

#include <string>
#include <vector>

#include "harness/checks/check_record.h"

namespace dexcheck {

/// Entries of a matrix that a tree's structure makes zero, as runs in the storage (column-major).
class ZeroPattern {
 public:
  /// @param may_differ rows x cols: where entries may differ from zero.
  explicit ZeroPattern(const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>& may_differ);

  /// Whether all of them are zero. @param data rows x cols numbers.
  [[nodiscard]] bool Holds(const double* data) const;
  /// Number of these entries.
  [[nodiscard]] long count() const { return count_; }
  /// Calls visit(row, col) for each of them.
  template <typename Visit>
  void ForEach(const Visit& visit) const {
    for (const Run& run : runs_) {
      for (Eigen::Index i = run.begin; i < run.begin + run.length; ++i) visit(i % rows_, i / rows_);
    }
  }

 private:
  struct Run {
    Eigen::Index begin;
    Eigen::Index length;
  };
  Eigen::Index rows_;
  std::vector<Run> runs_;
  long count_ = 0;
};

/// A step fills `model`, `engine` and `weight`, then calls Finish. Nothing allocates after construction but
/// when a new worst case is stored.
class StepTerm {
 public:
  /// @param where one location for each number.
  StepTerm(std::string name, double bound, std::vector<Location> where);

  [[nodiscard]] Eigen::Index size() const { return model.size(); }

  /// Adds entries that should be zero; before Finish. @param scale(row, col), @param location(row, col) of an
  /// entry.
  template <typename Matrix, typename Scale, typename Where>
  void CheckZeros(const ZeroPattern& pattern, const Matrix& matrix, const Scale& scale, const Where& location,
                  double when) {
    if (pattern.Holds(matrix.data())) {
      record_.comparisons += pattern.count();
      return;
    }
    pattern.ForEach([&](Eigen::Index row, Eigen::Index col) {
      const double error = record_.Compare(matrix(row, col), 0.0, scale(row, col), location(row, col), when);
      if (error > zeros_error_) zeros_error_ = error;
    });
  }

  /// Adds this step's numbers to the record.
  void Finish(double when);

  [[nodiscard]] const CheckRecord& record() const { return record_; }
  /// Largest relative error of the last step.
  [[nodiscard]] double step_error() const { return step_error_; }

  Eigen::ArrayXd model;
  Eigen::ArrayXd engine;
  Eigen::ArrayXd weight;  ///< 1 / scale

 private:
  CheckRecord record_;
  std::vector<Location> where_;
  double zeros_error_ = 0.0;  // of this step's CheckZeros
  double step_error_ = 0.0;
};

}  // namespace dexcheck
