#include <memory>
#include <string>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "harness/cli/commands.h"
#include "harness/cli/eval_terms.h"
#include "harness/cli/output_file.h"
#include "harness/cli/shipped_files.h"
#include "harness/engine/engine.h"

namespace dexcheck::cli {
namespace {

struct EvalRequest {
  std::filesystem::path robot = FindShippedFile("controller/parameters/assistant_robot.toml");
  std::filesystem::path mjcf;
  std::string state_file;
  std::string out = "-";
};

int Run(const EvalRequest& request) {
  const RobotModel model = ReadRobotModel(request.robot);
  const State state = ReadState(request.state_file, model);
  Json out = {{"robot", model.name()},
              {"q", std::vector<double>(state.q.begin(), state.q.end())},
              {"xi", std::vector<double>(state.xi.begin(), state.xi.end())}};
  try {
    AddModelTerms(model, state, &out);
  } catch (const InputError& error) {
    throw InputError(request.state_file + ": " + error.what());
  }
  if (!request.mjcf.empty()) {
    const MjModelPtr engine = LoadMjcf(request.mjcf);
    const Adapter adapter(model, *engine, request.mjcf.string());
    out["engine"] = EvaluateEngineTerms(adapter, state);
  }
  OutputFile(request.out).Write(out.dump(1) + "\n");
  return kSuccess;
}

}  // namespace

void AddEvalCommand(Command app) {
  const auto request = std::make_shared<EvalRequest>();
  Command command = app.AddCommand("eval", "Print every term at one state, as JSON");
  Option robot =
      command.AddOption("--robot FILE.toml", &request->robot, "Parameter file (TOML) of the analytic model");
  command
      .AddOption("--mjcf FILE.xml", &request->mjcf,
                 "The same robot for the engine: adds the engine's values of the terms as \"engine\"")
      .Needs(robot);
  command
      .AddOption("--state STATE.json", &request->state_file,
                 "JSON with q, xi; optionally object, kappa or contact_points, fingers, mu, law")
      .Required();
  Option out = command.AddOption("--out FILE.json", &request->out, "File to write (- for standard output)")
                   .ShowDefault();
  AddJsonOption(command, "the terms", &request->out).Excludes(out);
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
