// The analytic model against the engine on random robots: every kind of base, joint and branching.

#include "harness/engine/engine_terms.h"

#include <gtest/gtest.h>

#include "tests/common/matrix_near.h"
#include "tests/common/random_robot.h"

namespace dexcheck {
namespace {

using testing::DrawPositions;
using testing::DrawVelocities;
using testing::MatrixNear;
using testing::RandomRobotOptions;

struct Case {
  const char* name;
  RandomRobotOptions options;
};

std::vector<Case> MakeCases() {
  std::vector<Case> cases;
  const auto add = [&](const char* name, BaseType base, DriveVelocity velocity, bool free_joint,
                       double branching) {
    RandomRobotOptions options;
    options.base = base;
    options.velocity = velocity;
    options.planar_by_free_joint = free_joint;
    options.branching = branching;
    cases.push_back({name, options});
  };
  add("FixedChain", BaseType::kFixed, DriveVelocity::kTwist, true, 0.0);
  add("FixedTree", BaseType::kFixed, DriveVelocity::kTwist, true, 0.4);
  add("PlanarFreeJoint", BaseType::kPlanar, DriveVelocity::kTwist, true, 0.3);
  add("PlanarSlides", BaseType::kPlanar, DriveVelocity::kTwist, false, 0.3);
  add("DriveTwist", BaseType::kDifferentialDrive, DriveVelocity::kTwist, true, 0.3);
  add("DriveTwistSlides", BaseType::kDifferentialDrive, DriveVelocity::kTwist, false, 0.3);
  add("DriveWheelRates", BaseType::kDifferentialDrive, DriveVelocity::kWheelRates, true, 0.3);
  return cases;
}

class RandomRobot : public ::testing::TestWithParam<Case> {};

// Measured below 2e-13 relative to the largest entry on these robots (20 joints, reach about 2 m).
constexpr double kRounding = 2e-12;

TEST_P(RandomRobot, AgreesWithEngine) {
  std::mt19937 random(20161);
  for (int trial = 0; trial < 20; ++trial) {
    const RobotSpec spec = testing::MakeRandomRobot(GetParam().options, &random);
    const RobotModel model(spec);
    const MjModelPtr engine =
        LoadMjcfText(testing::WriteMjcf(spec, GetParam().options.planar_by_free_joint), "text");
    const Adapter adapter(model, *engine, "text");
    for (const Coordinates coordinates : {Coordinates::kReduced, Coordinates::kUnreduced}) {
      // In q_dot' of a differential drive the wheels' spin is no holonomic function: only the reduced terms
      // compare.
      if (spec.base.type == BaseType::kDifferentialDrive && coordinates == Coordinates::kUnreduced) continue;
      ModelTerms terms(model, coordinates);
      EngineTerms reference(adapter, coordinates);
      ASSERT_EQ(terms.size(), reference.size());
      const VectorXd q = DrawPositions(model, &random);
      const VectorXd velocity = DrawVelocities(terms.size(), &random);
      terms.SetState(q, velocity);
      terms.CalcDynamics();
      reference.SetState(q, velocity);

      const double M_scale = reference.M().cwiseAbs().maxCoeff();
      EXPECT_TRUE(MatrixNear(terms.M(), reference.M(), kRounding * M_scale)) << "M";
      const VectorXd coriolis = terms.C() * velocity;
      ASSERT_GT(reference.coriolis().norm(), 1e-3);
      EXPECT_TRUE(MatrixNear(coriolis, reference.coriolis(), kRounding * reference.coriolis().norm()))
          << "C velocity";
      EXPECT_TRUE(MatrixNear(terms.gravity(), reference.gravity(), kRounding * reference.gravity().norm()))
          << "gravity";
      EXPECT_TRUE(MatrixNear(terms.friction(), reference.friction(), kRounding * reference.friction().norm()))
          << "friction";

      Matrix6Xd J(6, terms.size());
      Matrix6Xd J_dot(6, terms.size());
      Matrix6Xd J_engine(6, terms.size());
      for (int frame = 0; frame < static_cast<int>(model.frames().size()); ++frame) {
        const Pose X = terms.CalcFramePose(frame);
        EXPECT_TRUE(MatrixNear(X.matrix(), reference.FramePose(frame).matrix(), kRounding)) << "pose";
        terms.CalcFrameJacobian(frame, J, J_dot);
        reference.CalcFrameJacobian(frame, J_engine);
        Matrix6Xd J_world(6, terms.size());
        J_world << X.linear() * J.topRows<3>(), X.linear() * J.bottomRows<3>();
        EXPECT_TRUE(MatrixNear(J_world, J_engine, kRounding)) << "J";
        Vector6d rate;
        Vector6d bias;
        terms.CalcFrameMotion(frame, &rate, &bias);
        EXPECT_TRUE(MatrixNear(rate, J_engine * velocity, 10.0 * kRounding)) << "J velocity";
        const Vector6d bias_engine = reference.CalcFrameBiasAcceleration(frame);
        EXPECT_TRUE(MatrixNear(bias, bias_engine, kRounding * (1.0 + bias_engine.norm())))
            << "J_dot velocity";
      }

      if (spec.base.type == BaseType::kFixed) continue;
      const EnergyAndMomentum energy = terms.CalcEnergyAndMomentum();
      const EnergyAndMomentum& expected = reference.energy_and_momentum();
      EXPECT_NEAR(energy.kinetic, expected.kinetic, kRounding * expected.kinetic);
      EXPECT_NEAR(energy.potential, expected.potential, kRounding * (std::abs(expected.potential) + 100.0));
      EXPECT_TRUE(MatrixNear(energy.linear_momentum, expected.linear_momentum, 100.0 * kRounding));
      EXPECT_TRUE(MatrixNear(energy.angular_momentum, expected.angular_momentum, 100.0 * kRounding));
      EXPECT_TRUE(MatrixNear(energy.com, expected.com, kRounding));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Bases, RandomRobot, ::testing::ValuesIn(MakeCases()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace dexcheck
