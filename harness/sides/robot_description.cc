#include "harness/sides/robot_description.h"

namespace dexcheck {

MatrixXd CalcCouplingMap(const RobotDescription& robot) {
  std::vector<int> column(robot.joints.size(), -1);
  int free = 0;
  for (size_t i = 0; i < column.size(); ++i) {
    if (!robot.joints[i].coupling) column[i] = free++;
  }
  MatrixXd T = MatrixXd::Zero(static_cast<Eigen::Index>(column.size()), free);
  for (size_t i = 0; i < column.size(); ++i) {
    const std::optional<JointCoupling>& coupling = robot.joints[i].coupling;
    const auto row = static_cast<Eigen::Index>(i);
    if (coupling) {
      T(row, column[static_cast<size_t>(coupling->leader)]) = coupling->multiplier;
    } else {
      T(row, column[i]) = 1.0;
    }
  }
  return T;
}

}  // namespace dexcheck
