#include "harness/checks/step_record.h"

#include "controller/object/euler_zyz.h"
#include "controller/object/so3.h"

namespace dexcheck {

Vector6d CalcX_o(const StepRecord& step) {
  const Pose& X_Bo = step.reading.state.X_Bo;
  if (step.model->has_coordinates()) {
    const Vector6d& measured = step.model->grasp().X_o();
    const bool is_true = step.measured.state.X_Bo.matrix() == X_Bo.matrix();
    return is_true ? measured : CalcObjectCoordinates(X_Bo, measured);
  }
  Vector6d X_o;
  X_o << X_Bo.translation(), CalcAnyZyzAngles(X_Bo.linear());
  return X_o;
}

void CalcContactDrifts(const StepRecord& step, std::vector<ContactDrift>* drift) {
  const GraspTerms& grasp = step.model->grasp();
  const std::vector<ContactCoordinates>& followed = step.followed_kappa;
  drift->resize(followed.size());
  for (size_t i = 0; i < followed.size(); ++i) {
    (*drift)[i] = CalcContactDrift(grasp.tip(static_cast<int>(i)), grasp.surface(), followed[i],
                                   step.reading.state.kappa[i]);
  }
}

TrackingError CalcTrackingError(const StepRecord& step) {
  const Pose& X_Bo = step.reading.state.X_Bo;
  const Vector6d& X_d = step.command.desired.X_d;
  const VectorXd& q_d = step.command.joints.q;
  return {X_d.head<3>() - X_Bo.translation(),
          LogSo3(X_Bo.linear().transpose() * CalcRotationZyz(X_d.tail<3>())).norm(),
          q_d.size() > 0 ? (q_d - step.reading.state.q.tail(q_d.size())).cwiseAbs().maxCoeff() : 0.0};
}

}  // namespace dexcheck
