// Contacts can be read back from the log: coordinates and charts give the contact points.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "controller/contact/shapes.h"
#include "controller/dynamics/model_terms.h"
#include "controller/object/so3.h"
#include "harness/log/log_reader.h"
#include "tests/common/paper_robot.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::contact_log_test {
namespace {

constexpr int kFingers = 4;
// The engine's contact point is midway between surfaces that overlap by a micrometre or two; the platform's
// tilt of some 1e-8 rad, which q does not have, is a metre away.
constexpr double kSamePoint = 3e-6;  // m

TEST(ContactLog, GivesTheContactPointsBackWhileFingersGraspTheObject) {
  const TempFolder folder;
  // Until the object is held; the rest of the task is cut off.
  const ProgramResult run = RunDexcheck({"run", "lift", "--no-report", "--quiet", "--out",
                                         (folder.path() / "run").string(), "--set", "duration=7.2"});
  ASSERT_EQ(run.exit_code, 3) << run.out << run.err;
  const LogReader log(folder.path() / "run/log.h5");
  EXPECT_EQ(log.ReadText("object_body"), "torus");
  const RowMatrixXd kappa = log.ReadSignal("contact/kappa");
  const RowMatrixXd charts = log.ReadSignal("contact/chart");
  const RowMatrixXd positions = log.ReadSignal("contact/position");
  const RowMatrixXd forces = log.ReadSignal("contact/force");
  const RowMatrixXd X_o = log.ReadSignal("object/X_o");
  const RowMatrixXd q = log.ReadSignal("q");
  ASSERT_EQ(charts.cols(), 2 * kFingers);
  ASSERT_EQ(charts.rows(), log.rows());

  const RobotModel model = ReadPaperRobot();
  const std::vector<std::string> tips = {"rf1_tip", "rf2_tip", "rf3_tip", "rf4_tip"};
  const Torus torus(0.035, 0.011);
  ModelTerms robot(model);
  std::set<int> charts_seen;
  int compared = 0;
  double worst_of_chart_0 = 0.0;
  constexpr long kStride = 10;
  for (long row = 0; row < log.rows(); row += kStride) {
    robot.SetState(q.row(row).transpose(), VectorXd::Zero(robot.size()));
    const Pose X_Bo = CalcObjectPose(X_o.row(row).transpose());
    for (int i = 0; i < kFingers; ++i) {
      if (forces.block<1, 3>(row, 3 * i).isZero(0.0)) continue;  // no contact
      ++compared;
      const int frame = model.FindFrame(tips[static_cast<size_t>(i)]);
      const Sphere tip(*model.frames()[static_cast<size_t>(frame)].sphere_radius);
      const auto chart_f = static_cast<int>(charts(row, 2 * i));
      const auto chart_o = static_cast<int>(charts(row, 2 * i + 1));
      charts_seen.insert(chart_f);
      const Vector3d expected = positions.block<1, 3>(row, 3 * i).transpose();
      const Eigen::Matrix<double, 1, 5> at = kappa.block<1, 5>(row, 5 * i);
      const Pose X_Bf = robot.CalcFramePose(frame);
      ASSERT_LT((X_Bf * tip.Evaluate({at[0], at[1], chart_f}).p - expected).norm(), kSamePoint)
          << "row " << row << ", finger " << i << ", chart " << chart_f;
      ASSERT_LT((X_Bo * torus.Evaluate({at[2], at[3], chart_o}).p - expected).norm(), kSamePoint)
          << "row " << row << ", finger " << i;
      worst_of_chart_0 =
          std::max(worst_of_chart_0, (X_Bf * tip.Evaluate({at[0], at[1], 0}).p - expected).norm());
    }
  }
  EXPECT_GT(compared, 100);
  // Without the chart the coordinates would mislead.
  EXPECT_TRUE(charts_seen.contains(1));
  EXPECT_GT(worst_of_chart_0, 1e-3);
}

}  // namespace
}  // namespace dexcheck::testing::contact_log_test
