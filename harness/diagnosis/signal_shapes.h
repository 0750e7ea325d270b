#pragma once

// The shapes that a motor or a sensor may give its signal.

#include <string>
#include <vector>

#include "harness/diagnosis/cause_estimator.h"
#include "harness/diagnosis/signal_causes.h"

namespace dexcheck {

inline constexpr Eigen::Index kFewestSteps = 3;     // that say anything
inline constexpr Eigen::Index kFewestOfNoise = 20;  // and of noise

/// The steps in which a series differs, and the signal's past there.
struct SignalSteps {
  std::vector<Eigen::Index> rows;
  Eigen::Index first = 0, last = -1;  // that differ, of all
  double from = 0.0, to = 0.0;        // s
  bool ends = false;                  // before the series does
  bool was_before = false;            // whether it may have begun before the series does

  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(rows.size()); }
  /// The signal `back` steps before each of them.
  [[nodiscard]] Eigen::ArrayXd Take(const Eigen::Ref<const VectorXd>& signal, Eigen::Index back = 0) const {
    Eigen::ArrayXd taken(size());
    for (Eigen::Index i = 0; i < size(); ++i)
      taken[i] = signal[std::max<Eigen::Index>(0, rows[static_cast<size_t>(i)] - back)];
    return taken;
  }
};

SignalSteps FindSteps(const SignalSeries& series);

/// The output of a transmission, before gain and offset.
struct SignalShape {
  std::string fault;  // empty for the signal itself
  std::string unit, detail;
  double value = 0.0;
  int parameters = 0;
  VectorXd output = {};  ///< At all steps.
  bool has_gain = true;
  Eigen::Index tried = 1;  ///< Out of how many this one is the best.
  /// How often it has to change: begin where it would have shown before, end where it would show after.
  int changes = 0;
};

/// Returns the output of this fault alone from a step on, at all steps; empty for one that no signal follows
/// from.
VectorXd Transmit(const Fault& fault, const SignalSeries& series, Eigen::Index begin = 0);
/// e^(-step / time) of a lag, of the step of a series.
double CalcDecay(const Fault& lag, const SignalSeries& series);

std::vector<SignalShape> ListShapes(const SignalSeries& series, const SignalSteps& steps,
                                    const std::vector<SignalSeries>& others);

/// Whether what has this output for good is over when it would still show.
bool IsRefuted(const SignalSeries& series, const SignalSteps& steps, const VectorXd& output);
/// "motor r_elbow", "joint r_elbow, position".
std::string PlaceOf(const SignalName& name);
/// Whether an output that goes on with this fraction of itself follows, and neither runs away nor ahead.
bool IsDecay(double decay);
/// The stages of the search. A stage is tried only where the one before explains nothing, as sines fit much.
enum class SignalSearch {
  kPlain,
  kSines,  ///< A ripple over time.
  kTurns,  ///< A ripple over the position, as cogging and an eccentricity make it.
};

/// Lists the candidates that add to a transmission's output: gain, offset, drift, lag, friction and a ripple.
std::vector<Candidate> ListAdded(const SignalSeries& series, const SignalSteps& steps,
                                 const SignalShape& shape, SignalSearch search);

}  // namespace dexcheck
