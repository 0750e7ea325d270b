// dexcheck: is my analytic robot model, and the controller built on it, right?

#include <stdlib.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include "controller/common/errors.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/base/version.h"
#include "harness/cli/commands.h"

namespace dexcheck::cli {
namespace {

/// An archive has fonts of its own; without them a bare system has none.
void UseInstalledFonts() {
  const std::filesystem::path fonts = FindInstalled("share/dexcheck/fonts/fonts.conf");
  if (::access(fonts.c_str(), R_OK) == 0) ::setenv("FONTCONFIG_FILE", fonts.c_str(), /*overwrite=*/0);
}

constexpr const char* kNoMemory =
    "not enough memory, or the limit of this process's (ulimit -v) is too small";

int Refuse(const std::string& problem) {
  ReportFailure(problem);
  return kInputError;
}

/// Describes an error of the system; one of printing names standard output.
std::string Explain(const std::system_error& error) {
  return std::ferror(stdout) != 0 ? "standard output: cannot be written: " + error.code().message()
                                  : error.what();
}

/// The command line as one could type it.
std::string JoinArguments(int argc, char** argv) {
  std::string text = "dexcheck";
  for (int i = 1; i < argc; ++i) text += " " + QuoteForShell(argv[i]);
  return text;
}

int RunProgram(int argc, char** argv) {
  const std::string typed = JoinArguments(argc, argv);
  CLI::App app("Validates analytic robot models and controllers against MuJoCo.", "dexcheck");
  app.formatter(MakeHelpFormatter());
  app.set_version_flag("--version", Version());
  app.footer("dexcheck A B, with two files of robots, is dexcheck consistency A B.");
  app.require_subcommand(1);
  app.group("Compare descriptions");  // of the commands that follow
  AddConsistencyCommand(&app);
  AddDiagnoseCommand(&app);
  AddAuditCommand(&app);
  AddImportCommand(&app);
  AddEvalCommand(&app);
  AddEngineComparisonCommand(&app);
  app.group("Run and look");
  AddRunCommand(&app, typed);
  AddReportCommand(&app);
  AddRenderCommand(&app);
  AddExportCommand(&app);
  AddCompareCommand(&app);
  AddJudgeCommand(&app);
  app.group("Study");
  AddStudyCommand(&app);
  AddBudgetCommand(&app);
  AddMutateCommand(&app);
  AddExciteCommand(&app);
  app.group("Set up");
  AddInitCommand(&app);
  AddHelpCommands(&app);
  return RunCommandLine(&app, argc, argv);
}

int Run(int argc, char** argv) {
  try {
    const int exit_code = RunProgram(argc, argv);
    FlushOutput();
    return exit_code;
  } catch (const UsageError& error) {
    return Refuse(error.what());
  } catch (const InputError& error) {
    return Refuse(error.what());
  } catch (const std::system_error& error) {
    // A thread for which there is no room.
    if (error.code() == std::errc::resource_unavailable_try_again) return ReportFailure(kNoMemory);
    return Refuse(Explain(error));
  } catch (const std::bad_alloc&) {
    return ReportFailure(kNoMemory);
  } catch (const std::logic_error& error) {  // readers throw InputError: this is a fault of the program
    return ReportFailure(std::string("internal error: ") + error.what());
  } catch (const std::exception& error) {
    return ReportFailure(error.what());
  }
}

}  // namespace
}  // namespace dexcheck::cli

namespace {
/// Before the libraries initialise themselves, which takes most of the time until main.
void HandleSignalsFirst() { dexcheck::HandleSignals(dexcheck::cli::kFailure); }
[[gnu::section(".preinit_array"), gnu::used]] void (*const kFirst)() = HandleSignalsFirst;
}  // namespace

// A handler of exceptions throws for want of memory alone. NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  dexcheck::OccupyStandardStreams();
  dexcheck::cli::UseInstalledFonts();
  dexcheck::AllowWatching(dexcheck::cli::kFailure);
  return dexcheck::EndProgram(dexcheck::cli::Run(argc, argv));
}
