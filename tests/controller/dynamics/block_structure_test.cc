// The blocks of (15), (16) and (17) for the paper's robot: where each is, which are zero, and how S_v enters.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "tests/common/mass_scaling.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/random_robot.h"
#include "tests/common/reduction_map.h"

namespace dexcheck::testing::block_structure_test {
namespace {

// One recursion behind both sides, entries scaled to 1 (M) and 30 (C). Measured 5e-16.
constexpr double kRounding = 5e-15;
// A block that is not zero has entries far above rounding.
constexpr double kVisible = 1e-3;

constexpr int kBody = 16;     // q_b: waist 2, arms 7 each
constexpr int kFingers = 32;  // q_f

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

// q' = [q_v; waist, right arm, left arm; right fingers, left fingers]
TEST_P(BlockStructure, CoordinatesComeInThePapersOrder) {
  EXPECT_EQ(ModelTerms(model_, GetParam()).size(), base_ + kBody + kFingers);
  const std::vector<std::pair<std::string, int>> groups = {
      {"waist", 2}, {"r_", 7}, {"l_", 7}, {"rf", 16}, {"lf", 16}};
  int next = base_;
  for (const auto& [prefix, count] : groups) {
    const std::vector<int> joints = FindJoints(model_, prefix, base_);
    ASSERT_EQ(joints.size(), static_cast<size_t>(count)) << prefix;
    for (const int joint : joints) EXPECT_EQ(joint, next++) << prefix;
  }
}

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

TEST_P(BlockStructure, LinksOfOneBranchCouple) {
  const ModelTerms terms = Evaluate(model_);
  const MatrixXd M = ScaleByMass(terms.M(), terms.M());
  const MatrixXd C = ScaleByMass(terms.C(), terms.M());
  std::vector<int> platform(static_cast<size_t>(base_));
  for (int i = 0; i < base_; ++i) platform[static_cast<size_t>(i)] = i;
  const std::vector<int> waist = FindJoints(model_, "waist", base_);
  for (const std::string side : {"r", "l"}) {
    const std::vector<int> arm = FindJoints(model_, side + "_", base_);
    for (int finger = 1; finger <= 4; ++finger) {
      const std::vector<int> joints = FindJoints(model_, side + "f" + std::to_string(finger), base_);
      for (const std::vector<int>& inner : {platform, waist, arm}) {
        EXPECT_GT(FindLargestInBlock(M, joints, inner), kVisible);
        EXPECT_GT(FindLargestInBlock(C, joints, inner), kVisible);
      }
    }
    EXPECT_GT(FindLargestInBlock(M, arm, platform), kVisible);
    EXPECT_GT(FindLargestInBlock(C, arm, platform), kVisible);
    EXPECT_GT(FindLargestInBlock(M, arm, waist), kVisible);
    EXPECT_GT(FindLargestInBlock(C, arm, waist), kVisible);
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

// (17), block by block. Row 3 of C_bar' reads [M_fv S_v_dot + C_fv S_v, C_fb, C_f] as in (18); the print of
// (17) has one factor too many there.
class ReducedBlocks : public ::testing::TestWithParam<DriveVelocity> {};

INSTANTIATE_TEST_SUITE_P(BothChoicesOfV, ReducedBlocks,
                         ::testing::Values(DriveVelocity::kTwist, DriveVelocity::kWheelRates),
                         [](const auto& info) {
                           return std::string(info.param == DriveVelocity::kTwist ? "Twist" : "WheelRates");
                         });

TEST_P(ReducedBlocks, AreThoseOfEquation17) {
  const RobotModel model = ReadPaperRobot(GetParam());
  std::mt19937 random(17);
  const VectorXd q = DrawPositions(model, &random);
  const VectorXd xi = DrawVelocities(model.num_velocities(), &random);
  const PlatformConstraint platform = CalcPlatformConstraint(model.base(), q.head<3>(), xi.head<2>());
  const Eigen::Matrix<double, 3, 2>& S_v = platform.S_v;
  const Eigen::Matrix<double, 3, 2>& S_v_dot = platform.S_v_dot;
  ASSERT_GT(S_v_dot.norm(), 0.01);

  ModelTerms full(model, Coordinates::kUnreduced);
  full.SetState(q, CalcReductionMap(model, q, xi).S * xi);
  full.CalcDynamics();
  ModelTerms reduced(model);
  reduced.SetState(q, xi);
  reduced.CalcDynamics();

  // Row and column of v, b, f: sizes 3, 16, 32 in (16) and 2, 16, 32 in (17).
  const auto block = [&](const MatrixXd& X, int i, int j) -> MatrixXd {
    constexpr int kStart[] = {0, 3, 3 + kBody};
    constexpr int kSize[] = {3, kBody, kFingers};
    return X.block(kStart[i], kStart[j], kSize[i], kSize[j]);
  };
  constexpr int v = 0;
  constexpr int b = 1;
  constexpr int f = 2;
  const MatrixXd& M = full.M();
  const MatrixXd& C = full.C();
  const MatrixXd S_v_T = S_v.transpose();
  const MatrixXd row_3 = block(M, f, v) * S_v_dot + block(C, f, v) * S_v;
  MatrixXd M_bar(reduced.size(), reduced.size());
  MatrixXd C_bar(reduced.size(), reduced.size());
  // clang-format off
  M_bar << S_v_T * block(M, v, v) * S_v, S_v_T * block(M, v, b), S_v_T * block(M, v, f),
           block(M, b, v) * S_v,         block(M, b, b),         block(M, b, f),
           block(M, f, v) * S_v,         block(M, f, b),         block(M, f, f);
  C_bar << S_v_T * block(M, v, v) * S_v_dot + S_v_T * block(C, v, v) * S_v,
                                                                S_v_T * block(C, v, b), S_v_T * block(C, v, f),
           block(M, b, v) * S_v_dot + block(C, b, v) * S_v,     block(C, b, b),         block(C, b, f),
           row_3,                                               block(C, f, b),         block(C, f, f);
  // clang-format on
  EXPECT_TRUE(MatrixNear(ScaleByMass(reduced.M(), M_bar), ScaleByMass(M_bar, M_bar), kRounding));
  EXPECT_TRUE(MatrixNear(ScaleByMass(reduced.C(), M_bar), ScaleByMass(C_bar, M_bar), kRounding));

  // Row 3 without M_fv S_v_dot is seen.
  C_bar.block<kFingers, 2>(2 + kBody, 0) -= block(M, f, v) * S_v_dot;
  EXPECT_GT(ScaleByMass(reduced.C() - C_bar, M_bar).cwiseAbs().maxCoeff(), kVisible);
}

}  // namespace
}  // namespace dexcheck::testing::block_structure_test
