#include "controller/control/grasp_model.h"

#include "controller/object/euler_zyz.h"

namespace dexcheck {

GraspModel::GraspModel(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
                       const Surface& surface, const GraspModelOptions& options)
    : orientation_(options.orientation),
      robot_(model, Coordinates::kReduced),
      grasp_(model, fingertips, object, surface),
      X_o_(options.X_o_start) {
  if (!options.bonds.empty()) grasp_.SetBonds(options.bonds);
}

void GraspModel::SetState(const MeasuredState& state) {
  robot_.SetState(state.q, state.xi);
  robot_.CalcDynamics();
  grasp_.SetOverlaps(state.overlap);
  if (has_coordinates()) {
    X_o_ = CalcObjectCoordinates(state.X_Bo, X_o_);
    grasp_.SetState(robot_, X_o_, CalcP(X_o_) * state.V_Bo, state.kappa);
  } else {
    grasp_.SetPose(robot_, state.X_Bo, state.V_Bo, state.kappa);
  }
}

}  // namespace dexcheck
