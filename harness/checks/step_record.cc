#include "harness/checks/step_record.h"

#include <cmath>

#include "controller/object/so3.h"
#include "harness/base/worst.h"

namespace dexcheck {
namespace {

/// Distance of followed and measured contact beyond which they are unrelated, m: one may lie at the pole of
/// the other's chart. It is less than from a chart's margin to its pole, 4 mm on a fingertip of 9 mm.
constexpr double kStray = 1e-3;

double CalcDistance(const Surface& surface, const SurfacePoint& a, const SurfacePoint& b) {
  return (surface.Evaluate(a).p - surface.Evaluate(b).p).norm();
}

}  // namespace

void FollowCharts(const Surface& tip, const Surface& object, const ContactCoordinates& measured,
                  ContactCoordinates* followed) {
  const int tip_chart = measured.alpha_f.chart;
  const int object_chart = measured.alpha_o.chart;
  if (followed->alpha_f.chart == tip_chart && followed->alpha_o.chart == object_chart) return;
  if (CalcDistance(tip, followed->alpha_f, measured.alpha_f) >= kStray) return;
  if (CalcDistance(object, followed->alpha_o, measured.alpha_o) >= kStray) return;
  *followed = ChangeCharts(tip, object, *followed, tip_chart, object_chart);
}

ContactDrift CalcContactDrift(const Surface& tip, const Surface& object, ContactCoordinates followed,
                              const ContactCoordinates& measured) {
  FollowCharts(tip, object, measured, &followed);
  return {.object = CalcDistance(object, followed.alpha_o, measured.alpha_o),
          .fingertip = CalcDistance(tip, followed.alpha_f, measured.alpha_f),
          .psi = std::abs(std::remainder(followed.psi - measured.psi, 2.0 * kPi))};
}

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
          MaxAbs(q_d - step.reading.state.q.tail(q_d.size()))};
}

}  // namespace dexcheck
