#pragma once

// Repairs in the terms of the parameter file.

#include <vector>

#include "controller/model/parameter_reader.h"
#include "harness/diagnosis/repair.h"

namespace dexcheck {

/// Says repairs by the numbers that stand in the parameter file.
///
/// A specification has bodies, places and frames in frame i, whose z axis is the joint's. A plain row of the
/// file (xyz, rpy, axis) has them in the link's own frame L, and no Denavit-Hartenberg parameters: what is
/// alpha of the specification is a roll of the file. Rows of modified parameters stay as they are.
class FileTerms {
 public:
  /// @param rows how the joints' rows are written, by joint; none stands for rows of modified parameters.
  FileTerms(RobotSpec spec, std::vector<WrittenRow> rows);

  /// Numbers as they stand in the file; no robot can be made of it.
  [[nodiscard]] const RobotSpec& written() const { return written_; }
  /// Each of the repairs as numbers of written(). They must be in the order in which they are to be made.
  [[nodiscard]] std::vector<Repair> Convert(const std::vector<Repair>& causes) const;
  /// Which number of the file, or vector of it, a single number of the specification is.
  [[nodiscard]] Repair ConvertPart(const Repair& cause) const;

 private:
  [[nodiscard]] bool IsWritten(const Parameter& parameter) const;
  [[nodiscard]] static RobotSpec Write(const RobotSpec& spec, const std::vector<WrittenRow>& rows);
  [[nodiscard]] Repair ConvertFrom(const RobotSpec& before, const std::vector<WrittenRow>& rows,
                                   const Repair& cause) const;

  RobotSpec spec_;
  std::vector<WrittenRow> rows_;
  bool is_plain_ = false;  // anywhere
  RobotSpec written_;
};

}  // namespace dexcheck
