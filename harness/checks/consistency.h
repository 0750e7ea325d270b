#pragma once

// Random states, model against engine, no stepping.

#include <cstdint>
#include <functional>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/checks/model_check.h"
#include "harness/descriptions/constant_checks.h"
#include "harness/descriptions/random_states.h"
#include "harness/engine/adapter.h"

namespace dexcheck {

/// What two descriptions need not share: constants of joints, and that joints follow others.
inline constexpr const char* kIgnorable[] = {"armature", "damping", "friction", "coupling"};

struct ConsistencyOptions {
  long samples = 10000;
  std::uint64_t seed = 1;
  StateRange range;
  ModelViewFactory make_view = MakeModelView;  ///< What stands for the model.
  ObjectFormulas object;                       ///< What stands for the object's equations.
  std::vector<std::string> ignore;             ///< What two files need not share: kIgnorable.
};

struct ConsistencyResult {
  ConstantChecks constants;
  std::vector<CheckRecord> terms;
  long samples = 0;  ///< Compared: fewer than asked for when `progress` said stop.
  double seconds = 0.0;

  [[nodiscard]] bool Agrees() const;
};

/// The constants, then all terms of robot and object at random states over the joint ranges.
/// @param progress called after each sample with the number done; its false ends the work early.
ConsistencyResult CheckConsistency(const Adapter& adapter, const ConsistencyOptions& options,
                                   const std::function<bool(long)>& progress);

}  // namespace dexcheck
