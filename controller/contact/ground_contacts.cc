#include "controller/contact/ground_contacts.h"

namespace dexcheck {

GroundContacts::GroundContacts(const RobotModel& model, std::span<const int> feet, double height)
    : feet_(feet.begin(), feet.end()), height_(height), X_WF_(feet.size(), Pose::Identity()) {
  for (const int foot : feet_) radii_.push_back(model.frame(foot).sphere_radius.value_or(0.0));
  const auto m = static_cast<Eigen::Index>(feet_.size());
  J_.setZero(3 * m, model.num_velocities());
  J_dot_xi_.setZero(3 * m);
  gap_.setZero(m);
  J_f_.setZero(6, model.num_velocities());
  J_f_dot_ = J_f_;
}

void GroundContacts::SetState(const ModelTerms& robot) {
  const VectorXd& xi = robot.velocity();
  for (size_t i = 0; i < feet_.size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    X_WF_[i] = robot.CalcFramePose(feet_[i]);
    const Matrix3d R = X_WF_[i].linear();
    robot.CalcFrameJacobian(feet_[i], J_f_, J_f_dot_);
    const double gap = X_WF_[i].translation().z() - radii_[i] - height_;
    gap_[static_cast<Eigen::Index>(i)] = gap;
    // v_F + omega x a, both of which J_f has along the frame's own axes
    const Vector3d n = R.transpose() * Vector3d::UnitZ();
    const Vector3d a = -(radii_[i] + 0.5 * gap) * n;
    J_.middleRows<3>(row).noalias() = R * (J_f_.topRows<3>() - Skew(a) * J_f_.bottomRows<3>());
    // a_F = R (v_dot + omega x v) of the velocity v along axes that turn
    const Vector6d V = J_f_ * xi;
    const Vector6d V_dot = J_f_dot_ * xi;
    const Vector3d v = V.head<3>(), omega = V.tail<3>();
    const Vector3d a_dot = -0.5 * n.dot(v) * n;
    J_dot_xi_.segment<3>(row) =
        R * (V_dot.head<3>() + omega.cross(v) + V_dot.tail<3>().cross(a) + omega.cross(a_dot));
  }
}

}  // namespace dexcheck
