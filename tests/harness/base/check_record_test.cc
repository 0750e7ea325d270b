// A check over steps or samples: worst value, first failure, rms; what is not a number.

#include "harness/base/check_record.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace dexcheck::testing::check_record_test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Location AtJoint(int joint) { return {Location::Kind::kJoint, joint, -1}; }

CheckRecord MakeRecord(double bound) {
  CheckRecord record;
  record.bound = bound;
  return record;
}

TEST(CheckRecord, KeepsTheWorstError) {
  CheckRecord record = MakeRecord(0.1);
  record.Compare(1.0, 1.0, 1.0, AtJoint(0), 10);
  EXPECT_EQ(record.at, 10);  // the first counts, even without error
  record.Compare(2.0, 2.25, 10.0, AtJoint(1), 11);
  record.Compare(3.0, 2.9375, 10.0, AtJoint(2), 12);
  EXPECT_EQ(record.worst, 0.025);
  EXPECT_EQ(record.model_value, 2.0);
  EXPECT_EQ(record.engine_value, 2.25);
  EXPECT_EQ(record.where.first, 1);
  EXPECT_EQ(record.at, 11);
  EXPECT_EQ(record.comparisons, 3);
  EXPECT_FALSE(record.failed);
}

TEST(CheckRecord, KeepsWorstAndFirstFailure) {
  CheckRecord check = MakeRecord(1.0);
  check.Add(0.5, 0.1);
  EXPECT_FALSE(check.failed);
  EXPECT_EQ(check.at, 0.1);
  check.Add(2.0, 0.2);
  check.Add(3.0, 0.3);
  check.Add(1.5, 0.4);
  EXPECT_TRUE(check.failed);
  EXPECT_EQ(check.failed_at, 0.2);
  EXPECT_EQ(check.worst, 3.0);
  EXPECT_EQ(check.at, 0.3);
  EXPECT_EQ(check.last, 1.5);
  EXPECT_EQ(check.count, 4);
  EXPECT_DOUBLE_EQ(check.rms(), std::sqrt((0.25 + 4.0 + 9.0 + 2.25) / 4.0));
}

TEST(CheckRecord, WhatIsTakenOffStandsBesideTheValue) {
  CheckRecord check = MakeRecord(1.0);
  EXPECT_STREQ(DescribeStatus(check), "not reached");
  EXPECT_EQ(ToJson(check, /*timed=*/true)["reached"], false);
  EXPECT_FALSE(ToJson(check, /*timed=*/true).contains("pass"));
  check.Add(1.0, 0.1, 3.0, 4.0);
  check.Add(1.0, 0.2, 4.0, 4.0);
  check.Add(1.0, 0.3, 2.0, 4.0);
  EXPECT_EQ(check.worst, 1.0) << "the bound, since the allowance explains the rest";
  EXPECT_EQ(check.residual, 4.0);
  EXPECT_EQ(check.allowance, 4.0);
  EXPECT_EQ(CalcFraction(check), 4.0 / 5.0);
  EXPECT_STREQ(DescribeStatus(check), "ok");
  const CheckRecord read = ReadCheck("one", ToJson(check, /*timed=*/true));
  EXPECT_EQ(read.residual, 4.0);
  EXPECT_EQ(read.allowance, 4.0);
  check.Add(1.5, 0.4, 5.5, 4.0);
  EXPECT_TRUE(check.failed);
  EXPECT_EQ(check.worst, 1.5);
}

// A value at the bound passes; what is no number is worse than any bound, and than all that comes later.
TEST(CheckRecord, WhatIsNotANumberFails) {
  for (const double bad : {kNaN, kInfinity, std::nextafter(1.0, 2.0)}) {
    for (const bool applies : {true, false}) {
      CheckRecord check = MakeRecord(1.0);
      check.applies = applies;
      check.Add(1.0, 0.1);
      EXPECT_FALSE(check.failed);
      check.Add(bad, 0.2);
      EXPECT_EQ(check.failed, applies);
      if (!applies) EXPECT_EQ(check.count, 0);
      if (!applies || bad < 2.0) continue;
      check.Add(5.0, 0.3);
      EXPECT_EQ(check.worst, kInfinity);
      EXPECT_EQ(check.at, 0.2);
      EXPECT_EQ(check.failed_at, 0.2);
      EXPECT_EQ(check.rms(), kInfinity);
    }
  }
  for (const auto& [model, engine] :
       {std::pair(kNaN, 1.0), {1.0, kNaN}, {kNaN, kNaN}, {kInfinity, kInfinity}}) {
    CheckRecord record = MakeRecord(kInfinity);
    record.Compare(model, engine, 1.0, AtJoint(3), 7);
    record.Compare(1.0, 2.0, 1.0, AtJoint(4), 8);
    EXPECT_TRUE(record.failed);
    EXPECT_EQ(record.worst, kInfinity);
    EXPECT_EQ(record.where.first, 3);  // nothing is worse
    EXPECT_EQ(record.first_failure.first, 3);
  }
}

}  // namespace
}  // namespace dexcheck::testing::check_record_test
