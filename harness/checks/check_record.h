#pragma once

// One check: a comparison of the analytic model with the engine, with its bound and what went worst.

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "controller/model/robot_model.h"

namespace dexcheck {

/// Which of the harness's four questions a check answers.
enum class CheckKind { kModel, kBalance, kPrediction, kAssumption };

/// "model", "balance", "prediction" or "assumption".
const char* NameOf(CheckKind kind);

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

/// The largest relative error of a term over all that was compared, and where it first left its bound.
struct CheckRecord {
  std::string name;  ///< As in NOTATION.md.
  CheckKind kind = CheckKind::kModel;
  double bound = 0.0;  ///< On the error relative to the term's scale.

  double worst =
      0.0;  ///< Largest error relative to the term's scale; infinity when something was not a number.
  double model_value = 0.0;
  double engine_value = 0.0;
  Location where;
  long sample = -1;

  /// Of the failures at the earliest failing sample, the one nearest the base: where to look first.
  bool failed = false;
  Location first_failure;
  long first_failing_sample = -1;

  long comparisons = 0;

  /// Adds one compared number. `scale` is positive; the error is |model - engine| / scale, which is returned.
  double Add(double model, double engine, double scale, const Location& location, long at_sample) {
    return AddError(std::abs(model - engine) / scale, model, engine, location, at_sample);
  }

  /// The same with the relative error calculated before; returns infinity when it is not a number.
  double AddError(double error, double model, double engine, const Location& location, long at_sample) {
    if (!(error < std::numeric_limits<double>::infinity())) error = std::numeric_limits<double>::infinity();
    ++comparisons;
    if (error > worst || comparisons == 1) {
      worst = error;
      model_value = model;
      engine_value = engine;
      where = location;
      sample = at_sample;
    }
    if (error > bound && !failed) {
      failed = true;
      first_failure = location;
      first_failing_sample = at_sample;
    }
    return error;
  }
};

}  // namespace dexcheck
