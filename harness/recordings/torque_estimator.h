#pragma once

// Which faults explain the balances of recordings.

#include <vector>

#include "harness/diagnosis/cause_estimator.h"
#include "harness/recordings/torque_rows.h"

namespace dexcheck {

/// Residuals of the right model, in units of noise: errors of derivatives are known to a factor of two.
inline constexpr double kMostNoise = 2.0;

/// The search is repeated until it settles: what no cause explains weighs as noise does in the next round,
/// samples that are alike count once, drives' gains are corrected, and products of faults are made linear
/// anew.
class TorqueEstimator {
 public:
  /// @param recordings their weights and gains are set. @throws InputError when no joint can be judged.
  TorqueEstimator(RecordingSet* recordings, size_t most_causes);

  [[nodiscard]] const std::vector<TorqueFault>& faults() const { return faults_; }
  /// Candidates are faults() by their places.
  [[nodiscard]] const CauseSelection& selection() const { return selection_; }
  [[nodiscard]] const TorqueRows& rows() const { return rows_; }
  /// Amplitudes of all columns under these terms; those that are part of every explanation follow from them.
  [[nodiscard]] VectorXd CalcAmplitudes(const std::vector<CauseTerm>& terms) const;
  /// Amplitudes of a plain least-squares fit of all bodies' numbers, friction, offsets and armatures.
  /// @param rank how many of them the motion tells.
  [[nodiscard]] VectorXd FitPlainly(Eigen::Index* rank) const;
  /// What these terms leave, by row.
  [[nodiscard]] VectorXd CalcLeft(const std::vector<CauseTerm>& terms) const;

 private:
  void ListFaults();
  CauseSelection Select();
  /// What products of faults leave is linear in each once the others are known.
  void Relinearise(const CauseSelection& selection);
  /// A gain's column: the torque of the model and of these causes, where the robot has them.
  void ScaleWhole(const std::vector<CauseTerm>& terms, TorqueFault* gain) const;
  void Weigh(const VectorXd& left);
  /// Of what is left, in units of noise.
  [[nodiscard]] double CalcMeanSquare(const VectorXd& left) const;
  /// As many rows as there are independent ones.
  void Compress();
  /// Of these, those that columns which are part of every explanation have.
  [[nodiscard]] Eigen::Index CountForcedRows() const;
  [[nodiscard]] CauseSelection SelectAmong(double alike) const;
  [[nodiscard]] CauseSelection SelectAmong(double alike, const std::vector<bool>& barred) const;
  [[nodiscard]] std::vector<Eigen::Index> ListFirstColumns() const;
  /// One stretch of time has one push, a joint one shape of its dry friction: others would share the force.
  bool BarSeconds();
  /// Where what is left is no noise, numbers of bodies, gravity and positions are named only when they
  /// explain much: drives have friction of more shapes than are tried, and a wrong mass fits a little of any.
  /// @return whether there are others to be chosen.
  bool BarWeakBodies();
  /// Amplitudes of a least-squares fit of drives' gains and faults of these kinds, friction in all its
  /// shapes; a plain one has the simplest only, and plausible sizes as a prior.
  [[nodiscard]] VectorXd Fit(const std::vector<TorqueFault::Kind>& kinds, bool is_plain,
                             Eigen::Index* rank) const;
  /// What drives' gains, friction and offsets leave, which no robot is without.
  [[nodiscard]] VectorXd CalcUsual() const;
  /// How many samples say the same, by how alike blocks are that follow one another.
  [[nodiscard]] double CalcAlike(const VectorXd& left) const;
  /// Adds what may have pushed for a while; false when nothing stands out.
  bool AddPushes();

  RecordingSet* recordings_;
  size_t most_causes_;
  std::vector<TorqueFault> faults_;
  std::vector<bool> barred_;  // of these
  TorqueRows rows_;
  MatrixXd R_;  // with the products of rows_
  CauseSelection selection_;
};

}  // namespace dexcheck
