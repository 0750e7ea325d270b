// GraspForceSolver against csdp, on the linear matrix inequalities themselves.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <random>
#include <sstream>
#include <string>

#include "controller/grasp/grasp_force.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/grasp/random_grasp.h"
#include "tests/controller/grasp/sdp_oracle.h"

namespace dexcheck::testing::grasp_force_sdp_test {
namespace {

// Relative difference of the optima. Both solvers stop at a relative gap of about 1e-7 (csdp: 1e-8).
constexpr double kRelative = 1e-6;

class GraspForceSdp : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("dexcheck_sdp_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // Solves random problems with both solvers until `count` feasible ones have been compared.
  void Compare(int num_contacts, int num_limits, int count) {
    std::mt19937_64 random(static_cast<unsigned>(100 * num_contacts + num_limits));
    GraspForceOptions options;
    options.objective = GraspForceObjective::kMinimum;
    options.warm_start = false;
    GraspForceSolver solver(num_contacts, num_limits, options);
    int feasible = 0;
    int infeasible = 0;
    int undecided = 0;
    double worst = 0.0;
    while (feasible < count) {
      GraspForceProblem problem = MakeRandomGraspForceProblem(random, num_contacts);
      std::uniform_real_distribution<double> uniform(-1.0, 1.0);
      for (double& weight : problem.weight) weight = 1.0 + 0.5 * uniform(random);
      if (num_limits > 0) AddLimits(random, num_limits, problem);
      const GraspForceResult& result = solver.Solve(problem);
      ASSERT_NE(result.status, GraspForceStatus::kNotConverged);
      // csdp takes some infeasible problems for failures of its own; a few certificates from it are enough.
      if (result.status == GraspForceStatus::kInfeasible && infeasible >= count / 4) continue;
      const SdpSolution sdp = testing::SolveSdp(problem, folder_);
      if (result.status == GraspForceStatus::kInfeasible) {
        ASSERT_NE(sdp.status, SdpStatus::kOptimal);
        if (sdp.status == SdpStatus::kInfeasible) ++infeasible;
        continue;
      }
      if (sdp.status == SdpStatus::kOther) {
        ++undecided;
        continue;
      }
      ASSERT_EQ(sdp.status, SdpStatus::kOptimal);
      ++feasible;
      EXPECT_GT(result.objective, 0.0);
      EXPECT_NEAR(result.objective, sdp.objective, kRelative * testing::TolScale() * sdp.objective);
      worst = std::max(worst, std::abs(result.objective / sdp.objective - 1.0));
    }
    std::ostringstream text;
    text << worst;
    RecordProperty("worst_relative_difference", text.str());
    EXPECT_LE(undecided, count / 10) << "csdp gave up too often";
    infeasible_ = infeasible;
  }

  int infeasible_ = 0;  // problems that both solvers called infeasible

 private:
  // Rows like those of joint torques: lever arms of up to 5 cm, limits of 1 N m.
  static void AddLimits(std::mt19937_64& random, int num_limits, GraspForceProblem& problem) {
    std::uniform_real_distribution<double> lever(-0.05, 0.05);
    MatrixXd J(problem.G.cols(), num_limits);
    for (double& entry : J.reshaped()) entry = lever(random);
    const VectorXd limit = VectorXd::Constant(num_limits, 1.0);
    GraspForceProblem limited(problem.num_contacts(), num_limits);
    limited.G = problem.G;
    limited.F_o = problem.F_o;
    limited.mu = problem.mu;
    limited.f_min = problem.f_min;
    limited.weight = problem.weight;
    limited.SetTorqueLimits(J, VectorXd::Zero(num_limits), -limit, limit);
    problem = limited;
  }

  std::filesystem::path folder_;
};

TEST_F(GraspForceSdp, ThreeContacts) { Compare(3, 0, 10); }
TEST_F(GraspForceSdp, FourContacts) {
  Compare(4, 0, 100);
  EXPECT_GT(infeasible_, 10);
}
TEST_F(GraspForceSdp, EightContacts) { Compare(8, 0, 30); }
TEST_F(GraspForceSdp, ThirteenContacts) { Compare(13, 0, 10); }
TEST_F(GraspForceSdp, FourContactsWithSixteenLimits) { Compare(4, 16, 20); }

}  // namespace
}  // namespace dexcheck::testing::grasp_force_sdp_test
