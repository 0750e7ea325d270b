#include "harness/checks/step_record.h"

#include "controller/object/euler_zyz.h"
#include "controller/object/so3.h"

namespace dexcheck {

Vector6d CalcX_o(const StepRecord& step) {
  if (step.model->has_coordinates()) return step.model->grasp().X_o();
  const Pose& X_Bo = step.reading.state.X_Bo;
  Vector6d X_o;
  X_o << X_Bo.translation(), CalcAnyZyzAngles(X_Bo.linear());
  return X_o;
}

TrackingError CalcTrackingError(const StepRecord& step) {
  const Pose& X_Bo = step.reading.state.X_Bo;
  const Vector6d& X_d = step.command.desired.X_d;
  return {X_d.head<3>() - X_Bo.translation(),
          LogSo3(X_Bo.linear().transpose() * CalcRotationZyz(X_d.tail<3>())).norm()};
}

}  // namespace dexcheck
