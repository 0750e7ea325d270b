#pragma once

// Where the five questions of the cross-check stand.

#include <array>
#include <string>

#include "harness/base/check_record.h"

namespace dexcheck {

/// The questions in the order in which they are shown.
inline constexpr std::array<CheckCategory, 5> kCheckCategorys = {
    CheckCategory::kModel, CheckCategory::kLaw, CheckCategory::kInverseDynamics,
    CheckCategory::kForwardDynamics, CheckCategory::kAssumption};

/// Where one of the questions stands.
struct CategoryStatus {
  std::string name;
  std::string check;   ///< The check that came nearest to its bound, or farthest beyond.
  double worst = 0.0;  ///< Its largest residual so far.
  double bound = 0.0;
  bool asked = false;  ///< False when the run has no check of this kind.

  [[nodiscard]] bool Passes() const { return worst <= bound; }
};

}  // namespace dexcheck
