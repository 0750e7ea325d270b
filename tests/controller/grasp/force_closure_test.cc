#include "controller/grasp/force_closure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "controller/grasp/grasp_force.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/grasp/random_grasp.h"

namespace dexcheck::testing::force_closure_test {
namespace {

ForceClosureOptions MakeOptions(ForceNormalization normalization) {
  ForceClosureOptions options;
  options.normalization = normalization;
  return options;
}

// Whether normalised contact forces can give the wrench F_o: decided by the interior-point solver, with f_i3
// <= 1 as bounds or sum f_i3 <= 1 as a limit.
bool CanGive(const GraspForceProblem& grasp, const Vector6d& F_o, ForceNormalization normalization) {
  const int n = grasp.num_contacts();
  GraspForceProblem problem(n, 1);
  problem.G = grasp.G;
  problem.mu = grasp.mu;
  problem.F_o = F_o;
  problem.f_max.setOnes();
  for (Eigen::Index i = 0; i < n; ++i) problem.A(0, 3 * i + 2) = 1.0;
  problem.a_min[0] = -1.0;
  problem.a_max[0] = normalization == ForceNormalization::kTotalNormal ? 1.0 : 2.0 * n;
  GraspForceSolver solver(n, 1);
  const GraspForceStatus status = solver.Solve(problem).status;
  EXPECT_NE(status, GraspForceStatus::kNotConverged);
  return status == GraspForceStatus::kOptimal;
}

class ForceClosure : public ::testing::TestWithParam<ForceNormalization> {};

TEST_P(ForceClosure, MarginIsWhereTheForceSolverGivesUp) {
  std::mt19937_64 random(1);
  const ForceClosureOptions options = MakeOptions(GetParam());
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
      EXPECT_FALSE(CanGive(grasp, 1e-3 * result.direction, GetParam()));
      EXPECT_EQ(result.margin_lower, 0.0);
      continue;
    }
    ++closed;
    EXPECT_GT(result.margin_lower, 0.0);
    EXPECT_LE(result.margin - result.margin_lower, options.tolerance * result.margin);
    EXPECT_NEAR(result.margin, CalcWrenchSupport(grasp.G, grasp.mu, scaled, options), 1e-12);
    // The functional `direction` bounds the wrenches on its own axis.
    EXPECT_FALSE(CanGive(grasp, 1.001 * result.margin * result.direction, GetParam()));
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 30; ++trial) {
      Vector6d n;
      for (double& entry : n) entry = normal(random);
      n.normalize();
      EXPECT_GE(CalcWrenchSupport(grasp.G, grasp.mu, n, options), result.margin_lower);
      n.tail<3>() *= options.length;
      EXPECT_TRUE(CanGive(grasp, 0.999 * result.margin_lower * n, GetParam()));
    }
  }
  EXPECT_GT(closed, 10);
  EXPECT_LT(closed, 60);
}

TEST_P(ForceClosure, DescentOverDirectionsFindsNothingWeaker) {
  // An independent minimisation of the support function over the unit sphere: descent along its numerical
  // gradient, from random directions and from around the direction found. At a kink it may stop early.
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  const ForceClosureOptions options = MakeOptions(GetParam());
  int closed = 0;
  while (closed < 8) {
    const GraspForceProblem grasp = MakeRandomGraspForceProblem(random, 5);
    const ForceClosureResult result = CalcForceClosure(grasp.G, grasp.mu, options);
    if (result.status != ForceClosureStatus::kForceClosure || result.margin < 0.02) continue;
    ++closed;
    const auto CalcSupport = [&](const Vector6d& n) {
      return CalcWrenchSupport(grasp.G, grasp.mu, n, options);
    };
    double best = std::numeric_limits<double>::infinity();
    for (int start = 0; start < 30; ++start) {
      Vector6d n;
      for (double& entry : n) entry = normal(random);
      if (start % 2 == 0) {
        n = 0.05 * n + result.direction;
        n.tail<3>() += (1.0 / options.length - 1.0) * result.direction.tail<3>();
      }
      n.normalize();
      double support = CalcSupport(n);
      for (double step = 0.3; step > 1e-5;) {
        Vector6d gradient;
        for (Eigen::Index k = 0; k < 6; ++k) {
          const Vector6d h = 1e-6 * Vector6d::Unit(k);
          gradient[k] = (CalcSupport(n + h) - CalcSupport(n - h)) / 2e-6;
        }
        gradient -= gradient.dot(n) * n;
        const Vector6d trial = (n - step * gradient.normalized()).normalized();
        const double trial_support = CalcSupport(trial);
        if (trial_support < support) {
          support = trial_support;
          n = trial;
        } else {
          step *= 0.7;
        }
      }
      best = std::min(best, support);
    }
    EXPECT_GE(best, result.margin_lower);
    EXPECT_LE(best, 1.2 * result.margin) << "a descent that stops far away would prove nothing";
  }
}

INSTANTIATE_TEST_SUITE_P(Both, ForceClosure,
                         ::testing::Values(ForceNormalization::kTotalNormal,
                                           ForceNormalization::kLargestNormal),
                         [](const auto& info) {
                           return info.param == ForceNormalization::kTotalNormal ? "TotalNormal"
                                                                                 : "LargestNormal";
                         });

TEST(ForceClosureHandWorked, FourContactsOnTheEquator) {
  // With f_i3 <= 1 the weakest direction is a moment about x (or y): only the two contacts on the other axis
  // have a lever, the torus's outer radius, and give it by friction: 2 mu (R + r) / length.
  constexpr double kMu = 0.8;
  const GraspForceProblem grasp = MakeEquatorGraspForceProblem(4, kMu);
  const ForceClosureOptions options = MakeOptions(ForceNormalization::kLargestNormal);
  const double expected = 2.0 * kMu * (testing::kTorusRadius + testing::kTubeRadius) / options.length;
  const ForceClosureResult result = CalcForceClosure(grasp.G, grasp.mu, options);
  EXPECT_EQ(result.status, ForceClosureStatus::kForceClosure);
  EXPECT_LE(result.margin_lower, expected);
  EXPECT_GE(result.margin, expected * (1.0 - 1e-12));
  EXPECT_LE(result.margin - result.margin_lower, options.tolerance * result.margin);
  EXPECT_LT(result.direction.head<3>().norm(), 0.1);
  EXPECT_LT(std::abs(result.direction[5]), 0.1 * options.length);
}

TEST(ForceClosureHandWorked, CharacteristicLengthWeighsMoments) {
  // The same grasp: doubling the length halves the margin as long as a moment is the weakest direction.
  const GraspForceProblem grasp = MakeEquatorGraspForceProblem(4, 0.8);
  ForceClosureOptions options = MakeOptions(ForceNormalization::kLargestNormal);
  const double margin = CalcForceClosure(grasp.G, grasp.mu, options).margin;
  options.length *= 2.0;
  EXPECT_NEAR(CalcForceClosure(grasp.G, grasp.mu, options).margin, 0.5 * margin,
              2.0 * options.tolerance * margin);
}

TEST(ForceClosureHandWorked, TwoHardFingersCannotResistTheirAxis) {
  // No moment about the line through two point contacts, here x.
  Matrix6Xd G(6, 6);
  G << testing::CalcContactColumns(testing::CalcTorusContact(0.0, 0.0, 0.0)),
      testing::CalcContactColumns(testing::CalcTorusContact(kPi, 0.0, 0.0));
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
    G.middleCols<3>(3 * i) = testing::CalcContactColumns(
        testing::CalcTorusContact(0.5 * kPi * static_cast<double>(i), 0.5 * kPi, 0.0));
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
        const testing::LineGrasp grasp = testing::MakeRandomLineGrasp(random, 3 + sample % 4, offset, unit);
        ForceClosureOptions options;
        options.length *= unit;
        const Matrix6Xd& G = grasp.problem.G;
        const ForceClosureResult result = CalcForceClosure(G, grasp.problem.mu, options);
        ASSERT_EQ(result.status, ForceClosureStatus::kNotForceClosure);
        ASSERT_EQ(result.num_vertices, 0) << "offset " << offset << ", unit " << unit;
        ASSERT_EQ(result.margin, 0.0);

        // As a functional on [force; moment / length] the direction is, up to its sign, the moment about the
        // line.
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
  // The same grasps with one contact a micrometre off the line, as seen from the middle of the line or
  // nearby.
  std::mt19937_64 random(4);
  for (const double unit : kUnits) {
    for (int sample = 0; sample < 100; ++sample) {
      testing::LineGrasp grasp = testing::MakeRandomLineGrasp(random, 3 + sample % 4, 0.1, unit);
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

TEST(ForceClosureErrors, NameTheValue) {
  const GraspForceProblem grasp = MakeEquatorGraspForceProblem(4, 0.5);
  const auto Call = [&](const Matrix6Xd& G, const VectorXd& mu, const ForceClosureOptions& options) {
    return [=] { CalcForceClosure(G, mu, options); };
  };
  const ForceClosureOptions options;
  ForceClosureOptions no_length;
  no_length.length = 0.0;
  Matrix6Xd G = grasp.G;
  EXPECT_THAT(Call(G, VectorXd::Zero(4), options),
              ThrowsMessage<std::invalid_argument>(HasSubstr("mu: must be positive")));
  EXPECT_THAT(Call(G, VectorXd::Ones(3), options),
              ThrowsMessage<std::invalid_argument>(HasSubstr("G: must have three")));
  EXPECT_THAT(Call(G, grasp.mu, no_length), ThrowsMessage<std::invalid_argument>(HasSubstr("length")));
  G(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Call(G, grasp.mu, options),
              ThrowsMessage<std::invalid_argument>(HasSubstr("G: must be finite")));
}

}  // namespace
}  // namespace dexcheck::testing::force_closure_test
