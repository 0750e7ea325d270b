#pragma once

// The inputs of a law at one step. A wrong law is the right one with other inputs, so that faults are
// recognised by the torques that the right law computes from changed inputs.

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/control/joint_motion.h"
#include "controller/control/trajectory.h"
#include "harness/checks/law_reference.h"

namespace dexcheck {

/// The measured and the desired state at one step, and the force that the law computes from them.
struct LawStep {
  double time = 0.0;        ///< s
  VectorXd q, xi;           ///< Measured: p and n entries.
  DesiredJoints joints;     ///< q_d, its rate and acceleration, of a law of joints.
  VectorXd position_error;  ///< q_d - q (n), of a law of joints.
  LawObject object;         ///< Measured, of a law of the object.
  DesiredMotion desired;    ///< X_d and its rates, of a law of the object.
  VectorXd force;           ///< E_bar' tau' (n) of the right law.
  VectorXd sent;            ///< The same of the torques that were sent.
};

/// All that the force is computed from. Changes of it are faults of the law.
struct LawInputs {
  LawStep now;
  mutable LawTerms terms;               ///< Its pointers are set by Link.
  MatrixXd M, C, J_dot;                 ///< M_bar', C_bar' (n x n), J_B_dot' (3N x n).
  Matrix6Xd G_dot;                      ///< 6 x 3N
  VectorXd F_N;                         ///< Internal force (3N).
  std::optional<LawSpec> spec;          ///< Gains and options of a law of the object.
  VectorXd velocity_error;              ///< q_d_dot - q_dot (n) that the feedback of a law of joints has.
  VectorXd coulomb, viscous;            ///< Friction that a law of joints compensates (n).
  VectorXd ground_force;                ///< J^T f (n) that the ground is asked for; empty without feet.
  bool feeds_back_torques = false;      ///< The feedback is not multiplied by M_bar',
  bool feeds_back_by_diagonal = false;  ///< or by its diagonal.

  bool exchanges_force_axes = false;  ///< Tangential axes of each contact force are exchanged.

  /// Returns the terms with pointers to this object's own matrices.
  const LawTerms& Link() const {
    terms.M = &M;
    terms.C = &C;
    terms.J_dot = &J_dot;
    return terms;
  }
};

/// A summand of a law, or several that are one thing, with the words that name it.
struct LawPartName {
  const char* symbol;
  const char* name;
  unsigned parts;                         ///< A bit for each summand.
  void (*remove)(LawInputs*);             ///< Takes it out of the law; null for all torques.
  bool doubles = false;                   ///< `remove` makes it twice as large instead.
  bool is_of_acceleration = false;        ///< Laws without a demanded acceleration do not have it.
  void (*without)(LawInputs*) = nullptr;  ///< Takes out other parts beforehand.
};
/// Summands of the laws of the object: single ones first, then sums. Of two that are equally good the first
/// is the name.
std::span<const LawPartName> ListLawParts();
/// Summands of the laws of joints.
std::span<const LawPartName> ListJointLawParts();

/// A step at which the torques were not the law's.
struct LawSnapshot {
  LawInputs inputs;
  std::deque<LawStep> before;  ///< Steps before it, the last one first.
  VectorXd difference;         ///< E_bar' (tau' - tau'_printed) (n).
  double noise = 0.0;          ///< Largest difference that rounding explains, in |.|_M^-1.
  VectorXd error_sum;          ///< Sum of position errors times the step, of joints, before this step (n).
};

/// The last steps of a run, and some of those at which the torques were not the law's.
class LawHistory {
 public:
  /// Number of steps that are remembered.
  static constexpr size_t kMemory = 128;

  /// Whether the next step that differs is kept.
  [[nodiscard]] bool Wants() const { return differing_ < kFirst || differing_ % stride_ == 0; }
  /// Counts a step that differs, and keeps it if it is wanted.
  void Skip() { ++differing_; }
  void Keep(LawSnapshot snapshot);
  /// Adds a step. @param step_time s.
  void Remember(const LawStep& state, double step_time);
  /// Forgets the steps that differ.
  void Forget();

  [[nodiscard]] const std::vector<LawSnapshot>& snapshots() const { return snapshots_; }

 private:
  static constexpr size_t kFirst = 16, kMost = 64;

  std::vector<LawSnapshot> snapshots_;
  std::vector<LawStep> ring_;  // of kMemory
  size_t remembered_ = 0;
  VectorXd error_sum_;
  size_t differing_ = 0, stride_ = 1;
};

}  // namespace dexcheck
