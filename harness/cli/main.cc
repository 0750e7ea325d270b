// dexcheck: is my analytic robot model, and the controller built on it, right?

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/commands.h"
#include "harness/common/shell.h"
#include "harness/common/version.h"

namespace dexcheck::cli {
namespace {

/// One line on standard error, whatever control characters stand in file names.
int Report(std::string problem, ExitCode code) {
  std::replace_if(
      problem.begin(), problem.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  std::fflush(stdout);
  fmt::print(stderr, "dexcheck: {}\n", problem);
  return code;
}

/// What CLI11 says, but for unknown words the nearest known one.
std::string Explain(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> unknown = app.remaining(/*recurse=*/true);
  if (unknown.empty()) return error.what();
  const std::string& word = unknown.front();
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const CLI::App& place = chosen.empty() ? app : *chosen.front();
  const bool is_option = word.starts_with("-");
  std::vector<std::string> known;
  if (is_option) {
    for (const CLI::Option* option : place.get_options()) known.push_back(option->get_name());
  } else {
    for (const CLI::App* command : place.get_subcommands([](const CLI::App*) { return true; })) {
      known.push_back(command->get_name());
    }
  }
  const std::string nearest = FindNearest(word, known);
  const std::string kind = is_option ? "option" : known.empty() ? "argument" : "command";
  return "unknown " + kind + " " + Quote(word) +
         (nearest.empty() ? "" : ", did you mean " + Quote(nearest) + "?");
}

/// The command line as one could type it.
std::string JoinArguments(int argc, char** argv) {
  std::string text = "dexcheck";
  for (int i = 1; i < argc; ++i) text += " " + QuoteForShell(argv[i]);
  return text;
}

int Run(int argc, char** argv) {
  CLI::App app("Validates analytic robot models and controllers against MuJoCo.", "dexcheck");
  app.set_version_flag("--version", Version());
  app.require_subcommand(1);
  int exit_code = kSuccess;
  AddConsistencyCommand(&app, &exit_code);
  AddDiagnoseCommand(&app, &exit_code);
  AddMutateCommand(&app, &exit_code);
  AddEvalCommand(&app, &exit_code);
  AddPlanCommand(&app, &exit_code);
  AddRunCommand(&app, JoinArguments(argc, argv), &exit_code);
  AddExportCommand(&app, &exit_code);
  AddRenderCommand(&app, &exit_code);
  AddReportCommand(&app, &exit_code);
  AddStudyCommand(&app, &exit_code);
  try {
    app.parse(argc, argv);
    if (std::fflush(stdout) == 0) return exit_code;
    return Report(std::string("standard output: cannot be written: ") + std::strerror(errno), kInputError);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    return Report(Explain(app, error) + " (see dexcheck --help)", kInputError);
  } catch (const InputError& error) {
    return Report(error.what(), kInputError);
  } catch (const std::invalid_argument& error) {
    return Report(error.what(), kInputError);
  } catch (const std::system_error& error) {
    return Report(error.what(), kInputError);
  } catch (const std::exception& error) {
    return Report(error.what(), kFailure);
  }
}

}  // namespace
}  // namespace dexcheck::cli

// What a handler of exceptions throws is want of memory. NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) { return dexcheck::cli::Run(argc, argv); }
