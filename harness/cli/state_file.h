#pragma once

#include <optional>
#include <string>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck::cli {

/// State of the manipulated object.
struct ObjectState {
  Vector6d X_o;      ///< Position and ZYZ angles, m and rad.
  Vector6d X_o_dot;  ///< m/s and rad/s.
};

/// One state of a robot, as the JSON object {"q": [...], "xi": [...]} gives it; "object": {"X_o": [...],
/// "X_o_dot": [...]} and "kappa" (one list per contact) may be there too.
struct State {
  VectorXd q;   ///< q', rad and m.
  VectorXd xi;  ///< Reduced velocity, rad/s and m/s.
  std::optional<ObjectState> object;
  std::optional<Eigen::Matrix<double, 4, 5>> kappa;  ///< Contact coordinates of one hand, a row per finger.
};

/// @throws InputError, one line that names file, key and value: also for unknown keys, so that a misspelt one
/// is never ignored.
State ReadState(const std::string& file, const RobotModel& model);

}  // namespace dexcheck::cli
