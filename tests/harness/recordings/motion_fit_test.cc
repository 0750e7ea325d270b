// The noise that a fit states for its samples is the spread of samples over draws of the same motion.

#include "harness/recordings/motion_fit.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "tests/harness/recordings/judge_panda.h"

namespace dexcheck::testing::motion_fit_test {
namespace {

/// Adds the part of a white torque error that a drive delivers: all of it, or its mean over some rows.
void AddTorqueErrors(size_t rows, std::mt19937* random, RecordedTable* table) {
  std::normal_distribution<double> normal;
  for (const std::string& name : table->names) {
    if (!name.starts_with("tau.")) continue;
    std::vector<double>& torque = table->Get(name);
    std::vector<double> errors(torque.size() + rows);
    for (double& error : errors) error = 0.1 * normal(*random);
    for (size_t i = 0; i < torque.size(); ++i)
      for (size_t k = 0; k < rows; ++k) torque[i] += errors[i + k] / static_cast<double>(rows);
  }
}

/// Smoothed torques of all samples, a row each, and the noise that is stated for them.
MatrixXd FitTorques(const RecordedTable& table, VectorXd* noise) {
  Recording recording = ToRecording(Panda(), table);
  MotionFit fit(Panda(), &recording);
  *noise = fit.facts().smooth_torque;
  std::vector<VectorXd> torques;
  fit.Run([&](const RecordedSample& sample) {
    torques.push_back(sample.torque);
    return true;
  });
  MatrixXd all(torques.size(), Panda().num_joints());
  for (Eigen::Index i = 0; i < all.rows(); ++i) all.row(i) = torques[static_cast<size_t>(i)];
  return all;
}

TEST(MotionFit, StatesTheNoiseOfRoundedTorques) {
  std::mt19937 random(5);
  const RecordedTable exact = RecordRobot(kMjcf, {}, {.encoder_bits = 16, .torque_noise = 0.0}, &random);
  for (const double step : {0.02, 0.05}) {
    RecordedTable rounded = exact;
    for (const std::string& name : exact.names)
      if (name.starts_with("tau."))
        for (double& torque : rounded.Get(name)) torque = step * std::round(torque / step);
    VectorXd stated, unused;
    const MatrixXd difference = FitTorques(rounded, &stated) - FitTorques(exact, &unused);
    for (Eigen::Index joint = 0; joint < stated.size(); ++joint) {
      const double spread = difference.col(joint).norm() / std::sqrt(static_cast<double>(difference.rows()));
      EXPECT_GT(stated[joint], 0.6 * spread) << step << ", joint " << joint;
      EXPECT_LT(stated[joint], 2.0 * spread) << step << ", joint " << joint;
    }
  }
}

TEST(MotionFit, StatesTheNoiseOfFilteredTorques) {
  std::mt19937 random(5);
  // Coarse encoders, so that windows are long.
  const RecordedTable exact = RecordRobot(kMjcf, {}, {.duration = 20.0, .torque_noise = 0.0}, &random);
  for (const size_t rows : {1U, 4U, 10U, 20U}) {
    RecordedTable one = exact, other = exact;
    AddTorqueErrors(rows, &random, &one);
    AddTorqueErrors(rows, &random, &other);
    VectorXd stated, again;
    const MatrixXd difference = FitTorques(one, &stated) - FitTorques(other, &again);
    ASSERT_GT(difference.rows(), 100);
    for (Eigen::Index joint = 0; joint < stated.size(); ++joint) {
      const double spread =
          std::sqrt(difference.col(joint).squaredNorm() / 2.0 / static_cast<double>(difference.rows()));
      EXPECT_GT(stated[joint], 0.75 * spread) << rows << " rows, joint " << joint;
      EXPECT_LT(stated[joint], 1.6 * spread) << rows << " rows, joint " << joint;
    }
  }
}

}  // namespace
}  // namespace dexcheck::testing::motion_fit_test
