#pragma once

// How soft the engine's contacts are, from the engine's own numbers.

#include <functional>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"
#include "harness/checks/declared_plant.h"
#include "harness/checks/step_record.h"
#include "harness/engine/adapter.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Fractions of a change of forces that soft contacts hold back at first. A smooth force F on the robot and
/// what it holds causes contact forces (A + R) f = -J M^-1 F + ... with A = J M^-1 J^T and the engine's R,
/// where rigid contacts have R = 0. In |.|_M the accelerations differ by the matrix (1 + J^T R^-1 J)^-1 on
/// the range of J^T (M = 1 in that metric), whose largest eigenvalue is
///
///   fraction = 1 / (1 + s),   s the smallest eigenvalue of R^-1/2 A R^-1/2 that is not zero:
///
/// directions that contacts hold twice have zeros there, and nothing moves along them.
struct ContactSoftness {
  double fraction = 0.0;             ///< Of all rows of all contacts.
  double tangential_fraction = 0.0;  ///< Of the rows along the tangents, the others taken as rigid.
  /// Likewise of the object's contacts alone.
  double object_fraction = 0.0, object_tangential_fraction = 0.0;
};

/// Where robot and object stand. Contacts that are open by less than 0.1 mm count as closed.
/// @param adapter of an engine whose contacts have constant impedances. @param q q' (p').
ContactSoftness FindContactSoftness(const Adapter& adapter, const Eigen::Ref<const VectorXd>& q,
                                    const Pose& X_Bo);

// How wheels of a differential drive roll: r thetadot = v +- w b / 2, the right one with +, (1).

/// [v; w], m/s and rad/s, of a platform that rolls. @param xi starts with the base's velocity.
Vector2d CalcRollingTwist(const Base& base, const VectorXd& xi);

/// v +- w b / 2 - r thetadot of the right and the left wheel, m/s. @param rates thetadot, rad/s.
Vector2d CalcRollingMismatch(const Base& base, const VectorXd& xi, const Vector2d& rates);

// What soft contacts hold back of a force that changes.

/// J_dot qvel of the plant's constraints at the fingertips (3N), m/s^2, each in its Sigma_cf: the model's
/// slip_bias(), and the w x v of object and platform, which the model's rates of velocities that turn along
/// have not and the engine's have. The rigid plant holds (46) whole; half of slip_bias() under semi-implicit
/// Euler, whose velocities are those of half a step before.
/// @param model at the true state.
void CalcContactBias(const Setup& setup, const StepRecord& step, const GraspModel& model, VectorXd* bias);

/// One soft contact under a vector of forces F(t). The engine lets J qacc = a_ref - R f, of a contact that
/// forces move by A: where it holds back a fraction s = R / (A + R) of a force that changes, along a normal
///
///   r_ddot = (1 - s) (-b r_dot - k r) - s F,   b = 2 / (tc d),  k = 1 / (d tc^2),
///
/// of time constant tc and impedance d, and along a tangent v_dot = -(1 - s) b v - s F. Under a constant
/// force the contact comes to rest and holds as a rigid one does; what it holds back is r_ddot, or v_dot.
/// Both are stepped as the engine steps: velocities first.
class ContactCompliance {
 public:
  /// s, and 1 - s.
  struct Fraction {
    double force = 0.0, contact = 1.0;
    static Fraction Of(double fraction) { return {fraction, 1.0 - fraction}; }
    /// Of an acceleration instead of a force: it is held back whole.
    static Fraction Whole() { return {1.0, 1.0}; }
  };
  ContactCompliance(const PlantOptions& plant, const Fraction& normal, const Fraction& tangential);

  /// The next step's force. The first one finds the contact at rest.
  void Add(const Eigen::Ref<const VectorXd>& force);

  [[nodiscard]] bool has_any() const { return depth_.size() > 0; }
  /// r_ddot and v_dot of that step.
  [[nodiscard]] const VectorXd& along_normal() const { return normal_acceleration_; }
  [[nodiscard]] const VectorXd& along_tangent() const { return tangent_acceleration_; }
  /// The sum of their magnitudes.
  [[nodiscard]] double size() const { return normal_acceleration_.norm() + tangent_acceleration_.norm(); }
  /// By which fraction a step's give is still there at the next: modes do not pass through zero together.
  [[nodiscard]] double memory() const { return memory_; }
  /// r_dot at its end.
  [[nodiscard]] const VectorXd& rate() const { return depth_rate_; }

 private:
  double time_step_, b_, k_, memory_;
  Fraction normal_, tangential_;
  VectorXd depth_, depth_rate_, slip_;
  VectorXd normal_acceleration_, tangent_acceleration_;
};

/// All modes of soft contacts under one vector of forces. The modes are orthogonal in |.|_M, and each holds
/// back a fraction s_i of its part of the force, from nothing up to the softest one's s. With theta = s_i / s
/// and h_theta the answer of r_ddot to a step of the force, over s_i, a mode is at theta between contacts
/// that hold back next to nothing, a = h_0 * F, and the softest, b = h_1 * F, but for what a straight line
/// leaves of h_theta:
///
///   |r_ddot_i| / s = theta |(1 - theta) a_i + theta b_i + (e_theta * dF)_i|,
///   e_theta = h_theta - (1 - theta) h_0 - theta h_1.
///
/// theta (1 - theta) is 1/4 at most, and norms of sums are less than sums of norms:
///
///   |r_ddot| <= s (|a| / 4 + |b| + sum_k max_theta |theta e_theta(k)| |F_n-k - F_n-k-1|).
///
/// Likewise along tangents. Modes in which normals and tangents take part are orthogonal but for what is of
/// the order of s, which is added: 1 + s times the sum.
class ModesCompliance {
 public:
  ModesCompliance(const PlantOptions& plant, double normal_fraction, double tangential_fraction);

  /// As ContactCompliance.
  void Add(const Eigen::Ref<const VectorXd>& force);
  /// Bound of what is held back; once after each force. @param norm of a vector.
  double CalcSize(const std::function<double(const VectorXd&)>& norm);
  [[nodiscard]] const ContactCompliance& softest() const { return softest_; }

 private:
  double fraction_;  // the largest s
  ContactCompliance softest_, stiffest_;
  VectorXd bends_;    // s max_theta |theta e_theta(k)| by k
  VectorXd changes_;  // |F_k - F_k-1| of as many steps, the one of this step at newest_
  Eigen::Index newest_ = 0;
  VectorXd force_, change_;
};

/// By how much soft contacts change what the rigid system (46), (48) predicts; formulas in
/// check_table.cc.
class PredictionCompliance {
 public:
  explicit PredictionCompliance(const Setup& setup);

  /// The next step that is judged. @param contact_bias CalcContactBias. @param force C_bar' xi + F_bar' -
  /// E_bar' tau' (n). @param f_c (3N) predicted. @param uneven what comes of tilt and slip, in |.|_M^-1.
  /// @param norm |f|_M^-1 of this step.
  void Follow(const StepRecord& step, const DeclaredStep& declared, const VectorXd& contact_bias,
              const VectorXd& force, const VectorXd& f_c, double uneven,
              const std::function<double(const VectorXd&)>& norm);
  /// Of xi_dot, in |.|_M.
  [[nodiscard]] double motion() const { return motion_; }
  /// Of f_c, N.
  [[nodiscard]] double force() const { return contact_force_; }
  /// Of the platform's velocity, m/s: how fast it sinks and tilts.
  [[nodiscard]] double sinking() const { return sinking_; }

 private:
  PredictionCompliance(const Setup& setup, const ContactSoftness& softness);

  const Setup* setup_;
  double mass_ = 0.0;  // of the robot, kg
  /// Of the force on the robot (n), of f_c (3N), and, of a plant that declares anything, of pushes (3) and of
  /// J_B'^T f_c (n).
  ModesCompliance force_, f_c_, push_, grasp_;
  /// Likewise of the accelerations that (46) has and the engine's constraints have not, m/s^2: of fingertips
  /// (3N), of the wheels sideways (1).
  ContactCompliance tips_, tyres_;
  VectorXd sideways_;                      // 1
  VectorXd grasp_force_;                   // n
  double held_ = 0.0, held_of_f_c_ = 0.0;  // with what is left of former steps
  double motion_ = 0.0, contact_force_ = 0.0, sinking_ = 0.0;
};

}  // namespace dexcheck
