// The help in other forms: completion for shells, and a manual page.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/console.h"
#include "harness/base/version.h"
#include "harness/cli/commands.h"
#include "harness/cli/run_folder.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck::cli {
namespace {

std::string Join(const std::vector<std::string>& words, const char* between) {
  return fmt::format("{}", fmt::join(words, between));
}

/// Text with each of some characters preceded by a backslash.
std::string Escape(const std::string& text, const char* special) {
  std::string escaped;
  for (const char c : text) {
    if (std::string_view(special).find(c) != std::string_view::npos) escaped += '\\';
    escaped += c;
  }
  return escaped;
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

/// Cases of a shell's `case "$command $word"`, which make "study" and then "run" the command "study run".
std::string ListCommandCases(const std::vector<CommandHelp>& commands) {
  std::string text;
  for (const CommandHelp& command : commands) {
    if (command.name.empty()) continue;
    const size_t space = command.name.rfind(' ');
    const std::string before = space == std::string::npos ? "" : command.name.substr(0, space);
    const std::string last = space == std::string::npos ? command.name : command.name.substr(space + 1);
    text += fmt::format("      '{} {}') command='{}' ;;\n", before, last, command.name);
  }
  return text;
}

/// For bash: words before the cursor choose the command; then its options, its commands, scenarios and files.
std::string MakeBashCompletion(const std::vector<CommandHelp>& commands) {
  std::string text =
      "# bash completion for dexcheck: put it into /usr/share/bash-completion/completions/dexcheck, or "
      "source it.\n"
      "_dexcheck() {\n"
      "  local cur=${COMP_WORDS[COMP_CWORD]} command= word\n"
      "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
      "    case \"$command $word\" in\n";
  text += ListCommandCases(commands) + "    esac\n  done\n  local words= files=\n  case $command in\n";
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

/// The program's commands, by the headings that they stand under.
std::vector<std::pair<std::string, std::vector<CommandHelp>>> ListGroups(
    const std::vector<CommandHelp>& commands) {
  std::vector<std::pair<std::string, std::vector<CommandHelp>>> groups;
  for (const CommandHelp& command : commands) {
    if (command.name.empty()) continue;
    if (groups.empty() || groups.back().first != command.heading) groups.push_back({command.heading, {}});
    groups.back().second.push_back(command);
  }
  return groups;
}

/// For zsh, with what each option means.
std::string MakeZshCompletion(const std::vector<CommandHelp>& commands) {
  std::string text =
      "#compdef dexcheck\n# zsh completion for dexcheck: put it as _dexcheck into a folder of "
      "$fpath.\n_dexcheck() {\n"
      "  local command= word\n  for word in ${words[2,CURRENT-1]}; do\n    case \"$command $word\" in\n";
  text += ListCommandCases(commands) +
          "    esac\n  done\n  local -a options next\n  local files=\n  case $command in\n";
  std::string groups;
  for (const auto& [heading, members] : ListGroups(commands)) {
    groups += "; next=(";
    for (const CommandHelp& command : members) {
      if (command.name.find(' ') == std::string::npos)
        groups += " " + QuoteForShell(command.name + ":" + Escape(command.text, ":"));
    }
    groups += "); _describe " + QuoteForShell(heading) + " next";
  }
  groups += "; next=()";
  for (const CommandHelp& command : commands) {
    std::string options;
    for (const OptionHelp& option : command.options) {
      if (option.is_positional) continue;
      for (const std::string& name : option.names) {
        options += " " + QuoteForShell(name + ":" + Escape(option.text, ":"));
      }
    }
    std::string next;
    if (!command.name.empty()) {  // those of the program stand in groups
      for (const std::string& word : ListNextWords(command)) next += " '" + word + "'";
    }
    text += fmt::format("    '{}') options=({}); next=({}); files={}{} ;;\n", command.name, options, next,
                        command.commands.empty() ? "1" : "", command.name.empty() ? groups : "");
  }
  text +=
      "  esac\n"
      "  if [[ ${words[CURRENT]} == -* ]]; then\n    _describe option options\n  else\n"
      "    (( ${#next} )) && _describe argument next\n    [[ -z $files ]] || _files\n  fi\n"
      "}\n_dexcheck \"$@\"\n";
  return text;
}

/// A manual page in man's macros.
std::string MakeManualPage(const std::vector<CommandHelp>& commands) {
  const auto clean = [](const std::string& text) {
    const std::string escaped = Escape(text, "\\-");
    // A line that begins with one of these would be a request.
    return escaped.starts_with(".") || escaped.starts_with("'") ? "\\&" + escaped : escaped;
  };
  std::string text =
      fmt::format(".TH DEXCHECK 1 \"\" \"dexcheck {}\" \"User Commands\"\n.SH NAME\ndexcheck \\- {}\n",
                  Version(), clean(commands.front().text));
  const auto describe = [&](const CommandHelp& command) {
    std::string section = fmt::format(".SS dexcheck {}", clean(command.name));
    for (const OptionHelp& option : command.options) {
      if (option.is_positional) section += " " + clean(option.names.front());
    }
    section += "\n" + clean(command.text) + ".\n";
    for (const OptionHelp& option : command.options) {
      section +=
          fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", clean(Join(option.names, ", ")),
                      option.value.empty() ? "" : " \\fI" + clean(option.value) + "\\fR", clean(option.text));
    }
    return section;
  };
  text += ".SH SYNOPSIS\n.B dexcheck\n.I COMMAND\n[\\fIOPTION\\fR]...\n";
  for (const auto& [heading, members] : ListGroups(commands)) {
    text += ".SH " + clean(heading) + "\n";
    for (const CommandHelp& command : members) text += describe(command);
  }
  text +=
      ".SH EXIT STATUS\n.TP\n0\nall good\n.TP\n1\na disagreement was found\n.TP\n2\nwrong usage or "
      "input\n.TP\n3\nthe run could not "
      "be completed or was interrupted\n";
  return text;
}

}  // namespace

void AddHelpCommands(Command app, const CommandLine& line) {
  Command completion = app.AddCommand("completion", "Print completion for a shell, made from the help");
  const auto shell = std::make_shared<std::string>();
  completion.AddOption("SHELL", shell.get(), "bash or zsh").Required().OneOf({"bash", "zsh"});
  completion.SetAction([shell, &line] {
    const std::vector<CommandHelp> commands = line.Describe();
    fmt::print("{}", *shell == "bash" ? MakeBashCompletion(commands) : MakeZshCompletion(commands));
    return kSuccess;
  });
  Command manual =
      app.AddCommand("man", "Print the manual page, made from the help (dexcheck man | man -l -)");
  manual.SetAction([&line] {
    fmt::print("{}", MakeManualPage(line.Describe()));
    return kSuccess;
  });
  Command version = app.AddCommand("version", "Print the versions of dexcheck and of its engine");
  version.SetAction([] {
    fmt::print("dexcheck {}\nMuJoCo {} (compiled with the headers of {})\n", Version(),
               FormatRelease(mj_version()), FormatRelease(mjVERSION_HEADER));
    return kSuccess;
  });
}

}  // namespace dexcheck::cli
