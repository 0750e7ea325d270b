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

/// The command line as one could type it.
std::string JoinArguments(int argc, char** argv) {
  std::string text = "dexcheck";
  for (int i = 1; i < argc; ++i) text += " " + QuoteForShell(argv[i]);
  return text;
}

int Run(int argc, char** argv) {
  CommandLine line("dexcheck", "Validates analytic robot models and controllers against MuJoCo.", Version());
  Command app = line.root();
  app.RequireCommand();
  AddConsistencyCommand(app);
  AddDiagnoseCommand(app);
  AddMutateCommand(app);
  AddEvalCommand(app);
  AddImportCommand(app);
  AddPlanCommand(app);
  AddRunCommand(app, JoinArguments(argc, argv));
  AddExportCommand(app);
  AddRenderCommand(app);
  AddReportCommand(app);
  AddStudyCommand(app);
  try {
    const int exit_code = line.Run(argc, argv);
    if (std::fflush(stdout) == 0) return exit_code;
    return Report(std::string("standard output: cannot be written: ") + std::strerror(errno), kInputError);
  } catch (const UsageError& error) {
    return Report(std::string(error.what()) + " (see dexcheck --help)", kInputError);
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
