#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/checks/file_comparison.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/mjcf_writer.h"
#include "harness/descriptions/parameter_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck::cli {
namespace {

namespace fs = std::filesystem;

struct InitRequest {
  fs::path robot;
  fs::path mjcf;
  std::string from;
  std::string out;
  UrdfOptions urdf;
};

void WriteFile(const fs::path& path, const std::string& text) { OutputFile(path).Write(text); }

void CopyFile(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  WriteFile(to, ReadBytes(from));
}

/// Copies meshes, textures and the like into the folder's assets: a log keeps what lies beside the MJCF.
void TakeAssets(const fs::path& folder, MjcfFile* mjcf) {
  AssetFolders places;
  for (const tinyxml2::XMLElement* compiler : ListChildren(mjcf->root(), "compiler")) places.Read(*compiler);
  int count = 0;
  VisitElements(mjcf->root(), [&](tinyxml2::XMLElement* element) {
    const std::string_view kind = element->Name();
    for (const char* attribute : ListAssetAttributes(kind)) {
      const std::string name = ReadAttribute(*element, attribute);
      if (name.empty()) continue;
      // The engine names an asset that has no name by its file.
      if (element->Attribute("name") == nullptr) element->SetAttribute("name", fs::path(name).stem().c_str());
      const fs::path from =
          mjcf->folder() / places.Find(kind == "texture" ? places.textures : places.meshes, name);
      const std::string to = fmt::format("assets/{}-{}", ++count, from.filename().string());
      CopyFile(from, folder / to);
      element->SetAttribute(attribute, to.c_str());
    }
  });
  for (tinyxml2::XMLElement* compiler : ListChildren(mjcf->root(), "compiler")) {
    for (const char* key : {"assetdir", "meshdir", "texturedir", "strippath"}) compiler->DeleteAttribute(key);
  }
}

/// The MJCF with motors, as a run needs it: of the user's, or of the description where there is none.
std::string MakeMjcf(const InitRequest& request, const RobotDescription& robot, const fs::path& folder) {
  const fs::path source = robot.format == RobotFormat::kMjcf ? request.robot : request.mjcf;
  const fs::path from_here = fs::current_path();
  std::map<std::string, double> limits;
  if (robot.format == RobotFormat::kUrdf)
    limits = ReadUrdfEfforts(ReadTextFile(request.robot.string()), request.robot.string());
  if (source.empty()) {
    MjcfFile mjcf(WriteMjcf(robot, request.robot.filename().string()),
                  request.robot.string() + " as an MJCF");
    AddMotors(&mjcf, limits);
    LoadMjcfText(mjcf.PrintFor(from_here), mjcf.source());
    return mjcf.Print();
  }
  MjcfFile mjcf(source);
  // The MJCF's own come first.
  std::map<std::string, double> own = FindForceRanges(mjcf);
  own.merge(limits);
  AdaptMjcf(&mjcf);
  StateNewDefaults(&mjcf);
  AddMotors(&mjcf, own);
  for (const std::string& pair : ExcludeBaseContacts(&mjcf))
    Warn(source.string() + ": contact of " + pair + " left out: neighbours at a joint");
  LoadMjcfText(mjcf.PrintFor(from_here), source.string());
  TakeAssets(folder, &mjcf);
  return mjcf.Print();
}

/// One joint's part of the motion: where it begins and where it goes, well within its range.
struct JointSpan {
  double start = 0.0;
  double end = 0.0;
};

JointSpan ChooseSpan(const Joint& joint, bool states_range) {
  constexpr double kMargin = 0.2;  // of the range, at either end
  const double most = joint.type == JointType::kPrismatic ? 0.05 : 0.3;
  const double width = states_range ? joint.upper - joint.lower : 2.0 * most;
  const double low = states_range ? joint.lower + kMargin * width : -most;
  const double high = states_range ? joint.upper - kMargin * width : most;
  JointSpan span;
  span.start = std::clamp(0.0, low, high);
  const double step = std::min(most, 0.5 * (high - low));
  span.end = span.start + step <= high ? span.start + step : span.start - step;
  return span;
}

std::string WriteScenario(const RobotDescription& robot, double tolerance) {
  const bool has_friction = std::any_of(robot.spec.joints.begin(), robot.spec.joints.end(),
                                        [](const Joint& joint) { return joint.dry_friction > 0.0; });
  std::vector<JointSpan> spans;
  std::string start, there, back, friction;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    JointSpan span = ChooseSpan(joint, robot.joints[i].states_range);
    if (joint.coupling && joint.coupling->leader < static_cast<int>(i)) {
      const JointSpan& leader = spans[static_cast<size_t>(joint.coupling->leader)];
      span = {joint.coupling->multiplier * leader.start + joint.coupling->offset,
              joint.coupling->multiplier * leader.end + joint.coupling->offset};
    }
    spans.push_back(span);
    const auto add = [&](double value, std::string* list) {
      *list += fmt::format("{}{} = {}", list->empty() ? "" : ", ", Quote(joint.name), FormatNumber(value, 4));
    };
    add(span.start, &start);
    add(span.end, &there);
    add(span.start, &back);
    add(joint.dry_friction, &friction);
  }
  return fmt::format(
      R"(# A motion of the joints within their ranges, by computed torque, checked at every step.
name = "motion"
description = "each joint leaves its place and comes back"
duration = 4.0
settle = 0.5
start = "rest"
{}
[model]
file = "robot.toml"

[plant]
mjcf = "robot.xml"

[joint_motion]
start = {{ {} }}
points = [
  {{ time = 2, joints = {{ {} }} }},
  {{ time = 4, joints = {{ {} }} }},
]

[control]
law = "computed_torque"
natural_frequency = 10
damping_ratio = 1
{}{})",
      tolerance > 0.0 ? fmt::format("# Numbers that were rounded when they were printed agree to this.\n"
                                    "tolerance = {}\n",
                                    FormatNumber(tolerance, 1))
                      : "",
      start, there, back,
      has_friction ? fmt::format("# Dry friction, compensated along the desired rates.\ncoulomb = {{ {} }}\n",
                                 friction)
                   : "",
      has_friction ? "" : "\n[expect]\njoints = 0.01\n");
}

constexpr const char* kStudy = R"(# Which gains follow the motion best, with margins that an arm needs.
name = "gains"
description = "natural frequency x damping ratio of the motion"
scenario = "motion.toml"
set = ["expect={}"]
metrics = ["joint_error_rms", "peak_effort", "gain_margin", "phase_margin"]
# A gain margin of 6 dB and a phase margin of 45 degrees.
constraints = ["peak_effort < 1", "gain_margin > 2", "phase_margin > 0.785"]

[[objective]]
minimize = "joint_error_rms"

[[vary]]
key = "control.natural_frequency"
from = 5
to = 500
count = 6
spacing = "log"

[[vary]]
key = "control.damping_ratio"
from = 0.5
to = 2
count = 3
spacing = "log"
)";

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

/// To what the two agree where they do not to rounding: a tolerance for runs. 0 to rounding; none when they
/// differ.
std::optional<double> FindTolerance(const fs::path& table, const fs::path& mjcf) {
  ConsistencyOptions options;
  options.samples = 100;
  options.within_digits = true;
  const ConsistencyResult result = CompareFiles(table, mjcf, {}, options).result;
  if (!result.Agrees()) return std::nullopt;
  double worst = 0.0;
  for (const auto* records : {&result.constants.records, &result.terms}) {
    for (const CheckRecord& record : *records) {
      if (record.worst > record.bound) worst = std::max(worst, record.worst);
    }
  }
  // Rates of a motion are other ones than the states that were compared.
  return worst > 0.0 ? std::pow(10.0, std::ceil(std::log10(worst)) + 1.0) : 0.0;
}

int InitRobot(const InitRequest& request) {
  RobotDescription robot = ReadDescription(request.robot, request.urdf);
  if (robot.format == RobotFormat::kToml)
    throw InputError(request.robot.string() + ": must be a URDF or an MJCF, is a parameter file");
  if (robot.format == RobotFormat::kMjcf && !request.mjcf.empty())
    throw InputError(request.mjcf.string() + ": must stand beside a URDF, got two MJCFs");
  if (robot.spec.base.type != BaseType::kFixed)
    throw InputError(request.robot.string() + ": base: must be fixed to be run, floats");
  // What cannot be an MJCF is refused before there is a folder.
  if (robot.format == RobotFormat::kUrdf && request.mjcf.empty()) MakeMjcf(request, robot, {});
  const RunFolder folder(request.out.empty() ? request.robot.stem().string() : request.out, "");
  const fs::path mjcf = folder.path() / "robot.xml";
  WriteFile(mjcf, MakeMjcf(request, robot, folder.path()));
  if (!request.mjcf.empty()) {
    // Names are the MJCF's, and what the URDF has no place for.
    RobotDescription other = ReadDescription(mjcf);
    CompleteEachOther(&other, &robot);
    const MjcfFile document(mjcf);
    TakeCompiledInertias(document, *LoadMjcf(mjcf), &robot);
  }
  const fs::path table = folder.path() / "robot.toml";
  const std::string parameters = WriteParameters(robot, request.robot.filename().string());
  ParseRobotModel(parameters, request.robot.string() + " as a parameter file");
  WriteFile(table, parameters);
  const std::optional<double> tolerance = FindTolerance(table, mjcf);
  WriteFile(folder.path() / "motion.toml", WriteScenario(robot, tolerance.value_or(0.0)));
  WriteFile(folder.path() / "gains.toml", kStudy);
  fs::create_directories(folder.path() / ".github/workflows");
  WriteFile(folder.path() / ".github/workflows/dexcheck.yml", kWorkflow);
  fmt::print("{}: robot.toml, robot.xml, motion.toml, gains.toml, .github/workflows/dexcheck.yml\n",
             folder.path().string());
  if (request.mjcf.empty() && robot.format == RobotFormat::kUrdf)
    fmt::print("robot.xml was made of {}: what is wrong there is wrong in both\n",
               request.robot.filename().string());
  if (!tolerance)
    fmt::print("the two differ, and a run will say so: dexcheck consistency {} {}\n", request.robot.string(),
               mjcf.string());
  fmt::print(
      "next: cd {} && dexcheck run motion.toml\n      dexcheck study run gains.toml --db gains.db\n"
      "      dexcheck budget motion.toml --set actuation.delay=0.002 --set sensing.joint_counts=4096\n",
      folder.path().string());
  return kSuccess;
}

/// Puts a key's line into a table of the text; an own table at its end when it has none.
void InsertKey(const std::string& table, const std::string& line, std::string* text) {
  const std::string header = "[" + table + "]\n";
  const size_t at = text->starts_with(header) ? 0 : text->find("\n" + header);
  if (at == std::string::npos) {
    *text += "\n" + header + line;
  } else {
    text->insert(text->find(header, at) + header.size(), line);
  }
}

int InitFrom(const InitRequest& request) {
  const fs::path source = kScenarios.Find(request.from);
  const ScenarioFiles files = FindScenario(request.from, {}, 0);
  const std::vector<std::string> parts = ListMjcfFiles(files.mjcf);
  const RunFolder folder(request.out.empty() ? source.stem().string() : request.out, "");
  std::string text = ReadTextFile(source.string());
  // As the scenario writes the files: from its own folder.
  const auto refer = [&](const std::string& stated, const char* table, const char* key,
                         const fs::path& file) {
    const std::string name = file.filename().string();
    const std::string written = fs::path(stated).lexically_relative(source.parent_path()).generic_string();
    const size_t at = stated.empty() ? std::string::npos : text.find('"' + written + '"');
    if (at == std::string::npos) {
      InsertKey(table, fmt::format("{} = \"{}\"\n", key, name), &text);
    } else {
      text.replace(at + 1, written.size(), name);
    }
  };
  refer(files.scenario.model_file, "model", "file", files.robot);
  refer(files.scenario.mjcf_file, "plant", "mjcf", files.mjcf);
  WriteFile(folder.path() / files.robot.filename(), ReadTextFile(files.robot.string()));
  for (const std::string& part : parts) CopyFile(files.mjcf.parent_path() / part, folder.path() / part);
  const fs::path scenario = folder.path() / source.filename();
  WriteFile(scenario, text);
  FindScenario(scenario.string(), {}, 0);
  fmt::print("{0}: {1}, {2}, {3}\nnext: cd {0} && dexcheck run {1}\n", folder.path().string(),
             scenario.filename().string(), files.robot.filename().string(), files.mjcf.filename().string());
  return kSuccess;
}

int Run(const InitRequest& request) {
  if (request.from.empty() && request.robot.empty())
    throw UsageError("init: must have a URDF or an MJCF, or --from a shipped scenario");
  return request.from.empty() ? InitRobot(request) : InitFrom(request);
}

}  // namespace

void AddInitCommand(Command app) {
  const auto request = std::make_shared<InitRequest>();
  Command command = app.AddCommand(
      "init",
      "Make a folder to start from: parameters, MJCF with motors, a motion, a study of its gains, CI");
  const Option robot = command.AddOption("ROBOT", &request->robot, "URDF or MJCF of an arm").TypeName("FILE");
  command
      .AddOption("MJCF", &request->mjcf, "The same arm for the engine; made of a URDF when it is not given")
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
