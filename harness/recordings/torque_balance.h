#pragma once

// Measured torques less the model's, along a recording, with what faults would leave in them.
//
// Each judged joint i has a row at each sample: y_i = tau_i - tau_model,i, and columns c_i. Kept are, in
// constant memory, sum c c^T over all samples and sum c over each of a few hundred blocks of time; so
// products of columns with one another, and with anything that is constant over blocks, are those of all
// samples.

#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "controller/dynamics/torque_regressor.h"
#include "harness/recordings/motion_fit.h"

namespace dexcheck {

/// A column of a joint's row.
struct TorqueColumn {
  enum Kind {
    kBody,          ///< By a link's BodyVector: index is the link, component 0 to 9.
    kTorque,        ///< The model's torque of joint index, with its friction.
    kPosition,      ///< By the position of joint index.
    kElastic,       ///< By its position's yielding to the torque of joint index, with its derivatives.
    kLatePosition,  ///< By a delay of the position of joint index, with its derivatives.
    kPositionGain,  ///< By the logarithm of the gain of joint index's position.
    kTurn,  ///< By its error along a turn, with its derivatives: sine and cosine of once, then twice a turn.
    kBacklash,  ///< kPosition, with the sign of that joint's torque.
    kGeometry,  ///< By where joint index stands and how it is turned: GeometryFault's numbers.
    kCutOff,    ///< By component: 2 of each torque at which it may have been cut off.
    kGravity,   ///< By component of gravity.
    kRate,      ///< Of the measured torque.
    kLate,      ///< By a delay of the velocities.
    kCurrent,   ///< Measured.
    kOffset,    ///< 1
    kDry,       ///< Direction of motion.
    kViscous,   ///< Velocity.
    kSquare,    ///< Velocity times its size.
    kTime,      ///< Since the first row, s.
    kDryTime,   ///< That times the direction of motion.
    kAcceleration,
    kFriction,  ///< RecordedSample::friction, by component.
    kLoad,      ///< Direction times the size of the model's torque.
    kAngle,     ///< Position.
    kShaking,   ///< By a base that shakes: m along each axis, then rad about it; the sine's and the cosine's.
  };
  Kind kind;
  int index = 0;
  int component = 0;
  bool operator<(const TorqueColumn& other) const {
    return std::tie(kind, index, component) < std::tie(other.kind, other.index, other.component);
  }
};

/// Torques at which a recorded torque may have been cut off (the first), or a motor's, which was less than
/// recorded: what is beyond, and by the logarithm of the limit.
inline constexpr int kCutOffs = 3;
/// Components of kGeometry: three of a placement, then two each of an orientation and an axis.
inline constexpr int kGeometries = 7;
/// Robots of more joints have no kGeometry: their regression would be too wide.
inline constexpr int kMostWithGeometry = 12;

/// Components of kTurn.
inline constexpr int kTurns = 4;
/// Such a torque, as far as is known. @param component of kCutOff. @param most that was recorded.
double FindCutOff(const Refinements& refinements, int joint, int component, double most);

class TorqueBalance {
 public:
  /// @param joints that are judged. @param refinements of the reading before.
  TorqueBalance(const RobotModel& model, const std::vector<int>& joints, bool has_currents,
                const Refinements& refinements = {});

  /// Sets the places at which the samples' wrenches act.
  void SetWrenches(const std::vector<WrenchPlace>& places);
  /// sum over samples of the squared entries of the columns by which a joint balances the wrenches (6 each).
  [[nodiscard]] VectorXd wrench_squares(size_t place) const {
    return wrench_squares_.row(static_cast<Eigen::Index>(place)).transpose();
  }

  /// @param is_judged by joint: not where friction holds it.
  void Add(const RecordedSample& sample, const std::vector<bool>& is_judged);
  /// y of the last sample, by place; 0 where it was not judged.
  [[nodiscard]] const VectorXd& residual() const { return residual_; }
  /// To be called once, after the last sample.
  void Finish();

  /// A stretch of time. Sums over its samples.
  struct Block {
    double from = 0.0, to = 0.0;  ///< s
    std::vector<VectorXd> sums;   ///< By judged joint: its columns, y last.
    std::vector<double> counts;   ///< Of its samples.
    MatrixXd forces;              ///< Judged joints x 6 links: CalcForceColumns of each link.
    MatrixXd gravity;             ///< Judged joints x 3: CalcGravityColumns.
    VectorXd q;                   ///< All joints.
    double samples = 0.0;
    [[nodiscard]] double centre() const { return 0.5 * (from + to); }
  };

  [[nodiscard]] const std::vector<int>& joints() const { return joints_; }
  [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }
  /// Returns the columns of a judged joint (by its place among these); y stands behind them.
  [[nodiscard]] const std::vector<TorqueColumn>& columns(size_t place) const { return columns_[place]; }
  /// -1 where its row has none.
  [[nodiscard]] Eigen::Index Find(size_t place, const TorqueColumn& column) const;
  /// sum c c^T, y last.
  [[nodiscard]] const MatrixXd& products(size_t place) const { return products_[place]; }
  [[nodiscard]] double samples(size_t place) const { return counts_[place]; }
  /// Rows with the same products: a factor of those within blocks, then one of each block, sum / sqrt(count).
  [[nodiscard]] const MatrixXd& rows(size_t place) const { return rows_[place]; }

 private:
  static constexpr Eigen::Index kPart = 128;  // rows that are multiplied at once
  static constexpr size_t kMostBlocks = 512;
  static constexpr int kAlong = 4 + kTurns;

  void ListColumns(bool has_currents);
  /// Returns the torques that balance a force at each wrench's point and a moment, in its axes: n x 6 each.
  [[nodiscard]] MatrixXd CalcWrenchColumns();
  /// Returns by what a unit of a fault of along_ changes a joint's position, velocity and acceleration.
  [[nodiscard]] Vector3d CalcMotionChange(int joint, int k, const RecordedSample& sample) const;
  /// Computes along_.
  void CalcMotionColumns(const RecordedSample& sample);
  void CalcShakingColumns(const RecordedSample& sample);
  /// The model's, at a joint.
  [[nodiscard]] double CalcFriction(int joint, const RecordedSample& sample) const;
  [[nodiscard]] double CalcCutOff(int joint, int component, const RecordedSample& sample) const;
  [[nodiscard]] double CalcEntry(int joint, const TorqueColumn& column, const RecordedSample& sample) const;
  void FillRow(size_t place, const RecordedSample& sample, Eigen::Ref<VectorXd> row) const;
  void Flush(size_t place);
  void MergeBlocks();
  [[nodiscard]] MatrixXd CalcRows(size_t place) const;

  const RobotModel* model_;
  TorqueRegressor regressor_;
  std::vector<int> joints_;
  bool has_currents_;
  Refinements refinements_;
  std::vector<std::vector<TorqueColumn>> columns_;
  std::vector<std::map<TorqueColumn, Eigen::Index>> places_;
  std::vector<MatrixXd> products_, rows_;
  std::vector<MatrixXd> parts_;  // columns x kPart
  std::vector<Eigen::Index> used_;
  std::vector<double> counts_;
  std::vector<Block> blocks_;
  double block_samples_ = 1.0;
  // at the sample
  MatrixXd bodies_, gravity_, forces_, shaking_;
  /// A model with each of kGeometry's numbers in turn, and its torques.
  struct Displaced {
    std::unique_ptr<RobotModel> model;
    std::unique_ptr<TorqueRegressor> regressor;
  };
  std::vector<Displaced> displaced_;
  MatrixXd geometry_;         // n x displaced_
  MatrixXd torques_in_time_;  // n x 3: the model's, and their derivatives
  MatrixXd along_;            // n x kAlong n: kPosition to kTurn of each joint
  std::vector<WrenchPlace> wrenches_;
  MatrixXd wrench_squares_;
  VectorXd torques_, late_, residual_;
};

}  // namespace dexcheck
