#pragma once

// The possible faults of a model of a recorded robot, and their columns.

#include <limits>
#include <vector>

#include "harness/diagnosis/cause_estimator.h"
#include "harness/recordings/channels.h"
#include "harness/recordings/torque_balance.h"

namespace dexcheck {

/// One of a fault's columns: the sum of these columns of torque balances, times a factor.
struct ColumnPart {
  TorqueColumn column;
  int joint = -1;  ///< In whose row; -1 for all that have it.
  double factor = 1.0;
  int recording = -1;  ///< -1 for all.
};

/// A force on a link (three columns, world axes, at its centre of mass; six with a moment), a torque at a
/// joint, a torque of it that is stuck (two columns), a point mass on a link (four columns: mass and its
/// first moment in the link's axes), or an acceleration of the base (three columns), for a time.
struct Push {
  int recording = 0;
  double from = 0.0, to = 0.0;  ///< s
  double reach = 0.0;           ///< Over which smoothing spreads its begin and end to each side, s.
  int link = -1;
  bool has_moment = false;
  int joint = -1;
  int payload = -1;  ///< Link that carries a mass. Without it, link and joint: the base.
  /// BodyVectors of the payload's columns: its mass, its first moment, and what inertia a point has there.
  Eigen::Matrix<double, TorqueRegressor::kBody, 4> masses =
      Eigen::Matrix<double, TorqueRegressor::kBody, 4>::Identity();
  bool is_stuck = false;  ///< The joint's recorded torque is a constant instead of what it was.
  int window = -1;        ///< The stretch of time in which it was found; its candidates share that.
};

/// A fault of the model at a place. The columns of the candidate are made of its sums, in units of noise,
/// when the estimator selects.
struct TorqueFault : Candidate {
  enum Kind {
    kDryFriction,
    kAllDry,
    kAllFriction,
    kViscousFriction,
    kSquareFriction,
    kStribeckFriction,
    kLoadFriction,
    kAllOffsets,
    kSpring,
    kOffset,
    kDrift,
    kDryDrift,
    kArmature,
    kIntegrator,
    kTorqueGain,
    kStuckTorque,
    kDelay,
    kZero,
    kEccentricity,
    kLatePosition,
    kPositionGain,
    kGeometry,
    kSaturation,
    kBacklash,
    kElasticity,
    kMass,
    kCentre,
    kInertia,
    kPayload,
    kGravity,
    kShaking,
    kPush,
  };
  Kind kind = kDryFriction;
  int index = -1;  ///< Joint or link; -1 for all.
  int recording = -1;
  std::vector<std::vector<ColumnPart>> sums;  ///< One for each column; none of a push.
  /// The largest plausible size of each amplitude with its nominal value; empty where is_possible says all.
  VectorXd most = {};
  Push push = {};
  /// Directions of the amplitudes of a centre of mass, in its link's frame, and of a geometry, in the frame
  /// of the link that carries the joint (3 x p); none of others.
  MatrixXd axes = {};

  /// It is one number of a vector or tensor that another fault has whole.
  [[nodiscard]] bool IsEntry() const {
    return (kind == kGeometry || kind == kCentre || kind == kInertia) && sums.size() == 1;
  }
  /// Friction of any shape, in one joint or in all.
  [[nodiscard]] bool IsFriction() const { return kind <= kLoadFriction; }
  /// Friction whose second amplitude is a change of its velocity's logarithm, times the first.
  [[nodiscard]] bool HasVelocity() const {
    return kind == kStribeckFriction || (kind == kDryFriction && sums.size() == 2);
  }
  /// Whether its columns hold for small sizes only.
  [[nodiscard]] bool IsGuess() const { return kind == kGeometry || kind == kPositionGain; }
  /// An error of a joint's measured position.
  [[nodiscard]] bool IsOfPosition() const { return kind >= kZero && kind <= kPositionGain; }
  /// A fault of bodies, gravity, positions or springs: all but the drive's own numbers.
  [[nodiscard]] bool IsOfLoad() const { return kind == kSpring || (kind >= kZero && kind <= kGravity); }
};

/// Links that carry no other one, and may carry a payload.
std::vector<int> ListLastLinks(const RobotModel& model);
/// Whether a mass and its first moment (kg, kg m) are those of a payload near its link.
bool IsPayload(const VectorXd& amplitude);

/// How large torques and motion of each joint are (n): what no size of a fault can go far beyond. Empty where
/// nothing was recorded.
struct MotionExtents {
  VectorXd torque;        ///< Measured and modelled together, N m or N.
  VectorXd speed;         ///< rad/s or m/s
  VectorXd acceleration;  ///< rad/s^2 or m/s^2
  VectorXd span;          ///< Of the position, rad or m.
  double step = 0.0;      ///< Between rows, s.

  /// The torque of a joint; infinite where nothing was recorded.
  [[nodiscard]] double FindTorque(int joint) const {
    return torque.size() > 0 ? torque[joint] : std::numeric_limits<double>::infinity();
  }
};

/// All that are tried of a model's recordings.
/// @param joints that are judged. @param recordings their number. @param frames along whose axes a joint may
/// be misplaced.
std::vector<TorqueFault> ListTorqueFaults(const RobotModel& model, const std::vector<int>& joints,
                                          int recordings, const Refinements& refinements = {},
                                          const MotionExtents& extents = {}, const LinkFrames& frames = {});

/// Gives a centre of mass, or a payload that is a point, the columns with which these amplitudes, if they can
/// be, leave what they leave: inertias about the link's origin grow with the square of a distance.
/// @param amplitude a shift, m; mass (kg) and mass times place (kg m).
void PlaceMass(const RobotModel& model, const VectorXd& amplitude, TorqueFault* fault);

}  // namespace dexcheck
