#include "controller/control/contact_follower.h"

#include "controller/common/errors.h"
#include "controller/contact/rolling.h"

namespace dexcheck {

ContactFollower::ContactFollower(const RobotModel& model, std::span<const int> fingertips,
                                 const Surface& surface, const StateTiming& timing)
    : robot_(model, Coordinates::kReduced),
      fingertips_(fingertips.begin(), fingertips.end()),
      surface_(&surface),
      timing_(timing),
      kappa_(fingertips.size()),
      last_(fingertips.size()) {
  Require(timing.time_step > 0.0, "time step [s]", "must be positive", timing.time_step);
  for (const int frame : fingertips_) tips_.emplace_back(model.tip_radius(frame));
  J_f_.setZero(6, model.num_velocities());
  J_f_dot_ = J_f_;
}

ContactFollower::Velocities ContactFollower::CalcVelocities(const MeasuredState& state, size_t finger) {
  robot_.CalcFrameJacobian(fingertips_[finger], J_f_, J_f_dot_);
  Velocities now;
  now.V_f.noalias() = J_f_ * state.xi;
  now.V_Bo = state.V_Bo;
  if (timing_.velocity_age > 0.0) {
    // xi, p_dot and omega are those of the middle of the step; J_f and R^T, at its end, go back to there.
    now.V_f.noalias() -= timing_.velocity_age * (J_f_dot_ * state.xi);
    const Vector3d v = state.V_Bo.head<3>();
    const Vector3d omega = state.V_Bo.tail<3>();
    now.V_Bo.head<3>() += timing_.velocity_age * omega.cross(v);
    return now;
  }
  const Velocities middle{0.5 * (last_[finger].V_f + now.V_f), 0.5 * (last_[finger].V_Bo + now.V_Bo)};
  last_[finger] = now;
  return middle;
}

const std::vector<ContactCoordinates>& ContactFollower::Follow(const MeasuredState& state) {
  robot_.SetState(state.q, state.xi);
  for (size_t i = 0; i < kappa_.size(); ++i) {
    const Velocities middle = CalcVelocities(state, i);
    if (!has_begun_) {
      kappa_[i] = state.kappa[i];
      continue;
    }
    const auto twist = [&](double /*t*/, const ContactGeometry& contact) {
      return CalcRelativeTwist(contact, middle.V_f, middle.V_Bo);
    };
    kappa_[i] = IntegrateKappa(tips_[i], *surface_, kappa_[i], 0.0, timing_.time_step, twist);
  }
  has_begun_ = true;
  return kappa_;
}

}  // namespace dexcheck
