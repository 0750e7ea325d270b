#pragma once

// The causes that explain a run's residuals.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "harness/diagnosis/cause_estimator.h"

namespace dexcheck {

/// A fault with its size.
struct Fault {
  std::string fault;     ///< "torque gain".
  std::string place;     ///< "motor r_elbow".
  double value = 0.0;    ///< With the fault; of a vector its length.
  double error = 0.0;    ///< Standard error.
  std::string unit;      ///< Empty for a factor.
  std::string detail;    ///< Its direction, or what else belongs to it; empty for nothing.
  double nominal = 0.0;  ///< The value without it.

  /// Returns whether it is the same kind at the same place.
  [[nodiscard]] bool IsLike(const Fault& other) const { return fault == other.fault && place == other.place; }
  /// "motor r_elbow: torque gain 0.99 +- 1e-12".
  [[nodiscard]] std::string Describe() const;
};

/// "(0.1, 0, -0.2)" with so many digits; entries that are rounding beside the largest are 0.
std::string FormatVector(const Eigen::Ref<const VectorXd>& v, int digits);

/// A fault that is none of those that are known.
inline constexpr const char* kUnknownFault = "differs";

/// The places at which residuals are compared, each of which shows faults of its own; and what checks
/// observe.
enum class CauseChannel {
  kMeasurement,
  kActuation,
  kLaw,
  kContact,
  kGeometry,
  kRolling,
  kBalance,
  kObservation
};
/// "measurement", "actuation", "law", "contact", "geometry", "rolling", "balance", "observation".
const char* NameOf(CauseChannel channel);

enum class CauseOutcome {
  kNamed,         ///< One fault explains it, and no other one does.
  kNamedClass,    ///< Several do, which this motion does not distinguish.
  kNotExplained,  ///< None does.
  kObserved,      ///< A fact that is no parameter of a fault: a contact slides, a joint is at its limit.
};
/// "named", "class", "not explained", "observed".
const char* NameOf(CauseOutcome outcome);

/// One fault, or several that the motion does not separate.
struct Explanation {
  CauseChannel channel = CauseChannel::kActuation;
  CauseOutcome outcome = CauseOutcome::kNamed;
  std::vector<Fault> faults;    ///< The most likely first; where nothing explains it, the nearest.
  double from = 0.0, to = 0.0;  ///< When it was seen, s.
  bool ends = false;            ///< Whether it was over before the run was.
  /// How much earlier it may have begun, and later have ended, where no steps were kept, s.
  double unseen_before = 0.0, unseen_after = 0.0;
  double fraction = 0.0;  ///< Of its channel's residual there, squared.
  double left = 0.0;      ///< What is left of that, in units of noise.
  std::string rival;      ///< The nearest fault that explains it worse; empty for none.
  double log_odds = 0.0;  ///< Against the rival, natural logarithm.

  void SetRival(const Candidate& candidate, double odds) {
    rival = candidate.place + ": " + candidate.fault;
    log_odds = odds;
  }
  /// One fault is named once, and whether there are several.
  void SetOutcome();
  /// In a line.
  [[nodiscard]] std::string Describe() const;
};

/// Returns the form of summaries of runs and judgements: null for infinite, and for the time of what holds
/// always.
nlohmann::ordered_json ToJson(const Fault& fault);
nlohmann::ordered_json ToJson(const Explanation& one);

/// All of a run, what explains what follows first; of each channel those that explain most of it.
using Causes = std::vector<Explanation>;

/// Whether the first fault of one of them is called so.
bool Names(const Causes& causes, std::string_view fault);
/// Returns the causes of one channel in words; empty for none.
std::string DescribeCauses(const Causes& causes, CauseChannel channel);

}  // namespace dexcheck
