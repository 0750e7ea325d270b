#include "controller/grasp/grasp_force.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <string>

#include "controller/common/errors.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/grasp/random_grasp.h"

namespace dexcheck::testing::grasp_force_test {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

// A cone or bound may be violated by the rounding of f_c alone: forces of at most 100 N.
constexpr double kConeTolerance = 100.0 * kEps;

GraspForceResult SolveCold(const GraspForceProblem& problem, const GraspForceOptions& options = {}) {
  return GraspForceSolver(problem.num_contacts(), options).Solve(problem);
}

// A feasible random problem.
GraspForceProblem MakeFeasibleProblem(std::mt19937_64& random, int num_contacts) {
  for (;;) {
    GraspForceProblem problem = MakeRandomGraspForceProblem(random, num_contacts);
    const GraspForceStatus status = SolveCold(problem).status;
    if (status == GraspForceStatus::kOptimal) return problem;
  }
}

// Value of the barrier objective; infinite outside cones and bounds.
double CalcBarrierObjective(const GraspForceProblem& problem, double rho, const VectorXd& f_c) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const Vector3d f = f_c.segment<3>(3 * i);
    const double mu_f3 = problem.mu[i] * f.z();
    Matrix2d P;
    P << mu_f3 + f.x(), f.y(), f.y(), mu_f3 - f.x();
    const double slacks = (f.z() - problem.f_min[i]) * (problem.f_max[i] - f.z());
    if (mu_f3 <= 0.0 || P.determinant() <= 0.0 || slacks <= 0.0)
      return std::numeric_limits<double>::infinity();
    sum += f.z() - rho * (std::log(P.determinant()) + std::log(slacks));
  }
  return sum;
}

// Minimum of the barrier objective from a feasible interior point, by damped Newton steps in null(G) (27)
// with derivatives of log det written out: shares nothing with the solver.
VectorXd MinimiseBarrier(const GraspForceProblem& problem, double rho, VectorXd f_c) {
  const MatrixXd Z = CalcNullspace(problem.G);
  for (int iteration = 0; iteration < 100; ++iteration) {
    VectorXd gradient = VectorXd::Zero(f_c.size());
    MatrixXd hessian = MatrixXd::Zero(f_c.size(), f_c.size());
    for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
      const Vector3d f = f_c.segment<3>(3 * i);
      const Vector3d J(-1.0, -1.0, problem.mu[i] * problem.mu[i]);
      const double det = f.dot(J.cwiseProduct(f));
      const Vector3d d_det = 2.0 * J.cwiseProduct(f);
      const double lower = f.z() - problem.f_min[i];
      const double upper = problem.f_max[i] - f.z();
      Matrix3d H = d_det * d_det.transpose() / (det * det);
      H.diagonal() -= 2.0 * J / det;
      H(2, 2) += 1.0 / (lower * lower) + 1.0 / (upper * upper);
      gradient.segment<3>(3 * i) = -rho * d_det / det;
      gradient[3 * i + 2] += 1.0 - rho * (1.0 / lower - 1.0 / upper);
      hessian.block<3, 3>(3 * i, 3 * i) = rho * H;
    }
    const VectorXd step = -Z * SolveDense(Z.transpose() * hessian * Z, Z.transpose() * gradient);
    const double value = CalcBarrierObjective(problem, rho, f_c);
    double length = 1.0;
    while (CalcBarrierObjective(problem, rho, f_c + length * step) > value && length > kEps) length *= 0.5;
    f_c += length * step;
  }
  return f_c;
}

TEST(GraspForceHandWorked, ThreeContactsCarryAWeightNearTheConesEdge) {
  // Three contacts every 120 degrees on the equator carry the weight F along z. sum f_i3 >= sum |f_it| / mu
  // >= F / mu; the objective exceeds that by less than 4 N rho.
  constexpr double kWeight = 1.962;
  constexpr double kMu = 0.5;
  GraspForceProblem problem = MakeEquatorGraspForceProblem(3, kMu);
  problem.F_o[2] = kWeight;
  for (const double rho : {0.1, 1e-3, 1e-5}) {
    GraspForceOptions options;
    options.barrier_weight = rho;
    const GraspForceResult result = SolveCold(problem, options);
    ASSERT_EQ(result.status, GraspForceStatus::kOptimal);
    EXPECT_GT(result.objective, kWeight / kMu);
    EXPECT_LT(result.objective, kWeight / kMu + 12.0 * rho);
  }
}

TEST(GraspForceHandWorked, BarrierBalancesWeightAgainstDistance) {
  // By symmetry each contact minimises f3 - rho [log((mu f3)^2 - t^2) + log f3 + log(f_max - f3)], t = F / 3.
  constexpr double kWeight = 1.962;
  constexpr double kMu = 0.5;
  GraspForceProblem problem = MakeEquatorGraspForceProblem(3, kMu);
  problem.F_o[2] = kWeight;
  const GraspForceOptions options;
  const GraspForceResult result = SolveCold(problem, options);
  ASSERT_EQ(result.status, GraspForceStatus::kOptimal);
  const double t = kWeight / 3.0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double f3 = result.f_c[3 * i + 2];
    EXPECT_GT(kMu * f3, t);
    const double derivative =
        1.0 - options.barrier_weight * (2.0 * kMu * kMu * f3 / (kMu * kMu * f3 * f3 - t * t) + 1.0 / f3 -
                                        1.0 / (problem.f_max[i] - f3));
    // Measured 4e-15: the last Newton step, far smaller than slack_tolerance asks for, left rounding only.
    EXPECT_NEAR(derivative, 0.0, 4e-14 * TolScale());
    EXPECT_NEAR(result.f_c[3 * i], 0.0, 10.0 * kEps * TolScale());
    EXPECT_NEAR(result.f_c[3 * i + 1], -t, 10.0 * kEps * TolScale());
  }
}

TEST(GraspForceHandWorked, LimitOfTheFingersIsCertified) {
  // Three fingers of 10 N and mu = 0.5 lift 15 N and not a gram more.
  GraspForceProblem problem = MakeEquatorGraspForceProblem(3, 0.5);
  problem.f_max.setConstant(10.0);
  problem.F_o[2] = 14.999;
  EXPECT_EQ(SolveCold(problem).status, GraspForceStatus::kOptimal);
  problem.F_o[2] = 15.001;
  const GraspForceResult result = SolveCold(problem);
  ASSERT_EQ(result.status, GraspForceStatus::kInfeasible);
  EXPECT_EQ(result.f_c, VectorXd::Zero(9));
  const Vector6d y = result.y;
  EXPECT_GT(CalcSeparation(problem, y), 0.0);
  EXPECT_LE(CalcSeparation(problem, y), 0.001 + kConeTolerance);
  EXPECT_LT(CalcSeparation(problem, -y), 0.0) << "the opposite direction proves nothing";
}

TEST(GraspForceBarrier, AgreesWithNewtonInTheNullSpace) {
  std::mt19937_64 random(1);
  for (const int num_contacts : {3, 4, 5, 8, 11}) {
    for (int sample = 0; sample < 10; ++sample) {
      const GraspForceProblem problem = MakeFeasibleProblem(random, num_contacts);
      GraspForceOptions options;
      const GraspForceResult result = SolveCold(problem, options);
      ASSERT_EQ(result.status, GraspForceStatus::kOptimal);
      // Another interior point to start from: the optimum for a rho ten times as large.
      options.barrier_weight = 1.0;
      const GraspForceResult start = SolveCold(problem, options);
      ASSERT_EQ(start.status, GraspForceStatus::kOptimal);
      ASSERT_GT((start.f_c - result.f_c).norm(), 1e-3);
      const VectorXd expected = MinimiseBarrier(problem, 0.1, start.f_c);
      // slack_tolerance of 1e-5 relative to slacks of a few newtons: measured 2.6e-6 N.
      EXPECT_TRUE(MatrixNear(result.f_c, expected, 2.6e-5));
      EXPECT_NEAR(CalcBarrierObjective(problem, 0.1, result.f_c),
                  CalcBarrierObjective(problem, 0.1, expected),
                  result.duality_gap + 1e-10 * result.objective);
    }
  }
}

TEST(GraspForceSolver, FollowsAMovingGraspAsIfStartedAnew) {
  std::mt19937_64 random(6);
  for (const int num_contacts : {4, 8, 10}) {
    GraspForceProblem problem = MakeFeasibleProblem(random, num_contacts);
    GraspForceSolver solver(num_contacts);
    int cold_iterations = 0;
    int warm_iterations = 0;
    for (int step = 0; step < 200; ++step) {
      const GraspForceResult expected = SolveCold(problem);
      const GraspForceResult& result = solver.Solve(problem);
      ASSERT_EQ(result.status, expected.status);
      if (expected.status != GraspForceStatus::kOptimal) break;
      EXPECT_EQ(result.warm_started, step > 0);
      // Both within their gaps.
      EXPECT_NEAR(result.objective, expected.objective, 2e-6 * TolScale() * expected.objective);
      if (step > 0) {
        cold_iterations += expected.iterations;
        warm_iterations += result.iterations;
      }
      MoveGrasp(random, problem);
    }
    EXPECT_GT(warm_iterations, 0);
    EXPECT_LT(warm_iterations, 0.3 * cold_iterations);
  }
}

TEST(GraspForceSolver, RecoversAfterAnInfeasibleProblem) {
  std::mt19937_64 random(7);
  GraspForceProblem problem = MakeFeasibleProblem(random, 4);
  GraspForceSolver solver(4);
  const VectorXd f_c = solver.Solve(problem).f_c;
  GraspForceProblem impossible = problem;
  impossible.F_o[2] = 1000.0;
  EXPECT_EQ(solver.Solve(impossible).status, GraspForceStatus::kInfeasible);
  const GraspForceResult& again = solver.Solve(problem);
  EXPECT_FALSE(again.warm_started);
  EXPECT_EQ(again.f_c, f_c);
  solver.Solve(problem);
  EXPECT_TRUE(again.warm_started);
  solver.Reset();
  solver.Solve(problem);
  EXPECT_FALSE(again.warm_started);
  EXPECT_EQ(again.f_c, f_c);
}

TEST(GraspForceErrors, NameTheValue) {
  EXPECT_THAT([] { GraspForceSolver solver(2); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("num_contacts")));
  GraspForceOptions options;
  options.barrier_weight = 0.0;
  EXPECT_THAT([&] { GraspForceSolver solver(4, options); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("barrier_weight")));

  GraspForceSolver solver(4);
  const auto ExpectError = [&](const std::string& text, auto change) {
    GraspForceProblem problem = MakeEquatorGraspForceProblem(4, 0.5);
    change(problem);
    EXPECT_THAT([&] { solver.Solve(problem); }, ThrowsMessage<std::invalid_argument>(HasSubstr(text)));
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ExpectError("mu[2]: must be positive, got 0", [](GraspForceProblem& p) { p.mu[2] = 0.0; });
  ExpectError("mu[0]: must be positive, got -0.5", [](GraspForceProblem& p) { p.mu[0] = -0.5; });
  ExpectError("G(4, 7): must be finite", [](GraspForceProblem& p) { p.G(4, 7) = kNan; });
  ExpectError("F_o(5, 0): must be finite", [](GraspForceProblem& p) { p.F_o[5] = -kInfinity; });
  ExpectError("f_max(1, 0): must be finite", [](GraspForceProblem& p) { p.f_max[1] = kInfinity; });
  ExpectError("f_max[3]: must be above f_min", [](GraspForceProblem& p) { p.f_max[3] = p.f_min[3]; });
  ExpectError("f_min[1]: must not be negative", [](GraspForceProblem& p) { p.f_min[1] = -1.0; });
  ExpectError("problem", [](GraspForceProblem& p) { p = MakeEquatorGraspForceProblem(5, 0.5); });
}

TEST(GraspForceErrors, ContactsOnAnyLineAreSingular) {
  // Random lines, seen from object frames near and far, in m, mm and km. F_o can be given, so that nothing
  // else stops the solver.
  std::mt19937_64 random(5);
  std::map<int, GraspForceSolver> solvers;
  for (int n = 3; n < 12; ++n) solvers.try_emplace(n, n);
  for (const double offset : {0.0, 0.1, 1.0, 10.0}) {
    for (const double unit : {1.0, 1e3, 1e-3}) {
      for (int sample = 0; sample < 100; ++sample) {
        const int n = 3 + sample % 9;
        GraspForceProblem problem = MakeRandomLineGrasp(random, n, offset, unit).problem;
        problem.F_o = problem.G * VectorXd::Ones(3 * n);
        GraspForceSolver& solver = solvers.at(n);
        ASSERT_THROW(solver.Solve(problem), SingularityError) << "offset " << offset << ", unit " << unit;
      }
    }
  }
}

TEST(GraspForceErrors, BoundsOfVeryDifferentSizesAreNot) {
  // Without the third contact the grasp has rank 5, and the third gives a ten-thousandth of what the others
  // do. Its determinant looks singular; G is not.
  GraspForceProblem problem = MakeEquatorGraspForceProblem(3, 0.5);
  problem.f_max[2] = 1e-4;
  GraspForceSolver solver(3);
  EXPECT_EQ(solver.Solve(problem).status, GraspForceStatus::kOptimal);
}

}  // namespace
}  // namespace dexcheck::testing::grasp_force_test
