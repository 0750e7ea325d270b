#pragma once

// The rows of a regression: balances of all recordings and joints in units of noise, and what each fault
// leaves in them.

#include <Eigen/SparseCore>
#include <vector>

#include "harness/recordings/read_recordings.h"
#include "harness/recordings/torque_candidates.h"

namespace dexcheck {

/// They are kept as factors: a joint's rows are those of its balance times a map of few entries.
struct TorqueRows {
  /// Those of a joint in a recording.
  struct Part {
    size_t recording, place;
    Eigen::Index begin, within,
        size;        ///< The first; how many are those within blocks, before the blocks'; all.
    double samples;  ///< That they stand for.
    const TorqueBalance* balance = nullptr;
    Eigen::SparseMatrix<double> map = {};     ///< Of the balance's columns to all.
    Eigen::SparseMatrix<double> pushes = {};  ///< What pushes add to the rows.
  };
  std::vector<Part> parts;
  double samples = 0.0;
  /// Columns that are part of every explanation, then the faults', y last.
  Eigen::Index columns = 0;
  std::vector<Eigen::Index> first;  ///< Of each fault.

  /// rows * a.
  [[nodiscard]] VectorXd Multiply(const VectorXd& a) const;
  /// y - columns * a.
  [[nodiscard]] VectorXd CalcLeft(const VectorXd& a) const;
  /// rows^T rows.
  [[nodiscard]] MatrixXd CalcProducts() const;
};

/// @param is_held the quarter that is kept for the end.
TorqueRows MakeTorqueRows(const RecordingSet& recordings, const std::vector<TorqueFault>& faults,
                          bool is_held);

/// Maps faults but for pushes to the columns of a joint's balance, y last: rows times this
/// are their columns.
Eigen::SparseMatrix<double> MapColumns(const TorqueBalance& balance, size_t place, size_t recording,
                                       const std::vector<TorqueFault>& faults);

/// How much of a push acts in a block, on average.
double CalcShare(const Push& push, const TorqueBalance::Block& block);
/// Returns its columns in a joint's row of a block in which all of it acts.
Eigen::RowVectorXd CalcPushColumns(const RecordingSet& recordings, const Push& push,
                                   const TorqueRows::Part& part, size_t block);

/// Columns of the errors of drives' gains, one for each joint where currents were recorded.
Eigen::Index CountForced(const RecordingSet& recordings);
Eigen::Index CountColumns(const TorqueFault& fault);

}  // namespace dexcheck
