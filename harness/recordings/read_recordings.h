#pragma once

// Recordings of one robot that have been read: their balances, noise and drives' gains.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "harness/recordings/torque_balance.h"
#include "harness/recordings/torque_candidates.h"

namespace dexcheck {

struct ReadOptions {
  /// Called for every second of a recording: root mean squares of what the model does not explain of these
  /// joints' torques, N m or N, since the call before.
  std::function<void(double time, const std::vector<int>& joints, const VectorXd& residual)> on_second;
  size_t ahead = 20'000;  ///< Rows that are read before the first is judged.
  Refinements refinements;
  LinkFrames frames;  ///< In which links' vectors are said.
};

/// A joint whose torques are not judged.
struct UnjudgedJoint {
  int joint = -1;
  bool moves = true;
  bool has_no_gain = false;  ///< Its current does not determine its torque.
  std::string reason;        ///< "its motion does not determine its drive's gain beside its friction".
};

/// One recording: a quarter of it, in stretches, is kept for the end.
struct ReadRecording {
  std::unique_ptr<RobotModel> model;
  std::unique_ptr<TorqueBalance> fit, held;
  MotionFacts motion;
  std::vector<bool> has_position;  ///< By joint.
  VectorXd most_torque;            ///< RecordedSample's.
  double reach = 0.0;              ///< Of smoothing, to each side, s.
  VectorXd noise;                  ///< Of a sample's balance, by judged joint, N m or N.
  VectorXd weight;                 ///< Likewise: noise, or what no cause explains.
};

class RecordingSet {
 public:
  /// Reads them. @param on_rows called with the number of rows so far; ends the reading by returning false.
  /// @throws InputError, one line, for data that cannot be understood.
  RecordingSet(const RobotModel& model, std::vector<Recording>* recordings, const ReadOptions& options,
               const std::function<bool(long rows)>& on_rows);

  [[nodiscard]] const RobotModel& model() const { return *model_; }
  [[nodiscard]] size_t size() const { return read_.size(); }
  [[nodiscard]] const ReadRecording& operator[](size_t recording) const { return read_[recording]; }
  /// The noise that the next search assumes.
  [[nodiscard]] double& weight(size_t recording, size_t place) {
    return read_[recording].weight[static_cast<Eigen::Index>(place)];
  }
  [[nodiscard]] double& noise(size_t recording, size_t place) {
    return read_[recording].noise[static_cast<Eigen::Index>(place)];
  }
  void ResetWeights();

  [[nodiscard]] const std::vector<int>& joints() const { return joints_; }
  [[nodiscard]] bool has_currents() const { return has_currents_; }
  /// Joints whose drives' gains are known.
  [[nodiscard]] std::vector<int> ListJudged() const;
  [[nodiscard]] bool IsJudged(size_t place) const { return gain(place) != 0.0; }
  /// N m/A of a joint's drive, 1 of torques; 0 where the motion does not determine it.
  [[nodiscard]] double gain(size_t place) const { return gains_[static_cast<Eigen::Index>(place)]; }
  void DivideGains(const Eigen::Ref<const VectorXd>& factors);
  /// Gains that became others than were estimated are not known. @return whether there are any.
  bool DropUnknownGains();

  /// Returns the extents with which sizes of faults are compared.
  [[nodiscard]] MotionExtents CalcExtents() const;
  [[nodiscard]] const Refinements& refinements() const { return refinements_; }  ///< As given.
  [[nodiscard]] const LinkFrames& frames() const { return frames_; }
  [[nodiscard]] double step() const { return step_; }  ///< The longest between rows, s.
  [[nodiscard]] long rows() const { return rows_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Whether a recording has velocities of other times than positions.
  [[nodiscard]] bool has_other_times() const { return has_other_times_; }
  /// Joints with a position, without a torque or with one that says nothing.
  [[nodiscard]] std::vector<UnjudgedJoint> ListUnjudged() const;
  /// Whether its position changes by more than noise in any recording.
  [[nodiscard]] bool Moves(int joint) const;
  /// Faults of the recordings themselves: velocities that are not the positions' derivatives.
  [[nodiscard]] const std::vector<Fault>& faults() const { return faults_; }

 private:
  void Read(Recording* recording, const ReadOptions& options, const std::function<bool(long rows)>& on_rows);
  void ReportSecond(const ReadOptions& options, double time, const VectorXd& residual);
  [[nodiscard]] double CalcNoise(const ReadRecording& one, size_t place) const;
  void MeasureNoise();
  /// From all recordings, with friction and an offset beside them.
  void EstimateGains();

  const RobotModel* model_;
  std::string first_name_;
  std::vector<ReadRecording> read_;
  std::vector<int> joints_;
  bool has_currents_ = false;
  double step_ = 0.0;
  Refinements refinements_;
  LinkFrames frames_;
  VectorXd gains_, first_gains_;  // by place
  long rows_ = 0;
  std::vector<std::string> notes_;
  bool has_other_times_ = false;
  std::vector<Fault> faults_;
  VectorXd second_;  // squares since a time
  double second_begin_ = 0.0;
  int second_samples_ = 0;
};

}  // namespace dexcheck
