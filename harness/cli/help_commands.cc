// Completion for bash, made from the help, and versions.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "harness/base/version.h"
#include "harness/cli/commands.h"
#include "harness/cli/run_folder.h"
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
