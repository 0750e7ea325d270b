#pragma once

// Made series of one motor or reading: torques, rates, what faults make of them, and what should be named.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "harness/diagnosis/signal_causes.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing {

using Eigen::ArrayXd;
using Eigen::Index;

inline constexpr Index kSteps = 200;
inline constexpr double kTimeStep = 1e-3;   // s
inline constexpr double kRelative = 0.01;   // of a value
inline constexpr double kErrors = 3.0;      // standard errors of a value
inline constexpr double kRounding = 1e-14;  // of a torque, relative to the largest

inline ArrayXd CalcTime() {
  return kTimeStep * ArrayXd::LinSpaced(kSteps, 0.0, static_cast<double>(kSteps - 1));
}

/// A torque that crosses zero, N m.
inline ArrayXd CalcTorque() {
  const ArrayXd t = CalcTime();
  return 2.0 * (2.0 * kPi * 12.0 * t + 0.4).sin() + 0.8 * (2.0 * kPi * 29.0 * t + 1.0).sin() + 0.1;
}

/// Torques of one sign.
inline ArrayXd CalcPositiveTorque() { return 4.0 + CalcTorque(); }

/// That of another motor, which is unlike.
inline ArrayXd CalcOtherTorque() { return 1.5 * (2.0 * kPi * 19.0 * CalcTime() + 2.0).cos() - 0.3; }

/// rad/s, of both signs and no multiple of the torque.
inline ArrayXd CalcRate() { return 0.7 * (2.0 * kPi * 15.0 * CalcTime() - 0.5).cos(); }

inline SignalSeries MakeSeries(const ArrayXd& expected, const ArrayXd& got) {
  SignalSeries series;
  series.name = {"motor elbow", "torque", "N m", "motors"};
  series.time = CalcTime();
  series.expected = expected;
  series.got = got;
  series.has_history.assign(kSteps, true);
  std::fill_n(series.has_history.begin(), StepStore::kHistory, false);
  series.noise = kRounding * expected.abs().maxCoeff();
  return series;
}

inline SignalSeries MakeSeries(const ArrayXd& got) { return MakeSeries(CalcTorque(), got); }

inline std::string TextOf(const Causes& causes) { return DescribeCauses(causes, CauseChannel::kActuation); }

inline Causes Explain(const SignalSeries& series) {
  SignalSeries other = series;
  other.name.place = "motor wrist";
  other.expected = other.got = CalcOtherTorque();
  return ExplainSignals({series, other}, CauseChannel::kActuation);
}

/// Returns the torques of a motor with this fault: `got` as a function of the step.
inline ArrayXd MakeEach(const std::function<double(Index)>& got) {
  ArrayXd all(kSteps);
  for (Index i = 0; i < kSteps; ++i) all[i] = got(i);
  return all;
}

/// The torque `back` steps before; the first, where there is none.
inline double Back(const ArrayXd& u, Index i, Index back) { return u[std::max<Index>(0, i - back)]; }

/// d = e^(-dt / time).
inline ArrayXd MakeLag(const ArrayXd& sent, double time) {
  ArrayXd given = sent;
  const double d = std::exp(-kTimeStep / time);
  for (Index i = 1; i < kSteps; ++i) given[i] = d * given[i - 1] + (1.0 - d) * sent[i];
  return given;
}

inline ArrayXd MakeNoise(double deviation, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, deviation);
  return MakeEach([&](Index) { return normal(random); });
}

inline bool HasValue(const Fault& fault, double value) {
  return std::abs(fault.value - value) <=
         std::max(kRelative * std::abs(value), kErrors * fault.error) * TolScale();
}

/// That these faults are named, each alone, and nothing else is.
inline void ExpectNamed(const Causes& causes, const std::vector<Fault>& faults) {
  SCOPED_TRACE(TextOf(causes));
  EXPECT_EQ(causes.size(), faults.size());
  for (const Fault& fault : faults) {
    const auto named = std::find_if(causes.begin(), causes.end(), [&](const Explanation& one) {
      return one.outcome == CauseOutcome::kNamed && one.faults.front().IsLike(fault);
    });
    if (named == causes.end()) {
      ADD_FAILURE() << fault.Describe() << " is not named";
      continue;
    }
    const Fault& told = named->faults.front();
    EXPECT_EQ(named->faults.size(), 1u);
    EXPECT_TRUE(HasValue(told, fault.value)) << told.Describe() << " against " << fault.value;
    EXPECT_EQ(told.unit, fault.unit);
    // An error that is as large as the value would let anything pass.
    EXPECT_LE(told.error, 0.2 * std::abs(told.value));
    EXPECT_FALSE(named->ends);
    EXPECT_GT(named->fraction, 0.99 - (fault.fault.substr(0, 5) == "noise" ? 1.0 : 0.0));
  }
}

inline std::vector<std::string> NamesOf(const Explanation& explanation) {
  std::vector<std::string> names;
  for (const Fault& fault : explanation.faults) names.push_back(fault.fault);
  return names;
}

/// Returns the value of a member of the class; NaN for others.
inline double ValueOf(const Explanation& explanation, const std::string& name) {
  for (const Fault& fault : explanation.faults)
    if (fault.fault == name) return fault.value;
  return std::nan("");
}

inline Fault OfMotor(const std::string& fault, double value, const std::string& unit = "") {
  return {fault, "motor elbow", value, 0.0, unit, ""};
}

inline double TimeOf(Index step) { return kTimeStep * static_cast<double>(step); }

}  // namespace dexcheck::testing
