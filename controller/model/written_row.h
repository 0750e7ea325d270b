#pragma once

#include "controller/common/types.h"

namespace dexcheck {

/// How a joint's row stands in its parameter file, as far as the specification does not say it.
struct WrittenRow {
  /// The link's own frame L, in which the file gives its mass and what hangs on it, in frame i.
  Pose X_iL = Pose::Identity();
  bool is_plain = false;  ///< A plain transform (xyz, rpy, axis), not Denavit-Hartenberg parameters.
};

}  // namespace dexcheck
