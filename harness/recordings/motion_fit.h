#pragma once

// The motion of a recording: positions, velocities and accelerations by local polynomials, with their errors.

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "controller/dynamics/torque_regressor.h"
#include "harness/diagnosis/causes.h"
#include "harness/recordings/channels.h"
#include "harness/recordings/friction_shapes.h"

namespace dexcheck {

inline double Square(double x) { return x * x; }
/// The results of a first reading, so that the next has columns that fit better.
struct Refinements {
  long held_stretch = 3;                ///< Which of four stretches is held out.
  std::map<int, double> stribeck;       ///< Velocities below which joints have more friction, rad/s or m/s.
  std::map<int, double> smooth;         ///< Velocities over which joints' dry friction turns, rad/s or m/s.
  std::map<int, double> limits;         ///< Torques at which joints' were cut off, N m or N.
  std::map<int, long> delays;           ///< Of joints' torques, rows.
  Vector3d gravity = Vector3d::Zero();  ///< What it is more than the model's, m/s^2, world.
  double shaking = 0.0;                 ///< Angular frequency of the base, rad/s; 0 where it rests.
  /// Forces follow from the velocities at the positions' times, and not from those recorded with them.
  bool advances_velocities = false;
  bool operator==(const Refinements&) const = default;
};

/// A row after smoothing. Entries by joint, in the model's order; those of joints that were not recorded are
/// zero.
struct RecordedSample {
  double time = 0.0;
  double passed = 0.0;  ///< Since the first row, s.
  VectorXd q, qd, qdd, jerk, snap;
  VectorXd torque;                    ///< Measured, or the current; smoothed like the motion.
  VectorXd most_torque;               ///< The largest of those that were read ahead, less its noise.
  VectorXd torque_rate;               ///< Per s, the secant's over a delay that is known.
  BaseMotion base;                    ///< At rest where it was not recorded.
  VectorXd wrench;                    ///< Measured, on the link, N and N m; empty for none.
  VectorXd direction;                 ///< Sign of the velocity, averaged as the torque is; 0 at rest.
  VectorXd slowest;                   ///< Row's speed the way that the first goes; negative where it turns.
  VectorXd beyond;                    ///< Share of the rows whose torque is beyond a limit that is known.
  MatrixXd friction;                  ///< Other shapes of it, n x kFrictionShapes.
  Vector2d swing = Vector2d::Zero();  ///< Sine and cosine of a base that shakes, averaged.
};

/// A recording's noise, as standard deviations by joint, and how it moves and is sampled.
struct MotionFacts {
  VectorXd position, velocity, torque;  ///< Of a single number.
  VectorXd smooth_position, smooth_torque,
      acceleration,           ///< Of a sample, this and the next with what smoothing leaves out.
      damped;                 ///< Of the model's viscous friction in a sample.
  VectorXd wrench;            ///< Of a sample; empty for none.
  double base = 0.0;          ///< Of a sample: the base's acceleration with gravity, m/s^2.
  VectorXd rest;              ///< Velocity below which a joint is at rest.
  bool is_quantised = false;  ///< The steps of an encoder are much of some position's noise.
  std::vector<bool> moves;    ///< By joint: whether it moves, and farther than its dry friction may hold it.
  MatrixXd inertia;           ///< Root mean square of the entries of M_bar'.
  /// Velocities of the shapes of friction, by the root mean square of the joints' velocities.
  MatrixXd shape_velocities;
  bool stands = false;  ///< No joint moves, in all of the recording.
  double step = 0.0;    ///< Median time between rows, s.
};

/// Reads a recording once, in constant memory. Rows whose times are doubled are left out, so are those that
/// repeat the row before (a logger faster than the robot), and nothing is smoothed across a gap.
class MotionFit {
 public:
  /// Returns false to end the reading.
  using Receiver = std::function<bool(const RecordedSample&)>;

  /// Reads ahead to see noise and sampling. Velocities that are not the positions' derivatives are not used.
  /// @param ahead rows. @throws InputError, one line that names file, row and column.
  MotionFit(const RobotModel& model, Recording* recording, size_t ahead = 20'000,
            const Refinements& refinements = {});

  /// All samples, in time.
  void Run(const Receiver& receive);

  /// Faults of the recording itself: velocities, lost samples, jumps.
  [[nodiscard]] const std::vector<Fault>& faults() const { return faults_; }
  [[nodiscard]] const MotionFacts& facts() const { return facts_; }
  /// Joints with a position and a torque or current.
  [[nodiscard]] const std::vector<int>& joints() const { return judged_; }
  /// By joint: whether a sample says what moves it. Where friction holds a joint that moves at other times,
  /// it does not; nor does it where a joint of which dry friction is known turns or rests within a window.
  [[nodiscard]] std::vector<bool> IsJudged(const RecordedSample& sample) const;
  [[nodiscard]] const VectorXd& most_torque() const { return sample_.most_torque; }
  [[nodiscard]] bool has_currents() const { return has_currents_; }
  [[nodiscard]] double window() const {
    return 2.0 * static_cast<double>(half_) * facts_.step;
  }  ///< That is smoothed over, s.
  [[nodiscard]] long rows() const { return rows_; }
  /// Says how the rows were treated, for the report.
  [[nodiscard]] std::vector<std::string> ListNotes() const;
  /// Whether velocities were recorded up to two rows before or after positions.
  [[nodiscard]] bool has_other_times() const { return !velocity_lags_.empty(); }

 private:
  static constexpr int kOrder = 4;      // of the polynomials
  static constexpr double kGap = 10.0;  // times the usual step
  /// One row: time, then each channel's numbers in SI units.
  using Row = VectorXd;

  [[nodiscard]] RecordedQuantity Effort() const {
    return has_currents_ ? RecordedQuantity::kCurrent : RecordedQuantity::kTorque;
  }
  bool ReadRow(Row* row);
  bool Fill();
  void Analyse();
  /// Finds the usual step, replaces wrong samples, undoes jumps and divides the rows where there are gaps.
  void CheckRows();
  /// Noise of each channel: what polynomials over short windows leave.
  [[nodiscard]] VectorXd MeasureNoise(const std::vector<size_t>& centres, size_t half) const;
  /// Noise of smoothed torques behind a filter, or rounded.
  [[nodiscard]] VectorXd CalcFilteredNoise();
  void ChooseWindow(const std::vector<size_t>& centres);
  void CalcSpeeds();
  void AddWrenchErrors();
  /// Takes whole turns off a row's positions that pass from one end of a turn to the other.
  void Unwrap(Row* row);
  /// Whether the whole recording was read ahead and no joint moves.
  [[nodiscard]] bool Stands() const;
  void CheckVelocities();
  /// Returns what is wrong with a joint's velocities, if they are not its position's derivative. A lag of
  /// less than two rows is no fault: it is kept in velocity_lags_.
  /// @param least that a gain is off.
  std::optional<Fault> CheckVelocity(int joint, const std::vector<size_t>& centres, size_t half,
                                     double least);
  /// Moves the velocities' polynomials to the positions' times, or their accelerations alone (Refinements).
  void AdvanceVelocities(MatrixXd* fitted) const;
  [[nodiscard]] std::vector<size_t> ListCentres(size_t half) const;
  /// (order + 1) x rows of the window: of the polynomial about the centre, in powers of the time.
  [[nodiscard]] MatrixXd CalcCoefficients(size_t centre, size_t half, int order) const;
  [[nodiscard]] MatrixXd GetWindow(size_t centre, size_t half) const;
  [[nodiscard]] bool IsWhole(size_t centre, size_t half) const;
  [[nodiscard]] int ChannelOf(RecordedQuantity quantity, int joint) const;
  [[nodiscard]] double FindQuantum(Eigen::Index channel) const;
  /// Sets how far a row's torque must be from four that agree to be a wrong sample, by what most rows have.
  void MeasureSteadiness();
  /// Replaces wrong samples of a row that is ahead by the mean of those beside it.
  void ReplaceWrongSamples(size_t row);
  void ReportWrongSamples();
  /// Whether a row of a channel is wrong that four others contradict: torques and positions.
  [[nodiscard]] bool IsSmooth(const Channel& channel) const {
    return channel.quantity == Effort() || channel.quantity == RecordedQuantity::kPosition;
  }
  /// Takes away by what positions change from one row to the next though no velocity beside them says so (an
  /// encoder that slips), and what the time does though positions do not (a clock that was set).
  void UndoJumps();
  /// Returns the motion of a base whose pose was recorded, by the polynomials.
  [[nodiscard]] BaseMotion CalcBase(const MatrixXd& fitted) const;
  void CheckBase(Row* row) const;
  /// Averages the shapes of a joint's friction over a window. @param rate coefficients of its velocity.
  /// @param errors CalcRateErrors.
  void AverageFriction(int joint, const VectorXd& times, const VectorXd& rate, const VectorXd& weights,
                       const VectorXd& errors);
  /// Returns the standard errors of a smoothed velocity at the times of a window's rows, which are larger at
  /// its ends, as multiples of the one at its centre. @param C the window's CalcCoefficients.
  [[nodiscard]] VectorXd CalcRateErrors(const VectorXd& times, const MatrixXd& C, bool of_positions) const;
  bool Emit(size_t centre, const Receiver& receive);
  /// @param fitted the torque's polynomial about the centre.
  [[nodiscard]] double CalcTorqueRate(int joint, size_t centre,
                                      const Eigen::Ref<const VectorXd>& fitted) const;
  /// Rows on each side that a sample needs.
  [[nodiscard]] size_t CalcReach() const;
  [[nodiscard]] MatrixXd CalcInertia(const std::vector<size_t>& centres);

  const RobotModel* model_;
  Recording* recording_;
  TorqueRegressor regressor_;
  Refinements refinements_;
  size_t part_;  // rows that are read at once
  std::vector<int> judged_;
  std::vector<Fault> faults_;
  std::vector<std::string> notes_;  // of wrong samples
  bool has_currents_ = false;
  std::deque<Row> rows_ahead_;
  std::deque<long> segments_;  // of each row ahead
  std::vector<double> numbers_;
  Row last_;
  std::map<int, double> turned_;                            // by joint: what unwrapping adds, rad
  std::map<int, long> wraps_;                               // by joint
  VectorXd most_alone_;                                     // by channel: MeasureSteadiness; empty before
  std::map<std::pair<int, RecordedQuantity>, long> wrong_;  // by joint: samples that were replaced
  VectorXd jumps_;                                          // by channel: added to later rows
  std::map<int, double> velocity_lags_;  // by joint: how much later than its velocity its position is, s
  long segment_ = 0, rows_ = 0, held_ = 0, held_run_ = 0, doubled_ = 0, empty_ = 0, gaps_ = 0;
  bool has_ended_ = false;
  double begin_ = 0.0;
  mutable std::map<std::pair<size_t, int>, MatrixXd> even_;  // of CalcCoefficients, by half and order
  size_t half_ = 2, stride_ = 1;
  MotionFacts facts_;
  RecordedSample sample_;
};

}  // namespace dexcheck
