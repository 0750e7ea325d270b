#include "controller/grasp/force_closure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "controller/grasp/grasp_force.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/grasp/random_grasp.h"

namespace dexcheck::testing::force_closure_test {
namespace {

// Whether contact forces with sum f_i3 <= 1 can give the wrench F_o: by the interior-point solver, whose
// optimum with a tiny barrier is the least sum of normal forces to 4 N rho.
bool CanGive(const GraspForceProblem& grasp, const Vector6d& F_o) {
  GraspForceProblem problem = grasp;
  problem.F_o = F_o;
  problem.f_min.setZero();
  problem.f_max.setOnes();
  GraspForceOptions options;
  options.barrier_weight = 1e-6;
  GraspForceSolver solver(grasp.num_contacts(), options);
  const GraspForceResult& result = solver.Solve(problem);
  EXPECT_NE(result.status, GraspForceStatus::kNotConverged);
  return result.status == GraspForceStatus::kOptimal && result.objective <= 1.0;
}

// Largest n^T [force; moment / length] of the wrenches of normalised contact forces: a contact gives most
// with its force on the cone's boundary.
double CalcSupport(const GraspForceProblem& grasp, const Vector6d& n) {
  Vector6d functional = n;
  functional.tail<3>() /= ForceClosureOptions().length;
  double most = 0.0;
  for (Eigen::Index i = 0; i < grasp.num_contacts(); ++i) {
    const Vector3d g = grasp.G.middleCols<3>(3 * i).transpose() * functional;
    most = std::max(most, g.z() + grasp.mu[i] * g.head<2>().norm());
  }
  return most;
}

TEST(ForceClosure, MarginIsWhereTheForceSolverGivesUp) {
  std::mt19937_64 random(1);
  const ForceClosureOptions options;
  int closed = 0;
  for (int sample = 0; sample < 60; ++sample) {
    const GraspForceProblem grasp = MakeRandomGraspForceProblem(random, 4 + sample % 3);
    const ForceClosureResult result = CalcForceClosure(grasp.G, grasp.mu, options);
    ASSERT_NE(result.status, ForceClosureStatus::kUndecided);
    Vector6d scaled = result.direction;
    scaled.tail<3>() /= options.length;
    ASSERT_NEAR(scaled.norm(), 1.0, 1e-12);
    if (result.status == ForceClosureStatus::kNotForceClosure) {
      // Not even a thousandth of the direction.
      EXPECT_FALSE(CanGive(grasp, 1e-3 * result.direction));
      EXPECT_EQ(result.margin_lower, 0.0);
      continue;
    }
    ++closed;
    EXPECT_GT(result.margin_lower, 0.0);
    EXPECT_LE(result.margin - result.margin_lower, options.tolerance * result.margin);
    EXPECT_NEAR(result.margin, CalcSupport(grasp, scaled), 1e-12);
    // The functional `direction` bounds the wrenches on its own axis.
    EXPECT_FALSE(CanGive(grasp, 1.001 * result.margin * result.direction));
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 30; ++trial) {
      Vector6d n;
      for (double& entry : n) entry = normal(random);
      n.normalize();
      EXPECT_GE(CalcSupport(grasp, n), result.margin_lower);
      n.tail<3>() *= options.length;
      EXPECT_TRUE(CanGive(grasp, 0.999 * result.margin_lower * n));
    }
  }
  EXPECT_GT(closed, 10);
  EXPECT_LT(closed, 60);
}

TEST(ForceClosureHandWorked, FourContactsOnTheEquator) {
  // With sum f_i3 <= 1 a wrench is held as far as the best contact holds it. A length that is long beside the
  // torus makes moments the weakest: the weakest of all is the one about the axis midway between x and y.
  // Each contact has the lever (R + r) / sqrt 2 and gives it by friction, mu (R + r) / (sqrt 2 length).
  constexpr double kMu = 0.8;
  const GraspForceProblem grasp = MakeEquatorGraspForceProblem(4, kMu);
  ForceClosureOptions options;
  options.length = 1.0;
  const double expected = kMu * (kTorusRadius + kTubeRadius) / (std::sqrt(2.0) * options.length);
  const ForceClosureResult result = CalcForceClosure(grasp.G, grasp.mu, options);
  EXPECT_EQ(result.status, ForceClosureStatus::kForceClosure);
  EXPECT_LE(result.margin_lower, expected);
  EXPECT_GE(result.margin, expected * (1.0 - 1e-12));
  EXPECT_LE(result.margin - result.margin_lower, options.tolerance * result.margin);
  EXPECT_LT(result.direction.head<3>().norm(), 0.1);
  EXPECT_LT(std::abs(result.direction[5]), 0.1 * options.length);
}

TEST(ForceClosureHandWorked, TwoHardFingersCannotResistTheirAxis) {
  // No moment about the line through two point contacts, here x.
  Matrix6Xd G(6, 6);
  G << CalcContactColumns(CalcTorusContact(0.0, 0.0, 0.0)),
      CalcContactColumns(CalcTorusContact(kPi, 0.0, 0.0));
  const ForceClosureResult result = CalcForceClosure(G, Vector2d(0.5, 0.5));
  EXPECT_EQ(result.status, ForceClosureStatus::kNotForceClosure);
  EXPECT_EQ(result.margin, 0.0);
  Vector6d expected = Vector6d::Zero();
  expected[3] = std::copysign(ForceClosureOptions().length, result.direction[3]);
  EXPECT_TRUE(MatrixNear(result.direction, expected, 1e-12));
}

TEST(ForceClosureHandWorked, FingersOnOneSideCannotPush) {
  // Four contacts on top press down: no wrench with an upward force beyond what friction lifts.
  const double mu = 0.3;
  Matrix6Xd G(6, 12);
  for (Eigen::Index i = 0; i < 4; ++i) {
    G.middleCols<3>(3 * i) =
        CalcContactColumns(CalcTorusContact(0.5 * kPi * static_cast<double>(i), 0.5 * kPi, 0.0));
  }
  const ForceClosureResult result = CalcForceClosure(G, Eigen::Vector4d::Constant(mu));
  EXPECT_EQ(result.status, ForceClosureStatus::kNotForceClosure);
  EXPECT_GT(result.direction[2], 0.0);
}

// Three times the hand's size to three hundred times, and lengths in m, mm, km.
constexpr double kOffsets[] = {0.0, 0.1, 1.0, 10.0};
constexpr double kUnits[] = {1.0, 1e3, 1e-3};

TEST(ForceClosureRank, ContactsOnOneLineNeverReachThePolytope) {
  std::mt19937_64 random(3);
  for (const double offset : kOffsets) {
    for (const double unit : kUnits) {
      for (int sample = 0; sample < 100; ++sample) {
        const LineGrasp grasp = MakeRandomLineGrasp(random, 3 + sample % 4, offset, unit);
        ForceClosureOptions options;
        options.length *= unit;
        const Matrix6Xd& G = grasp.problem.G;
        const ForceClosureResult result = CalcForceClosure(G, grasp.problem.mu, options);
        ASSERT_EQ(result.status, ForceClosureStatus::kNotForceClosure);
        ASSERT_EQ(result.num_vertices, 0) << "offset " << offset << ", unit " << unit;
        ASSERT_EQ(result.margin, 0.0);

        // The direction, a functional on [force; moment / length], is the moment about the line up to its
        // sign.
        Matrix6Xd scaled = G;
        scaled.bottomRows<3>() /= options.length;
        Vector6d n = result.direction;
        n.tail<3>() /= options.length;
        ASSERT_NEAR(n.norm(), 1.0, 1e-12);
        Vector6d expected = grasp.n;
        expected.tail<3>() *= options.length;
        expected.normalize();
        // Rounding of wrenches: their products with n are sums of six.
        const double rounding = 64.0 * std::numeric_limits<double>::epsilon() * scaled.norm();
        ASSERT_LT((scaled.transpose() * expected).norm(), rounding) << "the grasp is not of rank 5";
        ASSERT_LT((scaled.transpose() * n).norm(), rounding);
      }
    }
  }
}

TEST(ForceClosureRank, ContactsNearlyOnOneLineReachIt) {
  // Grasps with one contact a micrometre off the line, as seen from the middle of the line or nearby.
  std::mt19937_64 random(4);
  for (const double unit : kUnits) {
    for (int sample = 0; sample < 100; ++sample) {
      LineGrasp grasp = MakeRandomLineGrasp(random, 3 + sample % 4, 0.1, unit);
      Matrix6Xd& G = grasp.problem.G;
      const Vector3d aside = 1e-6 * unit * grasp.n.tail<3>().unitOrthogonal();
      G.block<3, 3>(3, 3) += Skew(aside) * G.block<3, 3>(0, 3);
      ForceClosureOptions options;
      options.length *= unit;
      options.max_vertices = 7;  // where it begins
      EXPECT_GE(CalcForceClosure(G, grasp.problem.mu, options).num_vertices, 7);
    }
  }
}

TEST(ForceClosureRank, FrictionThatIsAlmostNoneGivesNoRank) {
  // Without friction four contacts on the equator give three wrenches; the full rank of G does not help.
  const GraspForceProblem grasp = MakeEquatorGraspForceProblem(4, 1e-11);
  const ForceClosureResult result = CalcForceClosure(grasp.G, grasp.mu);
  EXPECT_EQ(result.status, ForceClosureStatus::kNotForceClosure);
  EXPECT_EQ(result.num_vertices, 0);
}

TEST(ForceClosureRank, MuchFrictionTakesNone) {
  // Normal forces count beside a friction of any size: what is far from singular with mu = 1 stays so.
  const GraspForceProblem grasp = MakeEquatorGraspForceProblem(4, 1e11);
  EXPECT_GE(CalcForceClosure(grasp.G, grasp.mu).num_vertices, 7);
}

}  // namespace
}  // namespace dexcheck::testing::force_closure_test
