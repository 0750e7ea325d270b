#include "harness/cli/shared_request.h"

#include "harness/cli/commands.h"

namespace dexcheck::cli {

void AddScenarioOptions(Command command, ScenarioRequest* request) {
  command.AddOption("SCENARIO", &request->scenario, "Name of a shipped scenario, or a TOML file").Required();
  command.AddOption("--set", &request->overrides, "Set a key of the scenario, as for run")
      .TypeName("KEY=VALUE")
      .Repeatable();
}

void AddResultOptions(Command command, const std::string& what, ScenarioRequest* request) {
  AddJsonOption(command, what, &request->json_file);
  command.AddFlag("--quiet", &request->quiet, "Print the last line only");
}

}  // namespace dexcheck::cli
