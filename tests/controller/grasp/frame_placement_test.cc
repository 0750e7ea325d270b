// Inverse kinematics of an arm against the forward kinematics of the robot's terms, an independent route.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "controller/dynamics/model_terms.h"
#include "controller/grasp/finger_placement.h"
#include "controller/handling/pick_plan.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::frame_placement_test {
namespace {

// Residual that ends the search, 1e-13, and the rounding of two chains of 13 transforms a metre long.
constexpr double kPoseTolerance = 1e-12;
// Random robots have 20 joints and lengths of metres.
constexpr double kLongChainTolerance = 1e-11;

class FramePlacementTest : public ::testing::Test {
 protected:
  [[nodiscard]] Pose CalcFramePose(const VectorXd& q, int frame) {
    terms_.SetState(q, VectorXd::Zero(terms_.size()));
    return terms_.CalcFramePose(frame);
  }

  /// Entry of q' of a joint.
  double& At(VectorXd* q, int joint) const { return (*q)[model_.num_base_positions() + joint]; }

  /// A posture with the joints anywhere in their ranges less `margin`; the platform stands somewhere.
  VectorXd DrawPosture(const std::vector<int>& joints, double margin) {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    VectorXd q = VectorXd::Zero(model_.num_positions());
    q.head<3>() << 0.4, -0.3, 0.7;
    for (const int index : joints) {
      const Joint& joint = model_.joint(index);
      const double range = joint.upper - joint.lower - 2.0 * margin;
      At(&q, index) = joint.lower + margin + unit(random_) * range;
    }
    return q;
  }

  [[nodiscard]] std::vector<int> ListArm(const std::string& side) const {
    std::vector<int> tips;
    for (const int tip : model_.fingertips()) {
      if (model_.frame(tip).name.starts_with(side)) tips.push_back(tip);
    }
    return ListArmJoints(model_, tips, model_.FindFrame(side + "_palm_frame"));
  }

  RobotModel model_ = ReadPaperRobot();
  ModelTerms terms_{model_};
  std::mt19937 random_{1};
};

TEST_F(FramePlacementTest, ArmsAreTheirOwnSevenJoints) {
  const std::vector<int> arm = ListArm("r");
  ASSERT_EQ(arm.size(), 7U);
  EXPECT_EQ(arm.front(), model_.FindJoint("r_shoulder_pitch"));
  EXPECT_EQ(arm.back(), model_.FindJoint("r_palm_roll"));
  EXPECT_EQ(ListArm("l").front(), model_.FindJoint("l_shoulder_pitch"));
}

TEST_F(FramePlacementTest, ReachesPosesOfTheForwardKinematics) {
  constexpr double kMargin = 0.05;
  for (const std::string side : {"r", "l"}) {
    for (const bool with_waist : {false, true}) {
      const int palm = model_.FindFrame(side + "_palm_frame");
      std::vector<int> joints = ListArm(side);
      if (with_waist) {
        joints.push_back(model_.FindJoint("waist_yaw"));
        joints.push_back(model_.FindJoint("waist_pitch"));
      }
      for (int sample = 0; sample < 100; ++sample) {
        const Pose X = CalcFramePose(DrawPosture(joints, kMargin), palm);
        VectorXd q = VectorXd::Zero(model_.num_positions());
        q.head<3>() << 0.4, -0.3, 0.7;
        const FramePlacement placement =
            SolveFramePlacement(model_, palm, X, joints, q, q, {.joint_margin = kMargin});
        ASSERT_TRUE(placement.reached)
            << side << ", sample " << sample << ", " << placement.position_residual;
        EXPECT_TRUE(MatrixNear(CalcFramePose(placement.q, palm).matrix(), X.matrix(), kPoseTolerance));
        EXPECT_GE(placement.joint_margin, kMargin * (1.0 - 1e-12));
        for (const int joint : joints) At(&q, joint) = placement.q[model_.num_base_positions() + joint];
        EXPECT_EQ(q, placement.q) << "other joints must stay";
      }
    }
  }
}

TEST_F(FramePlacementTest, StaysNearTheNominalPosture) {
  const int palm = model_.FindFrame("r_palm_frame");
  const std::vector<int> joints = ListArm("r");
  int tested = 0;
  double farthest = 0.0;
  for (int sample = 0; sample < 50; ++sample) {
    const Pose X = CalcFramePose(DrawPosture(joints, 0.2), palm);
    const VectorXd nominal = DrawPosture(joints, 0.5);
    const FramePlacement placement = SolveFramePlacement(model_, palm, X, joints, nominal, nominal);
    ASSERT_TRUE(placement.reached);
    if (placement.joint_margin < 1e-3) continue;  // the pull ended at a range
    ++tested;
    // The seventh joint's freedom: moving along it must not bring the posture nearer to first order.
    terms_.SetState(placement.q, VectorXd::Zero(terms_.size()));
    Matrix6Xd J(6, terms_.size());
    Matrix6Xd J_dot(6, terms_.size());
    terms_.CalcFrameJacobian(palm, J, J_dot);
    const Matrix6Xd J_arm = J.middleCols(model_.num_base_velocities() + joints.front(), 7);
    const MatrixXd J_pinv = CalcPseudoinverse(J_arm);
    const VectorXd away = (nominal - placement.q).segment(3 + joints.front(), 7);
    const VectorXd free = away - J_pinv * (J_arm * away);
    farthest = std::max(farthest, away.norm());
    // The pull ends where 0.005 rad are left in its own direction.
    EXPECT_LT(free.cwiseAbs().maxCoeff(), 0.01) << "sample " << sample;
  }
  EXPECT_GT(tested, 20);
  EXPECT_GT(farthest, 1.0);
}

TEST_F(FramePlacementTest, SaysHowFarThePoseIsOutOfReach) {
  const int palm = model_.FindFrame("r_palm_frame");
  const std::vector<int> joints = ListArm("r");
  const VectorXd q = VectorXd::Zero(model_.num_positions());
  Pose X = CalcFramePose(q, palm);
  X.translation().x() += 2.0;
  const FramePlacement placement = SolveFramePlacement(model_, palm, X, joints, q, q);
  EXPECT_FALSE(placement.reached);
  // The arm is 0.61 m long and stretched forward it is 1.06 m short or more.
  EXPECT_GT(placement.position_residual, 1.0);
  const Pose X_nearest = CalcFramePose(placement.q, palm);
  EXPECT_NEAR(placement.position_residual, (X.translation() - X_nearest.translation()).norm(),
              kPoseTolerance);
}

TEST_F(FramePlacementTest, RangesAreNeverLeft) {
  const int palm = model_.FindFrame("r_palm_frame");
  const std::vector<int> joints = ListArm("r");
  const VectorXd q = VectorXd::Zero(model_.num_positions());
  int missed = 0;
  for (int sample = 0; sample < 50; ++sample) {
    // Postures beyond the ranges: the arm is long enough, the joints do not turn so far.
    const Pose X = CalcFramePose(DrawPosture(joints, -0.5), palm);
    const FramePlacement placement =
        SolveFramePlacement(model_, palm, X, joints, q, q, {.joint_margin = 0.1});
    EXPECT_GE(placement.joint_margin, 0.1 * (1.0 - 1e-12));
    if (!placement.reached) ++missed;
  }
  EXPECT_GT(missed, 5);
  EXPECT_LT(missed, 45);
}

TEST(FramePlacementOfRandomRobots, FollowsTheForwardKinematics) {
  std::mt19937 random(7);
  int prismatic = 0;
  for (const BaseType base : {BaseType::kFixed, BaseType::kPlanar, BaseType::kDifferentialDrive}) {
    for (int sample = 0; sample < 20; ++sample) {
      const RobotModel model(MakeRandomRobot({.base = base}, &random));
      ModelTerms terms(model);
      const VectorXd q = DrawPositions(model, &random);
      terms.SetState(q, VectorXd::Zero(terms.size()));
      for (int frame = 0; frame < static_cast<int>(model.frames().size()); ++frame) {
        std::vector<int> joints;
        VectorXd q_start = q;
        int joint = model.frame(frame).link;
        for (; joint >= 0; joint = model.joint(joint).parent) {
          joints.push_back(joint);
          q_start[model.num_base_positions() + joint] += 0.02;
          prismatic += model.joint(joint).type == JointType::kPrismatic;
        }
        if (joints.empty()) continue;
        const Pose X = terms.CalcFramePose(frame);
        const FramePlacement placement = SolveFramePlacement(model, frame, X, joints, q_start, q_start);
        ASSERT_TRUE(placement.reached) << placement.position_residual;
        ModelTerms reached(model);
        reached.SetState(placement.q, VectorXd::Zero(terms.size()));
        EXPECT_TRUE(MatrixNear(reached.CalcFramePose(frame).matrix(), X.matrix(), kLongChainTolerance));
        EXPECT_NE(placement.q, q_start) << "there was something to do";
      }
    }
  }
  EXPECT_GT(prismatic, 10);
}

}  // namespace
}  // namespace dexcheck::testing::frame_placement_test
