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

std::string Join(const std::vector<std::string>& words, const char* between) {
  return fmt::format("{}", fmt::join(words, between));
}

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

/// A command with its name, "study run", which is empty for the program itself.
struct NamedCommand {
  std::string name;
  const CLI::App* command;
};

void AddNamed(const CLI::App& app, const std::string& name, std::vector<NamedCommand>* all) {
  all->push_back({name, &app});
  for (const CLI::App* command : ListCommands(app))
    AddNamed(*command, (name.empty() ? "" : name + " ") + command->get_name(), all);
}

/// Words before the cursor choose the command; then its options, its commands, scenarios and files follow.
std::string MakeBashCompletion(const CLI::App& app) {
  std::vector<NamedCommand> commands;
  AddNamed(app, "", &commands);
  std::string text =
      "# bash completion for dexcheck: put it into /usr/share/bash-completion/completions/dexcheck, or "
      "source it.\n"
      "_dexcheck() {\n"
      "  local cur=${COMP_WORDS[COMP_CWORD]} command= word\n"
      "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
      "    case \"$command $word\" in\n";
  // Each pattern of `case "$command $word"` adds a word to a command: "run" after "study" makes "study run".
  for (const auto& [name, command] : commands) {
    if (name.empty()) continue;
    const size_t space = name.rfind(' ');
    const std::string before = space == std::string::npos ? "" : name.substr(0, space);
    const std::string last = space == std::string::npos ? name : name.substr(space + 1);
    text += fmt::format("      '{} {}') command='{}' ;;\n", before, last, name);
  }
  text += "    esac\n  done\n  local words= files=\n  case $command in\n";
  for (const auto& [name, command] : commands) {
    text += fmt::format("    '{}') words='{}'; [[ $cur != -* ]] || words='{}'; files={} ;;\n", name,
                        Join(ListNextWords(*command), " "), Join(ListOptionNames(*command), " "),
                        ListCommands(*command).empty() || name.empty() ? "1" : "");
  }
  text +=
      "  esac\n"
      "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$cur\")\n"
      "  [[ -z $files || $cur == -* ]] || { compopt -o filenames; mapfile -t -O \"${#COMPREPLY[@]}\" "
      "COMPREPLY < <(compgen -f -- "
      "\"$cur\"); }\n"
      "}\n"
      "complete -F _dexcheck dexcheck\n";
  return text;
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
