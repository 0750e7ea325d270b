#pragma once

// The task "take the object from where it lies, carry it, put it down" as a sequence of phases. Which phase
// comes next is decided by what the hand feels.

#include <string>
#include <vector>

#include "controller/control/computed_torque.h"
#include "controller/control/controller.h"
#include "controller/control/trajectory.h"
#include "controller/handling/handling_controller.h"
#include "controller/handling/pick_plan.h"

namespace dexcheck {

enum class Phase {
  kApproach,  ///< The hand moves over the object and down around it, in free space.
  kClose,     ///< The fingers close until all fingertips touch.
  kGrip,      ///< From touching to grasp forces, without pushing the object.
  kTakeOver,  ///< The object's weight goes from the support to the hand: it is weighed.
  kCarry,     ///< Up, along, down.
  kHandOver,  ///< The weight goes to the support.
  kRelease,   ///< From grasp forces to none; the fingers open.
  kWithdraw,  ///< The hand moves up and back.
  kDone,
};
/// "approach" and so on.
const char* NameOf(Phase phase);
/// Whether all fingertips should touch the object.
constexpr bool IsHolding(Phase phase) { return phase >= Phase::kGrip && phase <= Phase::kHandOver; }

struct PickAndPlaceOptions {
  Vector3d raise = Vector3d(0.0, 0.0, 0.15);  ///< World, m.
  Vector3d transport = Vector3d(1.0, 0.0, 0.0);
  double approach_time = 2.0;   ///< To above the object and back, s each; longer for a far one.
  double lower_time = 1.5;      ///< From there to around it; longer for a far one.
  double close_time = 0.6;      ///< To just off the contacts.
  double search_speed = 0.006;  ///< From there on, m/s.
  double grip_time = 1.2;
  double take_over_time = 1.5;
  double raise_time = 3.0;  ///< Up, and down; longer where the arm has to bend far:
  double arm_rate = 0.2;    ///< its joints turn no faster than this on average, rad/s.
  double transport_time = 3.5;
  double touch_force = 0.3;    ///< N, while fingertips wait for the others.
  double f_min = 1.0;          ///< N, of the grasp.
  double overload = 1.5;       ///< Largest mass that is lifted, over the stated one.
  double largest_push = 3e-3;  ///< How far the closing hand may move the object, m.
  int attempts = 2;
  double posture_frequency = 20.0;  ///< Of all joints, rad/s, critically damped.
  PickPlanOptions plan;
};

/// When a phase began.
struct PhaseEntry {
  Phase phase;
  double time;  ///< s
  int attempt;  ///< From 1.
};

/// The sequence. Plans when an attempt begins, which takes time and allocates; steps do neither.
class PickAndPlace {
 public:
  /// @param hand with its fingertips in the grasp's order. @param start posture (q') that the task begins and
  /// ends in.
  /// @param time_step at the middle of which velocities are referred to (leapfrog), s; 0 for none.
  PickAndPlace(const RobotModel& model, const Hand& hand, const Surface& surface,
               const MassProperties& object, const VectorXd& start, const PickAndPlaceOptions& options,
               double time_step);

  /// Begins at time t with robot and object where they are. @throws InputError when the object is out of
  /// reach.
  void Begin(double t, const MeasuredState& state);

  /// Decides what to do at time t (s): the posture and the demand.
  void Update(double t, const MeasuredState& state, const Touch& touch);
  /// The demand's forces do not exist: bears less, and gives the object back.
  void Refuse(double t, const std::string& reason);

  [[nodiscard]] const HandlingDemand& demand() const { return demand_; }
  /// Desired joints and the stiffness about them; after the first Update.
  [[nodiscard]] const PostureTask& posture() const { return posture_; }
  [[nodiscard]] Phase phase() const { return phase_; }
  [[nodiscard]] bool is_done() const { return phase_ == Phase::kDone; }
  /// Why the object was not brought; empty when it was, or may yet be.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// Reason why the first attempt failed; empty without another attempt.
  [[nodiscard]] const std::string& first_failure() const { return first_failure_; }
  [[nodiscard]] const std::vector<PhaseEntry>& history() const { return history_; }
  [[nodiscard]] const PickPlan& plan() const { return plan_; }
  /// Mass of the object over its stated one, as weighed; 1 before.
  [[nodiscard]] double scale() const { return demand_.scale; }
  /// How far the closing hand moved the object, m.
  [[nodiscard]] double push() const { return push_; }

 private:
  /// From one posture to another with least snap.
  struct Move {
    VectorXd from, to;
    double begin = 0.0;
    double duration = 0.0;
    bool steady = false;                // at constant speed after a short ramp
    const PosturePath* path = nullptr;  // of the plan, instead of the straight way,
    bool backwards = false;
    VectorXd offset;  // and this far from it
  };

  void Enter(Phase phase, double t);
  void BeginStage(int stage, double t) {
    stage_ = stage;
    stage_begin_ = t;
  }
  void StartMove(const VectorXd& from, const VectorXd& to, double t, double duration, bool steady = false);
  /// Along a path of the plan, or back.
  void StartPath(const VectorXd& from, const PosturePath& path, bool backwards, double t, double duration);
  /// Path of the hand above the object: as planned, or at the place where it is put down.
  [[nodiscard]] const PosturePath& rise() const { return carried_over_ ? plan_.landing : plan_.rise; }
  [[nodiscard]] bool MoveDone(double t) const { return t >= move_.begin + move_.duration; }
  [[nodiscard]] ScalarMotion EvaluateMove(double t) const;
  /// Sets way_ and its derivatives.
  void EvaluateWay(double s);
  void FollowMove(double t);
  void SetPostureGains(double t);
  void HoldPosture(const VectorXd& q_joints) { StartMove(q_joints, q_joints, begin_, 0.0); }
  [[nodiscard]] VectorXd Joints(const MeasuredState& state) const {
    return state.q.tail(model_->num_joints());
  }

  void UpdateApproach(double t, const MeasuredState& state, const Touch& touch);
  void UpdateClose(double t, const MeasuredState& state, const Touch& touch);
  void UpdateGrip(double t, const MeasuredState& state, const Touch& touch);
  void UpdateTakeOver(double t, const MeasuredState& state, const Touch& touch);
  void UpdateCarry(double t, const MeasuredState& state, const Touch& touch);
  void UpdateHandOver(double t, const MeasuredState& state, const Touch& touch);
  void UpdateRelease(double t, const MeasuredState& state, const Touch& touch);
  void UpdateWithdraw(double t, const MeasuredState& state, const Touch& touch);
  void GiveUp(double t, const MeasuredState& state, const std::string& reason);
  void PlanAttempt(double t, const MeasuredState& state);
  [[nodiscard]] DesiredMotion EvaluateCarry(double t) const;
  /// When the object is up, and when it is over its new place, s.
  [[nodiscard]] double raised_at() const { return begin_ + raise_time_; }
  [[nodiscard]] double there_at() const { return raised_at() + transport_time_; }

  const RobotModel* model_;
  Hand hand_;
  const Surface* surface_;
  double weight_;  // stated, N
  VectorXd start_;
  PickAndPlaceOptions options_;
  double half_step_;
  std::vector<std::vector<int>> own_joints_;  // by fingertip

  PickPlan plan_;
  Phase phase_ = Phase::kApproach;
  int stage_ = 0;       // within a phase
  double begin_ = 0.0;  // of the phase, s
  double stage_begin_ = 0.0;
  int attempt_ = 0;
  Move move_;
  VectorXd way_, way_s_, way_ss_;  // posture of the move and its derivatives by s
  HandlingDemand demand_;
  PostureTask posture_;
  std::vector<double> touched_at_;  // by fingertip, s
  Vector3d lay_at_ = Vector3d::Zero();
  Vector6d X_start_ = Vector6d::Zero();
  double push_ = 0.0;
  double approach_time_ = 0.0;  // s
  double lower_time_ = 0.0;
  double raise_time_ = 0.0;
  double transport_time_ = 0.0;
  bool carried_over_ = false;   // to the end of its way
  double borne_ = 0.0;          // weight of the step before
  double lowering_from_ = 1.0;  // weight at the beginning of the hand-over
  bool refused_ = false;
  bool retrying_ = false;
  std::string failure_, first_failure_;
  std::vector<PhaseEntry> history_;
};

}  // namespace dexcheck
