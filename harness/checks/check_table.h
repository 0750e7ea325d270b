#pragma once

// The checks of a run, besides those of the model's terms: one entry says all that is fixed about a check,
// and how its value is found in a step's analysis. Attribution, summary, log, report and the document's table
// read these entries.

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

/// What a bound is proportional to; none of them for one that is rounding, or a fraction.
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
  const char* reason = "";  ///< Why it is that, in the document's table.
  Scaling scaling = Scaling::kNone;
  const char* formula = nullptr;  ///< In the document's table; null where the number is all there is to it.
  /// Compares model and plant relative to their own size: ten times a scenario's tolerance hold where that is
  /// wider.
  bool is_relative = false;

  /// The formula, or the number.
  [[nodiscard]] std::string Print() const;
};

/// What explains what: of the failed checks, those of the first of these ranks tell why, however late they
/// failed.
enum class Rank {
  kMeasurement,    ///< Whoever measures wrongly does what is wrong.
  kLaw,            ///< Torques that are not the law's, or gains that cannot settle.
  kActuator,       ///< Torques that did not arrive.
  kObjectBalance,  ///< A force on the object that neither description has.
  /// A limit, a contact that slides: from then on everything else is void. So it is from a force on the robot
  /// on that neither description has, and with wheels that do not roll as they should; what came first tells.
  kDecisive,
  kAssumption,  ///< Contacts that give, a platform that tilts, a solver that stopped early.
  /// By algebra the prediction differs from the engine's motion by what the inverse dynamics leave and by how
  /// the contacts give, J_B' xi_dot + J_B_dot' xi - d/dt(G^T V_o): where the inverse dynamics hold, contacts
  /// gave.
  kPrediction,
  kResidual,  ///< Nothing else failed.
};

/// What the failure of a check says of its cause.
struct FailureMeaning {
  Cause cause = Cause::kNone;  ///< kNone: nothing by itself, it follows from the cause of the run.
  /// Of checks that failed at one time, the one with the smallest number tells the run's cause.
  int precedence = 0;
  Rank rank = Rank::kAssumption;
  /// Whether the failure has this cause whatever else happened in the run; otherwise it has the run's.
  bool is_own = false;
  /// When this check failed too, its cause holds for both.
  std::string_view sharper = {};
};

/// Value of a check at one step.
struct CheckValue {
  double value = 0.0;
  int part = -1;           ///< Which joint, fingertip or pair of bodies it is of; -1 for none.
  double explained = 0.0;  ///< How much of it is known to come of the plant: taken off above the bound.
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

/// What a check is called, as in log and summary.
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
    kUnsent = 4U,    ///< Of torques that were not sent because they are above a motor's limit.
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

/// Words for what holds of a run whose checks passed, by those that were evaluated and are evidence: "model,
/// law, inverse and forward dynamics, assumptions hold at every step"; and then what was not judged.
[[nodiscard]] std::string DescribeWhatHolds(std::span<const CheckRecord> checks);

/// tc of the scenario's contacts, s: twice the time step unless it says otherwise.
[[nodiscard]] double FindContactTimeConstant(const PlantOptions& plant);
/// The bound of a check in that scenario, but for what the scenario itself says under [bounds] and [expect].
[[nodiscard]] double CalcBound(const CheckInfo& info, const Scenario& scenario);
/// A bound that the scenario itself states: for the plant and the gains of its file. Where these are set
/// otherwise the bound follows by its formula, unless it is set, too.
[[nodiscard]] double CalcStatedBound(const CheckInfo& info, const BoundOverride& stated,
                                     const Scenario& scenario);
/// Whether the scenario's bounds are those of checks. @throws InputError.
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
/// Of a fingertip that touches: the plant's distance less that of the declared shapes, m.
Evaluation EvaluateContactDistance(const StepAnalysis& step);
/// Of a hemispherical fingertip, m.
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
