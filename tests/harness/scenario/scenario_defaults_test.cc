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
const std::string kTask = "task={ xyz = [0.25, -0.5, 0.631], raise = 0.15, transport = [1, 0, 0] }";
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

/// Returns the text between the first backticks of a heading, without brackets.
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
    constexpr size_t kCells = 6;  // one before the first |
    if (!line.starts_with("| `") || line.find("| `", 1) == std::string::npos) continue;
    const std::vector<std::string> cells = SplitRow(line);
    if (cells.size() != kCells || line.find("| `" + cells[3] + "` |") == std::string::npos) continue;
    Key key{
        .path = section + cells[1].substr(0, cells[1].find('`')), .otherwise = cells[3], .example = cells[4]};
    const bool of_task = section == "task.";
    key.before = {of_task ? kTask : section == "trajectory." ? start : kLine};
    key.before.push_back(kContacts);
    if (of_task) key.before.emplace_back("control.orientation=\"rotation\"");
    if (section == "disturbance.0.") key.before.push_back(kPush);
    // Other keys that some keys need to matter.
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

/// Any value of a scenario as text.
template <typename T>
std::string Show(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return std::to_string(static_cast<int>(value));
  } else if constexpr (std::is_base_of_v<Eigen::EigenBase<T>, T>) {
    const MatrixXd numbers = (value.array() + 0.0).matrix();  // -0 is 0
    return fmt::format("{} ", fmt::join(numbers.reshaped().begin(), numbers.reshaped().end(), " "));
  } else if constexpr (requires { value.matrix(); }) {
    return Show(value.matrix().eval());
  } else if constexpr (requires { value.has_value(); }) {
    return value ? Show(*value) : "none ";
  } else if constexpr (requires { value.groups; }) {
    return fmt::format("{} {} ", value.all, value.groups);
  } else {
    return fmt::format("{} ", value);
  }
}

template <typename... T>
std::string ShowAll(const T&... values) {
  return (Show(values) + ...) + "\n";
}

std::string ShowImperfections(const Imperfections& all) {
  const SensingOptions& s = all.sensing;
  const ActuationOptions& a = all.actuation;
  const MismatchOptions& m = all.mismatch;
  std::string text = ShowAll(
      s.joint_counts, s.joint_noise, s.velocity_noise, s.velocity, s.velocity_cutoff, s.kalman_acceleration,
      s.odometry, s.object_position_noise, s.object_orientation_noise, s.object_rate, s.object_latency,
      s.object_velocity, s.object_velocity_cutoff, s.object_acceleration, s.contact_force_noise, s.latency);
  text += ShowAll(a.torque_step, a.gain_error, a.lag, a.coulomb, a.stribeck, a.backlash, a.stribeck_velocity,
                  a.delay, a.saturate, a.limit, m.mass, m.mass_within, m.damping, m.armature, m.friction);
  for (const DisturbanceOptions& d : all.disturbances) {
    text += ShowAll(d.kind, d.body, d.force, d.torque, d.at, d.in_body_frame, d.begin, d.duration, d.period,
                    d.frequency, d.begin_within, d.size_within);
  }
  return text;
}

/// Prints the trajectory at some times.
std::string ShowTrajectory(const TrajectoryMaker& make) {
  std::string text;
  for (const double t : {0.1, 0.7, 3.0}) text += Show(make(Vector6d::Zero())->Evaluate(t).X_d);
  return text;
}

/// All that the reader made of a scenario's keys.
std::string ShowScenario(const Scenario& scenario) {
  const PlantOptions& p = scenario.plant;
  const GraspOptions& g = scenario.grasp;
  const ControlOptions& c = scenario.control;
  std::string text = ShowAll(scenario.description, scenario.duration, scenario.settle, scenario.start,
                             scenario.start_error(), scenario.tolerance, scenario.expect.position,
                             scenario.expect.orientation, scenario.expect.from);
  text += ShowAll(p.type, p.integrator, p.time_step, p.control_step, p.contact_time_constant,
                  p.contact_impedance, p.impratio, p.noslip_iterations, p.bonded, p.implicit_damping,
                  p.floor_friction, p.finger_friction, p.collide, p.allowed_collision_pairs);
  text += ShowAll(g.fingertips, g.frame, g.joints, g.hemisphere, g.X_FO);
  for (const SurfacePoint& contact : g.contacts) text += ShowAll(contact.u, contact.v);
  text += ShowAll(c.law, c.gains.K_p, c.gains.K_v, c.stiffness, c.damping, c.orientation, c.weight,
                  c.platform_weight, c.arm_weight, c.posture_frequency, c.f_min, c.f_max, c.mu, c.kappa,
                  c.contact_error);
  text += ShowImperfections(scenario.imperfections);
  if (const PickTask* const task = scenario.pick_task()) {
    const PickAndPlaceOptions& k = task->pick_and_place;
    text += ShowAll(task->X_Bo, task->arm_joints, k.raise, k.transport, k.approach_time, k.lower_time,
                    k.close_time, k.search_speed, k.grip_time, k.take_over_time, k.raise_time, k.arm_rate,
                    k.transport_time, k.touch_force, k.overload, k.largest_push, k.attempts, k.plan.opening);
  }
  if (const TrajectoryTask* const task = scenario.trajectory_task()) text += ShowTrajectory(task->trajectory);
  return text;
}

std::string Read(const Key& key, const std::string& value) {
  std::vector<std::string> overrides = key.before;
  if (!value.empty()) overrides.push_back(key.path + "=" + value);
  return ShowScenario(ParseScenario(kRun, "least.toml", ".", overrides));
}

TEST(ScenarioDefaults, AreThoseOfTheDocument) {
  const std::vector<Key> keys = ListKeys();
  EXPECT_GE(keys.size(), 70U);
  for (const Key& key : keys) {
    EXPECT_EQ(Read(key, key.otherwise), Read(key, "")) << key.path << " = " << key.otherwise;
    // The scenario in which the default is compared has the key.
    if (key.example == key.otherwise) continue;
    EXPECT_NE(Read(key, key.example), Read(key, "")) << key.path << " = " << key.example;
  }
}

}  // namespace
}  // namespace dexcheck::testing::scenario_defaults_test
