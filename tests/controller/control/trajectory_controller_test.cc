// The law along a trajectory as one controller: what it sends, when, and what it says that it meant.

#include "controller/control/trajectory_controller.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/common/allocation_counter.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck::testing::trajectory_controller_test {
namespace {

class TrajectoryControllerTest : public ::testing::Test {
 protected:
  TrajectoryControllerTest()
      : options_(MakeOptions(scene_)),
        motion_(MakePointToPointTrajectory(scene_.X_o,
                                           (Vector6d() << 0.1, -0.2, 0.3, 0.2, 0.1, -0.1).finished(), 2.0)) {
    std::mt19937 random(3);
    scene_.DrawVelocities(&random, 0.05);
    reading_.state = {scene_.q,
                      scene_.xi,
                      scene_.grasp.X_Bo(),
                      scene_.grasp.V_Bo(),
                      scene_.kappa,
                      std::vector<double>(4, 0.0)};
  }

  static GraspControllerOptions MakeOptions(const GraspScene& scene) {
    GraspControllerOptions options(scene.model);
    options.gains.K_p.setConstant(400.0);
    options.gains.K_v.setConstant(40.0);
    options.posture.damping.setConstant(5.0);
    options.X_o_start = scene.X_o;
    options.f_min = 1.0;
    options.f_max = 50.0;
    return options;
  }

  TrajectoryController Make(const Sampling& sampling) const {
    return {scene_.model, scene_.fingertips, scene_.object, scene_.surface, options_, sampling};
  }

  GraspScene scene_;
  GraspControllerOptions options_;
  std::unique_ptr<Trajectory> motion_;
  Reading reading_;
  Command command_;
};

TEST_F(TrajectoryControllerTest, SendsTheLawsTorquesWithTheVelocityOfHalfAStepBefore) {
  constexpr double kStep = 0.01;
  TrajectoryController controller = Make({.time_step = kStep});
  controller.Follow(*motion_);
  controller.Step(reading_, 0.7, &command_);
  DesiredMotion desired = motion_->Evaluate(0.7);
  ASSERT_GT((desired.X_d_dot - motion_->Evaluate(0.7 - 0.5 * kStep).X_d_dot).norm(), 1e-5);
  desired.X_d_dot = motion_->Evaluate(0.7 - 0.5 * kStep).X_d_dot;
  GraspController law(scene_.model, scene_.fingertips, scene_.object, scene_.surface, options_);
  law.SetState(reading_.state);
  EXPECT_EQ(command_.tau, law.CalcTorque(desired));
  EXPECT_EQ(command_.desired.X_d_dot, desired.X_d_dot);
  EXPECT_TRUE(command_.tracks);
  EXPECT_TRUE(command_.handling.holding);
  EXPECT_FALSE(command_.handling.partial);
  EXPECT_EQ(command_.force_solves, 1);
}

TEST_F(TrajectoryControllerTest, HoldsTorquesUntilTheNextAreDue) {
  TrajectoryController controller = Make({.time_step = 1e-3, .hold = 3});
  double t = 0.0;
  const auto count_solves = [&](int steps) {
    int solves = 0;
    for (int i = 0; i < steps; ++i) {
      t += 0.1;
      controller.Step(reading_, t, &command_);
      solves += command_.force_solves;
    }
    return solves;
  };
  controller.Follow(*motion_);
  EXPECT_EQ(count_solves(3), 1);
  const VectorXd held = command_.tau;
  EXPECT_EQ(command_.desired.X_d, motion_->Evaluate(t).X_d);  // though the torques are older
  EXPECT_EQ(count_solves(1), 1);
  EXPECT_NE(command_.tau, held);
  // A new motion is due at once.
  controller.Follow(*motion_);
  EXPECT_EQ(count_solves(7), 3);
}

TEST_F(TrajectoryControllerTest, ReportsWhatItKnewWhenTheLawFails) {
  TrajectoryController controller = Make({});
  controller.Follow(*motion_);
  controller.Step(reading_, 0.0, &command_);
  const VectorXd before = command_.tau;
  const auto impossible = MakeLineTrajectory(scene_.X_o, Vector6d::Constant(1e6), 0.0);
  controller.Follow(*impossible);
  EXPECT_THROW(controller.Step(reading_, 0.5, &command_), GraspForceError);
  EXPECT_EQ(command_.tau, before);
  EXPECT_EQ(command_.desired.X_d, impossible->Evaluate(0.5).X_d);
}

TEST_F(TrajectoryControllerTest, StepsWithoutAllocation) {
  TrajectoryController controller = Make({.time_step = 1e-3});
  controller.Follow(*motion_);
  controller.Step(reading_, 0.1, &command_);
  const AllocationCounter counter;
  controller.Step(reading_, 0.2, &command_);
  EXPECT_EQ(counter.count(), 0);
}

}  // namespace
}  // namespace dexcheck::testing::trajectory_controller_test
