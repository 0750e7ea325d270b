#include "controller/control/actuation.h"

#include <Eigen/LU>

#include "controller/common/errors.h"
#include "controller/model/platform.h"

namespace dexcheck {

ActuationMap::ActuationMap(const RobotModel& model)
    : size_(model.num_velocities()),
      has_wheels_(model.base().type == BaseType::kDifferentialDrive),
      floats_(model.base().type == BaseType::kFloating) {
  if (!has_wheels_) return;
  // tau^T thetadot = (S_v^T E_v tau)^T v with thetadot = W v
  S_v_T_E_v_ = CalcWheelRateMap(model.base()).transpose();
  inverse_ = S_v_T_E_v_.inverse();
}

void ActuationMap::Apply(const Matrix2d& wheels, const Eigen::Ref<const VectorXd>& from,
                         Eigen::Ref<VectorXd> to) const {
  Require(from.size() == size_ && to.size() == size_, "length of tau'", "must be that of xi", from.size());
  if (to.data() != from.data()) to = from;
  if (floats_) to.head<6>().setZero();
  if (has_wheels_) to.head<2>() = Vector2d(wheels * to.head<2>());
}

void ActuationMap::CalcForce(const Eigen::Ref<const VectorXd>& tau, Eigen::Ref<VectorXd> force) const {
  Apply(S_v_T_E_v_, tau, force);
}

void ActuationMap::CalcTorque(const Eigen::Ref<const VectorXd>& force, Eigen::Ref<VectorXd> tau) const {
  Apply(inverse_, force, tau);
}

}  // namespace dexcheck
