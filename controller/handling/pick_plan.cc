#include "controller/handling/pick_plan.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "controller/dynamics/model_terms.h"
#include "controller/grasp/finger_placement.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

// TEMPORARY: replaced by frame_placement.
bool PlaceFrame(const RobotModel& model, int frame, const Pose& X_BF, VectorXd* q) {
  ModelTerms terms(model);
  const VectorXd at_rest = VectorXd::Zero(terms.size());
  Matrix6Xd J(6, terms.size()), J_dot(6, terms.size());
  std::vector<int> joints;
  for (int j = model.frames()[static_cast<size_t>(frame)].link; j >= 0;
       j = model.joints()[static_cast<size_t>(j)].parent)
    if (model.joints()[static_cast<size_t>(j)].name.find("waist") == std::string::npos) joints.push_back(j);
  double residual = 1.0;
  for (int it = 0; it < 300; ++it) {
    terms.SetState(*q, at_rest);
    const Pose X = terms.CalcFramePose(frame);
    Vector6d e;
    e.head<3>() = X.linear().transpose() * (X_BF.translation() - X.translation());
    e.tail<3>() = LogSo3(X.linear().transpose() * X_BF.linear());
    residual = e.norm();
    if (residual < 1e-13) break;
    terms.CalcFrameJacobian(frame, J, J_dot);
    MatrixXd Jo(6, static_cast<Eigen::Index>(joints.size()));
    for (size_t k = 0; k < joints.size(); ++k)
      Jo.col(static_cast<Eigen::Index>(k)) = J.col(model.num_base_velocities() + joints[k]);
    const Matrix6d A = Jo * Jo.transpose() + 1e-2 * e.squaredNorm() * Matrix6d::Identity();
    VectorXd step = Jo.transpose() * A.ldlt().solve(e);
    step *= std::min(1.0, 0.2 / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
    for (size_t k = 0; k < joints.size(); ++k) {
      const Joint& joint = model.joints()[static_cast<size_t>(joints[k])];
      double& p = (*q)[model.num_base_positions() + joints[k]];
      p = std::clamp(p + step[static_cast<Eigen::Index>(k)], joint.lower + 0.05, joint.upper - 0.05);
    }
  }
  return residual < 1e-10;
}

}  // namespace

PickPlan MakePickPlan(const RobotModel& model, std::span<const int> fingertips, int palm,
                      const Surface& object, const Pose& X_Bo, const Eigen::Ref<const VectorXd>& q,
                      const PickPlanOptions& options) {
  PickPlan plan, best;
  best.problem = "not reached";
  plan.problem = "not reached";
  for (int k = 0; k < 24; ++k) {
    const double psi = 2.0 * kPi * (k % 2 ? (k + 1) / 2 : -(k / 2)) / 24.0;
    Pose X_BP = Pose::Identity();
    X_BP.linear() = Eigen::AngleAxisd(psi, Vector3d::UnitZ()).toRotationMatrix() *
                    Eigen::AngleAxisd(kPi, Vector3d::UnitX()).toRotationMatrix();
    X_BP.translation() = X_Bo.translation() + Vector3d(0, 0, 0.13);
    VectorXd q_palm = q;
    if (!PlaceFrame(model, palm, X_BP, &q_palm)) continue;
    plan.problem = "fingers do not reach";
    plan.contacts.clear();
    for (const double degrees : {125.0, 90.0, 55.0, -90.0}) {
      const double u = degrees * kPi / 180.0;
      const Vector3d out =
          X_Bo.linear().transpose() * X_BP.linear() * Vector3d(std::cos(u), std::sin(u), 0.0);
      plan.contacts.push_back({std::atan2(out.y(), out.x()), 12.0 * kPi / 180.0, 0});
    }
    const auto place = [&](double gap, const VectorXd& from, VectorXd* joints) {
      const FingerPlacement placement =
          SolveFingerPlacement(model, fingertips, object, X_Bo, plan.contacts, from, {.penetration = -gap});
      *joints = placement.q.tail(model.num_joints());
      return placement;
    };
    VectorXd touch;
    const FingerPlacement at = place(0.0, q_palm, &touch);
    if (!at.reached) continue;
    if (!place(options.opening, at.q, &plan.q_open).reached) continue;
    if (!place(options.nearness, at.q, &plan.q_near).reached) continue;
    if (!place(-options.depth, at.q, &plan.q_deep).reached) continue;
    VectorXd q_above = at.q;
    q_above.tail(model.num_joints()) = plan.q_open;
    X_BP.translation().z() += options.raise;
    if (!PlaceFrame(model, palm, X_BP, &q_above)) continue;
    plan.q_above = q_above.tail(model.num_joints());
    plan.found = true;
    plan.problem.clear();
    double margin = 1e9;
    for (const VectorXd* v : {&plan.q_above, &plan.q_open})
      for (int j = 0; j < model.num_joints(); ++j) {
        const Joint& joint = model.joints()[static_cast<size_t>(j)];
        margin = std::min(margin, std::min((*v)[j] - joint.lower, joint.upper - (*v)[j]));
      }
    plan.margin = margin;
    if (margin > best.margin || !best.found) best = plan;
  }
  return best;
}

}  // namespace dexcheck
