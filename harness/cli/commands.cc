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

std::array<Option, 2> AddFileOptions(Command command, const std::string& help_a, const std::string& help_b,
                                     RobotFiles* files) {
  return {command.AddOption("A,--robot", &files->robot, help_a),
          command.AddOption("B,--mjcf", &files->mjcf, help_b)};
}

Option AddJsonOption(Command command, const std::string& what, std::string* file) {
  return command.AddOption(
      "--json [FILE.json]", file,
      "Write " + what + " to this file; without one, or with -, print them and nothing else");
}

Option AddJUnitOption(Command command, std::string* file) {
  return command.AddOption("--junit FILE.xml", file,
                           "Write each check as a test case of JUnit's XML to this file");
}

Option AddIgnoreOption(Command command, std::vector<std::string>* ignore) {
  return command
      .AddOption("--ignore WORD,...", ignore,
                 "Constants of joints in which the two may differ: armature, damping, friction, coupling to "
                 "others, effort")
      .Delimiter(',')
      .OneOf({kIgnorable[0], kIgnorable[1], kIgnorable[2], kIgnorable[3], kIgnorable[4]});
}

void AddUrdfOptions(Command command, UrdfOptions* options) {
  command
      .AddOption("--package PATH", &options->packages,
                 "Folder of a URDF's packages; its meshes are looked for")
      .Repeatable();
  command.AddFlag("--floating", &options->floating, "The root of a URDF floats");
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

Option AddControllerOptions(Command command, OwnController* controller) {
  const Option option = command.AddOption(
      "--controller FILE|COMMAND", &controller->run,
      "A controller of your own: a shared library (.so), a Python file (.py), or a command that "
      "speaks the protocol of controller_protocol.h");
  command
      .AddOption(
          "--controller-time-limit SECONDS", &controller->time_limit,
          "Time limit for each reply of the controller, s (1 by default); ten times that for its start")
      .Check(PositiveNumber())
      .Needs(option);
  return option;
}

std::array<Option, 3> AddOverrideOptions(Command command, Overrides* overrides) {
  const auto is_key = [](const std::string& text) {
    return text.find('=') == std::string::npos ? std::string() : "must be a key, got " + Quote(text);
  };
  const Option set =
      command
          .AddOption("--set KEY=VALUE", &overrides->set,
                     "Set a key of the scenario, or with model. before it one of the parameter file")
          .Repeatable();
  const Option unset =
      command.AddOption("--unset KEY", &overrides->unset, "Remove such a key, before any is set")
          .Check(is_key)
          .Repeatable();
  return {set, unset, AddControllerOptions(command, &overrides->controller)};
}

Option AddJobsOption(Command command, const std::string& what, std::uint64_t* jobs) {
  return command.AddOption("--jobs N", jobs, what + " at a time (all processors by default)")
      .Check(WholeNumber(1, 1000000));
}

int CountJobs(std::uint64_t jobs) { return jobs > 0 ? static_cast<int>(jobs) : CountProcessors(); }

Option AddSeedOption(Command command, std::uint64_t* seed, const std::string& help) {
  return command.AddOption("--seed N", seed, help)
      .Check(WholeNumber(0, std::numeric_limits<std::uint64_t>::max()));
}

}  // namespace dexcheck::cli
