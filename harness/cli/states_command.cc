#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "controller/common/errors.h"
#include "harness/base/files.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/result_files.h"

namespace dexcheck::cli {
namespace {

struct StatesRequest {
  std::filesystem::path robot;
  std::filesystem::path out;
  long count = 1000;
  std::uint64_t seed = 1;
  UrdfOptions urdf;
};

int Run(const StatesRequest& request) {
  const RobotDescription robot = ReadDescription(request.robot, request.urdf);
  const StateTable states = DrawStates(robot, request.count, {}, request.seed);
  MakeFolder(request.out);
  const auto write = [&](const char* name, const std::string& text) {
    OutputFile file(request.out / name);
    file.Write(text);
  };
  write("layout.json", WriteLayout(robot, request.robot.filename().string()));
  write("states.jsonl", WriteStateLines(states));
  write("q.npy", WriteNpy(states.q));
  write("v.npy", WriteNpy(states.v));
  return kSuccess;
}

}  // namespace

void AddStatesCommand(Command app) {
  constexpr long kMaxCount = 1000000;
  const auto request = std::make_shared<StatesRequest>();
  Command command = app.AddCommand(
      "states", "Write random states of a robot, for a program whose results consistency --results reads");
  command.AddOption("ROBOT", &request->robot, "Parameter file (TOML), URDF or MJCF")
      .TypeName("FILE")
      .Required();
  command.AddOption("--out DIR", &request->out, "Folder for layout.json, states.jsonl, q.npy and v.npy")
      .Required();
  AddSampleOptions(command, kMaxCount, &request->count, &request->seed, "--samples,--count");
  command.AddFlag("--floating", &request->urdf.floating, "The root of a URDF floats");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
