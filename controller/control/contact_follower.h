#pragma once

// Contact coordinates that are followed and not measured: (40) from where the contacts began, as in the
// paper.

#include <span>
#include <vector>

#include "controller/contact/shapes.h"
#include "controller/control/measured_state.h"
#include "controller/dynamics/model_terms.h"

namespace dexcheck {

/// When a state's velocities are, and how far states are apart.
struct StateTiming {
  double time_step = 0.0;     ///< From one state to the next, s.
  double velocity_age = 0.0;  ///< By how much velocities are older than positions, s: half a step, or 0.
};

/// Integrates (40) beside a motion that is known at time steps. Nothing allocates after construction.
class ContactFollower {
 public:
  /// @param fingertips frames that carry spheres. @param surface of the object; must outlive this.
  ContactFollower(const RobotModel& model, std::span<const int> fingertips, const Surface& surface,
                  const StateTiming& timing);

  /// kappa (39) of each contact: at the first state as it has them, then moved by
  ///
  ///   kappa(t) = kappa(t - dt) + integral of kappa_dot(kappa, V_f, V_Bo),
  ///
  /// with both body velocities those of the middle of the step: J_f xi - dt/2 J_f_dot xi where velocities are
  /// half a step old, otherwise the mean of both ends. Slip is part of them.
  /// @throws what CalcKappaDot throws.
  const std::vector<ContactCoordinates>& Follow(const MeasuredState& state);
  [[nodiscard]] const std::vector<ContactCoordinates>& kappa() const { return kappa_; }

 private:
  /// Body velocities of one contact's bodies.
  struct Velocities {
    Vector6d V_f = Vector6d::Zero();   // of the fingertip, in its frame
    Vector6d V_Bo = Vector6d::Zero();  // of the object, Sigma_o
  };
  [[nodiscard]] Velocities CalcVelocities(const MeasuredState& state, size_t finger);

  ModelTerms robot_;
  std::vector<int> fingertips_;
  std::vector<Sphere> tips_;
  const Surface* surface_;
  StateTiming timing_;
  Matrix6Xd J_f_, J_f_dot_;
  bool has_begun_ = false;
  std::vector<ContactCoordinates> kappa_;
  std::vector<Velocities> last_;
};

}  // namespace dexcheck
