#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/descriptions/parameter_writer.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/robot_file.h"
#include "harness/engine/add_motors.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_assets.h"
#include "harness/engine/mjcf_files.h"
#include "harness/engine/newer_mjcf.h"

namespace dexcheck::cli {
namespace {

struct ImportRequest {
  std::filesystem::path source;
  std::string out = "-";
  std::vector<std::string> packages;
  bool floating = false;
  bool downgrade = false;
  bool motors = false;
};

RobotDescription ReadSource(const ImportRequest& request) {
  if (FindFormat(request.source) == RobotFormat::kToml) {
    throw InputError(request.source.string() + ": must be a URDF or an MJCF, is a parameter file already");
  }
  UrdfOptions options;
  options.packages.assign(request.packages.begin(), request.packages.end());
  options.floating = request.floating;
  return ReadDescription(request.source, options);
}

/// A copy of an MJCF, for MuJoCo 2.2.2 or with motors.
int WriteCopy(const ImportRequest& request) {
  JoinedMjcf mjcf(request.source);
  if (mjcf.IsUrdf()) throw InputError(request.source.string() + ": must be an MJCF, got a URDF");
  const std::filesystem::path from = std::filesystem::absolute(request.source).parent_path();
  if (request.downgrade) {
    AdaptMjcf(from, &mjcf);
    StateNewDefaults(&mjcf);
  }
  if (request.motors) AddMotors(from, &mjcf);
  std::string copy = mjcf.Print();
  // What cannot be loaded must not be written.
  LoadMjcfText(MoveMjcf(copy, request.source.string(), from, std::filesystem::current_path()),
               request.source.string());
  const std::filesystem::path to = std::filesystem::absolute(request.out).parent_path();
  std::error_code error;
  if (request.out != "-" && !std::filesystem::equivalent(from, to, error))
    copy = MoveMjcf(copy, request.source.string(), from, to);
  OutputFile file(request.out);
  file.Write(copy);
  for (const MjcfChange& change : mjcf.changes()) {
    Warn(std::filesystem::path(change.file).filename().string() + ":" + std::to_string(change.line) + ": " +
         change.word + ": " + change.what);
  }
  return kSuccess;
}

int Run(const ImportRequest& request) {
  if (request.downgrade || request.motors) return WriteCopy(request);
  const RobotDescription robot = ReadSource(request);
  const std::string text = WriteParameters(robot, request.source.filename().string());
  // What cannot be read back must not be written: a name that is too long, for example.
  ParseRobotModel(text, request.source.string() + " as a parameter file");
  OutputFile file(request.out);
  file.Write(text);
  return kSuccess;
}

}  // namespace

void AddImportCommand(Command app) {
  const auto request = std::make_shared<ImportRequest>();
  Command command =
      app.AddCommand("import", "Write a parameter file (TOML) from a URDF or an MJCF, to start from");
  command.AddOption("FILE", &request->source, "URDF or MJCF").Required();
  command.AddOption("--out", &request->out, "File to write (- for standard output)")
      .TypeName("FILE.toml")
      .ShowDefault();
  command.AddOption("--package", &request->packages, "Folder of a URDF's packages; its meshes are looked for")
      .TypeName("PATH")
      .Repeatable();
  command.AddFlag("--floating", &request->floating, "The root of a URDF floats");
  command.AddFlag(
      "--downgrade", &request->downgrade,
      "Write an MJCF instead: a copy of a newer one for MuJoCo 2.2.2, without what has no effect on the "
      "dynamics");
  command.AddFlag("--motors", &request->motors,
                  "Write an MJCF instead: a copy with a torque motor for each joint, as run needs it, in the "
                  "place of all actuators");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
