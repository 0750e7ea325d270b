#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dexcheck {

/// Faults to make in a run, and the time for which each is observed.
struct RunMutationOptions {
  /// Time of the scenario at which the fault begins, s. In a motion of joints the fault is there from the
  /// first step, and this is added to `duration`.
  double from = 0.5;
  double duration = 0.1;  ///< Time of observation, s; 0 for a whole motion of joints, 0.1 s of other motions.
  /// Whether a fault that is not found by then is observed up to the end of a motion of joints.
  bool looks_on = false;
  int parameters = 40;  ///< Number of the model's numbers to change, evenly out of all of them.
  double scale = 1e-3;  ///< Size of the change, relative to GetScale.
  bool laws = true;
  bool equations = true;
  bool plants =
      true;  ///< One fault of each kind in plant, motors, sensors and law, its place and size drawn.
  std::vector<std::string> kinds = {};  ///< Kinds of faults to draw from (FaultKind::kind); empty for all.
  /// Number of sets of faults whose places, sizes and times are drawn, in place of all of these; 0 for none.
  int draws = 0;
  int together = 1;  ///< Number of faults in a set.
  std::uint64_t seed = 1;
};

}  // namespace dexcheck
