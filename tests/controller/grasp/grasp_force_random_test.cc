// Ten thousand random grasps: every answer is checked against the definitions, with nothing of the solver's.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "controller/grasp/grasp_force.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/grasp/random_grasp.h"

namespace dexcheck::testing::grasp_force_random_test {
namespace {

constexpr int kSamples = 10000;
// No cone and no bound violated beyond this, N.
constexpr double kViolation = 1e-9;
// |G f_c - F_o|: the solver's tolerance of 1e-10 relative to |F_o| <= 20 N.
constexpr double kResidual = 20.0 * 1e-10;

void ExpectAdmissible(const GraspForceProblem& problem, const VectorXd& f_c) {
  EXPECT_LE((problem.G * f_c - problem.F_o).lpNorm<Eigen::Infinity>(), kResidual * TolScale());
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const Vector3d f = f_c.segment<3>(3 * i);
    EXPECT_LE(f.head<2>().norm(), problem.mu[i] * f.z() + kViolation);
    EXPECT_GE(f.z(), problem.f_min[i] - kViolation);
    EXPECT_LE(f.z(), problem.f_max[i] + kViolation);
  }
}

class RandomGrasps : public ::testing::TestWithParam<int> {};

TEST_P(RandomGrasps, EveryResultIsProved) {
  std::mt19937_64 random(20);
  GraspForceOptions options;
  options.warm_start = false;
  GraspForceSolver solver(GetParam(), options);
  int feasible = 0;
  int infeasible = 0;
  for (int sample = 0; sample < kSamples; ++sample) {
    SCOPED_TRACE(sample);
    const GraspForceProblem problem = MakeRandomGraspForceProblem(random, GetParam());
    const GraspForceResult& result = solver.Solve(problem);
    ASSERT_NE(result.status, GraspForceStatus::kNotConverged);
    if (result.status == GraspForceStatus::kOptimal) {
      ++feasible;
      ExpectAdmissible(problem, result.f_c);
      double sum = 0.0;
      for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) sum += result.f_c[3 * i + 2];
      EXPECT_NEAR(result.objective, sum, 1e-12 * sum * TolScale());
      EXPECT_LE(result.duality_gap, 1e-7 * std::max(1.0, result.objective));
    } else {
      ++infeasible;
      const Vector6d y = result.y;
      EXPECT_NEAR(y.lpNorm<Eigen::Infinity>(), 1.0, 1e-12);
      EXPECT_GT(CalcSeparation(problem, y), 1e-9);
      EXPECT_LT(CalcSeparation(problem, -y), 0.0) << "the wrong sign must prove nothing";
    }
  }
  EXPECT_GT(feasible, kSamples / 5);
  EXPECT_GT(infeasible, kSamples / 20);
}

INSTANTIATE_TEST_SUITE_P(Contacts, RandomGrasps, ::testing::Values(4, 8),
                         ::testing::PrintToStringParamName());

TEST(RandomGraspsOfThree, SqueezeOrProveThatTheyCannot) {
  // Three contacts and no wrench leave few admissible forces, if any: the hardest problems for the barrier
  // objective.
  std::mt19937_64 random(22);
  GraspForceOptions options;
  options.warm_start = false;
  GraspForceSolver solver(3, options);
  int feasible = 0;
  int slow = 0;
  for (int sample = 0; sample < 5 * kSamples; ++sample) {
    GraspForceProblem problem = MakeRandomGraspForceProblem(random, 3);
    problem.F_o.setZero();
    const GraspForceResult& result = solver.Solve(problem);
    ASSERT_NE(result.status, GraspForceStatus::kNotConverged) << sample;
    if (result.status != GraspForceStatus::kOptimal) continue;
    ++feasible;
    if (result.iterations > 30) ++slow;
    ExpectAdmissible(problem, result.f_c);
  }
  EXPECT_GT(feasible, kSamples / 10);
  EXPECT_GT(slow, 0) << "none of them was hard";
}

TEST(RandomGraspsOracle, NoSampledForceGivesMore) {
  // CalcSeparation itself, against admissible forces drawn at random: never exceeded, and nearly reached.
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> normal;
  for (int sample = 0; sample < 20; ++sample) {
    const GraspForceProblem problem = MakeRandomGraspForceProblem(random, 3);
    Vector6d y;
    for (double& entry : y) entry = normal(random);
    const double most = y.dot(problem.F_o) - CalcSeparation(problem, y);
    double best = 0.0;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Vector3d g = problem.G.middleCols<3>(3 * i).transpose() * y;
      double best_contact = -std::numeric_limits<double>::infinity();
      for (int trial = 0; trial < 20000; ++trial) {
        const double f3 =
            problem.f_min[i] + (problem.f_max[i] - problem.f_min[i]) * std::round(uniform(random));
        const double angle = 2.0 * kPi * uniform(random);
        const double radius = problem.mu[i] * f3 * std::sqrt(uniform(random));
        best_contact =
            std::max(best_contact, g.dot(Vector3d(radius * std::cos(angle), radius * std::sin(angle), f3)));
      }
      best += best_contact;
    }
    EXPECT_LE(best, most);
    EXPECT_GT(best, most - 0.02 * std::abs(most) - 1.0);
  }
}

}  // namespace
}  // namespace dexcheck::testing::grasp_force_random_test
