#include "controller/control/object_space_inertia.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/gram_matrix.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

// Smallest pivot of Lambda_c^-1, against its diagonal entry, that counts as regular; as ConstrainedDynamics.
constexpr double kMinPivotRatio = 1e-8;

}  // namespace

ObjectSpaceInertia::ObjectSpaceInertia(const RobotModel& model, int num_contacts) : factor_(model) {
  Require(num_contacts > 0, "number of contacts", "must be positive", num_contacts);
  const Eigen::Index k = Eigen::Index{3} * num_contacts;
  half_.setZero(model.num_velocities(), PadToGramBlock(k));
  inverse_.setZero(half_.cols(), half_.cols());
  inverse_llt_ = Eigen::LLT<MatrixXd>(k);
  G_T_.setZero(k, 6);
}

void ObjectSpaceInertia::Compute(const ModelTerms& robot, const GraspTerms& grasp) {
  Require(robot.size() == half_.rows(), "entries of xi", "must be as constructed", robot.size());
  const Eigen::Index k = G_T_.rows();
  Require(grasp.num_forces() == k, "number of contact forces", "must be as constructed", grasp.num_forces());
  // M = L^T L; Lambda_c^-1 = (L^-T J^T)^T (L^-T J^T)
  factor_.Compute(robot.M());
  for (const int i : grasp.moving_entries()) half_.row(i).head(k) = grasp.J_B().col(i).transpose();
  factor_.SolveTransposedColumns(grasp.moving_entries(), half_);
  CalcGramMatrix(half_, grasp.moving_entries(), &inverse_);
  inverse_llt_.compute(inverse_.topLeftCorner(k, k));
  double smallest = inverse_llt_.info() == Eigen::Success ? 1.0 : 0.0;
  for (Eigen::Index i = 0; smallest > 0.0 && i < k; ++i) {
    const double pivot = inverse_llt_.matrixLLT()(i, i);
    smallest = std::min(smallest, pivot * pivot / inverse_(i, i));
  }
  if (!(smallest > kMinPivotRatio)) {
    throw SingularityError("J_B' has not full row rank, smallest independent part " + FormatNumber(smallest),
                           smallest);
  }
  // G Lambda_c G^T = (L_c^-1 G^T)^T (L_c^-1 G^T)
  G_T_ = grasp.G().transpose();
  inverse_llt_.matrixL().solveInPlace(G_T_);
  Lambda_ = grasp.body().M_hat;
  Lambda_.noalias() += G_T_.transpose() * G_T_;
  Lambda_llt_.compute(Lambda_);
}

}  // namespace dexcheck
