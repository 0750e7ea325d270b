// A check over a whole run: worst value, first failure, rms; what is not a number.

#include "harness/checks/run_check.h"

#include <gtest/gtest.h>

#include <limits>

namespace dexcheck {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

RunCheck MakeCheck() {
  RunCheck check;
  check.bound = 1.0;
  return check;
}

TEST(RunCheck, KeepsWorstAndFirstFailure) {
  RunCheck check = MakeCheck();
  check.Add(0.5, 0.1);
  EXPECT_FALSE(check.failed);
  EXPECT_EQ(check.at_time, 0.1);
  check.Add(2.0, 0.2);
  check.Add(3.0, 0.3);
  check.Add(1.5, 0.4);
  EXPECT_TRUE(check.failed);
  EXPECT_EQ(check.failed_at, 0.2);
  EXPECT_EQ(check.max, 3.0);
  EXPECT_EQ(check.at_time, 0.3);
  EXPECT_EQ(check.last, 1.5);
  EXPECT_EQ(check.count, 4);
  EXPECT_DOUBLE_EQ(check.rms(), std::sqrt((0.25 + 4.0 + 9.0 + 2.25) / 4.0));
}

TEST(RunCheck, ValueAtTheBoundPasses) {
  RunCheck check = MakeCheck();
  check.Add(1.0, 0.0);
  EXPECT_FALSE(check.failed);
  check.Add(std::nextafter(1.0, 2.0), 0.1);
  EXPECT_TRUE(check.failed);
}

TEST(RunCheck, EqualValuesKeepTheFirstTime) {
  RunCheck check = MakeCheck();
  check.Add(0.5, 0.1);
  check.Add(0.5, 0.2);
  EXPECT_EQ(check.at_time, 0.1);
}

TEST(RunCheck, WhatIsNotANumberIsInfinite) {
  for (const double bad : {kNaN, kInfinity}) {
    RunCheck check = MakeCheck();
    check.Add(0.5, 0.1);
    check.Add(bad, 0.2);
    check.Add(bad, 0.3);
    check.Add(5.0, 0.4);
    EXPECT_TRUE(check.failed);
    EXPECT_EQ(check.failed_at, 0.2);
    EXPECT_EQ(check.max, kInfinity);
    EXPECT_EQ(check.at_time, 0.2) << "nothing is worse than the first";
    EXPECT_EQ(check.rms(), kInfinity);
  }
}

TEST(RunCheck, AnInfiniteBoundStillRefusesWhatIsNotANumber) {
  RunCheck check;
  check.bound = kInfinity;
  check.Add(1e300, 0.1);
  EXPECT_FALSE(check.failed);
  check.Add(kNaN, 0.2);
  EXPECT_TRUE(check.failed);
  EXPECT_EQ(check.failed_at, 0.2);
}

TEST(RunCheck, WhatDoesNotApplyIsNotAsked) {
  RunCheck check = MakeCheck();
  check.applies = false;
  check.Add(5.0, 0.1);
  check.Add(kNaN, 0.2);
  EXPECT_FALSE(check.failed);
  EXPECT_EQ(check.count, 0);
  EXPECT_EQ(check.max, 0.0);
  EXPECT_EQ(check.rms(), 0.0);
}

TEST(RunCheck, ResetForgetsValuesOnly) {
  RunCheck check = MakeCheck();
  check.name = "fingertip_slip";
  check.Add(5.0, 0.1);
  check.where = "rf1_tip";
  check.Reset();
  EXPECT_FALSE(check.failed);
  EXPECT_EQ(check.max, 0.0);
  EXPECT_EQ(check.last, 0.0);
  EXPECT_EQ(check.failed_at, 0.0);
  EXPECT_EQ(check.count, 0);
  EXPECT_EQ(check.rms(), 0.0);
  EXPECT_EQ(check.where, "");
  EXPECT_EQ(check.name, "fingertip_slip");
  EXPECT_EQ(check.bound, 1.0);
  check.Add(0.25, 0.3);
  EXPECT_EQ(check.max, 0.25);
  EXPECT_EQ(check.at_time, 0.3);
}

}  // namespace
}  // namespace dexcheck
