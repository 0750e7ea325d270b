#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/checks/file_comparison.h"
#include "harness/cli/commands.h"
#include "harness/cli/init_motion.h"
#include "harness/cli/init_stance.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck::cli {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

struct InitRequest {
  fs::path robot;
  fs::path mjcf;
  std::string from;
  std::string out;
};

/// Copies meshes, textures and the like into the folder's assets: a log keeps what lies beside the MJCF.
void TakeAssets(const fs::path& folder, MjcfFile* mjcf) {
  int count = 0;
  for (const AssetFile& asset : ListAssetFiles(mjcf->root())) {
    // The engine names an asset that has no name by its file.
    if (asset.element->Attribute("name") == nullptr)
      asset.element->SetAttribute("name", asset.path.stem().c_str());
    const std::string to = fmt::format("assets/{}-{}", ++count, asset.path.filename().string());
    WriteFile(folder / to, ReadBytes(mjcf->folder() / asset.path));
    asset.element->SetAttribute(asset.attribute, to.c_str());
  }
  for (XMLElement* compiler : ListChildren(mjcf->root(), "compiler")) {
    for (const char* key : {"assetdir", "meshdir", "texturedir", "strippath"}) compiler->DeleteAttribute(key);
  }
}

void LeaveOutBaseContacts(MjcfFile* mjcf) {
  const std::vector<std::string> pairs = ExcludeBaseContacts(mjcf);
  if (!pairs.empty())
    Warn(mjcf->source() + ": contacts of neighbours at a joint left out: " + JoinNames(pairs));
}

MjModelPtr Load(const MjcfFile& mjcf) {
  return LoadMjcfText(mjcf.PrintFor(fs::current_path()), mjcf.source());
}

/// The user's MJCF with motors, as a run needs it.
std::unique_ptr<MjcfFile> AdaptForRun(const fs::path& source, std::map<std::string, double> limits) {
  auto mjcf = std::make_unique<MjcfFile>(source);
  // The MJCF's own come first.
  std::map<std::string, double> own = FindForceRanges(*mjcf);
  own.merge(limits);
  KeepMechanism(mjcf.get());
  AdaptMjcf(mjcf.get());
  StateNewDefaults(mjcf.get());
  RequireExactSolver(mjcf.get());
  LeaveOutOthers(*Load(*mjcf), mjcf.get());
  if (!mjcf->changes().empty()) Warn(mjcf->SummarizeChanges());
  AddMotors(mjcf.get(), own);
  LeaveOutBaseContacts(mjcf.get());
  return mjcf;
}

/// Writes the friction of joints into their elements, whatever their classes have.
void StateFriction(const std::vector<Joint>& joints, MjcfFile* mjcf) {
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    if (std::string_view(element->Name()) != "joint") return;
    for (const Joint& joint : joints) {
      if (ReadAttribute(*element, "name") != joint.name) continue;
      element->SetAttribute("damping", FormatNumber(joint.damping).c_str());
      element->SetAttribute("frictionloss", FormatNumber(joint.dry_friction).c_str());
    }
  });
}

/// Robot and MJCF of what was given; the MJCF is made of the description where there is none.
struct InitSources {
  RobotDescription robot;
  std::unique_ptr<MjcfFile> mjcf;
  std::map<std::string, double> rates;  ///< Largest that the URDF states, rad/s or m/s.
};

InitSources ReadSources(const InitRequest& request) {
  const std::string text = ReadBytes(request.robot);
  const RobotFormat format = FindFormat(text, request.robot);
  InitSources sources;
  if (format == RobotFormat::kMjcf) {
    if (!request.mjcf.empty())
      throw InputError(request.mjcf.string() + ": must stand beside a URDF, got two MJCFs");
    sources.mjcf = AdaptForRun(request.robot, {});
    sources.robot = DescriptionFile(request.robot, sources.mjcf->Print(), {}).Describe();
    return sources;
  }
  if (format != RobotFormat::kUrdf)
    throw InputError(request.robot.string() + ": must be a URDF or an MJCF, is a parameter file");
  const std::string source = request.robot.string();
  sources.robot = ParseUrdf(text, source);
  sources.rates = ReadUrdfLimits(text, source, "velocity");
  const std::map<std::string, double> limits = ReadUrdfLimits(text, source, "effort");
  if (!request.mjcf.empty()) {
    sources.mjcf = AdaptForRun(request.mjcf, limits);
    return sources;
  }
  const std::vector<int> legs = FindLegs(sources.robot);
  if (!sources.robot.states_base && !legs.empty()) {
    Warn(fmt::format("{}: floats, on {} legs that are alike; what hangs on a link \"world\" is fixed", source,
                     legs.size()));
    sources.robot = ParseUrdf(text, source, {.floating = true});
  }
  MendForEngine(&sources.robot);
  ReduceFriction(source, &sources.robot);
  sources.mjcf = std::make_unique<MjcfFile>(WriteMjcf(sources.robot, request.robot.filename().string()),
                                            source + " as an MJCF");
  if (sources.robot.spec.base.type == BaseType::kFloating)
    AddLegShapes(sources.robot, legs, sources.mjcf.get());
  AddMotors(sources.mjcf.get(), limits);
  return sources;
}

/// The sky of this program's own scenes, where the file has none: pictures have a black one otherwise.
void AddSky(MjcfFile* mjcf) {
  bool has_sky = false;
  VisitElements(mjcf->root(), [&](XMLElement* element) {
    has_sky |= std::string_view(element->Name()) == "texture" && ReadAttribute(*element, "type") == "skybox";
  });
  if (has_sky) return;
  XMLElement* const sky = RequireSection(mjcf->root(), "asset")->InsertNewChildElement("texture");
  constexpr const char* kSky[][2] = {{"type", "skybox"},         {"builtin", "gradient"},
                                     {"rgb1", "0.90 0.93 0.95"}, {"rgb2", "0.42 0.55 0.68"},
                                     {"width", "256"},           {"height", "1536"}};
  for (const auto& [attribute, value] : kSky) sky->SetAttribute(attribute, value);
}

/// Limits of motors by joint, N m or N.
std::map<std::string, double> ReadMotorLimits(const mjModel& m) {
  std::map<std::string, double> limits;
  for (int i = 0; i < m.nu; ++i) {
    if (m.actuator_ctrllimited[i] != 0)
      limits[NameOf(m, mjOBJ_ACTUATOR, i)] = m.actuator_ctrlrange[2 * i + 1];
  }
  return limits;
}

/// Where the first key frame puts joints, rad or m; nowhere without one.
std::map<std::string, double> ReadHome(const mjModel& m) {
  std::map<std::string, double> home;
  for (int joint = 0; m.nkey > 0 && joint < m.njnt; ++joint) {
    if (m.jnt_type[joint] == mjJNT_HINGE || m.jnt_type[joint] == mjJNT_SLIDE)
      home[NameOf(m, mjOBJ_JOINT, joint)] = m.key_qpos[m.jnt_qposadr[joint]];
  }
  return home;
}

/// Takes away the limits of motors that cannot carry the robot.
void FreeMotors(const std::vector<std::string>& names, MjcfFile* mjcf) {
  if (names.empty()) return;
  for (XMLElement* section : ListChildren(mjcf->root(), "actuator")) {
    for (XMLElement* motor : ListChildren(section)) {
      if (std::find(names.begin(), names.end(), ReadAttribute(*motor, "name")) != names.end())
        motor->SetAttribute("ctrllimited", "false");
    }
  }
  Warn("motors whose limits do not carry the robot along the motion run without them: " + JoinNames(names));
}

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

/// A robot whose base floats stands on its feet, or, where no stance is found, is held above the ground, so
/// that its joints move all the same.
std::optional<Stand> StandOrHold(const mjModel& engine, const std::map<std::string, double>& limits,
                                 InitSources* sources) {
  const std::string source = sources->mjcf->source();
  const auto copy = [&] {
    return std::make_unique<MjcfFile>(sources->mjcf->PrintFor(fs::current_path()), source);
  };
  const auto describe = [&](const MjcfFile& mjcf) {
    // Its files are found from the source's folder, and of this copy from the working directory.
    return DescriptionFile(source, mjcf.PrintFor(fs::absolute(source).parent_path()), {}).Describe();
  };
  Stand stand;
  std::unique_ptr<MjcfFile> mjcf;
  RobotDescription robot;
  std::string why;
  // A key frame may have it lie: then as its joints are zero.
  for (int at_key = engine.nkey > 0 ? 1 : 0; at_key >= 0; --at_key) {
    stand = FindStand(engine, at_key == 1);
    mjcf = copy();
    PutOnFloor(engine, stand, mjcf.get());
    robot = describe(*mjcf);
    AddFeet(stand, &robot);
    why = FindPosture(ParseRobotModel(WriteParameters(robot, source), source), limits, &stand);
    if (why.empty()) break;
  }
  if (!why.empty()) {
    mjcf = copy();
    HoldBase(engine.stat.extent, mjcf.get());
    LeaveOutBaseContacts(mjcf.get());
    robot = describe(*mjcf);
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

int InitRobot(const InitRequest& request) {
  const std::string out = request.out.empty() ? request.robot.stem().string() : request.out;
  RequireFree(out);
  InitSources sources = ReadSources(request);
  RobotDescription& robot = sources.robot;
  const bool is_made = request.mjcf.empty() && robot.format == RobotFormat::kUrdf;
  if (robot.spec.joints.empty()) throw InputError(request.robot.string() + ": has no joint that moves");
  for (const Joint& joint : robot.spec.joints) {
    if (joint.type == JointType::kBall)
      throw InputError(request.robot.string() + ": joint " + Quote(joint.name) +
                       ": must not be a ball joint in a run, whose law has one number for each joint");
  }
  if (robot.format == RobotFormat::kMjcf)
    StateFriction(ReduceFriction(request.robot.string(), &robot), sources.mjcf.get());
  // What cannot be an MJCF is refused before there is a folder.
  MjModelPtr engine = Load(*sources.mjcf);
  const std::map<std::string, double> home = ReadHome(*engine), limits = ReadMotorLimits(*engine);
  std::optional<Stand> stand;
  if (robot.spec.base.type == BaseType::kFloating) {
    stand = StandOrHold(*engine, limits, &sources);
    if (!request.mjcf.empty())
      Warn("robot.toml is made of " + request.mjcf.string() +
           ", too, where the base was changed: what is wrong there is wrong in both");
    engine = Load(*sources.mjcf);
  } else if (robot.spec.base.type != BaseType::kFixed) {
    throw InputError(request.robot.string() + ": base: must be fixed or float to be run, rolls");
  }
  if (!request.mjcf.empty()) {
    // Names are the MJCF's, and what the URDF has no place for.
    RobotDescription other = DescriptionFile(request.mjcf, sources.mjcf->Print(), {}).Describe();
    CompleteEachOther(&other, &robot);
    TakeCompiledInertias(*sources.mjcf, *engine, &robot);
  }
  const RobotDescription stated = robot;
  FreeCoupledJoints(&robot);
  const std::string parameters = WriteParameters(robot, request.robot.filename().string());
  InitMotion motion;
  if (!stand) {
    const std::string table = request.robot.string() + " as a parameter file";
    motion = PlanInitMotion(stated, ParseRobotModel(parameters, table), limits, sources.rates, home);
  }
  FreeMotors(stand ? stand->weak : motion.weak, sources.mjcf.get());
  const std::vector<std::string> overlaps =
      ExcludeOverlaps(stand ? stand->poses : motion.poses, sources.mjcf.get());
  if (!overlaps.empty()) Warn("contacts left out of what overlaps along the motion: " + JoinNames(overlaps));

  const RunFolder folder(out, "");
  const fs::path table = folder.path() / "robot.toml", mjcf = folder.path() / "robot.xml";
  AddSky(sources.mjcf.get());
  TakeAssets(folder.path(), sources.mjcf.get());
  WriteFile(mjcf, sources.mjcf->Print());
  WriteFile(table, parameters);
  const std::optional<double> tolerance = FindTolerance(table, mjcf);
  const double rounded = tolerance.value_or(0.0);
  WriteFile(folder.path() / "motion.toml",
            stand ? WriteStandScenario(robot, *stand, rounded) : WriteInitScenario(robot, motion, rounded));
  WriteFile(folder.path() / "gains.toml", WriteGainStudy(stand.has_value()));
  WriteFile(folder.path() / ".github/workflows/dexcheck.yml", kWorkflow);
  fmt::print("{}: robot.toml, robot.xml, motion.toml, gains.toml, .github/workflows/dexcheck.yml\n",
             folder.path().string());
  if (is_made)
    fmt::print("robot.xml was made of {}: what is wrong there is wrong in both\n",
               request.robot.filename().string());
  if (!tolerance)
    fmt::print("the two differ, and a run will say so: dexcheck consistency {} {}\n", request.robot.string(),
               mjcf.string());
  fmt::print(
      "next: cd {} && dexcheck run motion.toml\n      dexcheck study run gains.toml --db gains.db\n"
      "      dexcheck budget motion.toml --set actuation.delay=0.002 --set {}\n",
      folder.path().string(), stand ? "actuation.lag=0.002" : "sensing.joint_counts=4096");
  return kSuccess;
}

int Run(const InitRequest& request) {
  if (request.from.empty() && request.robot.empty())
    throw UsageError("init: must have a URDF or an MJCF, or --from a shipped scenario");
  return request.from.empty() ? InitRobot(request) : CopyScenario(request.from, request.out);
}

}  // namespace

void AddInitCommand(Command app) {
  const auto request = std::make_shared<InitRequest>();
  Command command = app.AddCommand(
      "init",
      "Make a folder to start from: parameters, MJCF with motors, a motion, a study of its gains, CI");
  const Option robot =
      command.AddOption("ROBOT", &request->robot, "URDF or MJCF of a robot").TypeName("FILE");
  command
      .AddOption("MJCF", &request->mjcf, "The same robot for the engine; made of a URDF when it is not given")
      .TypeName("FILE");
  command
      .AddOption("--from SCENARIO", &request->from,
                 "Copy a shipped scenario instead, with its robot (dexcheck run --list)")
      .Excludes(robot);
  command.AddOption("--out DIR", &request->out,
                    "Folder to make; named after the robot or scenario by default");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
