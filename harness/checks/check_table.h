#pragma once

// The checks of a run, except those of the model's terms. One entry holds everything that is fixed about a
// check, and how its value follows from a step's analysis. Attribution, summary, log, report and the
// document's table read these entries.

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "harness/base/check_record.h"
#include "harness/checks/failure_cause.h"
#include "harness/checks/step_analysis.h"
#include "harness/scenario/scenario.h"

namespace dexcheck {

class Setup;
struct StepAnalysis;

/// Quantity that a bound is proportional to; kNone for rounding bounds and fractions.
enum class Scaling {
  kNone,
  kSofter,           ///< 1 - d where contacts are softer than the shipped ones
  kCreep,            ///< (1 - d) dt
  kLag,              ///< dt
  kSquaredStep,      ///< dt^2
  kSinking,          ///< (1 - d) dt^2
  kSinkingRate,      ///< (1 - d) tc
  kPosture,          ///< (1 - d) dt^2 / omega_p^2 of the posture task
  kPositionGain,     ///< 1 / K_p, the least of position
  kOrientationGain,  ///< 1 / K_p, the least of orientation
};

/// Largest value that passes.
struct Bound {
  double shipped = 0.0;     ///< With the shipped plant and gains.
  const char* reason = "";  ///< Why the bound has this value, in the document's table.
  Scaling scaling = Scaling::kNone;
  const char* formula = nullptr;  ///< In the document's table; null where the number says everything.
  /// Whether the value is relative to model and plant: the bound is at least ten times the scenario's
  /// tolerance.
  bool is_relative = false;

  /// The formula, or the number.
  [[nodiscard]] std::string Print() const;
};

/// Rank of a failed check as an explanation of others: the first rank among the failed checks explains the
/// run, however late it failed.
enum class Rank {
  kMeasurement,    ///< A wrong measurement makes everything after it wrong.
  kLaw,            ///< Torques that are not the law's, or gains that cannot settle.
  kActuator,       ///< Torques that did not arrive.
  kObjectBalance,  ///< A force on the object that neither description has.
  /// A limit, or a contact that slides: everything after it is void. The same holds for a force on the robot
  /// that neither description has, and for wheels that do not roll; among these the earliest explains.
  kDecisive,
  kAssumption,  ///< Contacts that give, a platform that tilts, a solver that stopped early.
  /// The prediction differs from the engine's motion by what the inverse dynamics leave and by how the
  /// contacts give, J_B' xi_dot + J_B_dot' xi - d/dt(G^T V_o): where the inverse dynamics hold, contacts
  /// gave.
  kPrediction,
  kResidual,  ///< Nothing else failed.
};

/// Cause that the failure of a check points to.
struct FailureMeaning {
  Cause cause = Cause::kNone;  ///< kNone: the failure follows from the cause of the run.
  Rank rank = Rank::kAssumption;
  /// Whether the failure has this cause whatever else happened in the run; otherwise it has the run's.
  bool is_own = false;
  /// When this check failed too, its cause holds for both.
  std::string_view sharper = {};
};

/// Value of a check at one step.
struct CheckValue {
  double value = 0.0;
  int part = -1;  ///< Joint, fingertip or pair of bodies that has the value; -1 for none.
  double explained =
      0.0;  ///< Part of the value that is known to come from the plant; subtracted above the bound.
  /// The value before an allowance was taken off.
  std::optional<double> residual = {};
};
/// None where the step says nothing.
using Evaluation = std::optional<CheckValue>;

/// A check with a memory.
class StatefulJudge {
 public:
  virtual ~StatefulJudge() = default;
  virtual Evaluation Evaluate(const StepAnalysis& step) = 0;
  /// Time begins anew.
  virtual void Reset() = 0;
};

/// Name of a check in log and summary, with its category and unit.
struct CheckName {
  std::string_view name;
  CheckCategory category = CheckCategory::kModel;
  const char* unit = "1";
};

/// One check.
struct CheckInfo : CheckName {
  /// When a check is evaluated, bit by bit.
  enum Moment : unsigned {
    kSettling = 1U,  ///< At each step while everything settles.
    kRunning = 2U,   ///< At each step of the run.
    kUnsent = 4U,    ///< For torques that were not sent because they are above a motor's limit.
    kBefore = 8U,    ///< Before each step, which does not come when the check fails.
    kAlways = kSettling | kRunning,
  };

  Bound bound;
  const char* description = "";
  FailureMeaning meaning;
  struct Judging {
    Evaluation (*evaluate)(const StepAnalysis& step) = nullptr;
    unsigned moments = kAlways;
    std::string (*describe)(const StepAnalyzer& now, int part) = nullptr;  ///< A value's part in words.
    std::unique_ptr<StatefulJudge> (*make)(const Setup& setup) = nullptr;  ///< In the place of `evaluate`.
  };
  Judging by;
};

/// In the order of log and summary.
std::span<const CheckInfo> ListChecks();
/// The entry of that name; null for checks of the model.
const CheckInfo* FindCheck(std::string_view name);

/// Whether a check of the motion holds at every step of a right run, while everything settles, too.
/// Assumptions and expectations need not.
bool HoldsAlways(const CheckRecord& check);

/// Describes what holds of a run whose checks passed, by the evaluated checks that are evidence: "model, law,
/// inverse and forward dynamics, assumptions hold at every step"; then what was not judged.
[[nodiscard]] std::string DescribeWhatHolds(std::span<const CheckRecord> checks);

/// tc of the scenario's contacts, s: twice the time step unless it says otherwise.
[[nodiscard]] double FindContactTimeConstant(const PlantOptions& plant);
/// Returns the bound of a check in that scenario, without the scenario's own [bounds] and [expect].
[[nodiscard]] double CalcBound(const CheckInfo& info, const Scenario& scenario);
/// Returns a bound that the scenario itself states for the plant and the gains of its file. Where these are
/// set otherwise the bound follows by its formula, unless the bound is set as well.
[[nodiscard]] double CalcStatedBound(const CheckInfo& info, const BoundOverride& stated,
                                     const Scenario& scenario);
/// Checks that each of the scenario's bounds has the name of a check. @throws InputError.
void RequireKnownBounds(const Scenario& scenario);

// Bounds of the law. The engine's terms agree with the model's to some 1e-15 of their scales; the
// pseudoinverses of (47), (49) multiply that by the condition number, which is divided out, and are formed
// from Gram matrices, which have its square. Measured 6e-16 in `curve`, on a condition number of some tens.
inline constexpr double kLawTorqueBound = 1e-12;
// The solver's f_c has a residual of 1e-10 (GraspForceOptions::residual_tolerance), and F_N = f_c - G^+ F_o
// the rounding of G^+ besides.
inline constexpr double kGraspNullBound = 1e-9;
// Slope of the grasp-force objective, relative: ten times the tolerance of the solver's slacks, 1e-5.
inline constexpr double kGraspOptimalityBound = 1e-4;

// Values of checks that take more than a line (check_table.cc).

/// The difference of the measured signals from those that the declared sensing makes of the truth.
Evaluation EvaluateMeasurement(const StepAnalysis& step);
/// Largest torque that a joint received against the declared one, over the largest that was sent.
Evaluation EvaluateMotors(const StepAnalysis& step);
/// A wheel's rim against the platform above it, (1), m/s.
Evaluation EvaluateRolling(const StepAnalysis& step);
/// Distance of a fingertip that touches by the plant, less its distance by the declared shapes, m.
Evaluation EvaluateContactDistance(const StepAnalysis& step);
/// Distance of a contact beyond the rim of a hemispherical fingertip, m; negative before the rim.
Evaluation EvaluateRim(const StepAnalysis& step);
std::string DescribeFoot(const StepAnalyzer& now, int part);
std::string DescribeFingertip(const StepAnalyzer& now, int part);
/// How far a joint is beyond its range, rad or m.
Evaluation EvaluateJointLimit(const StepAnalysis& step);
std::string DescribeJoint(const StepAnalyzer& now, int part);
/// "joint r_elbow", of the equation of motion that is worst.
std::string DescribeEntry(const StepAnalyzer& now, int part);
/// "contact of r_fingertip_1 and torus", "limit of joint elbow".
std::string DescribeConstraint(const StepAnalyzer& now, int part);
/// "r_palm and bench", of the step's largest force between bodies.
std::string DescribeCollision(const StepAnalyzer& now, int part);
/// Movement of joints that do not carry the object, since the beginning, rad.
std::unique_ptr<StatefulJudge> MakeIdleJointsJudge(const Setup& setup);
/// kappa integrated by (40) from how fingertip and object moved, against where the contacts are, m.
std::unique_ptr<StatefulJudge> MakeKappaJudge(const Setup& setup);

}  // namespace dexcheck
