#pragma once

// One term's numbers side by side at a state, and what went worst over all states.

#include <vector>

#include "harness/base/check_record.h"

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

/// A state fills `model`, `engine` and `weight`, then calls Finish. Nothing allocates after construction but
/// when a new worst case is stored.
class ComparedTerm {
 public:
  /// @param record what is asked; the results are kept there. It must outlive this.
  /// @param where one location for each number. @param zeros of matrices of which only the other entries are
  /// among the numbers.
  ComparedTerm(CheckRecord* record, std::vector<Location> where, std::vector<ZeroPattern> zeros = {});

  [[nodiscard]] Eigen::Index size() const { return model.size(); }

  /// Adds a matrix's entries that should be zero; before Finish. @param pattern which of `zeros` is its own.
  /// @param scale of an entry: scale(row, col).
  /// @param location of an entry: location(row, col).
  template <typename Matrix, typename Scale, typename Where>
  void CheckZeros(size_t pattern, const Matrix& matrix, const Scale& scale, const Where& location,
                  double when) {
    const ZeroPattern& zeros = zeros_[pattern];
    if (zeros.Holds(matrix.data())) {
      record_->comparisons += zeros.count();
      return;
    }
    zeros.ForEach([&](Eigen::Index row, Eigen::Index col) {
      const double error = record_->Compare(matrix(row, col), 0.0, scale(row, col), location(row, col), when);
      if (error > zeros_error_) zeros_error_ = error;
    });
  }

  /// Adds this state's numbers to the record.
  void Finish(double when);

  [[nodiscard]] const CheckRecord& record() const { return *record_; }

  Eigen::ArrayXd model;
  Eigen::ArrayXd engine;
  Eigen::ArrayXd weight;  ///< 1 / scale

 private:
  CheckRecord* record_;
  std::vector<Location> where_;
  std::vector<ZeroPattern> zeros_;
  double zeros_error_ = 0.0;  // of this state's CheckZeros
};

}  // namespace dexcheck
