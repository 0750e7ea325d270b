#include "harness/cli/commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "harness/base/files.h"
#include "harness/base/process_pool.h"
#include "harness/base/version.h"
#include "harness/cli/run_folder.h"
#include "harness/comparison/consistency.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck::cli {
namespace {

std::vector<const CLI::App*> ListCommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

/// Commands or scenarios that may follow a command.
std::vector<std::string> ListNextWords(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::App* next : ListCommands(command)) words.push_back(next->get_name());
  const bool takes_scenario = std::ranges::any_of(command.get_options(), [](const CLI::Option* option) {
    return option->get_positional() && option->get_name(true).find("SCENARIO") != std::string::npos;
  });
  if (takes_scenario) {
    const std::vector<std::string> scenarios = kScenarios.ListNames();
    words.insert(words.end(), scenarios.begin(), scenarios.end());
  }
  return words;
}

std::vector<std::string> ListOptionNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) continue;
    for (const std::string& word : option->get_snames()) names.push_back("-" + word);
    for (const std::string& word : option->get_lnames()) names.push_back("--" + word);
  }
  return names;
}

/// Adds for a command and those below it how words lead to them, and what may follow them. Each pattern of
/// `case "$command $word"` adds a word to a command: "run" after "study" makes "study run".
/// @param name "study run", which is empty for the program itself.
void AddCompletion(const CLI::App& app, const std::string& name, std::string* words, std::string* choices) {
  const std::vector<const CLI::App*> commands = ListCommands(app);
  *choices += fmt::format("    '{}') words='{}'; [[ $cur != -* ]] || words='{}'; files={} ;;\n", name,
                          fmt::join(ListNextWords(app), " "), fmt::join(ListOptionNames(app), " "),
                          commands.empty() || name.empty() ? "1" : "");
  for (const CLI::App* command : commands) {
    const std::string longer = (name.empty() ? "" : name + " ") + command->get_name();
    *words += fmt::format("      '{} {}') command='{}' ;;\n", name, command->get_name(), longer);
    AddCompletion(*command, longer, words, choices);
  }
}

/// Words before the cursor choose the command; then its options, its commands, scenarios and files follow.
std::string MakeBashCompletion(const CLI::App& app) {
  std::string words, choices;
  AddCompletion(app, "", &words, &choices);
  return "# bash completion for dexcheck: put it into /usr/share/bash-completion/completions/dexcheck, or "
         "source it.\n"
         "_dexcheck() {\n"
         "  local cur=${COMP_WORDS[COMP_CWORD]} command= word\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    case \"$command $word\" in\n" +
         words + "    esac\n  done\n  local words= files=\n  case $command in\n" + choices +
         "  esac\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$cur\")\n"
         "  [[ -z $files || $cur == -* ]] || { compopt -o filenames; mapfile -t -O \"${#COMPREPLY[@]}\" "
         "COMPREPLY < <(compgen -f -- \"$cur\"); }\n"
         "}\n"
         "complete -F _dexcheck dexcheck\n";
}

}  // namespace

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

void AddHelpCommands(CLI::App* app) {
  CLI::App* const completion =
      AddCommand(app, "completion", "Print completion for a shell, made from the help",
                 {"dexcheck completion bash > ~/.local/share/bash-completion/completions/dexcheck",
                  "source <(dexcheck completion bash)"});
  const auto shell = std::make_shared<std::string>();
  AddOption(completion, "SHELL", shell.get(), "bash")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>{"bash"}));
  SetAction(completion, [app, shell] {
    fmt::print("{}", MakeBashCompletion(*app));
    return kSuccess;
  });
  CLI::App* const version = AddCommand(app, "version", "Print the versions of dexcheck and of its engine",
                                       {"dexcheck version", "dexcheck version > versions.txt"});
  SetAction(version, [] {
    fmt::print("dexcheck {}\nMuJoCo {} (compiled with the headers of {})\n", Version(),
               FormatRelease(mj_version()), FormatRelease(mjVERSION_HEADER));
    return kSuccess;
  });
}

}  // namespace dexcheck::cli
