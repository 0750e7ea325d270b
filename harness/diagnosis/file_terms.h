#pragma once

// A robot in the terms of its parameter file.

#include <utility>
#include <vector>

#include "controller/model/parameter_reader.h"

namespace dexcheck {

/// Turns a specification into the numbers that stand in the file, and back.
///
/// A specification has bodies, places and frames in frame i, whose z axis is the joint's. A plain row of the
/// file (xyz, rpy, axis) has them in the link's own frame L, and no Denavit-Hartenberg parameters. Rows of
/// modified parameters stay as they are.
class FileTerms {
 public:
  /// @param rows how the joints' rows are written, by joint; none stands for rows of modified parameters.
  explicit FileTerms(std::vector<WrittenRow> rows) : rows_(std::move(rows)) {}

  [[nodiscard]] bool IsPlain(int joint) const {
    return joint >= 0 && static_cast<size_t>(joint) < rows_.size() &&
           rows_[static_cast<size_t>(joint)].is_plain;
  }
  /// The specification's numbers as they stand in the file; no robot can be made of them.
  [[nodiscard]] RobotSpec Write(RobotSpec spec) const;
  /// The specification of a file with such numbers. In a plain row, q and alpha stand for another axis than
  /// the file's: Rot(z, q) Rot(x, alpha) in the frame in which that is z.
  [[nodiscard]] RobotSpec Read(RobotSpec written) const;
  /// The link's frame of the file in frame i of the specification, or in Sigma_0 (-1).
  [[nodiscard]] Pose OwnFrame(int joint) const {
    return IsPlain(joint) ? rows_[static_cast<size_t>(joint)].X_iL : Pose::Identity();
  }
  /// Frame i in the link's frame of the file.
  [[nodiscard]] Pose AxisFrame(const Joint& written, int joint) const;
  /// The link's frame of the file in its parent's. @param q of the joint, rad or m.
  [[nodiscard]] Pose CalcPlace(const Joint& written, int joint, double q) const;

 private:
  std::vector<WrittenRow> rows_;
};

}  // namespace dexcheck
