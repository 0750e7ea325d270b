// Does a right robot with a right law ever raise an alarm? Runs shipped scenarios, by default all of them,
// over seeds, time steps and impedances of the contacts, and tells how much of its bound each check takes.
//
//   false_alarms [--scenarios A,B] [--seeds N] [--steps MS,MS] [--impedances D,D] [--duration S]
//                [--set KEY=VALUE] [--draws N] [--first K]
//
// With --draws, runs K to K + N - 1 of a list without end: scenario, law, plant, step, impedance, seed and
// what is not ideal are drawn from the run's number alone. Otherwise seeds are tried with the scenario's own
// plant, steps and impedances in all combinations with seed 0. A duration of 0 is the scenario's own. Exit
// code 1 after an alarm.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing {
namespace {

/// Expected cause of a scenario: "none" unless an assumption breaks on purpose.
const std::map<std::string, std::string> kExpectedCause = {{"paper-rest", "wheel slip"}};
/// A fraction of the bound from which on a check is told, below an alarm.
constexpr double kNear = 0.5;

std::vector<std::string> ListShipped() {
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(SourcePath("/harness/shipped/scenarios"))) {
    if (file.path().extension() == ".toml") names.push_back(file.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

struct Options {
  std::vector<std::string> scenarios = ListShipped();
  int seeds = 20;
  std::vector<std::string> steps = {"0.25", "0.5", "1", "2"};  // ms
  std::vector<std::string> impedances = {"0.9", "0.99", "0.999"};
  std::string duration = "4";
  std::vector<std::string> overrides;
  int draws = 0;
  int first = 0;
};

/// One run's choices.
struct Choice {
  std::string scenario;
  std::uint64_t seed = 0;
  std::vector<std::string> overrides;
  [[nodiscard]] std::string Describe() const {
    std::string text = fmt::format("{} --seed {}", scenario, seed);
    for (const std::string& assignment : overrides) text += " --set " + assignment;
    return text;
  }
};

struct Largest {
  double fraction = 0.0;
  std::string where;
};

std::vector<std::string> Split(const std::string& list) {
  std::vector<std::string> parts;
  std::istringstream stream(list);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

Options ReadOptions(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i], value = argv[i + 1];
    if (key == "--scenarios")
      options.scenarios = Split(value);
    else if (key == "--seeds")
      options.seeds = std::stoi(value);
    else if (key == "--steps")
      options.steps = Split(value);
    else if (key == "--impedances")
      options.impedances = Split(value);
    else if (key == "--duration")
      options.duration = value;
    else if (key == "--set")
      options.overrides.push_back(value);
    else if (key == "--draws")
      options.draws = std::stoi(value);
    else if (key == "--first")
      options.first = std::stoi(value);
    else
      throw InputError("unknown option " + key);
  }
  if (argc % 2 == 0) throw InputError("every option has a value");
  return options;
}

/// Declarations of sensing, motors and plant that do not break the paper's assumptions: "<a..b>" stands for a
/// number drawn evenly over decades, "<a|b>" for one of both. The object's come last.
const std::vector<std::vector<std::string>> kDeclared = {
    {"sensing.joint_counts=<16384|65536|1048576>"},
    {"sensing.joint_counts=<65536|1048576>", "sensing.velocity=kalman",
     "sensing.kalman_acceleration=<5..50>"},
    {"sensing.joint_noise=<1e-7..1e-5>", "sensing.velocity=differenced", "sensing.velocity_cutoff=<20..80>"},
    {"sensing.joint_noise=<1e-8..1e-6>"},
    {"sensing.velocity_noise=<1e-6..3e-4>"},
    {"sensing.latency=<0.002|0.004>"},
    {"actuation.torque_step=<1e-5..3e-3>"},
    {"actuation.gain_error=<1e-4..1e-2>"},
    {"actuation.delay=<0.0005|0.0015|0.002>"},
    {"actuation.lag=<5e-4..3e-3>"},
    {"actuation.coulomb=<1e-3..3e-2>"},
    {"actuation.coulomb=<1e-3..1e-2>", "actuation.stribeck=<1e-2..3e-2>",
     "actuation.stribeck_velocity=<0.01..0.1>"},
    {"actuation.backlash=<1e-5..1e-3>"},
    {"mismatch.mass_within=<1e-3..3e-2>"},
    {"mismatch.mass=<0.97|1.01|1.03>"},
    {"mismatch.damping=<0.8|1.2|1.5>"},
    {"mismatch.armature=<0.9|1.2>"},
    {"disturbance=[{ type = 'slope', slope = [<1e-4..3e-3>, <1e-4..3e-3>] }]"},
    {"control.kappa=integrated"},
    {"sensing.object_position_noise=<1e-6..3e-5>", "sensing.object_velocity=kalman",
     "sensing.object_acceleration=<2..10>"},
    {"sensing.object_orientation_noise=<1e-6..1e-4>", "sensing.object_velocity=kalman",
     "sensing.object_acceleration=<2..10>"},
    {"sensing.object_rate=250", "sensing.object_latency=<0.004|0.008>",
     "sensing.object_velocity=differenced"},
    {"sensing.contact_force_noise=<1e-4..1e-2>"},
    {"disturbance=[{ type = 'pulse', body = 'object', force = [0, 0, <0.05..0.5>], begin = 0.05, duration = "
     "0.1 }]"},
    {"disturbance=[{ type = 'step', body = 'object', force = [<0.01..0.3>, 0, 0], begin = 0.03 }]"},
    {"disturbance=[{ type = 'sine', body = 'object', torque = [0, 0, <1e-4..1e-2>], frequency = <3..30> }]"},
    {"disturbance=[{ type = 'noise', body = 'object', force = [<1e-3..3e-2>, <1e-3..3e-2>, 0], frequency = "
     "<5..50> }]"},
};
constexpr size_t kOfJoints = 18;  // of them, those that every robot can have

/// The text with its sizes drawn.
std::string DrawSizes(std::string text, std::mt19937_64* random) {
  for (size_t begin = text.find('<'); begin != std::string::npos; begin = text.find('<')) {
    const size_t end = text.find('>', begin);
    const std::string inside = text.substr(begin + 1, end - begin - 1);
    const size_t dots = inside.find("..");
    std::string drawn;
    if (dots == std::string::npos) {
      std::vector<std::string> choices;
      std::istringstream stream(inside);
      for (std::string one; std::getline(stream, one, '|');) choices.push_back(one);
      drawn = choices[(*random)() % choices.size()];
    } else {
      const double low = std::stod(inside.substr(0, dots)), high = std::stod(inside.substr(dots + 2));
      const double part = static_cast<double>((*random)() >> 11) * 0x1p-53;
      drawn = fmt::format("{:.4g}", low * std::pow(high / low, part));
    }
    text.replace(begin, end - begin + 1, drawn);
  }
  return text;
}

/// The run of this number.
Choice Draw(int number, const Options& options) {
  std::mt19937_64 random(static_cast<std::uint64_t>(number));
  const auto pick = [&](const auto& list) { return list[random() % std::size(list)]; };
  Choice choice;
  do choice.scenario = pick(options.scenarios);
  while (kExpectedCause.contains(choice.scenario));
  choice.seed = random() % 20;
  choice.overrides = options.overrides;
  if (std::stod(options.duration) > 0.0) choice.overrides.push_back("duration=" + options.duration);
  const Scenario scenario = ReadShippedScenario(choice.scenario);
  const bool moves_joints = scenario.joint_task() != nullptr;
  bool is_as_written = true;  // as far as the scenario's expectation goes
  if (scenario.pick_task() == nullptr && !scenario.plant.bonded && random() % 3 == 0)
    choice.overrides.push_back(std::string("plant.type=") + (random() % 2 == 0 ? "rigid" : "rigid_euler"));
  else if (scenario.plant.type == PlantType::kEngine)
    choice.overrides.push_back("plant.contact_impedance=" + pick(options.impedances));
  if (scenario.pick_task() == nullptr && scenario.plant.type == PlantType::kEngine)
    choice.overrides.push_back(fmt::format("plant.time_step={}", 1e-3 * std::stod(pick(options.steps))));
  if (scenario.pick_task() == nullptr && random() % 2 == 0) {
    const char* const laws[] = {"pd_gravity", "feedforward_pd", "operational_space", "impedance"};
    choice.overrides.push_back(std::string("control.law=") +
                               (moves_joints ? laws[random() % 2] : pick(laws)));
    is_as_written = false;
  }
  const bool is_real = !scenario.imperfections.is_ideal();
  for (auto count = is_real || scenario.pick_task() != nullptr ? 0 : random() % 3; count > 0; --count) {
    for (const std::string& one : kDeclared[random() % (moves_joints ? kOfJoints : kDeclared.size())])
      choice.overrides.push_back(DrawSizes(one, &random));
    is_as_written = false;
  }
  if (!is_as_written) choice.overrides.emplace_back("expect={}");
  return choice;
}

std::vector<Choice> ListChoices(const Options& options) {
  std::vector<Choice> choices;
  for (int i = 0; i < options.draws; ++i) choices.push_back(Draw(options.first + i, options));
  if (options.draws > 0) return choices;
  for (const std::string& scenario : options.scenarios) {
    std::vector<std::string> always = options.overrides;
    if (std::stod(options.duration) > 0.0) always.push_back("duration=" + options.duration);
    for (int seed = 1; seed <= options.seeds; ++seed)
      choices.push_back({scenario, static_cast<std::uint64_t>(seed), always});
    for (const std::string& step : options.steps) {
      for (const std::string& impedance : options.impedances) {
        Choice choice{scenario, 0, always};
        choice.overrides.push_back(fmt::format("plant.time_step={}", 1e-3 * std::stod(step)));
        choice.overrides.push_back("plant.contact_impedance=" + impedance);
        choices.push_back(choice);
      }
    }
  }
  return choices;
}

/// @return whether the run came to what it should.
bool Try(const Choice& choice, std::map<std::string, Largest>* largest) {
  ShippedRun run(choice.scenario, choice.overrides, choice.seed);
  const RunResult& result = run.Run();
  const auto expected = kExpectedCause.find(choice.scenario);
  const std::string cause = NameOf(result.attribution.cause);
  const bool cut = run.loop().task() != nullptr;  // a task that is cut short has failed, and nothing is wrong
  const bool right = expected == kExpectedCause.end() ? cause == "none" && (cut || result.failure.empty())
                                                      : cause == expected->second;
  for (const Explanation& one : expected == kExpectedCause.end() ? result.causes : Causes())
    fmt::print("CAUSE {}: {}\n", choice.Describe(), one.Describe());
  if (!right) {
    fmt::print("ALARM {}: {}: {} {}\n", choice.Describe(), cause, result.attribution.evidence,
               result.failure);
  }
  std::string told;
  for (const CheckRecord& check : run.loop().checks().motion_checks()) {
    if (!check.applies || check.bound <= 0.0 || check.name == "closed_loop_spectral_radius") continue;
    const double fraction = check.worst / check.bound;
    if (expected == kExpectedCause.end() && fraction > (*largest)[check.name].fraction)
      (*largest)[check.name] = {fraction, choice.Describe()};
    if (fraction > kNear) told += fmt::format(" {} {:.2g} of {:.2g}", check.name, check.worst, check.bound);
  }
  if (!right || (!told.empty() && expected == kExpectedCause.end()))
    fmt::print("  {}:{}\n", choice.Describe(), told);
  std::cout.flush();
  return right && (result.causes.empty() || expected != kExpectedCause.end());
}

int RunCampaign(const Options& options) {
  std::map<std::string, Largest> largest;
  long runs = 0, alarms = 0, refused = 0;
  for (const Choice& choice : ListChoices(options)) {
    // A variation that no run can be made of, such as a grasp that is out of reach, raises no alarm.
    try {
      ++runs;
      alarms += Try(choice, &largest) ? 0 : 1;
    } catch (const InputError& error) {
      ++refused;
      fmt::print("refused {}: {}\n", choice.Describe(), error.what());
    }
  }
  fmt::print("\n{:<24}{:>16}  in\n", "check", "fraction of bound");
  for (const auto& [name, at] : largest) fmt::print("{:<24}{:>16.3g}  {}\n", name, at.fraction, at.where);
  fmt::print("{} false alarms in {} runs, {} refused\n", alarms, runs - refused, refused);
  // A campaign that runs next to nothing says nothing.
  return alarms == 0 && 2 * refused <= runs ? 0 : 1;
}

}  // namespace
}  // namespace dexcheck::testing

int main(int argc, char** argv) {
  try {
    return dexcheck::testing::RunCampaign(dexcheck::testing::ReadOptions(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "false_alarms: {}\n", error.what());
    return 2;
  }
}
