#pragma once

#include <memory>
#include <optional>

#include "controller/common/types.h"
#include "controller/control/baseline_law.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/joint_motion.h"
#include "controller/control/stance.h"
#include "controller/control/trajectory_controller.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/platform.h"

namespace dexcheck {

// Laws for the joints of a robot that holds nothing, on a fixed base or standing on its feet. e = q_d - q,
// e_dot = q_d_dot - q_dot; K_p, K_v, K and D are diagonal.
//
// kComputedTorque [Luh, Walker, Paul 1980; Craig 1989, 10.4], (18) inverted:
//   tau' = M_bar' (q_d_ddot + K_v e_dot + K_p e) + C_bar' q_dot + F_bar'
// so that e_ddot + K_v e_dot + K_p e = 0.
//
// kPdGravity [Takegaki, Arimoto 1981]: springs and dampers against the weight, nothing that moves is known.
//   tau' = K e + D e_dot + g
//
// kFeedforwardPd [Paden, Panja 1988, "PD+"]: the same, and what the desired motion takes.
//   tau' = M_bar' q_d_ddot + C_bar' q_d_dot + F_bar' + K e + D e_dot
//
// Each of them may compensate friction that its model does not have, of each joint
//   tau_f = coulomb tanh(q_d_dot / coulomb_velocity) + viscous q_d_dot
// along the desired rate: the measured one would feed the sign of its noise back [Armstrong-Helouvry, Dupont,
// Canudas de Wit 1994, 5.3].

// A robot that stands has no motors for its base: e is that of all coordinates, K and D are zero for the
// base, and of the force F that a law has above the ground gives its part (StanceForces), tau' = (F - J^T
// f)_joints.

/// Gains of the joints, and friction that is compensated; one entry for each. Of a robot that stands, with
/// six before for its base.
struct JointGains {
  VectorXd K_p;  ///< 1/s^2: kComputedTorque.
  VectorXd K_v;  ///< 1/s: kComputedTorque.
  VectorXd K;    ///< N m/rad, N/m: the others.
  VectorXd D;    ///< N m s/rad, N s/m: the others.

  VectorXd coulomb;                ///< N m, N; empty for none.
  VectorXd viscous;                ///< N m s/rad, N s/m; empty for none.
  double coulomb_velocity = 0.01;  ///< rad/s, m/s: where tanh smooths the sign.

  std::optional<Stance> stance{};  ///< Of a robot that stands.
};

/// Adds tau_f (n) at a desired rate to a force.
void AddFrictionCompensation(const JointGains& gains, const VectorXd& q_d_dot, VectorXd* force);

/// Whether the law is one for joints: kComputedTorque, kPdGravity, kFeedforwardPd.
[[nodiscard]] bool IsJointLaw(ControlLaw law);

/// One of them. Nothing allocates after construction.
class JointLaw {
 public:
  /// @throws std::invalid_argument unless the base is fixed or stands, the law is one for joints, and its
  /// gains and what it compensates have an entry for each joint.
  JointLaw(const RobotModel& model, ControlLaw law, const JointGains& gains);

  /// tau' (n), N m or N. @param robot CalcDynamics done, reduced. @param q, xi the state that it is at.
  const VectorXd& CalcTorque(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& q,
                             const Eigen::Ref<const VectorXd>& xi, const DesiredJoints& desired);

  /// xi_dot that the last torques mean to have: of computed torque q_d_ddot + K_v e_dot + K_p e, of the
  /// others q_d_ddot.
  [[nodiscard]] const VectorXd& xi_dot_d() const { return xi_dot_d_; }
  [[nodiscard]] ControlLaw law() const { return law_; }
  /// Ground contact forces (3m) of the last torques, world axes, N; empty for a fixed base.
  [[nodiscard]] const VectorXd& ground_forces() const { return ground_forces_; }
  [[nodiscard]] const JointGains& gains() const { return gains_; }

 private:
  ControlLaw law_;
  JointGains gains_;
  ActuationMap actuation_;
  std::unique_ptr<StanceForces> stance_;  // null for a base that is fixed
  VectorXd xi_dot_d_, force_, tau_;       // n
  VectorXd error_;                        // n, q_d - q
  VectorXd ground_forces_;
};

/// Joints that a motion demands of a controller: its start until Begin, then q_d(t).
class JointDemand {
 public:
  /// @param motion outlives this.
  JointDemand(const JointMotion& motion, double time_step) : motion_(&motion), time_step_(time_step) {}

  void Begin() { has_begun_ = true; }
  /// Fills `joints` as EvaluateDesired does, and says that nothing is held or carried.
  void Fill(const Reading& reading, double t, Command* command);

  /// q_d, q_d_ddot at t, and q_d_dot half a time step before. @param half_step scratch.
  static void EvaluateDesired(const JointMotion& motion, double t, double time_step, DesiredJoints* desired,
                              DesiredJoints* half_step);

 private:
  const JointMotion* motion_;
  double time_step_;
  bool has_begun_ = false;
  DesiredJoints half_step_;
};

/// A joint law along q_d(t), for a robot that holds nothing. It keeps the start until Begin.
class JointController final : public Controller {
 public:
  /// @param model of the robot without contacts: the grasp in it has none. @param motion outlives this.
  /// @throws as JointLaw and GraspModel; std::invalid_argument unless sampling.hold > 0.
  JointController(const RobotModel& model, const MassProperties& object, const Surface& surface,
                  ControlLaw law, const JointGains& gains, const JointMotion& motion,
                  const Sampling& sampling);

  /// No motion of an object is followed.
  void Follow(const Trajectory& motion) override;
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] const GraspModel& model() const override { return model_; }

 private:
  GraspModel model_;
  JointLaw law_;
  JointDemand demand_;
  Sampling sampling_;
  long steps_until_due_ = 0;
};

}  // namespace dexcheck
