#include "harness/cli/command_line.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <string_view>
#include <vector>

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

}  // namespace dexcheck::cli
