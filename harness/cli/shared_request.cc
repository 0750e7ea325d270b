#include "harness/cli/shared_request.h"

#include "controller/common/text.h"
#include "harness/base/process_pool.h"
#include "harness/cli/commands.h"

namespace dexcheck::cli {

std::vector<std::string> Overrides::List() const {
  std::vector<std::string> list;
  for (const std::string& key : unset) list.push_back(key + "-=");
  list.insert(list.end(), set.begin(), set.end());
  return list;
}

std::array<Option, 2> AddOverrideOptions(Command command, Overrides* overrides) {
  const auto is_key = [](const std::string& text) {
    return text.find('=') == std::string::npos ? std::string() : "must be a key, got " + Quote(text);
  };
  const Option set =
      command
          .AddOption("--set", &overrides->set,
                     "Set a key of the scenario, or with model. before it one of the parameter file")
          .TypeName("KEY=VALUE")
          .Repeatable();
  const Option unset = command.AddOption("--unset", &overrides->unset, "Remove such a key, before any is set")
                           .TypeName("KEY")
                           .Check(is_key)
                           .Repeatable();
  return {set, unset};
}

Option AddJobsOption(Command command, const std::string& what, std::uint64_t* jobs) {
  return command.AddOption("--jobs", jobs, what + " at a time (all processors by default)")
      .TypeName("N")
      .Check(WholeNumber(1, 1000000));
}

int CountJobs(std::uint64_t jobs) { return jobs > 0 ? static_cast<int>(jobs) : CountProcessors(); }

void AddScenarioOptions(Command command, ScenarioRequest* request) {
  command.AddOption("SCENARIO", &request->scenario, "Name of a shipped scenario, or a TOML file").Required();
  AddOverrideOptions(command, &request->overrides);
}

void AddResultOptions(Command command, const std::string& what, ScenarioRequest* request) {
  AddJsonOption(command, what, &request->json_file);
  command.AddFlag("--quiet", &request->quiet, "Print the last line only");
}

}  // namespace dexcheck::cli
