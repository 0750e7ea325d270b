#pragma once

#include "controller/control/controller.h"
#include "harness/plant/plant_reading.h"

namespace dexcheck {

/// Faults of what the controller is told. All zero: it is told the truth.
struct SensingOptions {
  double contact_error = 0.0;  ///< By how much each contact's place on the object is told wrongly, rad.
};

/// Stands between the plant and the controller.
class Sensing {
 public:
  explicit Sensing(const SensingOptions& options) : options_(options) {}

  /// What the controller is told when this is the truth. Nothing allocates, once `told` has its sizes.
  void Tell(const PlantReading& truth, Reading* told) const {
    told->state = truth.state;
    told->touch = truth.touch;
    for (ContactCoordinates& kappa : told->state.kappa) kappa.alpha_o.u += options_.contact_error;
  }

 private:
  SensingOptions options_;
};

}  // namespace dexcheck
