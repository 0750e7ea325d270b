#include "harness/cli/commands.h"

#include <limits>

#include "harness/base/files.h"
#include "harness/base/process_pool.h"
#include "harness/cli/run_folder.h"
#include "harness/comparison/consistency.h"

namespace dexcheck::cli {

void RobotFiles::TakeShipped() {
  if (!robot.empty() || !mjcf.empty()) return;
  robot = FindShippedFile("controller/parameters/assistant_robot.toml");
  mjcf = FindShippedFile("mjcf/scene.xml");
}

std::array<CLI::Option*, 2> AddFileOptions(CLI::App* command, const std::string& help_a,
                                           const std::string& help_b, RobotFiles* files) {
  return {AddOption(command, "A,--robot", &files->robot, help_a),
          AddOption(command, "B,--mjcf", &files->mjcf, help_b)};
}

CLI::Option* AddJsonOption(CLI::App* command, const std::string& what, std::string* file) {
  return AddOption(command, "--json [FILE.json]", file,
                   "Write " + what + " to this file; without one, or with -, print them and nothing else");
}

CLI::Option* AddJUnitOption(CLI::App* command, std::string* file) {
  return AddOption(command, "--junit FILE.xml", file,
                   "Write each check as a test case of JUnit's XML to this file");
}

CLI::Option* AddIgnoreOption(CLI::App* command, std::vector<std::string>* ignore) {
  return AddOption(
             command, "--ignore WORD,...", ignore,
             "Constants of joints in which the two may differ: armature, damping, friction, coupling to "
             "others, effort")
      ->delimiter(',')
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(kIgnorable), std::end(kIgnorable))));
}

void AddUrdfOptions(CLI::App* command, UrdfOptions* options) {
  AddOption(command, "--package PATH", &options->packages,
            "Folder of a URDF's packages; its meshes are looked for")
      ->allow_extra_args(false);
  command->add_flag("--floating", options->floating, "The root of a URDF floats");
}

std::vector<std::string> Overrides::List() const {
  std::vector<std::string> list;
  for (const std::string& key : unset) list.push_back(key + "-=");
  list.insert(list.end(), set.begin(), set.end());
  const std::vector<std::string> own = controller.List();
  list.insert(list.end(), own.begin(), own.end());
  return list;
}

std::vector<std::string> OwnController::List() const {
  if (run.empty()) return {};
  std::vector<std::string> list = NameController(run, CurrentFolder());
  if (time_limit > 0.0) list.push_back("controller.time_limit=" + FormatNumber(time_limit));
  return list;
}

CLI::Option* AddControllerOptions(CLI::App* command, OwnController* controller) {
  CLI::Option* const option =
      AddOption(command, "--controller FILE|COMMAND", &controller->run,
                "A controller of your own: a shared library (.so), a Python file (.py), or a command that "
                "speaks the protocol of controller_protocol.h");
  AddOption(command, "--controller-time-limit SECONDS", &controller->time_limit,
            "Time limit for each reply of the controller, s (1 by default); ten times that for its start")
      ->check(PositiveNumber())
      ->needs(option);
  return option;
}

std::array<CLI::Option*, 3> AddOverrideOptions(CLI::App* command, Overrides* overrides) {
  const auto is_key = [](const std::string& text) {
    return text.find('=') == std::string::npos ? std::string() : "must be a key, got " + Quote(text);
  };
  CLI::Option* const set =
      AddOption(command, "--set KEY=VALUE", &overrides->set,
                "Set a key of the scenario, or with model. before it one of the parameter file")
          ->allow_extra_args(false);
  CLI::Option* const unset =
      AddOption(command, "--unset KEY", &overrides->unset, "Remove such a key, before any is set")
          ->check(is_key)
          ->allow_extra_args(false);
  return {set, unset, AddControllerOptions(command, &overrides->controller)};
}

CLI::Option* AddJobsOption(CLI::App* command, const std::string& what, std::uint64_t* jobs) {
  return AddOption(command, "--jobs N", jobs, what + " at a time (all processors by default)")
      ->check(WholeNumber(1, 1000000));
}

int CountJobs(std::uint64_t jobs) { return jobs > 0 ? static_cast<int>(jobs) : CountProcessors(); }

CLI::Option* AddSeedOption(CLI::App* command, std::uint64_t* seed, const std::string& help) {
  return AddOption(command, "--seed N", seed, help)
      ->check(WholeNumber(0, std::numeric_limits<std::uint64_t>::max()));
}

}  // namespace dexcheck::cli
