#include "harness/cli/commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <sstream>
#include <string_view>
#include <vector>

#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/process_pool.h"
#include "harness/base/version.h"
#include "harness/cli/report.h"
#include "harness/cli/run_folder.h"
#include "harness/comparison/consistency.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck::cli {

namespace {

/// Accepts texts that are numbers of a kind. @param demand what is said of others.
template <typename Number, typename IsGood>
ValueCheck CheckNumber(const std::string& demand, IsGood is_good) {
  return [=](const std::string& text) {
    const std::optional<Number> value = ParseNumber<Number>(text);
    return value && is_good(*value) ? std::string() : demand + ", got " + Quote(text);
  };
}

}  // namespace

ValueCheck WholeNumber(std::uint64_t least, std::uint64_t most) {
  return CheckNumber<std::uint64_t>(
      "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most),
      [=](std::uint64_t value) { return least <= value && value <= most; });
}

ValueCheck PositiveNumber(const std::string& demand) {
  return CheckNumber<double>(demand, [](double value) { return std::isfinite(value) && value > 0.0; });
}

ValueCheck NumberFrom(double least, double most) {
  return CheckNumber<double>("must be a number from " + FormatNumber(least) + " to " + FormatNumber(most),
                             [=](double value) { return least <= value && value <= most; });
}

ValueCheck Fraction() {
  return CheckNumber<double>("must be a number above 0 and below 1",
                             [](double value) { return 0.0 < value && value < 1.0; });
}

CLI::App* AddCommand(CLI::App* app, const std::string& name, const std::string& help,
                     const std::array<const char*, 2>& examples) {
  CLI::App* const command = app->add_subcommand(name, help);
  if (app->get_parent() != nullptr) command->group("Subcommands");
  command->footer(std::string("Examples:\n  ") + examples[0] + "\n  " + examples[1]);
  return command;
}

ExitCode ReportFailure(const std::string& why) {
  std::fflush(stdout);
  Warn(why);
  return kFailure;
}

namespace {

/// Lines that fit the terminal, descriptions below one another.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    // The option beside a positional argument means the same.
    if (!is_positional && option->get_positional()) return "";
    return Wrap(Formatter::make_option(option, is_positional), get_column_width()) + "\n";
  }
  /// Name of the value, and the default; which options go together is said when they do not.
  std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_positional()) return "";
    const std::string text = Formatter::make_option_opts(option);
    return text.substr(0, std::min(text.find(" Needs:"), text.find(" Excludes:")));
  }
  std::string make_subcommand(const CLI::App* command) const override {
    return Wrap(Formatter::make_subcommand(command), get_column_width()) + "\n";
  }
  std::string make_description(const CLI::App* app) const override {
    return Wrap(Formatter::make_description(app), 0) + "\n";
  }
};

/// Whether the word names a file that may describe a robot.
bool NamesRobot(std::string_view word) {
  return !word.starts_with("-") && (word.ends_with(".urdf") || word.ends_with(".xml") ||
                                    word.ends_with(".mjcf") || word.ends_with(".toml"));
}

/// Whether the word names a recording of one, or the folder of a run.
bool NamesRecording(const std::string& word) {
  constexpr std::string_view kExtensions = " .csv .tsv .txt .mcap .db3 .npz .npy .h5 .hdf5 ";
  const std::string extension = ExtensionOf(word);
  return !word.starts_with("-") &&
         (extension.empty() ? IsFolder(word)
                            : kExtensions.find(" " + extension + " ") != std::string_view::npos);
}

/// The words with what they leave out: the command for two robots, or for a robot and its recording, and the
/// "-" of a --json that names no file. The next word is none when it is an option, a description of a robot,
/// or what a command reads: a scenario's name or a folder.
std::vector<std::string> CompleteWords(int argc, char** argv) {
  std::vector<std::string> words(argv, argv + argc);
  if (argc > 1 && NamesRobot(words[1])) {
    const bool is_recorded = argc > 2 && NamesRecording(words[2]);
    words.insert(words.begin() + 1, is_recorded ? "judge" : "consistency");
  }
  const auto is_file = [&](const std::string& word) {
    if (word == "-" || word.ends_with(".json") || word.starts_with("/dev/")) return true;
    const bool is_of_run = words.size() > 1 && words[1] == "run";
    return !word.empty() && !word.starts_with("-") && !NamesRobot(word) && !is_of_run;
  };
  for (size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--json" && !(i + 1 < words.size() && is_file(words[i + 1]))) words[i] = "--json=-";
  }
  return words;
}

/// " (see dexcheck study run --help)", of the command that was given.
std::string NameHelp(const CLI::App& app) {
  std::string words = app.get_name();
  for (const CLI::App* at = &app; !at->get_subcommands().empty();) {
    at = at->get_subcommands().front();
    words += " " + at->get_name();
  }
  return " (see " + words + " --help)";
}

/// Says what is wrong with the words. @param what by CLI11.
std::string Explain(const CLI::App& app, const std::string& what) {
  const std::vector<std::string> unknown = app.remaining(/*recurse=*/true);
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const CLI::App& place = chosen.empty() ? app : *chosen.front();
  if (unknown.empty()) {
    std::string text = what;
    for (const CLI::Option* option : place.get_options()) {  // "A" and not "--robot", which means the same
      const size_t at = option->get_positional() ? text.find(option->get_name()) : std::string::npos;
      if (at != std::string::npos) text.replace(at, option->get_name().size(), option->get_name(true));
    }
    return text;
  }
  const std::string& word = unknown.front();
  const bool is_option = word.starts_with("-");
  std::vector<std::string> known;
  if (is_option) {
    for (const CLI::Option* option : place.get_options()) known.push_back(option->get_name());
  } else {
    for (const CLI::App* command : place.get_subcommands([](const CLI::App*) { return true; })) {
      known.push_back(command->get_name());
    }
  }
  const std::string kind = is_option ? "option" : known.empty() ? "argument" : "command";
  return "unknown " + kind + " " + Quote(word) + SuggestNearest(word, known);
}

}  // namespace

std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter() { return std::make_shared<HelpFormatter>(); }

int RunCommandLine(CLI::App* app, int argc, char** argv) {
  try {
    const std::vector<std::string> words = CompleteWords(argc, argv);
    std::vector<const char*> pointers;
    pointers.reserve(words.size());
    for (const std::string& word : words) pointers.push_back(word.c_str());
    app->parse(static_cast<int>(pointers.size()), pointers.data());
    return kSuccess;
  } catch (const CLI::RuntimeError& end) {
    return end.get_exit_code();
  } catch (const CLI::Success& success) {
    // By way of a text: whether standard output takes it is the caller's to see.
    std::ostringstream help;
    const int exit_code = app->exit(success, help, help);
    std::fputs(help.str().c_str(), stdout);
    return exit_code;
  } catch (const CLI::ParseError& error) {
    throw UsageError(Explain(*app, error.what()) + NameHelp(*app));
  } catch (const UsageError& error) {
    throw UsageError(error.what() + NameHelp(*app));
  }
}

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
            "Folder of a URDF's packages, where its meshes are")
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
  CLI::Option* const option = AddOption(command, "--controller FILE|COMMAND", &controller->run,
                                        "Your controller: a library (.so), a Python file (.py), or a command "
                                        "with the protocol of controller_protocol.h");
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
      AddOption(command, "--unset KEY", &overrides->unset, "Remove a key, before any is set")
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
