// Ctrl-C and SIGTERM at any time: exit code 3 and no verdict, nothing half written, no temporary folder.

#include <chrono>
#include <csignal>
#include <thread>

#include "harness/log/log_reader.h"
#include "tests/common/refused_text.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::interruption_test {
namespace {

namespace fs = std::filesystem;

class Interruption : public CommandTest {
 protected:
  Interruption() { fs::create_directory(Path("tmp")); }

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

  /// Starts the program, sends the signal once a file as wanted has been there for a while, and waits.
  template <typename Predicate>
  ProgramResult Interrupt(const Words& command, int signal, const Predicate& predicate,
                          std::chrono::milliseconds later = {}) {
    Program program(DexcheckCommand(command),
                    {.folder = folder_.path(), .environment = {{"TMPDIR", Path("tmp").string()}}});
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!HasFile(predicate) && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(later);
    program.Signal(signal);
    return program.Wait();
  }

  [[nodiscard]] bool HasLeftovers() const { return !fs::is_empty(Path("tmp")) || HasFile(IsPartial); }
  static bool IsPartial(const fs::path& path) {
    return path.filename().string().find(".partial") != std::string::npos;
  }
  static bool IsScript(const fs::path& path) { return path.extension() == ".gnuplot"; }
  static bool IsLog(const fs::path& path) { return path.filename() == "log.h5"; }
};

/// A command that is ended before its end, and where its JSON says so.
struct Interrupted {
  std::string name;
  const char* command;
  int signal;
  const char* file;  ///< The JSON.
  const char* pointer;
  Json value;
  int later_ms = 0;  ///< From the begin of the file, or of the log, to the signal.
};
void PrintTo(const Interrupted& interrupted, std::ostream* out) { *out << interrupted.name; }

class Results : public Interruption, public ::testing::WithParamInterface<Interrupted> {};

TEST_P(Results, SayThatTheyAreOfAPart) {
  const Interrupted& one = GetParam();
  const std::string name = fs::path(one.file).filename();
  const auto begin = std::chrono::steady_clock::now();
  // The program makes its output file once it listens to signals.
  const ProgramResult result = Interrupt(
      one.command, one.signal,
      [&](const fs::path& path) {
        return IsLog(path) || path.filename().string().find(name) != std::string::npos;
      },
      std::chrono::milliseconds(one.later_ms));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
  EXPECT_EQ(result.exit_code, 3) << result.out << result.err;
  const Json json = ReadJson(one.file);
  EXPECT_EQ(json.at(Json::json_pointer(one.pointer)), one.value);
  if (json.contains("samples_requested")) {
    EXPECT_GT(json["samples"], 0);
    EXPECT_LT(json["samples"], json["samples_requested"]);
  }
  if (Has("run/log.h5")) EXPECT_EQ(LogReader(Path("run/log.h5")).rows(), json["speed"]["steps"].get<long>());
  EXPECT_FALSE(HasLeftovers());
}

INSTANTIATE_TEST_SUITE_P(
    All, Results,
    ::testing::ValuesIn(std::vector<Interrupted>{
        {"Consistency", "consistency --samples 1000000000 --json out.json", SIGINT, "out.json", "/verdict",
         "failed"},
        {"ConsistencyTerminated", "consistency --samples 1000000000 --json out.json", SIGTERM, "out.json",
         "/verdict", "failed"},
        {"Mutate", "mutate --json out.json", SIGINT, "out.json", "/complete", false},
        {"MutateRun", "mutate hold --set settle=0.1 --from 0.01 --numbers 100000 --json out.json", SIGINT,
         "out.json", "/complete", false},
        {"Run", "run hold --set duration=1000 --out run", SIGINT, "run/summary.json", "/interrupted", true,
         2000},
        {"RunSettling", "run hold --set settle=100 --out run", SIGINT, "run/summary.json", "/speed/steps", 0,
         1000},
        // It settles twice, the second time while it moves: as short before as the test can distinguish.
        {"RunMovingOff",
         "run paper --set settle=0.01 --set plant.time_step=1e-5 --set duration=1e-3 --out run", SIGINT,
         "run/summary.json", "/speed/steps", 0, 1000}}),
    CaseName());

TEST_F(Interruption, OfAReplayIsNoVerdict) {
  Expect(0, "run hold --no-report --set duration=1 --set settle=0.1 --out run");
  for (const int signal : {SIGINT, SIGTERM}) {
    const ProgramResult result = Interrupt("run --replay run", signal, [&](const fs::path& path) {
      return IsLog(path) && path.parent_path() != Path("run");
    });
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_EQ(result.out, "") << "no verdict";
    EXPECT_FALSE(HasLeftovers());
  }
}

TEST_F(Interruption, OfAReportLeavesNothing) {
  WriteReportRun(Path("run"), {.rows = 20000});
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const ProgramResult result = Interrupt("report run", signal, signal == SIGINT ? IsPartial : IsScript);
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_TRUE(IsOneLineWith(result.err, {"interrupted"}));
    EXPECT_FALSE(HasLeftovers());
    EXPECT_EQ(CountFiles("run"), 1) << "the log";
  }
}

/// It may be faster than the signal; then the table is whole.
TEST_F(Interruption, OfAnExportLeavesAWholeTableOrNone) {
  WriteReportRun(Path("run"), {.rows = 20000});
  const ProgramResult result = Interrupt("export run --csv all.csv", SIGTERM, [](const fs::path& path) {
    return path.filename().string().find("all.csv") != std::string::npos;
  });
  EXPECT_THAT(result.exit_code, ::testing::AnyOf(0, 3)) << result.err;
  EXPECT_EQ(Has("all.csv"), result.exit_code == 0);
  EXPECT_FALSE(HasLeftovers());
}

/// Its verdict is there, and so it is the exit code.
TEST_F(Interruption, OfARunsReportKeepsItsVerdict) {
  const ProgramResult result =
      Interrupt("run hold --set duration=0.05 --set settle=0.1 --out run", SIGINT, IsScript);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(ReadJson("run/summary.json")["verdict"], "pass");
  EXPECT_TRUE(IsOneLineWith(result.err, {"interrupted"}));
  EXPECT_FALSE(HasLeftovers());
  EXPECT_EQ(CountFiles("run"), 2) << "log and summary";
  EXPECT_EQ(LogReader(Path("run/log.h5")).rows(), 50);
}

TEST_F(Interruption, OfADiagnosisIsNoVerdict) {
  // Before anything is compared.
  const ProgramResult result = Interrupt("diagnose --json all.json", SIGINT, [](const fs::path& path) {
    return path.filename().string().find("all.json") != std::string::npos;
  });
  EXPECT_EQ(result.exit_code, 3) << result.out;
}

TEST_F(Interruption, OfAVideoLeavesNothing) {
  Copy("arm.xml");
  Copy("own.toml");
  Expect(0, "import arm.xml --out arm.toml");
  Expect(0, "run own.toml --set duration=20 --no-check --no-report --out run");
  const long files = CountFiles("run");
  // Until the drawing has begun, by the temporary file.
  const ProgramResult result = Interrupt(
      "render run --size 160x90", SIGINT,
      [](const fs::path& path) { return path.filename().string().find("video") != std::string::npos; },
      std::chrono::milliseconds(200));
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_TRUE(IsOneLineWith(result.err, {"of 600 frames"}));
  EXPECT_EQ(CountFiles("run"), files);
}

}  // namespace
}  // namespace dexcheck::testing::interruption_test
