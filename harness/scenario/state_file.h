#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// State of the manipulated object.
struct ObjectState {
  Vector6d X_o;      ///< Position and ZYZ angles, m and rad.
  Vector6d X_o_dot;  ///< m/s and rad/s.
};

/// Contacts between fingertips and object: by their contact coordinates, or by points on the object.
struct ContactState {
  std::vector<int> fingertips;  ///< Frames of the model, one for each contact.
  /// kappa = [u_f v_f u_o v_o psi] (39) in the charts with index 0, a row for each contact; empty when points
  /// are given.
  Eigen::Matrix<double, Eigen::Dynamic, 5> kappa;
  /// Points on the object's surface, in the object frame, m; empty when kappa is given.
  Eigen::Matrix<double, Eigen::Dynamic, 3> points;
  double friction = 0.0;  ///< mu of (21).
};

/// One state of a robot, as the JSON object {"q": [...], "xi": [...]} gives it. Optional: "object": {"X_o":
/// [...], "X_o_dot": [...]}; contacts by "kappa" (a list of five numbers each) or by "contact_points" (three
/// each, with an object); then also "fingers" (names of their frames; by default the model's first
/// fingertips) and "mu" (by default the object's).
struct State {
  VectorXd q;   ///< q', rad and m.
  VectorXd xi;  ///< Reduced velocity, rad/s and m/s.
  std::optional<ObjectState> object;
  std::optional<ContactState> contacts;
};

/// @throws InputError, one line that names file, key and value: also for unknown keys, so that a misspelt one
/// is never ignored.
State ReadState(const std::string& file, const RobotModel& model);

/// The same for a text; `source` stands for the file in messages.
State ParseState(std::string_view text, const std::string& source, const RobotModel& model);

}  // namespace dexcheck
