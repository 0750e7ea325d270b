#include "harness/cli/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/cli/terminal.h"

namespace dexcheck::cli {

ValueCheck WholeNumber(std::uint64_t least, std::uint64_t most) {
  return [least, most](const std::string& text) -> std::string {
    const auto value = ParseNumber<std::uint64_t>(text);
    if (value && least <= *value && *value <= most) return {};
    return "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most) + ", got " +
           Quote(text);
  };
}

ValueCheck PositiveNumber(const std::string& demand) {
  return [demand](const std::string& text) {
    const double value = ParseNumber<double>(text).value_or(std::nan(""));
    return std::isfinite(value) && value > 0.0 ? std::string() : demand + ", got " + Quote(text);
  };
}

ValueCheck NumberFrom(double least, double most) {
  return [least, most](const std::string& text) {
    const double value = ParseNumber<double>(text).value_or(std::nan(""));
    if (least <= value && value <= most) return std::string();
    return "must be a number from " + FormatNumber(least) + " to " + FormatNumber(most) + ", got " +
           Quote(text);
  };
}

ValueCheck Fraction() {
  return [](const std::string& text) {
    const double value = ParseNumber<double>(text).value_or(std::nan(""));
    if (0.0 < value && value < 1.0) return std::string();
    return "must be a number above 0 and below 1, got " + Quote(text);
  };
}

Option& Option::TypeName(const std::string& name) {
  option_->type_name(name);
  return *this;
}

Option& Option::Required() {
  option_->required();
  return *this;
}

Option& Option::Excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}

Option& Option::Needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

Option& Option::Check(const ValueCheck& check) {
  option_->check(CLI::Validator([check](std::string& text) { return check(text); }, ""));
  return *this;
}

Option& Option::OneOf(std::initializer_list<const char*> values) {
  option_->check(CLI::IsMember(std::vector<std::string>(values.begin(), values.end())));
  return *this;
}

Option& Option::Repeatable() {
  option_->allow_extra_args(false);
  return *this;
}

Option& Option::Delimiter(char delimiter) {
  option_->delimiter(delimiter);
  return *this;
}

Option& Option::ShowDefault() {
  option_->capture_default_str();
  return *this;
}

template <typename Value>
Option Command::AddOption(const std::string& name, Value* value, const std::string& help) {
  const size_t blank = name.find(' ');
  Option option(app_->add_option(name.substr(0, blank), *value, help));
  option.Check([](const std::string& text) { return text.empty() ? "must not be empty" : ""; });
  return blank == std::string::npos ? option : option.TypeName(name.substr(blank + 1));
}

Option Command::AddFlag(const std::string& name, bool* value, const std::string& help) {
  return Option(app_->add_flag(name, *value, help));
}

Option Command::AddFlag(const std::string& name, const std::string& help) {
  return Option(app_->add_flag(name, help));
}

Command Command::Under(const std::string& heading) const {
  Command command = *this;
  command.heading_ = heading;
  return command;
}

Command Command::AddCommand(const std::string& name, const std::string& help,
                            const std::array<const char*, 2>& examples) {
  CLI::App* const command = app_->add_subcommand(name, help);
  // Which it would have of the program otherwise.
  command->group(heading_.empty() ? "Subcommands" : heading_);
  command->footer(std::string("Examples:\n  ") + examples[0] + "\n  " + examples[1]);
  return {command, exit_code_};
}

bool Command::is_given(const std::string& option) const { return app_->count(option) > 0; }

void Command::RequireCommand() { app_->require_subcommand(1); }

void Command::SetAction(const std::function<int()>& action) {
  app_->callback([action, exit_code = exit_code_] { *exit_code = action(); });
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

}  // namespace

CommandLine::CommandLine(const std::string& program, const std::string& help, const std::string& version)
    : app_(std::make_unique<CLI::App>(help, program)) {
  app_->formatter(std::make_shared<HelpFormatter>());
  app_->set_version_flag("--version", version);
  app_->footer(program + " A B, with two files of robots, is " + program + " consistency A B.");
}

CommandLine::~CommandLine() = default;

namespace {

void DescribeCommand(const CLI::App& app, const std::string& name, std::vector<CommandHelp>* all) {
  CommandHelp help{name, {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    OptionHelp one;
    one.is_positional = option->get_positional();
    if (one.is_positional) {
      one.names = {option->get_name(true)};
    } else {
      for (const std::string& word : option->get_snames()) one.names.push_back("-" + word);
      for (const std::string& word : option->get_lnames()) one.names.push_back("--" + word);
    }
    help.options.push_back(one);
  }
  const std::vector<const CLI::App*> commands = app.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* command : commands) help.commands.push_back(command->get_name());
  all->push_back(help);
  for (const CLI::App* command : commands) {
    DescribeCommand(*command, (name.empty() ? "" : name + " ") + command->get_name(), all);
  }
}

}  // namespace

ExitCode ReportFailure(const std::string& why) {
  std::fflush(stdout);
  Warn(why);
  return kFailure;
}

std::vector<CommandHelp> CommandLine::Describe() const {
  std::vector<CommandHelp> all;
  DescribeCommand(*app_, "", &all);
  return all;
}

namespace {

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

}  // namespace

int CommandLine::Run(int argc, char** argv) {
  try {
    const std::vector<std::string> words = CompleteWords(argc, argv);
    std::vector<const char*> pointers;
    pointers.reserve(words.size());
    for (const std::string& word : words) pointers.push_back(word.c_str());
    app_->parse(static_cast<int>(pointers.size()), pointers.data());
    return exit_code_;
  } catch (const CLI::Success& success) {
    // By way of a text: whether standard output takes it is the caller's to see.
    std::ostringstream help;
    const int exit_code = app_->exit(success, help, help);
    std::fputs(help.str().c_str(), stdout);
    return exit_code;
  } catch (const CLI::ParseError& error) {
    throw UsageError(Explain(error.what()) + NameHelp());
  } catch (const UsageError& error) {
    throw UsageError(error.what() + NameHelp());
  }
}

std::string CommandLine::NameHelp() const {
  std::string words = app_->get_name();
  for (const CLI::App* at = app_.get(); !at->get_subcommands().empty();) {
    at = at->get_subcommands().front();
    words += " " + at->get_name();
  }
  return " (see " + words + " --help)";
}

std::string CommandLine::Explain(const std::string& what) const {
  const std::vector<std::string> unknown = app_->remaining(/*recurse=*/true);
  const std::vector<CLI::App*> chosen = app_->get_subcommands();
  const CLI::App& place = chosen.empty() ? *app_ : *chosen.front();
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

template Option Command::AddOption(const std::string&, std::string*, const std::string&);
template Option Command::AddOption(const std::string&, std::filesystem::path*, const std::string&);
template Option Command::AddOption(const std::string&, double*, const std::string&);
template Option Command::AddOption(const std::string&, int*, const std::string&);
template Option Command::AddOption(const std::string&, long*, const std::string&);
template Option Command::AddOption(const std::string&, std::uint64_t*, const std::string&);
template Option Command::AddOption(const std::string&, std::optional<double>*, const std::string&);
template Option Command::AddOption(const std::string&, std::vector<double>*, const std::string&);
template Option Command::AddOption(const std::string&, std::vector<std::string>*, const std::string&);
template Option Command::AddOption(const std::string&, std::vector<std::filesystem::path>*,
                                   const std::string&);

}  // namespace dexcheck::cli
