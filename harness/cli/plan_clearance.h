#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "controller/model/robot_model.h"
#include "harness/engine/clearance.h"

namespace dexcheck::cli {

/// The smallest distance of a class of pairs over the postures of a plan.
struct PlanClearance {
  double distance = std::numeric_limits<double>::infinity();  ///< m
  std::string bodies;                                         ///< Empty when there is no such pair.
};

/// How far bodies that should not touch are apart in an MJCF's scene, with the hand open and closed
/// around the object. @param q, q_open positions q'. @throws InputError as LoadMjcf and Adapter.
std::array<PlanClearance, kPairClassCount> FindPlanClearance(const RobotModel& model,
                                                             const std::filesystem::path& mjcf,
                                                             const Pose& X_Bo, const VectorXd& q,
                                                             const VectorXd& q_open);

}  // namespace dexcheck::cli
