#include "harness/checks/check_record.h"

#include <gtest/gtest.h>

#include <limits>

namespace dexcheck {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Location AtJoint(int joint) { return {Location::Kind::kJoint, joint, -1}; }

CheckRecord MakeRecord() {
  CheckRecord record;
  record.bound = 0.1;
  return record;
}

TEST(CheckRecord, KeepsTheWorstError) {
  CheckRecord record = MakeRecord();
  record.Add(1.0, 1.0, 1.0, AtJoint(0), 10);
  EXPECT_EQ(record.sample, 10);  // the first counts, even without error
  record.Add(2.0, 2.25, 10.0, AtJoint(1), 11);
  record.Add(3.0, 2.9375, 10.0, AtJoint(2), 12);
  EXPECT_EQ(record.worst, 0.025);
  EXPECT_EQ(record.model_value, 2.0);
  EXPECT_EQ(record.engine_value, 2.25);
  EXPECT_EQ(record.where.first, 1);
  EXPECT_EQ(record.sample, 11);
  EXPECT_EQ(record.comparisons, 3);
  EXPECT_FALSE(record.failed);
}

TEST(CheckRecord, KeepsTheFirstFailure) {
  CheckRecord record = MakeRecord();
  record.Add(1.0, 1.0625, 1.0, AtJoint(0), 0);  // within the bound
  record.Add(1.0, 1.25, 1.0, AtJoint(1), 1);
  record.Add(1.0, 1.5, 1.0, AtJoint(2), 2);
  EXPECT_TRUE(record.failed);
  EXPECT_EQ(record.first_failure.first, 1);
  EXPECT_EQ(record.first_failing_sample, 1);
  EXPECT_EQ(record.where.first, 2);
  EXPECT_EQ(record.worst, 0.5);
}

TEST(CheckRecord, ErrorAtTheBoundPasses) {
  CheckRecord record;
  record.bound = 0.25;
  record.Add(1.0, 1.25, 1.0, {}, 0);
  EXPECT_FALSE(record.failed);
  record.Add(1.0, 1.250001, 1.0, {}, 0);
  EXPECT_TRUE(record.failed);
}

TEST(CheckRecord, WhatIsNotANumberFails) {
  for (const auto& [model, engine] :
       {std::pair(kNaN, 1.0), {1.0, kNaN}, {kNaN, kNaN}, {kInfinity, kInfinity}}) {
    CheckRecord record = MakeRecord();
    record.Add(model, engine, 1.0, AtJoint(3), 7);
    record.Add(1.0, 2.0, 1.0, AtJoint(4), 8);
    EXPECT_TRUE(record.failed);
    EXPECT_EQ(record.worst, kInfinity);
    EXPECT_EQ(record.where.first, 3);  // nothing is worse
    EXPECT_EQ(record.first_failure.first, 3);
  }
}

}  // namespace
}  // namespace dexcheck
