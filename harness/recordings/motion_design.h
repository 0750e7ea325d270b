#pragma once

// A motion to be recorded, in which the faults of a model would show best: optimal design of the experiment
// that judge evaluates.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "harness/recordings/motion_limits.h"
#include "harness/recordings/read_recordings.h"

namespace dexcheck {

/// Joint i moves as q_i(t) = c_i + w(t) sum_k a_ik sin(k w_0 t) + b_ik cos(k w_0 t), where w rises smoothly
/// from 0 and falls back to it: the robot begins and ends at rest in the posture c. Units rad and m, s.
class SeriesMotion {
 public:
  static constexpr int kHarmonics = 5;

  SeriesMotion(const VectorXd& centre, double duration);

  /// At a time from 0 to duration().
  void Calc(double time, VectorXd* q, VectorXd* qd, VectorXd* qdd) const;
  [[nodiscard]] double duration() const { return duration_; }
  [[nodiscard]] int joints() const { return static_cast<int>(centre_.size()); }

  VectorXd& centre() { return centre_; }
  /// a_i1 ... a_iH, b_i1 ... b_iH by row.
  MatrixXd& coefficients() { return coefficients_; }
  /// Columns (2 kHarmonics) that the coefficients are multiplied by: position, velocity, acceleration.
  [[nodiscard]] Eigen::Matrix<double, 3, 2 * kHarmonics> CalcBasis(double time) const;

 private:
  VectorXd centre_;
  double duration_;
  MatrixXd coefficients_;
};

struct MotionDesignOptions {
  double duration = 20.0;  ///< s
  double rate = 100.0;     ///< Rows per second whose noise is independent.
  int evaluations = 2000;  ///< Motions that are tried at the most.
  std::uint64_t seed = 1;
  /// How far bodies overlap in a posture, m; empty for what is not known.
  std::function<double(const VectorXd& q)> calc_overlap;
  /// The information that is known already: the motion adds to it. Its noise is expected again; without it,
  /// noise of 1 % of each joint's usual torque.
  const RecordingSet* recorded = nullptr;
  std::function<bool(int evaluations)> go_on;  ///< False ends the search with the best so far.
};

/// How well a fault's size is known: standard errors, in the mean over places of one kind, relative to a
/// size that is plausible.
struct ExpectedError {
  std::string fault;
  double before = 1.0;  ///< From the recordings so far; 1: nothing is known.
  double after = 1.0;   ///< With the motion.
};

struct MotionDesign {
  SeriesMotion motion;
  VectorXd torque;  ///< Largest of each joint, N m or N.
  std::vector<ExpectedError> errors;
  /// Combinations of all faults' sizes that are known to a third of what is plausible.
  int known_before = 0, known_after = 0, combinations = 0;
  int evaluations = 0;
};

/// Returns the model's torques of a motion, with friction, N m or N. @param q, qd, qdd by joint.
VectorXd CalcMotionTorques(const VectorXd& q, const VectorXd& qd, const VectorXd& qdd,
                           TorqueRegressor* regressor);

/// Maximises log det(1 + S W^T W S) over the motions within limits: W are the columns that faults leave in
/// the joints' balances in units of noise, those of `recorded` included, and S the sizes that are plausible.
/// By SBPLX (T. Rowan 1990; NLopt's) from the best of motions drawn at random.
/// @throws InputError when the base moves, or when no motion within the limits was found.
MotionDesign DesignMotion(const RobotModel& model, const MotionLimits& limits,
                          const MotionDesignOptions& options);

}  // namespace dexcheck
