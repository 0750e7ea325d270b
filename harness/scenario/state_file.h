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

/// The aims of the law (47) to (57) at that state.
struct LawState {
  Vector6d X_d, X_d_dot, X_d_ddot;  ///< Desired motion of the object, m and rad.
  Vector6d K_p, K_v;                ///< 1/s^2, 1/s.
  double f_min = 0.0, f_max = 0.0;  ///< Of the normal forces, N.
  VectorXd sigma_prime;             ///< sigma' of (47) (n).
};

/// One state of a robot, as the JSON object {"q": [...], "xi": [...]} gives it. Optional: "object": {"X_o":
/// [...], "X_o_dot": [...]}; contacts by "kappa" (a list of five numbers each) or by "contact_points" (three
/// each, with an object); then also "fingers" (names of their frames; by default the model's first
/// fingertips) and "mu" (by default the object's). With object and contacts also "law": {"X_d", "X_d_dot",
/// "X_d_ddot", "K_p", "K_v": six numbers each, "f_min", "f_max", and, by default zero, "sigma_prime"}.
struct State {
  VectorXd q;   ///< q', rad and m.
  VectorXd xi;  ///< Reduced velocity, rad/s and m/s.
  std::optional<ObjectState> object;
  std::optional<ContactState> contacts;
  std::optional<LawState> law;
};

/// @throws InputError, one line that names file, key and value: also for unknown keys, so that a misspelt one
/// is never ignored.
State ReadState(const std::string& file, const RobotModel& model);

/// Reads a text; `source` stands for the file in messages.
State ParseState(std::string_view text, const std::string& source, const RobotModel& model);

}  // namespace dexcheck
