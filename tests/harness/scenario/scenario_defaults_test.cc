// The defaults that harness/shipped/scenarios/README.md states are the reader's.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <sstream>

#include "harness/scenario/scenario.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::scenario_defaults_test {
namespace {

/// Only what a scenario must have, so that every other key has its default.
const std::string kRun = R"(
name = "least"
duration = 1
start = "rest"
[grasp]
fingertips = ["rf1_tip", "rf2_tip", "rf3_tip"]
frame = "r_palm_frame"
[control]
K_p = 1
K_v = 1
f_max = 50
mu = 0.6
)";
const std::string kContacts = "grasp.contacts_deg=[[125, 0], [90, 0], [-90, 0]]";
const std::string kLine = "trajectory={ type = \"line\" }";
const std::string kTask =
    "task={ xyz = [0.25, -0.5, 0.631], support_height = 0.62, raise = 0.15, transport = [1, 0, 0] }";
const std::string kPush = "disturbance=[{ type = \"step\", body = \"object\" }]";

/// A key of the document's tables with a default that is a value, written `like this`.
struct Key {
  std::string path;  ///< "plant.time_step".
  std::string otherwise;
  std::string example;
  std::vector<std::string> before;  ///< Assignments that the key needs.
};

/// Cells of a table's row, without what surrounds them.
std::vector<std::string> SplitRow(const std::string& row) {
  std::vector<std::string> cells;
  std::istringstream stream(row);
  std::string cell;
  while (std::getline(stream, cell, '|')) {
    const size_t begin = cell.find_first_not_of(" `");
    const size_t end = cell.find_last_not_of(" `");
    cells.push_back(begin == std::string::npos ? "" : cell.substr(begin, end - begin + 1));
  }
  return cells;
}

/// What stands between the first backticks of a heading, without brackets.
std::string FindSection(const std::string& heading) {
  const size_t begin = heading.find_first_not_of("# `[");
  return heading.substr(begin, heading.find_first_of("`]", begin) - begin);
}

std::vector<Key> ListKeys() {
  std::istringstream document(ReadText(SourcePath("/harness/shipped/scenarios/README.md")));
  std::vector<Key> keys;
  std::string section, start;
  for (std::string line; std::getline(document, line);) {
    if (line.starts_with("## ")) {
      section = line.find("`[") == std::string::npos ? "" : FindSection(line) + ".";
      if (section == "disturbance.") section += "0.";
    }
    if (line.starts_with("### `")) section = "trajectory.";
    if (line.starts_with("    trajectory = ")) start = "trajectory=" + line.substr(17);
    constexpr size_t kCells = 7;  // one before the first |
    if (!line.starts_with("| `") || line.find("| `", 1) == std::string::npos) continue;
    const std::vector<std::string> cells = SplitRow(line);
    if (cells.size() != kCells || line.find("| `" + cells[4] + "` |") == std::string::npos) continue;
    Key key{
        .path = section + cells[1].substr(0, cells[1].find('`')), .otherwise = cells[4], .example = cells[5]};
    const bool of_task = section == "task.";
    key.before = {of_task ? kTask : section == "trajectory." ? start : kLine};
    if (!of_task) key.before.push_back(kContacts);
    if (of_task) key.before.emplace_back("control.orientation=\"rotation\"");
    if (section == "disturbance.0.") key.before.push_back(kPush);
    // What some keys need to matter.
    for (const auto& [type, motion] : {std::pair("line", "velocity"), std::pair("oscillation", "xyz")}) {
      const std::string path = std::string("trajectory.") + motion;
      const bool has_type = start.find(type) != std::string::npos;
      if (section == "trajectory." && has_type && key.path != path) key.before.push_back(path + "=[1, 0, 0]");
    }
    if (section == "sensing.") {
      key.before.emplace_back("sensing.kalman_acceleration=20");
      key.before.emplace_back("sensing.object_acceleration=5");
    }
    if (key.path == "plant.mjcf") continue;  // its default is a shipped file, not a value
    keys.push_back(key);
  }
  return keys;
}

template <typename T>
std::string Show(const std::optional<T>& value) {
  if (!value) return "none";
  if constexpr (std::is_same_v<T, Vector6d>) {
    return fmt::format("{}", fmt::join(value->begin(), value->end(), " "));
  } else {
    return fmt::format("{}", *value);
  }
}

std::string Show(MatrixXd numbers) {
  numbers.array() += 0.0;  // -0 is 0
  return fmt::format("{}", fmt::join(numbers.reshaped().begin(), numbers.reshaped().end(), " "));
}

std::string Show(const ByName& numbers) { return fmt::format("{} {}", numbers.all, numbers.groups); }

std::string Show(const SensingOptions& sensing) {
  return fmt::format("{} | {} | {} | {} {} {} {} {} {} {} {} {} {} {} {} {}", Show(sensing.joint_counts),
                     Show(sensing.joint_noise), Show(sensing.velocity_noise),
                     static_cast<int>(sensing.velocity), sensing.velocity_cutoff, sensing.kalman_acceleration,
                     sensing.odometry, sensing.object_position_noise, sensing.object_orientation_noise,
                     sensing.object_rate, sensing.object_latency, static_cast<int>(sensing.object_velocity),
                     sensing.object_velocity_cutoff, sensing.object_acceleration, sensing.contact_force_noise,
                     sensing.latency);
}

std::string Show(const ActuationOptions& actuation) {
  return fmt::format("{} | {} | {} | {} | {} | {} | {} {} {}", Show(actuation.torque_step),
                     Show(actuation.gain_error), Show(actuation.lag), Show(actuation.coulomb),
                     Show(actuation.stribeck), Show(actuation.backlash), actuation.stribeck_velocity,
                     actuation.delay, actuation.saturate);
}

std::string Show(const DisturbanceOptions& push) {
  return fmt::format("{} {} {} | {} | {} | {} | {} {} {} {} {} {}", static_cast<int>(push.kind), push.body,
                     Show(push.force), Show(push.torque), Show(push.at), push.in_body_frame, push.begin,
                     push.duration, push.period, push.frequency, push.begin_within, push.size_within);
}

std::string Show(const MismatchOptions& mismatch) {
  return fmt::format("{} | {} | {} | {}", Show(mismatch.mass), Show(mismatch.mass_within),
                     Show(mismatch.damping), Show(mismatch.armature));
}

std::string Show(const PlantOptions& plant) {
  std::string touching;
  for (const auto& [a, b] : plant.allowed_collision_pairs) touching += a + " " + b + " ";
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {}", static_cast<int>(plant.type),
                     static_cast<int>(plant.integrator), plant.time_step, plant.control_step,
                     plant.contact_time_constant, plant.contact_impedance, plant.impratio,
                     plant.noslip_iterations, plant.bonded, plant.implicit_damping,
                     Show(plant.floor_friction), Show(plant.finger_friction), plant.collide, touching);
}

std::string Show(const GraspOptions& grasp) {
  std::string text = fmt::format("{} {}", fmt::join(grasp.fingertips, " "), grasp.frame);
  for (const SurfacePoint& contact : grasp.contacts) text += fmt::format(" {} {}", contact.u, contact.v);
  for (const auto& [joint, angle] : grasp.joints) text += fmt::format(" {} {}", joint, angle);
  if (grasp.hemisphere) text += Show(*grasp.hemisphere);
  return text + Show(MatrixXd(grasp.X_FO.matrix()));
}

std::string Show(const ControlOptions& control) {
  return fmt::format("{} {} {} | {} | {} | {} {} {} {} {} {} {} {} {} {}", static_cast<int>(control.law),
                     Show(control.gains.K_p), Show(control.gains.K_v), Show(control.stiffness),
                     Show(control.damping), static_cast<int>(control.orientation),
                     static_cast<int>(control.weight), control.platform_weight, control.arm_weight,
                     control.posture_frequency, control.f_min, control.f_max, control.mu,
                     static_cast<int>(control.kappa), control.contact_error);
}

std::string Show(const PickTask& task) {
  const PickAndPlaceOptions& pick = task.pick_and_place;
  return fmt::format("{} {} {} {} | {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}",
                     Show(MatrixXd(task.X_Bo.matrix())), fmt::join(task.arm_joints, " "), Show(pick.raise),
                     Show(pick.transport), pick.approach_time, pick.lower_time, pick.close_time,
                     pick.search_speed, pick.grip_time, pick.take_over_time, pick.raise_time, pick.arm_rate,
                     pick.transport_time, pick.touch_force, pick.overload, pick.largest_push, pick.attempts,
                     pick.plan.opening, pick.plan.support);
}

/// Where the trajectory is at some times.
std::string Show(const TrajectoryMaker& make) {
  std::string text;
  for (const double t : {0.1, 0.7, 3.0}) text += Show(make(Vector6d::Zero())->Evaluate(t).X_d) + " ";
  return text;
}

/// All that the reader made of a scenario's keys.
std::string Show(const Scenario& scenario) {
  std::string text =
      fmt::format("{} {} {} {} {} {}\n", scenario.description, scenario.duration, scenario.settle,
                  static_cast<int>(scenario.start), Show(scenario.start_error()), scenario.tolerance);
  text += Show(scenario.plant) + "\n" + Show(scenario.grasp) + "\n" + Show(scenario.control) + "\n";
  text += Show(scenario.imperfections.sensing) + "\n" + Show(scenario.imperfections.actuation) + "\n";
  for (const auto& push : scenario.imperfections.disturbances) text += Show(push) + "\n";
  text += Show(scenario.imperfections.mismatch) + "\n";
  if (scenario.pick_task() != nullptr) text += Show(*scenario.pick_task()) + "\n";
  if (scenario.trajectory_task() != nullptr) text += Show(scenario.trajectory_task()->trajectory) + "\n";
  return text + fmt::format("{} {} {}", Show(scenario.expect.position), Show(scenario.expect.orientation),
                            scenario.expect.from);
}

std::string Read(const Key& key, const std::string& value) {
  std::vector<std::string> overrides = key.before;
  if (!value.empty()) overrides.push_back(key.path + "=" + value);
  return Show(ParseScenario(kRun, "least.toml", ".", overrides));
}

TEST(ScenarioDefaults, AreThoseOfTheDocument) {
  const std::vector<Key> keys = ListKeys();
  EXPECT_GE(keys.size(), 70U);
  for (const Key& key : keys) {
    EXPECT_EQ(Read(key, key.otherwise), Read(key, "")) << key.path << " = " << key.otherwise;
    // What the default is compared in has the key.
    if (key.example == key.otherwise) continue;
    EXPECT_NE(Read(key, key.example), Read(key, "")) << key.path << " = " << key.example;
  }
}

}  // namespace
}  // namespace dexcheck::testing::scenario_defaults_test
