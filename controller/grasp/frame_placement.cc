#include "controller/grasp/frame_placement.h"

#include <limits>

#include "controller/common/errors.h"
#include "controller/grasp/serial_chain.h"
#include "controller/object/so3.h"

namespace dexcheck {

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
  result.orientation_residual = best.orientation;
  result.joint_margin = chain.range().CalcMargin(best.q);
  result.reached = best.reached;
  return result;
}

}  // namespace dexcheck
