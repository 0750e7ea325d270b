#pragma once

// The ways in which a joint's row can be read.

#include <set>
#include <string>
#include <vector>

#include "harness/descriptions/row_search.h"

namespace dexcheck {

// A convention costs 1; one that many joints have explains more of them at once. A number that can take any
// value explains by chance what a convention does not.
inline constexpr double kConvention = 1.0;
inline constexpr double kCommonConvention = 0.6;
inline constexpr double kNumber = 1.3;
inline constexpr double kUnexplained = 4.0;
inline constexpr const char* kZero = "zero.offset";

bool IsOfRow(Quantity of);

class RowReader {
 public:
  explicit RowReader(const RowProblem& problem);

  /// Conventions, by their ids, and offsets of zeros, by their words, that many rows have.
  std::set<std::string> common;

  /// Joints on a link; -1: on the base.
  [[nodiscard]] const std::vector<size_t>& ListChildren(int joint) const {
    return children_[static_cast<size_t>(joint + 1)];
  }
  /// From here on a row's parent frame is that in which the file places it.
  [[nodiscard]] Pose ToCarrier(size_t i, const Pose& X_ab) const {
    return problem_.given[i].X_PW.inverse() * X_ab;
  }

  [[nodiscard]] StatedPart StateRow(size_t i) const {
    StatedPart part = problem_.bodies[i + 1].given;
    part.X_PL = problem_.given[i].X_PW.inverse() * problem_.given[i].X_PL;
    part.axis = problem_.given[i].axis;
    return part;
  }

  /// What would be right if the two files had the same frame on the link.
  [[nodiscard]] StatedPart StateRight(size_t i, const Pose& X_ab_P) const {
    StatedPart part;
    part.X_PL = X_ab_P * problem_.right[i].X_PL;
    part.axis = problem_.right[i].axis;
    return part;
  }
  [[nodiscard]] bool IsSame(const StatedPart& a, const StatedPart& b) const;

  /// Readings under which the axis is right.
  /// @param in_pairs also two conventions at once.
  [[nodiscard]] std::vector<RowReading> ListReadings(size_t i, const Pose& X_ab_P, bool in_pairs) const;

 private:
  using Readings = std::vector<RowReading>;
  [[nodiscard]] double CostOf(const Convention& convention) const;
  void Offer(size_t i, const Pose& X_ab_P, RowReading reading, Readings* readings) const;
  void AddNumbers(size_t i, const Pose& X_ab_P, const StatedPart& given, const StatedPart& right,
                  Readings* readings) const;
  void AddOffsets(size_t i, const Pose& X_ab_P, const StatedPart& given, Readings* readings) const;
  void OfferOffset(size_t i, const Pose& X_ab_P, const StatedPart& given, double offset,
                   Readings* readings) const;

  const RowProblem& problem_;
  std::vector<std::vector<size_t>> children_;  // of the base, then of each joint
};

}  // namespace dexcheck
