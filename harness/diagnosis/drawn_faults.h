#pragma once

// Faults of motors, sensors, joints, links, object and world whose place, size and time are drawn, to see
// whether they are named. They act on the plant and on what is measured; nothing here knows the signatures
// that they are recognised by.

#include <cstdint>
#include <vector>

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/plant_faults.h"

namespace dexcheck {

/// Faults that are there at once.
struct DrawnFaults {
  PlantFault fault;  ///< All of them.
  std::vector<PlantFault> each;
  std::vector<Fault> truth;  ///< Each as it should be told; `error` is by how much it changes its value.
};

struct DrawOptions {
  size_t count = 0;     ///< Of sets.
  size_t together = 1;  ///< Faults in each.
  std::uint64_t seed = 1;
  double duration = 0.0;  ///< Of the run, s.
  VectorXd tau;           ///< Torques of the right run, which dead zones and steps are relative to.
};
std::vector<DrawnFaults> DrawFaults(const Setup& setup, const DrawOptions& options);

/// How the explanations of a run compare with what was wrong in it.
struct NamingScore {
  int right = 0;     ///< Named: kind, place, and value within 5 % of the change or 3 standard errors.
  int in_class = 0;  ///< Named with others that this motion does not tell apart.
  int not_explained = 0;
  int wrong = 0;  ///< Single names, or values, of what was not so.
};
/// @param truth what should be named. @param all what may be, besides: too small to be seen alone.
NamingScore ScoreNames(const std::vector<Fault>& truth, const std::vector<Fault>& all, const Causes& causes);

}  // namespace dexcheck
