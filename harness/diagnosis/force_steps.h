#pragma once

// The steps of a store whose residual is explained at once.

#include <vector>

#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// Times the noise of an entry, from which on a step differs.
inline constexpr double kFails = 10.0;

/// Steps from the first that differs to the last.
struct ForceSteps {
  std::vector<Eigen::Index> all;     ///< Of the store.
  std::vector<VectorXd> rows;        ///< Rows of some of them and of those beside jumps, in time.
  std::vector<Eigen::Index> begins;  ///< Rows at which something jumps, each after that of the step before.
  std::vector<VectorXd> changes;     ///< Of the residual at each, StepStore::Jump.
};
/// Returns none where no step differs.
ForceSteps ListForceSteps(const StepStore& store);

}  // namespace dexcheck
