// From (16) to (17), (18): the reduced terms as projections of the unreduced ones, the blocks of (15) to
// (17), and the skew symmetry of M_dot - 2 C (Property 2).

#include <gtest/gtest.h>

#include "tests/common/finite_difference.h"
#include "tests/common/mass_scaling.h"
#include "tests/common/matrix_near.h"
#include "tests/common/reduction_map.h"
#include "tests/controller/dynamics/robot_cases.h"

namespace dexcheck::testing::reduction_test {
namespace {

// Both sides come from one recursion and differ in the base's columns only: entries scaled to 1 (M), 30 (C),
// 100 (forces). Measured 6e-14.
constexpr double kRounding = 2e-13;
// M_dot by five points: truncation h^4 (d/dt)^5 M / 30, with joint rates that add up to 20 rad/s
// 1e-16 * 3e6 / 30 = 1e-11; rounding of a finger's M, 1e-12, / h = 1e-8. Measured 1.3e-8.
constexpr double kStep = 1e-4;
constexpr double kDifference = 1e-7;
// A wrong formula must miss by far more.
constexpr double kVisible = 1e-3;

/// xi with a base that moves as fast, whatever its v is.
VectorXd DrawReducedVelocities(const RobotModel& model, std::mt19937* random) {
  VectorXd xi = DrawVelocities(model.num_velocities(), random);
  const Base& base = model.base();
  const bool by_wheels =
      base.type == BaseType::kDifferentialDrive && base.velocity == DriveVelocity::kWheelRates;
  if (by_wheels) xi.head<2>() /= base.wheel_radius;
  return xi;
}

/// A robot at a random state, its terms in both coordinates, and S' between them.
struct Evaluation {
  Evaluation(const RobotModel& model, std::mt19937* random)
      : q(DrawPositions(model, random)),
        xi(DrawReducedVelocities(model, random)),
        map(CalcReductionMap(model, q, xi)),
        reduced(model, Coordinates::kReduced),
        unreduced(model, Coordinates::kUnreduced) {
    reduced.SetState(q, xi);
    reduced.CalcDynamics();
    unreduced.SetState(q, map.S * xi);
    unreduced.CalcDynamics();
  }
  VectorXd q;
  VectorXd xi;
  ReductionMap map;
  ModelTerms reduced;
  ModelTerms unreduced;
};

double FindLargest(const MatrixXd& matrix) { return matrix.cwiseAbs().maxCoeff(); }

class Reduction : public ::testing::TestWithParam<RobotCase> {
 protected:
  static constexpr int kStates = 5;
  const RobotModel& model_ = GetParam().model;
  const bool constrained_ = model_.base().type == BaseType::kDifferentialDrive;
  std::mt19937 random_{1718};
};

INSTANTIATE_TEST_SUITE_P(Robots, Reduction, ::testing::ValuesIn(MakeRobotCases(317)), NameOf);

// M_bar' = S'^T M S',  C_bar' = S'^T C S' + S'^T M S'_dot,  F_bar' = S'^T F   (14), (18)
TEST_P(Reduction, ReducedTermsAreProjections) {
  for (int state = 0; state < kStates; ++state) {
    const Evaluation at(model_, &random_);
    const MatrixXd& S = at.map.S;
    const MatrixXd& M = at.unreduced.M();
    const MatrixXd M_bar = S.transpose() * M * S;
    const MatrixXd C_bar = S.transpose() * (at.unreduced.C() * S + M * at.map.S_dot);
    const VectorXd gravity = S.transpose() * at.unreduced.gravity();
    const VectorXd friction = S.transpose() * at.unreduced.friction();
    ASSERT_GT(FindLargest(ScaleByMass(C_bar, M_bar)), 0.1);
    ASSERT_GT(ScaleForceByMass(gravity, M_bar).norm(), 1.0);
    ASSERT_GT(ScaleForceByMass(friction, M_bar).norm(), 0.1);
    const auto scale = [&](const MatrixXd& X) { return ScaleByMass(X, M_bar); };
    const auto scale_force = [&](const VectorXd& f) { return ScaleForceByMass(f, M_bar); };
    EXPECT_TRUE(MatrixNear(scale(at.reduced.M()), scale(M_bar), kRounding)) << "M_bar'";
    EXPECT_TRUE(MatrixNear(scale(at.reduced.C()), scale(C_bar), kRounding)) << "C_bar'";
    EXPECT_TRUE(MatrixNear(scale_force(at.reduced.gravity()), scale_force(gravity), kRounding)) << "gravity";
    EXPECT_TRUE(MatrixNear(scale_force(at.reduced.friction()), scale_force(friction), kRounding))
        << "friction";
    if (!constrained_) continue;
    // Without S'^T M S'_dot, or with its sign turned, C_bar' is another matrix.
    const MatrixXd without_S_dot = S.transpose() * at.unreduced.C() * S;
    EXPECT_GT(FindLargest(scale(at.reduced.C() - without_S_dot)), kVisible);
  }
}

// The recursive Newton-Euler equations give C's product with the velocity, without C; M, gravity and friction
// are the same to the last bit.
TEST(NewtonEuler, GivesTheProductOfC) {
  std::mt19937 random(1720);
  std::vector<RobotCase> cases = MakeRobotCases(318);
  for (const BaseType base : {BaseType::kFixed, BaseType::kFloating}) {
    const RandomRobotOptions options{.base = base, .joints = 30, .prismatic = 0.2, .ball = 0.3};
    cases.push_back({"Balls", RobotModel(MakeRandomRobot(options, &random))});
  }
  for (const RobotCase& robot : cases) {
    SCOPED_TRACE(robot.name);
    ModelTerms whole(robot.model), recursive(robot.model);
    for (int state = 0; state < 5; ++state) {
      const VectorXd q = DrawPositions(robot.model, &random);
      const VectorXd xi = DrawVelocities(whole.size(), &random);
      whole.SetState(q, xi);
      whole.CalcDynamics();
      recursive.SetState(q, xi);
      recursive.CalcMassAndCoriolis();
      EXPECT_EQ(recursive.M(), whole.M());
      EXPECT_EQ(recursive.gravity(), whole.gravity());
      EXPECT_EQ(recursive.friction(), whole.friction());
      const VectorXd expected = ScaleForceByMass(whole.C() * xi, whole.M());
      ASSERT_GT(expected.norm(), 0.1);
      EXPECT_TRUE(MatrixNear(ScaleForceByMass(recursive.coriolis(), whole.M()), expected, kRounding));
    }
  }
  const RobotModel drive = ReadPaperRobot();
  ModelTerms unreduced(drive, Coordinates::kUnreduced);
  EXPECT_THROW(unreduced.CalcMassAndCoriolis(), std::invalid_argument);
}

// Neither where the robot stands nor where it looks changes M_bar' and C_bar', to the last bit, nor gravity's
// part of F_bar' when gravity is vertical.
TEST(PlatformPose, IsCyclic) {
  std::mt19937 random(1719);
  int drives = 0;
  for (const RobotCase& robot : MakeRobotCases(317)) {
    if (robot.model.base().type != BaseType::kDifferentialDrive) continue;
    ++drives;
    SCOPED_TRACE(robot.name);
    RobotSpec spec = robot.model.spec();
    spec.gravity = Vector3d(0.0, 0.0, -9.81);
    const RobotModel model(spec);
    ModelTerms here(model);
    ModelTerms there(model);
    VectorXd q = DrawPositions(model, &random);
    const VectorXd xi = DrawReducedVelocities(model, &random);
    here.SetState(q, xi);
    here.CalcDynamics();
    q.head<3>() += Vector3d(1e7, -3e6, 1.0);
    there.SetState(q, xi);
    there.CalcDynamics();
    EXPECT_TRUE(here.M() == there.M());
    EXPECT_TRUE(here.C() == there.C());
    EXPECT_TRUE(MatrixNear(ScaleForceByMass(there.gravity(), here.M()),
                           ScaleForceByMass(here.gravity(), here.M()), kRounding));
    // The first joint's angle is not cyclic.
    q[3] += 1e-3;
    there.SetState(q, xi);
    there.CalcDynamics();
    EXPECT_FALSE(here.M() == there.M());
  }
  EXPECT_EQ(drives, 4);
}

/// M_dot of given terms along q_dot, by differences.
MatrixXd CalcMassMatrixRate(ModelTerms* terms, const VectorXd& q, const VectorXd& q_dot,
                            const VectorXd& velocity) {
  return Differentiate(
      [&](double t) -> MatrixXd {
        terms->SetState(q + t * q_dot, velocity);
        terms->CalcDynamics();
        return terms->M();
      },
      kStep);
}

TEST_P(Reduction, MassMatrixRateMinusTwiceCIsSkew) {
  for (int state = 0; state < kStates; ++state) {
    const Evaluation at(model_, &random_);
    const VectorXd q_dot = at.map.S * at.xi;
    for (const ModelTerms* terms : {&at.unreduced, &at.reduced}) {
      const bool is_reduced = terms == &at.reduced;
      const VectorXd& velocity = is_reduced ? at.xi : q_dot;
      ModelTerms moving(model_, is_reduced ? Coordinates::kReduced : Coordinates::kUnreduced);
      const MatrixXd M_dot = CalcMassMatrixRate(&moving, at.q, q_dot, velocity);
      const auto symmetric_part = [&](const MatrixXd& C) {
        const MatrixXd N = M_dot - 2.0 * C;
        return ScaleByMass(N + N.transpose(), terms->M());
      };
      ASSERT_GT(FindLargest(ScaleByMass(M_dot, terms->M())), 0.1);
      EXPECT_TRUE(
          MatrixNear(symmetric_part(terms->C()), MatrixXd::Zero(terms->size(), terms->size()), kDifference))
          << (is_reduced ? "reduced" : "unreduced");

      // Another C with the same C velocity has the same motion, but not Property 2.
      VectorXd normal = VectorXd::Zero(terms->size());
      normal[0] = velocity[1];
      normal[1] = -velocity[0];
      const MatrixXd other = terms->C() + terms->M().col(0) * normal.transpose();
      ASSERT_LT(((other - terms->C()) * velocity).norm(), 1e-10);
      EXPECT_GT(FindLargest(symmetric_part(other)), kVisible);
    }
    if (!constrained_) continue;
    // S'^T C S' alone lacks S'^T M S'_dot.
    ModelTerms moving(model_);
    const MatrixXd M_bar_dot = CalcMassMatrixRate(&moving, at.q, q_dot, at.xi);
    const MatrixXd N = M_bar_dot - 2.0 * at.map.S.transpose() * at.unreduced.C() * at.map.S;
    EXPECT_GT(FindLargest(ScaleByMass(N + N.transpose(), at.reduced.M())), kVisible);
  }
}

}  // namespace
}  // namespace dexcheck::testing::reduction_test
