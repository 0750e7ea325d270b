#pragma once

// Sets of faults whose kinds, places, sizes and times are drawn, and whether they are named.

#include <cstdint>
#include <string>
#include <vector>

#include "harness/injection/fault_kinds.h"

namespace dexcheck {

struct DrawOptions {
  size_t count = 0;     ///< Of sets.
  size_t together = 1;  ///< Faults in each.
  std::uint64_t seed = 1;
  double duration = 0.0;           ///< Of the run, s.
  VectorXd tau;                    ///< tau' (n) of the right run.
  std::vector<std::string> kinds;  ///< Of FaultKind::kind, out of which is drawn; empty for all.
};

/// Kinds that apply to the run. @throws InputError for a kind that there is not, or not in this run.
std::vector<FaultKind> ListFaultKinds(const Setup& setup, const DrawOptions& options);

/// Faults that are there at once, each by itself.
using FaultSet = std::vector<InjectedFault>;
/// Sets of kinds that are drawn; no two faults of a set at the same place.
std::vector<FaultSet> DrawFaults(const Setup& setup, const DrawOptions& options);
/// One fault of each kind, `count` times.
std::vector<FaultSet> DrawEachKind(const Setup& setup, const DrawOptions& options);

/// `count` numbers of the model, evenly out of all, changed by `scale` relative to GetScale.
std::vector<FaultSet> ListNumberFaults(const Setup& setup, size_t count, double scale);
/// Each part of (55) a thousandth too large and left out, and what else may be wrong in it.
std::vector<FaultSet> ListLawFaults(const Setup& setup);
/// Wrong equations of the model that the law goes by.
std::vector<FaultSet> ListEquationFaults(const Setup& setup);

/// How the explanations of a run compare with what was wrong in it.
struct NamingScore {
  int right = 0;     ///< Named: kind, place, and value within 5 % of the change or 3 standard errors.
  int in_class = 0;  ///< Named with others that are indistinguishable on this motion.
  int not_explained = 0;
  int wrong = 0;  ///< Single names, or values, of what was not so.
  /// The name that each fault got: its own, "a class", another one's single name, or "nothing".
  std::vector<std::string> named_as = {};
  std::vector<CauseOutcome> outcomes = {};  ///< Of each fault.
};
/// @param truth what should be named. @param all what may be, besides: too small to be seen alone.
NamingScore ScoreNames(const std::vector<Fault>& truth, const std::vector<Fault>& all, const Causes& causes);

}  // namespace dexcheck
