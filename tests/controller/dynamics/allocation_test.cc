// Nothing allocates once a ModelTerms is built.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/common/allocation_counter.h"
#include "tests/controller/dynamics/robot_cases.h"

namespace dexcheck::testing::allocation_test {
namespace {

std::vector<RobotCase> MakeCases() {
  std::vector<RobotCase> cases;
  std::mt19937 random(200);
  const auto add = [&](const std::string& name, const RobotModel& model) {
    cases.push_back({name + "Reduced", model, Coordinates::kReduced});
    cases.push_back({name + "Unreduced", model, Coordinates::kUnreduced});
  };
  for (const BaseType base : {BaseType::kFixed, BaseType::kPlanar, BaseType::kDifferentialDrive}) {
    const RandomRobotOptions options{.base = base, .joints = 200};
    add("Tree" + std::to_string(static_cast<int>(base)), RobotModel(MakeRandomRobot(options, &random)));
  }
  add("Paper", ReadPaperRobot());
  cases.push_back({"PaperWheelRates", ReadPaperRobot(DriveVelocity::kWheelRates), Coordinates::kReduced});
  cases.push_back({"Panda", ReadPanda(), Coordinates::kReduced});
  return cases;
}

class Allocation : public ::testing::TestWithParam<RobotCase> {
 protected:
  /// Allocations while `call` runs.
  template <typename Call>
  static std::int64_t Count(const Call& call) {
    const AllocationCounter counter;
    call();
    return counter.count();
  }

  const RobotModel& model_ = GetParam().model;
  std::mt19937 random_{12};
  ModelTerms terms_{model_, GetParam().coordinates};
  const VectorXd q_ = DrawPositions(model_, &random_);
  const VectorXd velocity_ = DrawVelocities(terms_.size(), &random_);
};

INSTANTIATE_TEST_SUITE_P(Robots, Allocation, ::testing::ValuesIn(MakeCases()), NameOf);

// The first call counts, too: the workspace is complete when the constructor returns.
TEST_P(Allocation, NoneAfterConstruction) {
  Matrix6Xd J = Matrix6Xd::Zero(6, terms_.size());
  Matrix6Xd J_dot = Matrix6Xd::Zero(6, terms_.size());
  EnergyAndMomentum energy;
  double turning = 0.0;
  double path = 0.0;
  for (int repeat = 0; repeat < 2; ++repeat) {
    EXPECT_EQ(Count([&] { terms_.SetState(q_, velocity_); }), 0) << "SetState";
    EXPECT_EQ(Count([&] { terms_.CalcDynamics(); }), 0) << "CalcDynamics";
    if (GetParam().coordinates == Coordinates::kReduced)
      EXPECT_EQ(Count([&] { terms_.CalcMassAndCoriolis(); }), 0) << "CalcMassAndCoriolis";
    EXPECT_EQ(Count([&] { energy = terms_.CalcEnergyAndMomentum(); }), 0) << "CalcEnergyAndMomentum";
    for (int frame = 0; frame < static_cast<int>(model_.frames().size()); ++frame) {
      EXPECT_EQ(Count([&] { terms_.CalcFrameJacobian(frame, J, J_dot); }), 0) << "CalcFrameJacobian";
      turning += J_dot.norm();
      EXPECT_EQ(Count([&] { path += terms_.CalcFramePose(frame).translation().norm(); }), 0)
          << "CalcFramePose";
    }
  }
  // The calls did their work.
  EXPECT_GT(energy.kinetic, 0.0);
  EXPECT_GT(turning, 0.0);
  EXPECT_GT(path, 0.0);
}

// The counter sees what the library does: the constructor, and a temporary made for an argument.
TEST_P(Allocation, AllocationsInTheLibraryAreSeen) {
  EXPECT_GT(Count([&] { ModelTerms(model_, GetParam().coordinates); }), 10);
  EXPECT_EQ(Count([&] { terms_.SetState(2.0 * q_, velocity_); }), 1);
}

}  // namespace
}  // namespace dexcheck::testing::allocation_test
