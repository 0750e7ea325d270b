// Torques of prescribed motions against M qdd + C qd + F, and their derivatives against differences.

#include "controller/dynamics/torque_regressor.h"

#include <gtest/gtest.h>

#include <random>

#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::torque_regressor_test {
namespace {

struct Motion {
  VectorXd q, qd, qdd;
};

Motion DrawMotion(int n, std::mt19937* random) {
  std::uniform_real_distribution<> number(-1.0, 1.0);
  const auto draw = [&] {
    return VectorXd(VectorXd::NullaryExpr(n, [&](Eigen::Index) { return number(*random); }));
  };
  Motion motion;
  motion.q = draw();
  motion.qd = draw();
  motion.qdd = draw();
  return motion;
}

RobotModel Panda() { return ReadRobotModel(SourcePath("/controller/parameters/panda.toml")); }

/// A tree on a fixed base, with prismatic joints.
RobotSpec DrawRobot(int seed) {
  std::mt19937 random(static_cast<unsigned>(seed));
  RandomRobotOptions options;
  options.base = BaseType::kFixed;
  options.joints = 8;
  return MakeRandomRobot(options, &random);
}

VectorXd CalcTorques(const RobotModel& model, const Motion& motion) {
  TorqueRegressor regressor(model);
  regressor.SetMotion(motion.q, motion.qd, motion.qdd);
  VectorXd torques(model.num_joints());
  regressor.CalcTorques(torques);
  return torques;
}

class TorqueRegressorTest : public ::testing::TestWithParam<int> {
 protected:
  /// The Panda, or a tree that is drawn, with prismatic joints too.
  RobotModel model_ = GetParam() == 0 ? Panda() : RobotModel(DrawRobot(GetParam()));
  std::mt19937 random_{static_cast<unsigned>(GetParam())};
  Motion motion_ = DrawMotion(model_.num_joints(), &random_);
};

TEST_P(TorqueRegressorTest, TorquesAreThoseOfTheEquationsOfMotion) {
  ModelTerms terms(model_);
  terms.SetState(motion_.q, motion_.qd);
  terms.CalcDynamics();
  const VectorXd expected = terms.M() * motion_.qdd + terms.C() * motion_.qd + terms.gravity();
  EXPECT_TRUE(MatrixNear(CalcTorques(model_, motion_), expected, 1e-12 * (1.0 + expected.norm())));
}

TEST_P(TorqueRegressorTest, TorquesAreLinearInBodies) {
  TorqueRegressor regressor(model_);
  regressor.SetMotion(motion_.q, motion_.qd, motion_.qdd);
  const int n = model_.num_joints();
  MatrixXd columns(n, TorqueRegressor::kBody * n);
  regressor.CalcBodyColumns(columns);
  VectorXd sum(n);
  for (int i = 0; i < n; ++i) sum[i] = model_.joint(i).armature * motion_.qdd[i];
  for (int i = 0; i < n; ++i)
    sum += columns.middleCols<TorqueRegressor::kBody>(TorqueRegressor::kBody * i) *
           TorqueRegressor::Pack(model_.joint(i).body);
  const VectorXd torques = CalcTorques(model_, motion_);
  EXPECT_TRUE(MatrixNear(sum, torques, 1e-12 * (1.0 + torques.norm())));
}

TEST_P(TorqueRegressorTest, GravityColumnsAreDerivatives) {
  TorqueRegressor regressor(model_);
  regressor.SetMotion(motion_.q, motion_.qd, motion_.qdd);
  MatrixXd columns(model_.num_joints(), 3);
  regressor.CalcGravityColumns(columns);
  RobotSpec heavy = model_.spec();
  const Vector3d change(0.3, -0.5, 0.7);
  heavy.gravity += change;
  const VectorXd difference = CalcTorques(RobotModel(heavy), motion_) - CalcTorques(model_, motion_);
  EXPECT_TRUE(MatrixNear(columns * change, difference, 1e-11 * (1.0 + difference.norm())));
}

TEST_P(TorqueRegressorTest, ForceColumnsDoThePowerOfTheForce) {
  const int link = model_.num_joints() - 1;
  TorqueRegressor regressor(model_);
  regressor.SetMotion(motion_.q, motion_.qd, motion_.qdd);
  MatrixXd columns(model_.num_joints(), 6);
  regressor.CalcForceColumns(link, columns);
  ModelTerms terms(model_);
  terms.SetState(motion_.q, motion_.qd);
  const Vector6d velocity = terms.CalcLinkVelocity(link);
  const Vector3d arm = terms.CalcLinkPose(link).linear() * model_.joint(link).body.com;
  Vector6d twist = velocity;
  twist.head<3>() += velocity.tail<3>().cross(arm);
  // The power of the balancing torques is opposite to that of the force.
  EXPECT_TRUE(MatrixNear(columns.transpose() * motion_.qd, -twist, 1e-12 * (1.0 + twist.norm())));
}

INSTANTIATE_TEST_SUITE_P(Robots, TorqueRegressorTest, ::testing::Range(0, 6));

TEST(TorqueRegressor, ABaseThatAcceleratesUpwardsIsGravity) {
  const RobotModel model = Panda();
  std::mt19937 random(3);
  const Motion motion = DrawMotion(model.num_joints(), &random);
  TorqueRegressor regressor(model);
  BaseMotion base;
  base.a = -0.5 * model.gravity();
  regressor.SetMotion(motion.q, motion.qd, motion.qdd, base);
  VectorXd torques(model.num_joints());
  regressor.CalcTorques(torques);
  RobotSpec heavy = model.spec();
  heavy.gravity *= 1.5;
  EXPECT_TRUE(MatrixNear(torques, CalcTorques(RobotModel(heavy), motion), 1e-11));
}

TEST(TorqueRegressor, BodiesArePackedWithoutLoss) {
  const MassProperties body = Panda().joint(3).body;
  const MassProperties back = TorqueRegressor::Unpack(TorqueRegressor::Pack(body));
  EXPECT_DOUBLE_EQ(back.mass, body.mass);
  EXPECT_TRUE(MatrixNear(back.com, body.com, 1e-15));
  EXPECT_TRUE(MatrixNear(back.inertia, body.inertia, 1e-15));
}

}  // namespace
}  // namespace dexcheck::testing::torque_regressor_test
