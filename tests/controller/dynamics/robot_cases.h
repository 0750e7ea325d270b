#pragma once

// Robots that tests of the dynamics run over.

#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "tests/common/paper_robot.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing {

struct RobotCase {
  std::string name;
  RobotModel model;
  Coordinates coordinates = Coordinates::kReduced;
  double tolerance = 0.0;
};

inline void PrintTo(const RobotCase& robot, std::ostream* out) { *out << robot.name; }

/// Suffix of a test's name.
inline std::string NameOf(const ::testing::TestParamInfo<RobotCase>& info) { return info.param.name; }

/// A random tree on each kind of base that stands or drives, and the paper's robot with either v (12).
inline std::vector<RobotCase> MakeRobotCases(unsigned seed) {
  std::vector<RobotCase> cases;
  std::mt19937 random(seed);
  const auto add = [&](const char* name, BaseType base, DriveVelocity velocity) {
    const RandomRobotOptions options{.base = base, .velocity = velocity};
    cases.push_back({name, RobotModel(MakeRandomRobot(options, &random))});
  };
  add("Fixed", BaseType::kFixed, DriveVelocity::kTwist);
  add("Planar", BaseType::kPlanar, DriveVelocity::kTwist);
  add("DriveTwist", BaseType::kDifferentialDrive, DriveVelocity::kTwist);
  add("DriveWheelRates", BaseType::kDifferentialDrive, DriveVelocity::kWheelRates);
  cases.push_back({"PaperTwist", ReadPaperRobot(DriveVelocity::kTwist)});
  cases.push_back({"PaperWheelRates", ReadPaperRobot(DriveVelocity::kWheelRates)});
  return cases;
}

}  // namespace dexcheck::testing
