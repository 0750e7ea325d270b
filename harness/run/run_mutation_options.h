#pragma once

namespace dexcheck {

/// Which faults are made in a run, and how long each is looked at.
struct RunMutationOptions {
  /// The fault begins at this time of the scenario, s. In a motion of joints it is there from the first,
  /// and this is added to `duration`.
  double from = 0.5;
  double duration = 0.1;  ///< How long it is looked at, s.
  int parameters = 40;    ///< Numbers of the model that are changed, evenly out of all of them.
  double scale = 1e-3;    ///< By how much, relative to GetScale.
  bool laws = true;
  bool equations = true;
  bool plants = true;
};

}  // namespace dexcheck
