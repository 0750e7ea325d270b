#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/cli/commands.h"
#include "harness/cli/run_folder.h"
#include "harness/comparison/description_match.h"
#include "harness/comparison/file_comparison.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/run/runner.h"
#include "harness/scenario/runnable_robot.h"
#include "harness/scenario/stand.h"

namespace dexcheck::cli {
namespace {

namespace fs = std::filesystem;

struct InitRequest {
  fs::path robot, mjcf;
  std::string from, out;
};

constexpr const char* kWorkflow =
    R"(# Compares the two descriptions at every push. In the place of OWNER and REVISION: where dexcheck lies.
name: dexcheck
on: [push, pull_request]
jobs:
  robot:
    runs-on: ubuntu-latest
    container: debian:12
    steps:
      - uses: actions/checkout@v4
      - uses: OWNER/dexcheck/.github/actions/consistency@REVISION
        with:
          a: robot.toml
          b: robot.xml
          audit: "true"
)";

/// Runs a scenario to its end. @returns why it does not pass; empty when it does.
std::string TryScenario(const fs::path& file) {
  try {
    const ScenarioFiles files = FindScenario(file.string(), {}, /*seed=*/0);
    const Setup setup(files.scenario, files.robot, files.mjcf);
    Runner runner(setup, /*check=*/true);
    const RunResult& result = runner.Run([](const StepRecord&) {}, [] { return false; });
    if (result.verdict == Verdict::kPass) return "";
    if (!result.failure.empty()) return result.failure;
    return fmt::format("{} ({})", NameOf(result.attribution.cause), result.attribution.evidence);
  } catch (const InputError& error) {
    return error.what();
  }
}

/// A robot whose base floats stands on its feet, or, where no stance is found, is held above the ground, so
/// that its joints move all the same.
/// @param held why it is held whether or not there is a stance; empty where a stance is looked for.
std::optional<Stand> StandOrHold(const mjModel& engine, const std::map<std::string, double>& limits,
                                 const std::string& held, RunnableRobot* sources) {
  const std::string source = sources->mjcf->source();
  const auto copy = [&] {
    return std::make_unique<MjcfFile>(sources->mjcf->PrintFor(CurrentFolder()), source);
  };
  Stand stand;
  std::unique_ptr<MjcfFile> mjcf;
  RobotDescription robot;
  std::string why = held;
  // A key frame may have it lie: then as its joints are zero.
  for (int at_key = engine.nkey > 0 ? 1 : 0; at_key >= 0 && held.empty(); --at_key) {
    stand = FindStand(engine, at_key == 1);
    mjcf = copy();
    PutOnFloor(engine, stand, mjcf.get());
    robot = Describe(source, *mjcf);
    AddFeet(stand, &robot);
    why = FindPosture(ParseRobotModel(WriteParameters(robot, source), source), limits, &stand);
    if (why.empty()) break;
  }
  if (!why.empty()) {
    mjcf = copy();
    HoldBase(engine.stat.extent, mjcf.get());
    LeaveOutBaseContacts(mjcf.get());
    robot = Describe(source, *mjcf);
  }
  sources->robot = std::move(robot);
  sources->mjcf = std::move(mjcf);
  if (why.empty()) {
    Warn("contacts other than the feet's with the floor are left out; overlaps are judged by their distance");
    return stand;
  }
  Warn(source + ": the base is held: no stance was found, because " + why);
  return std::nullopt;
}

/// Writes the folder's files, the scenario with a smaller motion until its run passes.
/// @returns why none does; empty when one does, or when the two files that were given differ.
std::string WriteRunnable(const InitRequest& request, const RobotDescription& robot,
                          const std::string& parameters, const fs::path& folder, MjcfFile* mjcf,
                          std::optional<Stand>* stand, FirstMotion* motion, bool* differ) {
  TakeAssets(folder, mjcf);
  WriteFile(folder / "robot.xml", mjcf->Print());
  WriteFile(folder / "robot.toml", parameters);
  ConsistencyOptions options;
  options.samples = 100;
  options.within_digits = true;
  const Comparison compared = CompareFiles(folder / "robot.toml", folder / "robot.xml", {}, options);
  std::optional<double> tolerance;
  if (compared.Agrees()) tolerance = CalcTolerance(compared.result);
  *differ = !tolerance;
  constexpr int kHalvings = 4;
  std::string why;
  for (int k = 0; k <= kHalvings; ++k) {
    const double rounded = tolerance.value_or(0.0);
    WriteFile(folder / "motion.toml", *stand ? WriteStandScenario(robot, **stand, rounded)
                                             : WriteMotionScenario(robot, *motion, rounded));
    // Two files that differ are what a run shows.
    why = *differ && !request.mjcf.empty() ? "" : TryScenario(folder / "motion.toml");
    if (why.empty()) break;
    if (*stand) (*stand)->sway *= 0.5;
    Shrink(motion);
  }
  WriteFile(folder / "gains.toml", WriteGainStudy(stand->has_value()));
  WriteFile(folder / ".github/workflows/dexcheck.yml", kWorkflow);
  return why;
}

/// @param held why a base that floats is held; empty where a stance is looked for.
/// @returns why no motion that was tried passes; empty when the folder is made.
std::string MakeRobotFolder(const InitRequest& request, const std::string& out, const std::string& held,
                            bool* stands) {
  RunnableRobot sources = ReadRunnableRobot(request.robot, request.mjcf);
  RobotDescription& robot = sources.robot;
  const bool is_made = request.mjcf.empty() && robot.format == RobotFormat::kUrdf;
  // A robot that cannot be an MJCF is refused before there is a folder.
  MjModelPtr engine = Load(*sources.mjcf);
  const std::map<std::string, double> home = ReadHome(*engine), limits = ReadMotorLimits(*engine);
  std::optional<Stand> stand;
  if (robot.spec.base.type == BaseType::kFloating) {
    stand = StandOrHold(*engine, limits, held, &sources);
    if (!request.mjcf.empty())
      Warn("robot.toml is made of " + request.mjcf.string() +
           ", too, where the base was changed: what is wrong there is wrong in both");
    engine = Load(*sources.mjcf);
  } else if (robot.spec.base.type != BaseType::kFixed) {
    throw InputError(request.robot.string() + ": base: must be fixed or float to be run, rolls");
  }
  if (!request.mjcf.empty()) {
    // Names are the MJCF's, and what the URDF has no place for.
    RobotDescription other = Describe(request.mjcf, *sources.mjcf);
    CompleteEachOther(&other, &robot);
    TakeCompiledInertias(*sources.mjcf, *engine, &robot);
  }
  FreeCoupledJoints(&robot);
  const std::string parameters = WriteParameters(robot, request.robot.filename().string());
  FirstMotion motion;
  if (!stand) {
    const std::string table = request.robot.string() + " as a parameter file";
    motion = PlanFirstMotion(robot, ParseRobotModel(parameters, table), limits, sources.rates, home);
  }
  FreeMotors(stand ? stand->weak : motion.weak, sources.mjcf.get());
  const std::vector<std::string> overlaps =
      ExcludeOverlaps(stand ? stand->poses : motion.poses, /*with_world=*/!stand, sources.mjcf.get());
  if (!overlaps.empty()) Warn("contacts left out of what overlaps along the motion: " + JoinNames(overlaps));

  *stands = stand.has_value();
  AddSky(sources.mjcf.get());
  const TemporaryFolder made;
  bool differ = false;
  std::string why =
      WriteRunnable(request, robot, parameters, made.path(), sources.mjcf.get(), &stand, &motion, &differ);
  if (!why.empty()) return why;
  const fs::path folder = MakeRunFolder(out);
  std::error_code error;
  fs::copy(made.path(), folder, fs::copy_options::recursive, error);
  if (error) throw InputError(folder.string() + ": cannot be written: " + error.message());
  fmt::print("{}: robot.toml, robot.xml, motion.toml, gains.toml, .github/workflows/dexcheck.yml\n",
             folder.string());
  if (is_made)
    fmt::print("robot.xml was made from {}, so that an error of that file is in both\n",
               request.robot.filename().string());
  if (differ)
    fmt::print("the two files differ, so that a run fails; compare them: dexcheck consistency {} {}\n",
               request.robot.string(), (folder / "robot.xml").string());
  fmt::print(
      "next: cd {} && dexcheck run motion.toml\n      dexcheck study run gains.toml --db gains.db\n"
      "      dexcheck budget motion.toml --set actuation.delay=0.002 --set {}\n",
      folder.string(), stand ? "actuation.lag=0.002" : "sensing.joint_counts=4096");
  return "";
}

int InitRobot(const InitRequest& request) {
  const std::string out = request.out.empty() ? request.robot.stem().string() : request.out;
  RequireFree(out);
  bool stands = false;
  std::string why = MakeRobotFolder(request, out, "", &stands);
  if (!why.empty() && stands) why = MakeRobotFolder(request, out, "its run does not pass: " + why, &stands);
  if (!why.empty())
    throw InputError(
        fmt::format("{}: even the smallest motion fails its run: {}", request.robot.string(), why));
  return kSuccess;
}

int Run(const InitRequest& request) {
  if (request.from.empty() && request.robot.empty())
    throw UsageError("init: must have a URDF or an MJCF, or --from a shipped scenario");
  return request.from.empty() ? InitRobot(request) : CopyScenario(request.from, request.out);
}

}  // namespace

void AddInitCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<InitRequest>(
      app, "init",
      "Make a folder to start from: parameters, MJCF with motors, a motion, a study of its gains, CI",
      {"dexcheck init arm.urdf arm.xml --out my_arm", "dexcheck init --from panda-reach"});
  CLI::Option* const robot =
      AddOption(command, "ROBOT", &request->robot, "URDF or MJCF of a robot")->type_name("FILE");
  AddOption(command, "MJCF", &request->mjcf,
            "The same robot for the engine; made of a URDF when it is not given")
      ->type_name("FILE");
  AddOption(command, "--from SCENARIO", &request->from,
            "Copy a shipped scenario instead, with its robot (dexcheck run --list)")
      ->excludes(robot);
  AddOption(command, "--out DIR", &request->out, "Folder to make; by default named after robot or scenario");
}

}  // namespace dexcheck::cli
