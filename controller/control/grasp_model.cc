#include "controller/control/grasp_model.h"

#include "controller/object/euler_zyz.h"

namespace dexcheck {

GraspModel::GraspModel(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
                       const Surface& surface, const GraspModelOptions& options)
    : orientation_(options.orientation),
      robot_(model, Coordinates::kReduced),
      grasp_(model, fingertips, object, surface),
      kappa_(fingertips.size()),
      X_o_(options.X_o_start) {
  if (!options.bonds.empty()) grasp_.SetBonds(options.bonds);
}

void GraspModel::SetState(const MeasuredState& state) {
  robot_.SetState(state.q, state.xi);
  robot_.CalcDynamics();
  grasp_.SetOverlaps(state.overlap);
  const std::span<const ContactCoordinates> kappa =
      follower_ ? follower_->Follow(robot_, state) : std::span<const ContactCoordinates>(state.kappa);
  kappa_.assign(kappa.begin(), kappa.end());
  if (has_coordinates()) {
    X_o_ = CalcObjectCoordinates(state.X_Bo, X_o_);
    grasp_.SetState(robot_, X_o_, CalcP(X_o_) * state.V_Bo, kappa_);
  } else {
    grasp_.SetPose(robot_, state.X_Bo, state.V_Bo, kappa_);
  }
}

void GraspModel::FollowContacts(const StateTiming& timing) {
  follower_.emplace(robot_.model(), grasp_.fingertips(), grasp_.surface(), timing);
}

}  // namespace dexcheck
