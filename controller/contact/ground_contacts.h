#pragma once

// Contacts of feet with level ground that roll without slipping: spheres, ends of capsules, and, with radius
// 0, corners of boxes.

#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/dynamics/model_terms.h"

namespace dexcheck {

/// m feet, each the sphere of its frame; a frame without one is a point. With n the upward normal and
/// a = -(r + gap / 2) n from a foot's centre to the middle of gap or overlap, the ground holds
/// v_F + omega x a, the velocity of what touches it:
///
///   J xi = 0,   J xi_dot + J_dot xi = 0,   J_dot xi = a_F + alpha x a + omega x a_dot at xi_dot = 0,
///
/// a_dot = -(n . v_F) n / 2, since n does not turn. Rows are x, y, z in world axes, foot by foot: the third
/// is d/dt of the gap.
class GroundContacts {
 public:
  /// @param feet frames of the model, which outlives this. @param height of the ground, m.
  GroundContacts(const RobotModel& model, std::span<const int> feet, double height = 0.0);

  /// @param robot SetState done, reduced.
  void SetState(const ModelTerms& robot);

  [[nodiscard]] int count() const { return static_cast<int>(feet_.size()); }
  [[nodiscard]] const MatrixXd& J() const { return J_; }                ///< 3m x n.
  [[nodiscard]] const VectorXd& J_dot_xi() const { return J_dot_xi_; }  ///< 3m, m/s^2.
  [[nodiscard]] const VectorXd& gap() const { return gap_; }            ///< m, negative where it overlaps, m.
  [[nodiscard]] const Pose& X_WF(int foot) const { return X_WF_[static_cast<size_t>(foot)]; }
  [[nodiscard]] double radius(int foot) const { return radii_[static_cast<size_t>(foot)]; }  ///< m

 private:
  std::vector<int> feet_;
  std::vector<double> radii_;
  double height_;
  std::vector<Pose> X_WF_;
  MatrixXd J_;
  VectorXd J_dot_xi_, gap_;
  Matrix6Xd J_f_, J_f_dot_;
};

}  // namespace dexcheck
