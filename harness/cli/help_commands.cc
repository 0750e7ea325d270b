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

/// Commands or scenarios that may follow a command.
std::vector<std::string> ListNextWords(const CommandHelp& command) {
  std::vector<std::string> words = command.commands;
  const bool takes_scenario = std::ranges::any_of(command.options, [](const OptionHelp& option) {
    return option.is_positional && option.names.front().find("SCENARIO") != std::string::npos;
  });
  if (takes_scenario) {
    const std::vector<std::string> scenarios = kScenarios.ListNames();
    words.insert(words.end(), scenarios.begin(), scenarios.end());
  }
  return words;
}

std::vector<std::string> ListOptionNames(const CommandHelp& command) {
  std::vector<std::string> names;
  for (const OptionHelp& option : command.options) {
    if (!option.is_positional) names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return names;
}

/// Words before the cursor choose the command; then its options, its commands, scenarios and files follow.
std::string MakeBashCompletion(const std::vector<CommandHelp>& commands) {
  std::string text =
      "# bash completion for dexcheck: put it into /usr/share/bash-completion/completions/dexcheck, or "
      "source it.\n"
      "_dexcheck() {\n"
      "  local cur=${COMP_WORDS[COMP_CWORD]} command= word\n"
      "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
      "    case \"$command $word\" in\n";
  // Each pattern of `case "$command $word"` adds a word to a command: "run" after "study" makes "study run".
  for (const CommandHelp& command : commands) {
    if (command.name.empty()) continue;
    const size_t space = command.name.rfind(' ');
    const std::string before = space == std::string::npos ? "" : command.name.substr(0, space);
    const std::string last = space == std::string::npos ? command.name : command.name.substr(space + 1);
    text += fmt::format("      '{} {}') command='{}' ;;\n", before, last, command.name);
  }
  text += "    esac\n  done\n  local words= files=\n  case $command in\n";
  for (const CommandHelp& command : commands) {
    text += fmt::format("    '{}') words='{}'; [[ $cur != -* ]] || words='{}'; files={} ;;\n", command.name,
                        Join(ListNextWords(command), " "), Join(ListOptionNames(command), " "),
                        command.commands.empty() || command.name.empty() ? "1" : "");
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

void AddHelpCommands(Command app, const CommandLine& line) {
  Command completion =
      app.AddCommand("completion", "Print completion for a shell, made from the help",
                     {"dexcheck completion bash > ~/.local/share/bash-completion/completions/dexcheck",
                      "source <(dexcheck completion bash)"});
  const auto shell = std::make_shared<std::string>();
  completion.AddOption("SHELL", shell.get(), "bash").Required().OneOf({"bash"});
  completion.SetAction([&line, shell] {
    fmt::print("{}", MakeBashCompletion(line.Describe()));
    return kSuccess;
  });
  Command version = app.AddCommand("version", "Print the versions of dexcheck and of its engine",
                                   {"dexcheck version", "dexcheck version > versions.txt"});
  version.SetAction([] {
    fmt::print("dexcheck {}\nMuJoCo {} (compiled with the headers of {})\n", Version(),
               FormatRelease(mj_version()), FormatRelease(mjVERSION_HEADER));
    return kSuccess;
  });
}

}  // namespace dexcheck::cli
