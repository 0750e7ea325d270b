#pragma once

// How what arrived differs from what was meant to: torques that motors gave against those that were sent,
// readings that a controller was told against the truth. Each is explained by one number where one suffices.

#include <string>
#include <vector>

#include "controller/control/measured_state.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// What an entry's difference from what was meant is, when one number says it.
struct SignalFinding {
  enum class Kind { kNone, kGain, kOffset, kDelay, kLag, kDryFriction, kDamping };
  Kind kind = Kind::kNone;  ///< kNone: several numbers, or none of these.
  /// kGain: the factor; kOffset: in the signal's unit; kDelay: steps; kLag: fraction of the difference that
  /// is made up a step; kDryFriction, kDamping: N m, N m s/rad.
  double value = 0.0;
  double explained = 0.0;  ///< Fraction of the difference's square.
};

/// Regression of got - meant, for many entries at once. Nothing allocates after construction.
class SignalEvidence {
 public:
  /// Largest delay that is looked for, steps.
  static constexpr long kMostDelay = 8;

  explicit SignalEvidence(Eigen::Index size);
  /// One step. @param rate of what the entry moves, for damping; empty for none.
  void Add(const VectorXd& meant, const VectorXd& got, const VectorXd& rate);

  [[nodiscard]] bool has_any() const { return squares_.maxCoeff() > 0.0; }
  /// Entries that differed at any step, the most different first, by `weight` times the difference.
  [[nodiscard]] std::vector<Eigen::Index> ListDifferent(const VectorXd& weight) const;
  [[nodiscard]] SignalFinding Find(Eigen::Index entry) const { return Fit(entry, 1); }
  /// One explanation for all entries.
  [[nodiscard]] SignalFinding FindCommon() const { return Fit(0, squares_.size()); }
  /// Largest |got - meant| of an entry.
  [[nodiscard]] double largest(Eigen::Index entry) const { return largest_[entry]; }

 private:
  void Compare(const VectorXd& meant, const VectorXd& got, const VectorXd& rate);
  [[nodiscard]] SignalFinding Fit(Eigen::Index begin, Eigen::Index count) const;

  /// One column for each delay from 0 on, one row for each entry.
  using Delays = Eigen::Array<double, Eigen::Dynamic, kMostDelay + 1>;
  long seen_ = 0;                            // steps
  long steps_ = 0;                           // of these, from the first on at which something differed
  Eigen::ArrayXd step_difference_;           // got - meant
  VectorXd difference_, squares_, largest_;  // of that: sum, sum of squares, largest
  VectorXd by_meant_, meant_squares_;
  VectorXd by_sign_;
  VectorXd by_rate_, rate_squares_;
  VectorXd lag_by_, lag_squares_, lag_change_;  // got_t - got_t-1 on meant_t - got_t-1
  VectorXd before_;                             // got
  MatrixXd history_;                            // meant of the last steps, one column each
  Delays delay_left_;                           // sum of (got_t - meant_t-k)^2
  Delays squares_before_;                       // squares_ after the first k steps
};

/// Motors: which, and gain, delay, lag, offset, friction.
class MotorEvidence {
 public:
  MotorEvidence(const RobotModel& model, double time_step);
  /// @param sent, received tau' (n). @param xi n.
  void Add(const VectorXd& sent, const VectorXd& received, const VectorXd& xi);
  /// "motor r_elbow received 0.99 times what was sent"; empty when none differs.
  [[nodiscard]] std::string Tell() const;

 private:
  std::vector<std::string> names_;
  double time_step_;
  SignalEvidence evidence_;
};

/// Readings: which entry, and how much.
class SensorEvidence {
 public:
  SensorEvidence(const RobotModel& model, const std::vector<int>& fingertips, double time_step);
  void Add(const MeasuredState& told, const MeasuredState& truth);
  [[nodiscard]] std::string Tell() const;

 private:
  void Pack(const MeasuredState& state, const MeasuredState& truth, VectorXd* entries) const;

  std::vector<std::string> names_, units_;
  double time_step_;
  VectorXd measured_, truth_, none_;
  SignalEvidence evidence_;
};

}  // namespace dexcheck
