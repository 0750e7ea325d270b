// Columns of logs by their names: quantity, joint, unit.

#include "harness/recordings/column_names.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "harness/descriptions/read_description.h"
#include "harness/recordings/channels.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::column_names_test {
namespace {

/// "joint: quantity" of each column that is known.
std::string Guess(const std::vector<std::string>& names) {
  const RobotModel model = MakeUnknownRobot(3);
  std::string text;
  for (const Channel& one : GuessChannels(model, names))
    text += std::string(NameOf(one.quantity)) + (one.joint < 0 ? "" : std::to_string(one.joint + 1)) + " ";
  return text;
}

TEST(Channels, AreFoundByTheWordsOfLogs) {
  EXPECT_EQ(Guess({"time", "q1", "q2", "dq1", "tau_2"}), "t q1 q2 qd1 tau2 ");
  EXPECT_EQ(Guess({"timestamp", "actual_q_0", "actual_qd_0", "actual_current_0", "target_q_0"}),
            "t q1 qd1 current1 ");
  EXPECT_EQ(Guess({"__time", "/joint_states/joint 2/position", "/joint_states/joint 2/effort"}),
            "t q2 tau2 ");
  EXPECT_EQ(Guess({"t [ms]", "joint 3 angle [deg]", "joint_3_torque_cmd"}), "t q3 ");
  EXPECT_EQ(Guess({"position[0]", "position[2]", "velocity[2]"}), "q1 q3 qd3 ");
  EXPECT_EQ(Guess({"temperature_1", "comment"}), "");
  // Brackets hold a unit: of another quantity, or none, it is no such column.
  EXPECT_EQ(
      Guess({"check/motion position [1]", "q2 [rad]", "tau_3 [N m]", "tau 1 ratio [1]", "effort_2 (A)"}),
      "q2 tau3 current2 ");
  EXPECT_EQ(Guess({"time [s]", "q1 (\u00b0)", "torque_2 [N\u00b7m]", "q3 [N m]"}), "t q1 tau2 ");
  // A free joint without a name is no joint's number.
  EXPECT_EQ(Guess({"engine/qpos.#0.x", "engine/qpos.#0.y", "engine/qpos.joint 1"}), "q1 ");
  EXPECT_EQ(GuessChannels(MakeUnknownRobot(3), {"qpos.#0.x", "qpos.joint 1"})[0].column, 1U);
  EXPECT_EQ(Guess({"q.x [m]", "q.y [m]", "q.z [m]", "q.qw", "q.qx", "q.qy", "q.qz", "q.joint 1"}),
            "q1 base1 base2 base3 base4 base5 base6 base7 ");
  EXPECT_EQ(Guess({"base_orientation_x", "base_orientation_y", "base_orientation_z", "base_orientation_w",
                   "base_position_x", "base_position_y", "base_position_z", "base_velocity_x"}),
            "base5 base6 base7 base4 base1 base2 base3 ");
  EXPECT_EQ(Guess({"base.x", "base.y", "base.z"}), "") << "a pose has its quaternion";
  EXPECT_DOUBLE_EQ(GuessChannels(MakeUnknownRobot(1), {"time_ms"})[0].scale, 1e-3);
  EXPECT_DOUBLE_EQ(GuessChannels(MakeUnknownRobot(1), {"angle_deg"})[0].scale, kPi / 180.0);
  EXPECT_DOUBLE_EQ(GuessChannels(MakeUnknownRobot(1), {"q [\u00b0]"})[0].scale, kPi / 180.0);
}

TEST(Channels, ForcesOnFeetAreThoseOfARunsLog) {
  const RobotModel model(ReadDescription(SourcePath("/controller/parameters/quadruped.toml")).spec);
  Recording recording;
  GuessFeet(model,
            {"time", "law/foot_force.fr_foot.x", "foot/force.fr_foot.x [N]", "foot/force.fr_foot.y [N]",
             "foot/force.fr_foot.z [N]"},
            &recording);
  ASSERT_EQ(recording.wrenches.size(), 1U);
  EXPECT_EQ(model.link_name(recording.wrenches[0].link), "fr_shank");
  EXPECT_TRUE(recording.wrenches[0].is_world);
  EXPECT_EQ(recording.wrenches[0].below, 0.02);
  ASSERT_EQ(recording.channels.size(), 3U);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(recording.FindColumn(RecordedQuantity::kWrench, k), 2 + k);
}

}  // namespace
}  // namespace dexcheck::testing::column_names_test
