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

// The barrier's optimum exceeds csdp's, which has a relative gap of 1e-8, by at most 4 N rho.
constexpr double kRho = 1e-5;  // N
constexpr double kRelative = 1e-6;

class GraspForceSdp : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("dexcheck_sdp_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // Solves random problems with both solvers until `count` feasible ones have been compared.
  void Compare(int num_contacts, int count) {
    std::mt19937_64 random(static_cast<unsigned>(100 * num_contacts));
    GraspForceOptions options;
    options.barrier_weight = kRho;
    options.warm_start = false;
    GraspForceSolver solver(num_contacts, options);
    int feasible = 0;
    int infeasible = 0;
    int undecided = 0;
    double worst = 0.0;
    while (feasible < count) {
      const GraspForceProblem problem = MakeRandomGraspForceProblem(random, num_contacts);
      const GraspForceResult& result = solver.Solve(problem);
      ASSERT_NE(result.status, GraspForceStatus::kNotConverged);
      // csdp takes some infeasible problems for failures of its own; a few certificates from it are enough.
      if (result.status == GraspForceStatus::kInfeasible && infeasible >= count / 4) continue;
      const SdpSolution sdp = SolveSdp(problem, folder_);
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
      EXPECT_NEAR(result.objective, sdp.objective,
                  TolScale() * (kRelative * sdp.objective + 4.0 * num_contacts * kRho));
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
  std::filesystem::path folder_;
};

TEST_F(GraspForceSdp, ThreeContacts) { Compare(3, 10); }
TEST_F(GraspForceSdp, FourContacts) {
  Compare(4, 100);
  EXPECT_GT(infeasible_, 10);
}
TEST_F(GraspForceSdp, EightContacts) { Compare(8, 30); }
TEST_F(GraspForceSdp, ThirteenContacts) { Compare(13, 10); }

}  // namespace
}  // namespace dexcheck::testing::grasp_force_sdp_test
