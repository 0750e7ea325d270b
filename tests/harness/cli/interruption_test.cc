// Ctrl-C and SIGTERM at any time: exit code 3 and no verdict, nothing half written, no temporary folder.

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "harness/log/log_reader.h"
#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::interruption_test {
namespace {

namespace fs = std::filesystem;

class Interruption : public ::testing::Test {
 protected:
  Interruption() { fs::create_directory(temporary()); }
  [[nodiscard]] fs::path run_dir() const { return folder_.path() / "run"; }
  [[nodiscard]] fs::path temporary() const { return folder_.path() / "tmp"; }

  /// Whether there is a file or folder below the test's folder for which the predicate holds.
  template <typename Predicate>
  [[nodiscard]] bool HasFile(const Predicate& predicate) const {
    std::error_code error;
    for (auto it = fs::recursive_directory_iterator(folder_.path(), error);
         !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
      if (predicate(it->path())) return true;
    }
    return false;
  }

  /// Starts the program, sends the signal once a file as wanted has appeared, and waits.
  template <typename Predicate>
  ProgramResult Interrupt(const std::vector<std::string>& command, int signal, const Predicate& predicate) {
    ProgramOptions options;
    options.environment = {{"TMPDIR", temporary().string()}};
    Program program(testing::DexcheckCommand(command), options);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!HasFile(predicate) && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    program.Signal(signal);
    return program.Wait();
  }

  [[nodiscard]] bool HasLeftovers() const {
    return !fs::is_empty(temporary()) || HasFile([](const fs::path& path) {
      return path.filename().string().find(".partial") != std::string::npos;
    });
  }

  testing::TempFolder folder_;
};

TEST_F(Interruption, OfAReplayIsNoVerdict) {
  const ProgramResult run = RunDexcheck({"run", "hold", "--no-report", "--set", "duration=1", "--set",
                                         "settle=0.1", "--out", run_dir().string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const int signal : {SIGINT, SIGTERM}) {
    const ProgramResult result = Interrupt(
        {"run", "--replay", run_dir().string()}, signal,
        [&](const fs::path& path) { return path.filename() == "log.h5" && path.parent_path() != run_dir(); });
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_EQ(result.out, "") << "no verdict";
    EXPECT_THAT(result.err, HasSubstr("dexcheck: interrupted"));
    EXPECT_FALSE(HasLeftovers());
  }
}

TEST_F(Interruption, OfAReportLeavesNothing) {
  testing::ReportRun run;
  run.rows = 20000;
  testing::WriteReportRun(run_dir(), run);
  const auto is_partial = [](const fs::path& path) {
    return path.filename().string().find(".partial") != std::string::npos;
  };
  const auto is_script = [](const fs::path& path) { return path.extension() == ".gnuplot"; };
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const ProgramResult result = signal == SIGINT
                                     ? Interrupt({"report", run_dir().string()}, signal, is_partial)
                                     : Interrupt({"report", run_dir().string()}, signal, is_script);
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_EQ(result.err, "dexcheck: interrupted\n");
    EXPECT_FALSE(HasLeftovers());
    EXPECT_EQ(std::distance(fs::directory_iterator(run_dir()), fs::directory_iterator()), 1) << "the log";
  }
}

/// It may be faster than the signal; then the table is whole.
TEST_F(Interruption, OfAnExportLeavesAWholeTableOrNone) {
  testing::ReportRun run;
  run.rows = 20000;
  testing::WriteReportRun(run_dir(), run);
  const fs::path table = folder_.path() / "all.csv";
  const ProgramResult result = Interrupt(
      {"export", run_dir().string(), "--csv", table.string()}, SIGTERM,
      [](const fs::path& path) { return path.filename().string().find("all.csv") != std::string::npos; });
  EXPECT_THAT(result.exit_code, ::testing::AnyOf(0, 3)) << result.err;
  EXPECT_EQ(fs::exists(table), result.exit_code == 0);
  EXPECT_FALSE(HasLeftovers());
}

/// The verdict is told, and so it is the exit code.
TEST_F(Interruption, OfARunsReportKeepsItsVerdict) {
  const ProgramResult result =
      Interrupt({"run", "hold", "--set", "duration=0.05", "--set", "settle=0.1", "--out", run_dir().string()},
                SIGINT, [](const fs::path& path) { return path.extension() == ".gnuplot"; });
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\nPASS: "));
  EXPECT_EQ(result.err, "dexcheck: interrupted\n");
  EXPECT_FALSE(HasLeftovers());
  EXPECT_FALSE(fs::exists(run_dir() / "report.html"));
  EXPECT_FALSE(fs::exists(run_dir() / "figures"));
  EXPECT_EQ(LogReader(run_dir() / "log.h5").rows(), 50);
}

TEST_F(Interruption, OfADiagnosisIsNoVerdict) {
  // Before anything is compared.
  const fs::path json = folder_.path() / "all.json";
  const ProgramResult result = Interrupt(
      {"diagnose", "--json", json.string()}, SIGINT,
      [](const fs::path& path) { return path.filename().string().find("all.json") != std::string::npos; });
  EXPECT_EQ(result.exit_code, 3) << result.out;
}

}  // namespace
}  // namespace dexcheck::testing::interruption_test
