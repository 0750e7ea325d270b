// EngineStep forms sparsely what EngineTerms forms by dense projections of the engine's own matrices and
// forces.

#include "harness/engine/engine_step.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "harness/engine/engine_terms.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"

namespace dexcheck {
namespace {

using testing::MatrixNear;

// Masses of 90 kg, lengths of 2 m, rates of 3 rad/s, in sums of some hundred products: measured 1.2e-13.
constexpr double kRounding = 1e-12;

class EngineStepTest : public ::testing::TestWithParam<DriveVelocity> {};

TEST_P(EngineStepTest, IsWhatEngineTermsHas) {
  const RobotModel model = testing::ReadPaperRobot(GetParam());
  const MjModelPtr engine = LoadMjcf(testing::SourcePath("/mjcf/scene.xml"));
  const Adapter adapter(model, *engine, "scene.xml");
  EngineTerms dense(adapter, Coordinates::kReduced);
  EngineStep sparse(adapter, model.fingertips());
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const VectorXd q = testing::DrawPositions(model, &random);
    const VectorXd xi = testing::DrawVelocities(model.num_velocities(), &random);
    dense.SetState(q, xi);
    sparse.SetState(q, xi, Pose::Identity(), Vector6d::Zero());

    MatrixXd M = MatrixXd::Zero(sparse.size(), sparse.size());
    for (size_t i = 0; i < sparse.mass_entries().size(); ++i) {
      const auto [row, col] = sparse.mass_entries()[i];
      ASSERT_EQ(M(row, col), 0.0) << "listed twice";
      M(row, col) = M(col, row) = sparse.mass()[static_cast<Eigen::Index>(i)];
    }
    EXPECT_TRUE(MatrixNear(M, dense.M(), kRounding));
    ASSERT_GT(dense.coriolis().norm(), 0.1);
    EXPECT_TRUE(MatrixNear(sparse.coriolis(), dense.coriolis(), kRounding));
    EXPECT_TRUE(MatrixNear(sparse.gravity(), dense.gravity(), kRounding));
    EXPECT_TRUE(MatrixNear(sparse.friction(), dense.friction(), kRounding));

    const EnergyAndMomentum& a = sparse.energy_and_momentum();
    const EnergyAndMomentum& b = dense.energy_and_momentum();
    EXPECT_NEAR(a.kinetic, b.kinetic, kRounding);
    EXPECT_NEAR(a.potential, b.potential, kRounding);
    EXPECT_TRUE(MatrixNear(a.linear_momentum, b.linear_momentum, kRounding));
    EXPECT_TRUE(MatrixNear(a.angular_momentum, b.angular_momentum, kRounding));

    for (int finger = 0; finger < static_cast<int>(model.fingertips().size()); ++finger) {
      const int frame = model.fingertips()[static_cast<size_t>(finger)];
      const Pose X = sparse.FramePose(frame);
      EXPECT_TRUE(MatrixNear(X.matrix(), dense.FramePose(frame).matrix(), kRounding));
      Matrix6Xd J_dense(6, sparse.size());
      dense.CalcFrameJacobian(frame, J_dense);
      const std::vector<int>& chain = sparse.chain(finger);
      Matrix6Xd J_chain(6, static_cast<Eigen::Index>(chain.size()));
      sparse.CalcTipJacobian(finger, X.translation(), J_chain);
      Matrix6Xd J = Matrix6Xd::Zero(6, sparse.size());
      for (size_t i = 0; i < chain.size(); ++i) J.col(chain[i]) = J_chain.col(static_cast<Eigen::Index>(i));
      EXPECT_TRUE(MatrixNear(J, J_dense, kRounding));
      const EngineMotion motion = sparse.TipMotion(finger);
      Vector6d bias;
      bias << motion.a, motion.alpha;
      EXPECT_TRUE(MatrixNear(bias, dense.CalcFrameBiasAcceleration(frame), kRounding));
      Vector6d velocity;
      velocity << motion.v, motion.omega;
      EXPECT_TRUE(MatrixNear(velocity, J_dense * xi, kRounding));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Drive, EngineStepTest,
                         ::testing::Values(DriveVelocity::kTwist, DriveVelocity::kWheelRates));

TEST(EngineStep, NeedsAnObjectAndSpheresThatTouch) {
  const RobotModel model = testing::ReadPaperRobot();
  RobotSpec spec = model.spec();
  spec.object.reset();
  const RobotModel alone(spec);
  const MjModelPtr robot = LoadMjcf(testing::SourcePath("/mjcf/robot.xml"));
  const Adapter without_object(alone, *robot, "robot.xml");
  EXPECT_THROW(EngineStep(without_object, model.fingertips()), InputError);

  const MjModelPtr scene = LoadMjcf(testing::SourcePath("/mjcf/scene.xml"));
  const Adapter adapter(model, *scene, "scene.xml");
  const std::vector<int> palm = {model.FindFrame("r_palm_frame")};
  EXPECT_THROW(EngineStep(adapter, palm), InputError);
  for (int pair = 0; pair < scene->npair; ++pair) {  // of the floor with itself
    scene->pair_geom1[pair] = 0;
    scene->pair_geom2[pair] = 0;
  }
  EXPECT_THROW(EngineStep(adapter, model.fingertips()), InputError);
}

}  // namespace
}  // namespace dexcheck
