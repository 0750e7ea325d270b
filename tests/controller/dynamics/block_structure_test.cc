// The blocks of (15) and (16) that are zero for the paper's robot.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "tests/common/mass_scaling.h"
#include "tests/common/paper_robot.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::block_structure_test {
namespace {

// A block that is not zero has entries far above rounding.
constexpr double kVisible = 1e-3;

/// Indices of the joints whose name starts so, as coordinates after `base` entries of the platform.
std::vector<int> FindJoints(const RobotModel& model, const std::string& prefix, int base) {
  std::vector<int> found;
  for (int i = 0; i < model.num_joints(); ++i) {
    if (model.joint(i).name.starts_with(prefix)) found.push_back(base + i);
  }
  return found;
}

double FindLargestInBlock(const MatrixXd& X, const std::vector<int>& rows, const std::vector<int>& columns) {
  return std::max(X(rows, columns).cwiseAbs().maxCoeff(), X(columns, rows).cwiseAbs().maxCoeff());
}

/// Pairs of joint groups on different branches of the tree, by the prefixes of their names.
std::vector<std::pair<std::string, std::string>> ListSeparateBranches() {
  std::vector<std::pair<std::string, std::string>> pairs = {
      {"r_", "l_"}, {"r_", "lf"}, {"l_", "rf"}, {"rf", "lf"}};
  for (const std::string hand : {"rf", "lf"}) {
    for (int i = 1; i <= 4; ++i) {
      for (int j = i + 1; j <= 4; ++j) {
        pairs.emplace_back(hand + std::to_string(i), hand + std::to_string(j));
      }
    }
  }
  return pairs;
}

class BlockStructure : public ::testing::TestWithParam<Coordinates> {
 protected:
  /// M and C of a model at a random state.
  ModelTerms Evaluate(const RobotModel& model) {
    ModelTerms terms(model, GetParam());
    for (int state = 0; state < 3; ++state) {
      // More than once: an entry must not stay behind from the state before.
      terms.SetState(DrawPositions(model, &random_), DrawVelocities(terms.size(), &random_));
      terms.CalcDynamics();
    }
    return terms;
  }
  const RobotModel model_ = ReadPaperRobot();
  const int base_ = GetParam() == Coordinates::kReduced ? 2 : 3;
  std::mt19937 random_{15};
};

INSTANTIATE_TEST_SUITE_P(Coordinates, BlockStructure,
                         ::testing::Values(Coordinates::kUnreduced, Coordinates::kReduced),
                         [](const auto& info) {
                           return std::string(info.param == Coordinates::kReduced ? "Reduced" : "Unreduced");
                         });

TEST_P(BlockStructure, SeparateBranchesDoNotCouple) {
  const ModelTerms terms = Evaluate(model_);
  for (const auto& [one, other] : ListSeparateBranches()) {
    const std::vector<int> rows = FindJoints(model_, one, base_);
    const std::vector<int> columns = FindJoints(model_, other, base_);
    ASSERT_FALSE(rows.empty() || columns.empty());
    EXPECT_EQ(FindLargestInBlock(terms.M(), rows, columns), 0.0) << "M: " << one << ", " << other;
    EXPECT_EQ(FindLargestInBlock(terms.C(), rows, columns), 0.0) << "C: " << one << ", " << other;
  }
}

TEST_P(BlockStructure, AnArmOnTheOtherArmCouples) {
  RobotSpec spec = model_.spec();
  const int shoulder = model_.FindJoint("l_shoulder_pitch");
  ASSERT_GE(shoulder, 0);
  spec.joints[static_cast<size_t>(shoulder)].parent = model_.FindLink("r_palm");
  const RobotModel mutated(spec);
  const ModelTerms terms = Evaluate(mutated);
  const std::vector<int> right = FindJoints(mutated, "r_", base_);
  const std::vector<int> left = FindJoints(mutated, "l_", base_);
  EXPECT_GT(FindLargestInBlock(ScaleByMass(terms.M(), terms.M()), right, left), kVisible);
  EXPECT_GT(FindLargestInBlock(ScaleByMass(terms.C(), terms.M()), right, left), kVisible);
}

}  // namespace
}  // namespace dexcheck::testing::block_structure_test
