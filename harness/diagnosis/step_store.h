#pragma once

// The signals of the steps that are to be explained, from a little before the first that differs.

#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "controller/model/robot_model.h"
#include "harness/checks/judged_law.h"
#include "harness/checks/step_analysis.h"
#include "harness/engine/engine.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Entry of a reading, or a motor.
struct SignalName {
  std::string place;  ///< "joint r_elbow".
  std::string what;   ///< "position".
  std::string unit;
  std::string group;  ///< What a fault may have in common: "joint positions".
};

/// Nothing allocates after construction. As long as there is room every step is kept, and then every second
/// block of kBlock consecutive steps, every fourth, ...
class StepStore {
 public:
  /// Steps that a block has at the most, and of those the first whose predecessors may be missing.
  static constexpr Eigen::Index kBlock = 64, kHistory = 16;

  /// Torques pass a gear once and back.
  static constexpr double kTorqueRounding = 1e-14;

  /// The parts of a step that can be judged: all; no forces, as of the first contacts; no torques either,
  /// which a motor refused.
  enum class Judged { kAll, kSignals, kReadings };

  /// Signals of a step, and their sizes: n of xi, m of a reading.
  enum Signal {
    kTime,
    kTauDeclared,      ///< n, N m: what the declared motors make of the command.
    kTauReceived,      ///< n, N m
    kPosition,         ///< q', as it is.
    kVelocity,         ///< n, in the order of xi.
    kDeclaredReading,  ///< m, what the declared sensing makes of the truth.
    kReading,          ///< m, what was measured.
    kMotionPosition,   ///< MotionBalance::q, nu, nu_dot, residual, size; size is 0 where there are no forces.
    kMotionVelocity,
    kMotionAcceleration,
    kResidual,
    kSize,
    kObjectPose,       ///< 12: rotation by columns, position.
    kObjectMotion,     ///< 12: V_Bo and V_Bo_dot.
    kDryFriction,      ///< n: what the plant says of it, beyond the declared; 0 where it says nothing.
    kWheelRates,       ///< 2, right and left, rad/s.
    kWheelMismatch,    ///< 2, RollingFindings::mismatch, m/s.
    kWheelNoise,       ///< 2: what of that slipping is, and rounding, m/s; 0 without wheels.
    kContactMismatch,  ///< N: TouchFindings::mismatch, m.
    kLawDiffers,       ///< 1 where the torques are not the law's, else 0.
    kSignalCount
  };

  /// @param law of MakeJudgedLaw; null where none is known. @param rolling_bound of the check `rolling`, m/s.
  StepStore(const Setup& setup, JudgedLaw* law, double rolling_bound);

  /// @param differs whether a check fails at this step.
  void Add(const StepRecord& step, const StepAnalysis& analysis, bool differs, Judged judged = Judged::kAll);
  /// Time begins anew.
  void Reset();

  /// Number of steps that are kept; 0 where nothing differed.
  [[nodiscard]] Eigen::Index size() const { return size_; }
  /// A copy without the steps from that time on, s.
  [[nodiscard]] StepStore GetBefore(double time) const;
  /// Entries (rows) by steps (columns).
  [[nodiscard]] auto Get(Signal signal) const {
    return data_.block(offsets_[signal], 0, offsets_[signal + 1] - offsets_[signal], size_);
  }
  /// A signal of a row: of a column of all signals.
  [[nodiscard]] auto Part(const Eigen::Ref<const VectorXd>& row, Signal signal) const {
    return row.segment(offsets_[signal], offsets_[signal + 1] - offsets_[signal]);
  }
  [[nodiscard]] auto Row(Eigen::Index step) const { return data_.col(step); }
  /// Rounding of each entry of a row's residual: of its summands, or the scenario's tolerance. Infinite for
  /// base and wheels where one of these stands elsewhere: of another size, it stands higher.
  void CalcNoise(const Eigen::Ref<const VectorXd>& row, VectorXd* noise) const;
  [[nodiscard]] VectorXd CalcNoise(const Eigen::Ref<const VectorXd>& row) const {
    VectorXd noise;
    CalcNoise(row, &noise);
    return noise;
  }
  /// Whether forces of a row were judged.
  [[nodiscard]] bool HasForces(const Eigen::Ref<const VectorXd>& row) const {
    return Part(row, kSize)[0] > 0.0;
  }
  /// Whether the step's predecessors are those before it in the store.
  [[nodiscard]] bool HasHistory(Eigen::Index step) const;
  /// Time of the last step that was added, s.
  [[nodiscard]] double last_time() const { return last_time_; }
  [[nodiscard]] const Setup& setup() const { return *setup_; }
  /// The robot whose equations of motion are judged: MotionBalance.
  [[nodiscard]] const RobotModel& moving_model() const { return moving_model_; }
  /// When a signal differs from what is declared, of all steps, s; NaN for never.
  struct Span {
    double first = std::numeric_limits<double>::quiet_NaN(), last = first;
  };
  /// A step at which part of the residual begins or ends: the rows of that step and of the one before, and
  /// the residual's change, less that at a step beside.
  struct Jump {
    VectorXd before, after, change;
  };
  /// All jumps, in time; none where there are more than can be kept.
  [[nodiscard]] std::span<const Jump> jumps() const {
    return {jumps_.data(), num_jumps_ <= kMostJumps ? num_jumps_ : 0};
  }
  [[nodiscard]] const std::vector<Span>& motor_spans() const { return motor_spans_; }
  [[nodiscard]] const std::vector<Span>& reading_spans() const { return reading_spans_; }
  /// A link, or a wheel of the base, that the plant has elsewhere on its parent than the engine's model: how
  /// far, in the parent's axes.
  struct Misplaced {
    std::string place, parent;           ///< "link r_palm", "wheel wheel_left".
    double from = 0.0;                   ///< s
    Vector3d offset = Vector3d::Zero();  ///< m
    double turn = 0.0;                   ///< rad
    int body = -1, on = -1;              ///< The engine's bodies.
    Pose X = Pose::Identity();           ///< Of the one on the other at that time.
    double position = 0.0;               ///< Its joint's then, rad or m.
    /// Angle of the joint's axis against the declared one in the link, rad, by how the link moved since then;
    /// 0 where that is as declared, and the link is elsewhere at every position.
    double axis_turn = 0.0;
    double moved = 0.0;  ///< Of the joint between then and the step that showed it, rad or m.
  };
  [[nodiscard]] const std::vector<Misplaced>& misplaced() const { return misplaced_; }
  /// Whether a link is among them, and not only wheels.
  [[nodiscard]] bool has_misplaced_link() const { return misplaced_.size() > misplaced_wheels_; }
  /// Residual of the check `rolling`, m/s.
  [[nodiscard]] double rolling_bound() const { return rolling_bound_; }
  [[nodiscard]] JudgedLaw* law() const { return law_; }
  [[nodiscard]] const std::vector<SignalName>& readings() const { return readings_; }
  [[nodiscard]] const std::vector<SignalName>& motors() const { return motors_; }

 private:
  static constexpr Eigen::Index kCapacity = 16 * kBlock;
  static constexpr size_t kMostJumps = 8;
  static constexpr Eigen::Index kRecent = 8;  // steps that a jump is seen by

  void NameReadings();
  void PackReading(const Reading& reading, const Reading& declared, Eigen::Ref<VectorXd> entries) const;
  void Pack(const StepRecord& step, const StepAnalysis& analysis, Judged judged, Eigen::Ref<VectorXd> row);
  /// Notes when signals differ.
  void Watch(const Eigen::Ref<const VectorXd>& row);
  /// Notes where the residual jumps, some steps later.
  void WatchJumps(const Eigen::Ref<const VectorXd>& row);
  /// Returns how far the residual's change at a recent step is from that of any step around it, the robot's
  /// and the object's root mean square over their noise.
  [[nodiscard]] Vector2d CalcApart(Eigen::Index step) const;
  /// Notes which links are misplaced, until some are, and then about which axes these move.
  void FindMisplaced(const StepRecord& step);
  void FindAxes(const PlantReading& plant);
  void Keep(Eigen::Index block, const Eigen::Ref<const VectorXd>& row);

  const Setup* setup_;
  JudgedLaw* law_;
  double rolling_bound_, rounding_;
  RobotModel moving_model_;
  std::vector<SignalName> readings_, motors_;
  Eigen::Index offsets_[kSignalCount + 1] = {};
  MatrixXd before_;  // ring of the last steps, before anything differed
  MatrixXd data_;
  std::vector<Eigen::Index> block_;  // of each step that is kept
  std::vector<Span> motor_spans_, reading_spans_;
  std::shared_ptr<mjData> kinematics_;  // of the engine's model
  std::vector<Misplaced> misplaced_;
  size_t misplaced_wheels_ = 0;  // of these
  // The last steps with forces, by their number modulo kRecent: rows, changes of the residual since the step
  // before, CalcApart.
  MatrixXd recent_, changes_, apart_;
  Eigen::Index num_recent_ = 0;
  std::vector<Jump> jumps_;
  size_t num_jumps_ = 0;
  double largest_torque_ = 0.0;  // N m, declared
  VectorXd row_, noise_;
  Eigen::Index seen_ = 0;  // steps in the ring
  Eigen::Index size_ = 0, added_ = 0;
  Eigen::Index stride_ = 1;  // of blocks that are kept
  bool has_begun_ = false;
  double last_time_ = 0.0;
};

}  // namespace dexcheck
