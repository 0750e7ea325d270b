#pragma once

// One check, with its bound and what went worst.

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>

#include "controller/model/robot_model.h"
#include "harness/base/worst.h"

namespace dexcheck {

/// Which of the harness's five categories a check belongs to.
enum class CheckCategory { kModel, kInverseDynamics, kForwardDynamics, kAssumption, kLaw };

/// "model", "law", "inverse_dynamics", "forward_dynamics" or "assumption".
const char* NameOf(CheckCategory kind);

/// The part of the robot that a compared number belongs to.
struct Location {
  enum class Kind { kWhole, kJoint, kLink, kFrame, kVelocity, kVelocityPair, kWheel, kObject };
  Kind kind = Kind::kWhole;
  int first =
      -1;  ///< Joint, link (by its joint; -1 the base), frame, velocity coordinate, or wheel (0 right).
  int second = -1;  ///< The other velocity coordinate of a matrix entry.

  bool operator==(const Location&) const = default;
};

/// A location in words, by the model's names: "joint r_elbow on link r_upper_arm".
/// @param velocities number of the base's velocity coordinates that precede the joints'.
std::string Describe(const Location& where, const RobotModel& model, int base_velocities);

/// One check: what is checked, and what went worst over the steps of a run or the samples of a comparison.
/// Every category of the harness keeps its results in this record, and everything that prints, stores or
/// judges results reads it.
///
/// A check has one number each step, which Add takes, or many numbers of two providers. Those are given to
/// Compare one by one, or, where they are formed in bulk, to a ComparedTerm, which keeps the record.
struct CheckRecord {
  // Quantity that is checked.
  std::string name;  ///< As in the log and in summary.json; of terms, as in NOTATION.md.
  CheckCategory kind = CheckCategory::kModel;
  std::string unit = "1";
  std::string description;   ///< What is measured, and against what: one line for log and report.
  double bound = 0.0;        ///< Largest value that passes.
  bool applies = true;       ///< Whether this run evaluates it at all; otherwise Add does nothing.
  bool is_empty = false;     ///< Whether the robot has nothing that it compares, so that it is not shown.
  bool same_source = false;  ///< Both sides come from one file: agreement is no evidence.

  // Result. "When" is the time in s of a step of a run, the number of a sample elsewhere.
  double last = 0.0;   ///< Value of the last step.
  double worst = 0.0;  ///< Largest value; infinity when something was not a number.
  /// At the same step, the value before what is known to come of the plant was taken off, and how much that
  /// is; `worst` and 0 of a check that forgives nothing.
  double residual = 0.0, allowance = 0.0;
  double at = 0.0;  ///< When it was worst, for the first time.
  Location where;   ///< Of the worst number.
  double model_value = 0.0;
  double engine_value = 0.0;
  bool failed = false;     ///< Whether any value was above the bound, or was not a number.
  double failed_at = 0.0;  ///< When, for the first time.
  /// The failure nearest the base at that time: where to look first.
  Location first_failure;
  std::string part;      ///< That location in words, when the check has parts.
  long comparisons = 0;  ///< Numbers.
  long count = 0;        ///< Steps.
  double sum_of_squares = 0.0;

  /// Adds the value of one step.
  void Add(double value, double when) { Add(value, when, value, 0.0); }
  /// Adds a value from which an allowance has been subtracted.
  /// @param before the value before that. @param allowed the part that is known to come from the plant.
  void Add(double value, double when, double before, double allowed);

  /// Adds one of a step's numbers. `scale` is positive; the error is |model - engine| / scale. Returns it, or
  /// infinity when it is not a number.
  double Compare(double model, double engine, double scale, const Location& location, double when) {
    return CompareError(std::abs(model - engine) / scale, model, engine, location, when);
  }

  /// Adds a relative error that is calculated already.
  double CompareError(double error, double model, double engine, const Location& location, double when) {
    const bool failed_before = failed;
    if (Note(error, when)) {
      model_value = model;
      engine_value = engine;
      where = location;
    }
    if (failed && !failed_before) first_failure = location;
    return std::isnan(error) ? std::numeric_limits<double>::infinity() : error;
  }

  /// Adds a step's largest error, whose numbers were compared one by one, to `last` and the mean.
  void AddStep(double value) {
    last = value;
    const double size = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
    sum_of_squares += size * size;
    ++count;
  }

  /// Root of the mean square over the steps.
  [[nodiscard]] double rms() const {
    return count > 0 ? std::sqrt(sum_of_squares / static_cast<double>(count)) : 0.0;
  }

  /// Takes what is worse in the record of the same check elsewhere; `last` becomes the larger of the two.
  void Merge(const CheckRecord& other) {
    if (other.worst > worst) {
      worst = other.worst;
      residual = other.residual;
      allowance = other.allowance;
      at = other.at;
      model_value = other.model_value;
      engine_value = other.engine_value;
      where = other.where;
      if (!failed) part = other.part;
    }
    if (other.failed && !failed) {
      failed = true;
      failed_at = other.failed_at;
      first_failure = other.first_failure;
      part = other.part;
    }
    last = Worst(last, other.last);
  }

  /// Forgets what came of it.
  void Reset() {
    CheckRecord fresh;
    fresh.name = std::move(name);
    fresh.kind = kind;
    fresh.unit = std::move(unit);
    fresh.description = std::move(description);
    fresh.bound = bound;
    fresh.applies = applies;
    fresh.is_empty = is_empty;
    fresh.same_source = same_source;
    *this = std::move(fresh);
  }

 private:
  /// Records a value; NaN counts as infinite and fails any bound. Returns whether the value is the worst.
  bool Note(double value, double when) {
    const double size = std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
    const bool is_worst = size > worst || comparisons == 0;
    ++comparisons;
    if (is_worst) {
      worst = residual = size;
      at = when;
    }
    if (!(value <= bound) && !failed) {
      failed = true;
      failed_at = when;
    }
    return is_worst;
  }
};

// Results of checks by category and as JSON.

/// Categories in the order in which they are shown.
inline constexpr std::array<CheckCategory, 5> kCheckCategories = {
    CheckCategory::kModel, CheckCategory::kLaw, CheckCategory::kInverseDynamics,
    CheckCategory::kForwardDynamics, CheckCategory::kAssumption};

/// "Inverse dynamics": NameOf at the beginning of a line.
const char* TitleOf(CheckCategory category);

/// A value as a fraction of its bound; 0 for 0 / 0, infinite for anything else over 0.
double CalcFraction(double value, double bound);
inline double CalcFraction(const CheckRecord& check) {
  return check.failed ? CalcFraction(check.worst, check.bound)
                      : CalcFraction(check.residual, check.bound + check.allowance);
}

/// Whether a check is evaluated at each step, and not once, as a constant is.
inline bool IsTimed(const CheckRecord& check) { return check.count > 0; }

/// Whether a check of a run was evaluated at all: a run may end before.
inline bool IsReached(const CheckRecord& check) { return check.comparisons > 0; }
/// "FAILS", "ok", "same source" or "not reached".
const char* DescribeStatus(const CheckRecord& check);
/// Value and bound in words: "worst 1e-8, bound 1e-6", with residual and allowance where they differ.
std::string DescribeNumbers(const CheckRecord& check);

/// A record as summaries and pages have it: kind, max, bound, unit, pass, where, description; of a check that
/// is evaluated at each step (`timed`) rms, at_time_s and failed_at_s; residual and allowance where something
/// was taken off. A timed check that was not reached has `reached` false in the place of max and pass.
nlohmann::ordered_json ToJson(const CheckRecord& record, bool timed);
/// Reads a check from JSON, which has null for infinity. @throws nlohmann::json::exception.
CheckRecord ReadCheck(const std::string& name, const nlohmann::json& json);

/// Status of one category: the check that is nearest to its bound, or farthest beyond.
struct CategoryStatus {
  explicit CategoryStatus(CheckCategory of = CheckCategory::kModel) : category(of) {}

  CheckCategory category;
  CheckRecord nearest;   ///< The check.
  long checks = 0;       ///< None when the run has reached no check of this category.
  long failed = 0;       ///< Of these.
  long same_source = 0;  ///< Of these, those that hold and are no evidence.
  long not_reached = 0;  ///< Besides these.

  void Add(const CheckRecord& check);
  [[nodiscard]] bool is_asked() const { return checks > 0; }
  /// "holds", "2 of 5 fail", "same source", "not reached" or "not checked".
  [[nodiscard]] std::string Describe() const;
};

}  // namespace dexcheck
