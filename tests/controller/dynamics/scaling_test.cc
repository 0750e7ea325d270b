// Cost of the terms grows with joints times depth: measured on chains and trees of 10 to 200 joints beside
// the naive sum over bodies, which grows with the cube of the number of joints.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "tests/common/naive_dynamics.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::scaling_test {
namespace {

constexpr std::array kJoints = {10, 20, 50, 100, 200};
// Branching 0 is a chain; 0.5 gives depth 17, and 1 depth 10, at 200 joints.
constexpr std::array kBranching = {0.0, 0.5, 1.0};

// Seconds of processor time. Noise only ever adds to it, so the least of many samples counts; samples of all
// robots take turns, so that a slow spell of the machine meets them all.
constexpr int kRounds = 40;
// Cost per (joints times depth) may not grow with the robot. Measured: it falls, as the fraction of work per
// joint does, or rises by 1.03 (1.22 on a busy machine). The naive sum's grows fivefold from 10 to 200
// joints.
constexpr double kGrowth = 2.0;
// From 50 to 200 joints in a chain: 16 times the joints times depth, 64 times the cube. Measured 12.8;
// naive 52.
constexpr double kChainGrowth = 32.0;
// Among robots of 200 joints the flat tree, a twentieth as deep, is the cheaper. Measured 0.2, and 0.59 with
// the sanitizers' work per call; naive 0.97.
constexpr double kTreeToChain = 0.75;

/// A robot at one state, and what its terms cost.
struct Sample {
  Sample(int joints, double branching) : model(MakeTree(joints, branching)), terms(model) {
    std::mt19937 random(8);
    q = testing::DrawPositions(model, &random);
    velocity = testing::DrawVelocities(terms.size(), &random);
  }
  static RobotModel MakeTree(int joints, double branching) {
    std::mt19937 random(7);
    testing::RandomRobotOptions options;
    options.joints = joints;
    options.branching = branching;
    options.base = BaseType::kFixed;
    return RobotModel(testing::MakeRandomRobot(options, &random));
  }
  [[nodiscard]] double joints_times_depth() const {
    return static_cast<double>(model.num_joints()) * model.max_depth();
  }

  RobotModel model;
  ModelTerms terms;
  VectorXd q;
  VectorXd velocity;
  double cost = std::numeric_limits<double>::infinity();  // s
};

void CalcTerms(Sample* sample) {
  sample->terms.SetState(sample->q, sample->velocity);
  sample->terms.CalcDynamics();
}

void CalcNaiveTerms(Sample* sample) {
  const MatrixXd M = testing::NaiveDynamics<double>(sample->model, sample->q).CalcMassMatrix();
  ASSERT_GT(M(0, 0), 0.0);
}

using Calculation = std::function<void(Sample*)>;

/// Fills in the cost of one call; `work` is the number of calls for a robot of one joint.
void Measure(const Calculation& calculate, int work, int rounds, const std::vector<Sample*>& samples) {
  for (int round = 0; round < rounds; ++round) {
    for (Sample* sample : samples) {
      const int calls = std::max(1, work / sample->model.num_joints());
      const std::clock_t start = std::clock();
      for (int i = 0; i < calls; ++i) calculate(sample);
      const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      sample->cost = std::min(sample->cost, seconds / calls);
    }
  }
}

/// Largest factor by which cost per (joints times depth) grows from one robot to a later one.
double FindGrowth(const std::vector<Sample*>& samples) {
  double growth = 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (const Sample* sample : samples) {
    const double cost = sample->cost / sample->joints_times_depth();
    growth = std::max(growth, cost / least);
    least = std::min(least, cost);
  }
  return growth;
}

class Scaling : public ::testing::Test {
 protected:
  Scaling() {
    for (const double branching : kBranching) {
      std::vector<Sample*>& family = families_.emplace_back();
      for (const int joints : kJoints) {
        robots_.push_back(std::make_unique<Sample>(joints, branching));
        family.push_back(robots_.back().get());
      }
    }
  }
  [[nodiscard]] std::vector<Sample*> All() const {
    std::vector<Sample*> all;
    for (const auto& robot : robots_) all.push_back(robot.get());
    return all;
  }

  std::vector<std::unique_ptr<Sample>> robots_;
  std::vector<std::vector<Sample*>> families_;  // by branching, each of growing size
};

TEST_F(Scaling, CostGrowsWithJointsTimesDepth) {
  Measure(CalcTerms, 2000, kRounds, All());
  for (size_t i = 0; i < families_.size(); ++i) {
    ASSERT_GT(families_[i].front()->cost, 0.0);
    EXPECT_LT(FindGrowth(families_[i]), kGrowth) << "branching " << kBranching[i];
  }
  const std::vector<Sample*>& chains = families_.front();
  EXPECT_LT(chains[4]->cost / chains[2]->cost, kChainGrowth);
  ASSERT_LT(families_.back().back()->model.max_depth(), 20);
  EXPECT_LT(families_.back().back()->cost / chains.back()->cost, kTreeToChain);
}

// The same three questions tell the naive sum over bodies from the recursion.
TEST_F(Scaling, CubicCostIsSeen) {
  const std::vector<Sample*>& chains = families_.front();
  Sample* const flat_tree = families_.back().back();
  Measure(CalcNaiveTerms, 50, 10, {chains[0], chains[1], chains[2], chains[4], flat_tree});
  EXPECT_GT(FindGrowth({chains[0], chains[1], chains[2], chains[4]}), kGrowth);
  EXPECT_GT(chains[4]->cost / chains[2]->cost, kChainGrowth);
  EXPECT_GT(flat_tree->cost / chains[4]->cost, kTreeToChain);
}

}  // namespace
}  // namespace dexcheck::testing::scaling_test
