#include <filesystem>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"

namespace dexcheck::cli {
namespace {

struct ImportRequest : Outputs {
  std::filesystem::path source;
  std::string out = "-";
  UrdfOptions urdf;
  bool downgrade = false;
  bool motors = false;
};

/// Writes what was read, and what of it was left out.
void WriteJson(const ImportRequest& request, const RobotDescription* robot,
               const std::vector<MjcfChange>& changes) {
  Json json = {{"source", request.source.string()}, {"out", request.out}};
  if (robot != nullptr) {
    const BaseType base = robot->spec.base.type;
    json["robot"] = robot->spec.name;
    json["base"] = {{"link", robot->spec.base.link}, {"floats", base == BaseType::kFloating}};
    json["joints"] = Json::array();
    for (const Joint& joint : robot->spec.joints) json["joints"].push_back(joint.name);
    json["links"] = Json::array();
    for (const DescribedPart& part : robot->parts) json["links"].push_back(part.name);
    json["notes"] = robot->notes;
    for (const std::string& note : ListLoadNotes()) json["notes"].push_back(note);
  }
  json["changes"] = Json::array();
  for (const MjcfChange& change : changes) {
    json["changes"].push_back(
        {{"file", change.file}, {"line", change.line}, {"word", change.word}, {"what", change.what}});
  }
  OutputFile(request.json_file).Write(json);
}

/// The copy or table, unless the JSON takes its place on standard output.
void WriteOut(const ImportRequest& request, const std::string& text) {
  if (request.out != "-" || request.json_file != "-") OutputFile(request.out).Write(text);
}

RobotDescription ReadSource(const ImportRequest& request) {
  RobotDescription robot = ReadDescription(request.source, request.urdf);
  if (robot.format != RobotFormat::kToml) return robot;
  throw InputError(request.source.string() + ": must be a URDF or an MJCF, is a parameter file already");
}

/// A copy of an MJCF, for MuJoCo 2.2.2 or with motors.
int WriteCopy(const ImportRequest& request) {
  MjcfFile mjcf(request.source);
  if (mjcf.IsUrdf()) throw InputError(request.source.string() + ": must be an MJCF, got a URDF");
  const std::map<std::string, double> limits = FindForceRanges(mjcf);
  if (request.downgrade) {
    AdaptMjcf(&mjcf);
    StateNewDefaults(&mjcf);
  }
  if (request.motors) AddMotors(&mjcf, limits);
  // A file that cannot be loaded must not be written.
  LoadMjcfText(mjcf.PrintFor(CurrentFolder()), request.source.string());
  const std::filesystem::path to = MakeAbsolute(request.out).parent_path();
  std::error_code error;
  const bool stays = request.out == "-" || std::filesystem::equivalent(mjcf.folder(), to, error);
  WriteOut(request, stays ? mjcf.Print() : mjcf.PrintFor(to));
  for (const MjcfChange& change : mjcf.changes()) {
    Warn(std::filesystem::path(change.file).filename().string() + ":" + std::to_string(change.line) + ": " +
         change.word + ": " + change.what);
  }
  WriteJson(request, nullptr, mjcf.changes());
  return kSuccess;
}

int Run(const ImportRequest& request) {
  if (request.downgrade || request.motors) return WriteCopy(request);
  const RobotDescription robot = ReadSource(request);
  const std::string text = WriteParameters(robot, request.source.filename().string());
  // A file that cannot be read back must not be written: with a name that is too long, for example.
  ParseRobotModel(text, request.source.string() + " as a parameter file");
  WriteOut(request, text);
  WriteJson(request, &robot, {});
  return kSuccess;
}

}  // namespace

void AddImportCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<ImportRequest>(
      app, "import", "Write a parameter file (TOML) from a URDF or an MJCF, to start from",
      {"dexcheck import arm.urdf --out arm.toml", "dexcheck import newer.xml --downgrade --out arm.xml"});
  AddOption(command, "FILE", &request->source, "URDF or MJCF")->required();
  AddOption(command, "--out FILE.toml", &request->out, "File to write (- for standard output)")
      ->capture_default_str();
  AddUrdfOptions(command, &request->urdf);
  command->add_flag("--downgrade", request->downgrade,
                    "Write an MJCF for MuJoCo 2.2.2, without parts that have no effect on the dynamics");
  command->add_flag("--motors", request->motors,
                    "Write an MJCF with a torque motor for each joint, as run needs it");
  AddJsonOption(command, "what was read, and what was left out or changed", &request->json_file);
}

}  // namespace dexcheck::cli
