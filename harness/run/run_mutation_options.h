#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dexcheck {

/// Which faults are made in a run, and how long each is looked at.
struct RunMutationOptions {
  /// The fault begins at this time of the scenario, s. In a motion of joints it is there from the first,
  /// and this is added to `duration`.
  double from = 0.5;
  double duration = 0.1;  ///< How long it is looked at, s; 0 for all of a motion of joints, 0.1 s of others.
  /// What is not found by then is looked at up to the end of a motion of joints, which begins at rest.
  bool looks_on = false;
  int parameters = 40;  ///< Numbers of the model that are changed, evenly out of all of them.
  double scale = 1e-3;  ///< By how much, relative to GetScale.
  bool laws = true;
  bool equations = true;
  bool plants =
      true;  ///< One fault of each kind in plant, motors, sensors and law, its place and size drawn.
  std::vector<std::string> kinds = {};  ///< Of FaultKind::kind, out of which is drawn; empty for all.
  /// Sets of faults whose places, sizes and times are drawn, in the place of all of these; 0 for none.
  int draws = 0;
  int together = 1;  ///< Faults of a set.
  std::uint64_t seed = 1;
};

}  // namespace dexcheck
