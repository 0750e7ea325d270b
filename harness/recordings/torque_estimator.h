#pragma once

// Which faults explain the balances of recordings.

#include <cmath>
#include <vector>

#include "harness/diagnosis/cause_estimator.h"
#include "harness/recordings/torque_rows.h"

namespace dexcheck {

/// Residuals of the right model, in units of noise: errors of derivatives are known to a factor of two.
inline constexpr double kMostNoise = 2.0;

/// How well a set of numbers predicts the quarter that it was not fitted to.
struct HeldPrediction {
  long numbers = 0;
  double held_left = 0.0;     ///< Root mean square of the rest, in units of noise.
  double inexact = 0.0;       ///< Errors of integrators and derivatives without any noise, in units of noise.
  bool is_quantised = false;  ///< Noise is the steps of encoders, which depend on the motion.

  /// Whether another prediction is better by more than a factor and than integrators are exact.
  [[nodiscard]] bool IsWorseThan(const HeldPrediction& other, double factor) const {
    return other.held_left > 0.0 && held_left > std::hypot(factor * other.held_left, inexact);
  }
  /// Whether a fit of all numbers predicts better. The noise of accelerations is known to a factor of two;
  /// this says more. Where the model is right, what all numbers fit is noise, and they predict worse: in 176
  /// recordings of right models the ratio was 0.4 to 1.12, and 1.44 in one of an encoder of 12 bits.
  /// @param has_numbers that some cause has; otherwise the model stands alone.
  [[nodiscard]] bool IsBeatenBy(const HeldPrediction& all, bool has_numbers) const {
    constexpr double kBetter = 1.08, kBetterThanModel = 1.15, kBetterOfSteps = 1.5;
    return IsWorseThan(all, has_numbers ? kBetter : is_quantised ? kBetterOfSteps : kBetterThanModel);
  }
};

/// The search is repeated until it settles: what no cause explains weighs as noise does in the next round,
/// equal samples count once, drives' gains are corrected, and products of faults are made linear
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
  /// Bodies' numbers, dry and viscous friction, offsets and armatures; friction in all its shapes and
  /// offsets, which no robot is without; all faults, of pushes those that were selected.
  enum class Part { kPlain, kUsual, kAll };
  /// Amplitudes of a least-squares fit of drives' gains and such faults. Plausible sizes are a prior.
  /// @param rank how many of them the motion determines; null where it is not asked for.
  [[nodiscard]] VectorXd FitAmplitudes(Part part, Eigen::Index* rank) const;
  /// Predict the quarter that was held out: by the selection, and by a fit of Part::kPlain.
  /// @param held its rows (MakeTorqueRows).
  [[nodiscard]] HeldPrediction PredictByCauses(const TorqueRows& held) const;
  [[nodiscard]] HeldPrediction PredictByAll(const TorqueRows& held) const;
  /// Returns the residual of these terms, by row.
  [[nodiscard]] VectorXd CalcLeft(const std::vector<CauseTerm>& terms) const;
  /// Returns the largest root mean square error of a joint's torque that the search may pass over, N m or N:
  /// what is missing to the noise that is assumed, and what one more cause must explain. @param noise, left
  /// of the joint, N m or N. @param samples of it.
  [[nodiscard]] double CalcHidden(double noise, double left, double samples) const;
  /// Returns the root mean square of a residual of such rows, in units of noise.
  [[nodiscard]] double CalcRms(const TorqueRows& rows, const VectorXd& left) const;

 private:
  void ListFaults();
  /// Errors are no less than those by which stretches of time, or joints, disagree.
  void WidenErrors();
  void Select();
  /// Computes columns of products of faults anew: they are linear in each once the others are known.
  void Relinearise();
  /// A gain's column: the torque of the model and of these causes, where the robot has them.
  void ScaleWhole(const std::vector<CauseTerm>& terms, TorqueFault* gain) const;
  void Weigh(const VectorXd& left);
  /// Number of those rows that belong to columns of every explanation.
  [[nodiscard]] Eigen::Index CountForcedRows() const;
  [[nodiscard]] CauseSelection SelectAmong() const;
  /// One stretch of time has one push, a joint one shape of its dry friction, a link one mass, and some
  /// recording no payload: others would share the force.
  bool ExcludeSeconds();
  [[nodiscard]] static bool IsPart(const TorqueFault& fault, Part part);
  /// Returns the residual of that fit.
  [[nodiscard]] VectorXd Fit(Part part) const;
  [[nodiscard]] bool IsNoise(const VectorXd& left) const { return CalcRms(rows_, left) <= kMostNoise; }
  /// How many samples say the same, by how similar blocks are that follow one another.
  [[nodiscard]] double CalcBlockSize(const VectorXd& left) const;
  /// Lowers the noise to what a fit of all numbers leaves of the quarter that was held out, where that
  /// predicts better than the selection: the search ended too early. @return whether it does.
  bool LowerNoise();
  /// Returns the error of a joint's torque by integrators and derivatives without any noise, N m or N.
  [[nodiscard]] double CalcInexact(const TorqueRows::Part& part) const;
  /// Adds what may have pushed for a while; false when nothing stands out.
  bool AddPushes();

  RecordingSet* recordings_;
  size_t most_causes_;
  std::vector<TorqueFault> faults_;
  std::vector<bool> excluded_;  // of these
  TorqueRows rows_;
  double block_size_ = 1.0, floor_ = 1.0;  // CauseOptions'
  MatrixXd R_;  // with the products of rows_, and as many rows as there are independent ones
  CauseSelection selection_;
};

}  // namespace dexcheck
