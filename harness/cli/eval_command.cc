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

struct Request {
  std::filesystem::path robot = FindShippedFile("controller/parameters/assistant_robot.toml");
  std::filesystem::path mjcf;
  std::string state_file;
  std::string out = "-";
};

int Run(const Request& request) {
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

void AddEvalCommand(CLI::App* app, int* exit_code) {
  const auto request = std::make_shared<Request>();
  CLI::App* command = app->add_subcommand("eval", "Print every term at one state, as JSON");
  CLI::Option* robot =
      command->add_option("--robot", request->robot, "Parameter file (TOML) of the analytic model")
          ->type_name("FILE.toml");
  command
      ->add_option("--mjcf", request->mjcf,
                   "The same robot for the engine: adds the engine's values of the terms as \"engine\"")
      ->type_name("FILE.xml")
      ->needs(robot);
  command
      ->add_option("--state", request->state_file,
                   "JSON with q, xi; optionally object, kappa or contact_points, fingers, mu")
      ->type_name("STATE.json")
      ->required();
  command->add_option("--out", request->out, "File to write (- for standard output)")
      ->type_name("FILE.json")
      ->capture_default_str();
  command->callback([=] { *exit_code = Run(*request); });
}

}  // namespace dexcheck::cli
