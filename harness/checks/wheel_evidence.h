#pragma once

// Do the wheels roll as (1) has it, and if not, which radius or distance would explain it?

#include <array>
#include <string>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// What the wheels' rates say of the platform's geometry. A wheel that rolls has r thetadot = v +- w b / 2,
/// the right one with +; d = v +- w b / 2 - r thetadot is what is left of it, m/s. Another radius leaves d =
/// dr thetadot, another distance d = -+ w db / 2 at both.
class WheelEvidence {
 public:
  explicit WheelEvidence(const Base& base) : base_(&base) {}

  /// w, rad/s, of a platform that rolls.
  [[nodiscard]] double CalcTurn(const VectorXd& xi) const { return CalcTwist(xi)[1]; }
  /// d of the right and left wheel. @param xi starts with the base's velocity. @param rates thetadot, rad/s.
  [[nodiscard]] Vector2d CalcMismatch(const VectorXd& xi, const Vector2d& rates) const;
  /// Adds a step in which d is more than the wheels slip.
  void Add(const VectorXd& xi, const Vector2d& rates);
  [[nodiscard]] bool has_any() const { return squares_.sum() > 0.0; }
  /// "wheel wheel_left rolls with a radius of 0.09995 m instead of 0.1 m".
  [[nodiscard]] std::string Tell() const;

 private:
  [[nodiscard]] Vector2d CalcTwist(const VectorXd& xi) const;

  const Base* base_;
  Vector2d squares_ = Vector2d::Zero();  // of d, by wheel
  Vector2d by_rate_ = Vector2d::Zero(), rate_squares_ = Vector2d::Zero();
  double by_turn_ = 0.0, turn_squares_ = 0.0;
};

}  // namespace dexcheck
