#include "controller/grasp/finger_placement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/serial_chain.h"
#include "controller/object/so3.h"

namespace dexcheck {

FingerPlacement SolveFingerPlacement(const RobotModel& model, std::span<const int> fingertips,
                                     const Surface& object, const Pose& X_Bo,
                                     std::span<const SurfacePoint> targets,
                                     const Eigen::Ref<const VectorXd>& q,
                                     const FingerPlacementOptions& options) {
  if (targets.size() != fingertips.size())
    throw std::invalid_argument("targets: one for each fingertip expected");
  const std::vector<std::vector<int>> own_joints = grasp_internal::ListOwnJoints(model, fingertips);
  std::vector<Vector3d> places;
  for (size_t i = 0; i < fingertips.size(); ++i) {
    const SurfaceGeometry surface = object.Evaluate(targets[i]);
    const double height = model.tip_radius(fingertips[i]) - options.penetration;
    places.push_back(X_Bo * Vector3d(surface.p + height * surface.R.col(2)));
  }

  FingerPlacement result;
  result.q = q;
  ModelTerms terms(model);
  const VectorXd at_rest = VectorXd::Zero(terms.size());
  Matrix6Xd J(6, terms.size());
  Matrix6Xd J_dot(6, terms.size());
  const int q_offset = model.num_base_positions();
  const int dof_offset = model.num_base_velocities();
  for (int iteration = 0; iteration <= options.max_iterations; ++iteration) {
    terms.SetState(result.q, at_rest);
    result.residual = 0.0;
    for (size_t i = 0; i < fingertips.size(); ++i) {
      const Pose X = terms.CalcFramePose(fingertips[i]);
      const Vector3d error = places[i] - X.translation();
      result.residual = std::max(result.residual, error.norm());
      if (iteration == options.max_iterations) continue;
      // Levenberg-Marquardt: dq = J^T (J J^T + lambda)^-1 error, lambda vanishing with the error.
      terms.CalcFrameJacobian(fingertips[i], J, J_dot);
      MatrixXd J_own(3, static_cast<Eigen::Index>(own_joints[i].size()));
      for (size_t k = 0; k < own_joints[i].size(); ++k) {
        J_own.col(static_cast<Eigen::Index>(k)) = X.linear() * J.col(dof_offset + own_joints[i][k]).head<3>();
      }
      constexpr double kDamping = 1e-2;
      const double lambda = kDamping * error.squaredNorm();
      const Matrix3d normal = J_own * J_own.transpose() + lambda * Matrix3d::Identity();
      const VectorXd step = J_own.transpose() * normal.ldlt().solve(error);
      constexpr double kLargestStep = 0.2;  // rad
      const double shrink = std::min(1.0, kLargestStep / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
      for (size_t k = 0; k < own_joints[i].size(); ++k) {
        const Joint& joint = model.joint(own_joints[i][k]);
        double& position = result.q[q_offset + own_joints[i][k]];
        position =
            std::clamp(position + shrink * step[static_cast<Eigen::Index>(k)], joint.lower, joint.upper);
      }
    }
    if (result.residual <= options.tolerance) break;
  }
  // Rounding of world coordinates may keep the residual a little above a very small tolerance.
  const double rounding = 8.0 * std::numeric_limits<double>::epsilon() * (1.0 + X_Bo.translation().norm());
  result.reached = result.residual <= std::max(options.tolerance, rounding);
  return result;
}

using grasp_internal::ChainSolution;
using grasp_internal::JointRange;
using grasp_internal::SerialChain;

FramePlacement SolveFramePlacement(const RobotModel& model, int frame, const Pose& X_BF,
                                   std::span<const int> joints, const Eigen::Ref<const VectorXd>& q,
                                   const Eigen::Ref<const VectorXd>& q_nominal,
                                   const FramePlacementOptions& options) {
  RequireRotation(X_BF.linear(), "X_BF");
  Require(X_BF.translation().allFinite(), "X_BF", "must be finite", std::numeric_limits<double>::quiet_NaN());
  Require(q_nominal.size() == q.size(), "q_nominal", "must have as many entries as q", q_nominal.size());
  Require(options.num_starts >= 1, "num_starts", "must be at least 1", options.num_starts);
  Require(options.length > 0.0, "length", "must be positive", options.length);
  const SerialChain chain(model, frame, joints, q);
  const JointRange range = chain.range().Shrink(options.joint_margin);
  const VectorXd nominal = chain.Gather(q_nominal);

  ChainSolution best;
  double best_error = std::numeric_limits<double>::infinity();
  for (int start = 0; start < options.num_starts && !best.reached; ++start) {
    VectorXd q_start = start == 0 ? chain.Gather(q) : nominal;
    if (start >= 2) q_start = range.CalcSpreadPoint(start - 1);
    const ChainSolution solution = SolveChain(
        chain, {X_BF, options.length, options.tolerance, options.max_iterations}, range, q_start, nominal);
    const double error = solution.position + options.length * solution.orientation;
    if (!solution.reached && error >= best_error) continue;
    best = solution;
    best_error = error;
  }
  FramePlacement result;
  result.q = q;
  chain.Scatter(best.q, result.q);
  result.position_residual = best.position;
  result.joint_margin = chain.range().CalcMargin(best.q);
  result.reached = best.reached;
  return result;
}

}  // namespace dexcheck
