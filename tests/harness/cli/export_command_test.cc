// dexcheck export: a run's log as a table.

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "harness/log/log_writer.h"
#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::export_command_test {
namespace {

constexpr long kRows = 25;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const std::string kHeader =
    "time [s],object/X_o.x [m],object/X_o.phi [rad],object/f.0 [N],object/f.1 [N],"
    "\"check/mixed.0 [m, rad]\",\"check/mixed.1 [m, rad]\",\"check/mixed.2 [m, rad]\",check/M_bar [1]\n";

/// Number k of a row; not a short decimal.
double Number(long row, int k) {
  return std::sin(static_cast<double>(row) + 0.1 * k) / 3.0 * std::pow(10.0, k);
}

std::vector<std::string> SplitLines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<double> ReadNumbers(const std::string& line) {
  std::vector<double> numbers;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');)
    numbers.push_back(std::strtod(field.c_str(), nullptr));
  return numbers;
}

class ExportTest : public ::testing::Test {
 protected:
  ExportTest() {
    std::filesystem::create_directory(folder_.path() / "run");
    LogWriter log(folder_.path() / "run/log.h5", 100);
    log.AddSignal({"object/X_o", "m, rad", "Pose of the object", 2, {"x", "phi"}, {}});
    log.AddSignal({"object/f", "N", "Force", 2, {}, {}});
    log.AddSignal({"check/mixed", "m, rad", "Two units, three numbers", 3, {}, {}});
    log.AddSignal({"check/M_bar", "1", "Worst error", 1, {}, {{"bound", 1e-10}}});
    log.StartRows();
    for (long row = 0; row < kRows; ++row) {
      log.Row(LogWriter::kTime)[0] = 1e-3 * static_cast<double>(row);
      int k = 1;
      for (int signal = 1; signal <= 4; ++signal) {
        for (double& number : log.Row(signal)) number = Number(row, k++);
      }
      if (row == 3) log.Row(4)[0] = -kNan;
      if (row == 4) log.Row(4)[0] = -std::numeric_limits<double>::infinity();
      log.EndRow();
    }
    log.Close();
  }

  [[nodiscard]] testing::ProgramResult Export(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"export", "run"});
    testing::ProgramOptions options;
    options.folder = folder_.path();
    return RunDexcheck(arguments, options);
  }

  /// The first line of what goes to standard output.
  [[nodiscard]] std::string HeaderOf(const std::string& signals) const {
    const testing::ProgramResult result = Export({"--csv", "-", "--signals", signals});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return SplitLines(result.out).at(0);
  }

  testing::TempFolder folder_;
};

TEST_F(ExportTest, EveryNumberReadsBackExactly) {
  const testing::ProgramResult result = Export({"--csv", "out.csv"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, ::testing::HasSubstr("cut off after")) << "the log has no summary";
  const std::string text = ReadText(folder_.path() / "out.csv");
  EXPECT_THAT(text, ::testing::StartsWith(kHeader));
  const std::vector<std::string> lines = SplitLines(text);
  ASSERT_EQ(lines.size(), kRows + 1U);
  for (long row = 0; row < kRows; ++row) {
    const std::vector<double> numbers = ReadNumbers(lines[static_cast<size_t>(row) + 1]);
    ASSERT_EQ(numbers.size(), 9U);
    EXPECT_EQ(numbers[0], 1e-3 * static_cast<double>(row));
    for (int k = 1; k < 8; ++k) EXPECT_EQ(numbers[static_cast<size_t>(k)], Number(row, k)) << row << " " << k;
  }
  EXPECT_THAT(lines[4], ::testing::EndsWith(",nan"));
  EXPECT_THAT(lines[5], ::testing::EndsWith(",-inf"));
  EXPECT_EQ(Export({"--csv", "-"}).out, text);
}

TEST_F(ExportTest, SignalsAreChosenByPattern) {
  EXPECT_EQ(HeaderOf("check/M_bar"), "time [s],check/M_bar [1]");
  EXPECT_EQ(HeaderOf("object/f,check/M_bar"), "time [s],object/f.0 [N],object/f.1 [N],check/M_bar [1]");
  EXPECT_EQ(HeaderOf("check/M_bar,object/f"), HeaderOf("object/f,check/M_bar")) << "the log's order counts";
  EXPECT_EQ(HeaderOf("*bar,time"), "time [s],check/M_bar [1]");
  EXPECT_EQ(HeaderOf("object/?"), "time [s],object/f.0 [N],object/f.1 [N]");
  EXPECT_EQ(HeaderOf("*") + "\n", kHeader);
  // The option takes one word: the folder may follow it.
  testing::ProgramOptions options;
  options.folder = folder_.path();
  const testing::ProgramResult result =
      RunDexcheck({"export", "--csv", "-", "--signals", "check/M_bar", "run"}, options);
  EXPECT_THAT(result.out, ::testing::StartsWith("time [s],check/M_bar [1]\n")) << result.err;
}

TEST_F(ExportTest, RowsAreThinnedOut) {
  const std::vector<std::string> all = SplitLines(Export({"--csv", "-"}).out);
  EXPECT_THAT(SplitLines(Export({"--csv", "-", "--every", "10"}).out),
              ElementsAre(all[0], all[1], all[11], all[21]));
  EXPECT_THAT(SplitLines(Export({"--csv", "-", "--every", "1000"}).out), ElementsAre(all[0], all[1]));
}

TEST_F(ExportTest, ListNamesUnitsAndDescriptions) {
  const testing::ProgramResult result = Export({"--list"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(SplitLines(result.out), ElementsAre("25 rows", "signal       numbers  [unit] description",
                                                  "time               1  [s] Simulated time",
                                                  "object/X_o         2  [m, rad] Pose of the object",  //
                                                  "object/f           2  [N] Force",
                                                  "check/mixed        3  [m, rad] Two units, three numbers",
                                                  "check/M_bar        1  [1] Worst error"));
  EXPECT_THAT(SplitLines(Export({"--list", "--signals", "object/f"}).out), ::testing::SizeIs(4));
}

/// More text than is handed on at a time.
TEST_F(ExportTest, LongLogsAreWhole) {
  constexpr long kManyRows = 60000;
  std::filesystem::remove(folder_.path() / "run/log.h5");
  LogWriter log(folder_.path() / "run/log.h5", kManyRows);
  log.AddSignal({"x", "m", "", 1, {}, {}});
  log.StartRows();
  for (long row = 0; row < kManyRows; ++row) {
    log.Row(LogWriter::kTime)[0] = static_cast<double>(row);
    log.Row(1)[0] = Number(row, 1);
    log.EndRow();
  }
  log.Close();
  ASSERT_EQ(Export({"--csv", "out.csv"}).exit_code, 0);
  const std::vector<std::string> lines = SplitLines(ReadText(folder_.path() / "out.csv"));
  ASSERT_EQ(lines.size(), kManyRows + 1U);
  for (long row = 0; row < kManyRows; ++row) {
    ASSERT_EQ(ReadNumbers(lines[static_cast<size_t>(row) + 1]),
              (std::vector<double>{static_cast<double>(row), Number(row, 1)}));
  }
}

TEST_F(ExportTest, LogsWithoutRowsGiveAHeader) {
  std::filesystem::remove(folder_.path() / "run/log.h5");
  {
    LogWriter log(folder_.path() / "run/log.h5", 10);
    log.StartRows();
    log.Close();
  }
  EXPECT_EQ(Export({"--csv", "-"}).out, "time [s]\n");
}

TEST_F(ExportTest, BadRequestsAreRefusedInOneLine) {
  EXPECT_TRUE(IsRefused(Export({}), {"--csv FILE.csv or --list is required"}));
  EXPECT_TRUE(IsRefused(Export({"--csv", "-", "--list"}), {"--csv excludes --list"}));
  EXPECT_TRUE(IsRefused(Export({"--csv", "out.csv", "--signals", "object/f,object/g"}),
                        {"--signals: no signal matches \"object/g\", did you mean \"object/f\"?"}));
  EXPECT_TRUE(
      IsRefused(Export({"--csv", "out.csv", "--signals", "gripper/*"}), {"\"gripper/*\" (see --list)"}));
  for (const char* every : {"0", "-1", "x", "1.5"}) {
    EXPECT_TRUE(
        IsRefused(Export({"--csv", "out.csv", "--every", every}), {"--every: must be a whole number"}));
  }
  EXPECT_TRUE(IsRefused(RunDexcheck({"export", "--csv", "-"}), {"RUN_DIR is required"}));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out.csv"));
}

TEST_F(ExportTest, BadLogsAreRefusedInOneLine) {
  WriteText(folder_.path() / "out.csv", "before");
  const std::filesystem::path log = folder_.path() / "run/log.h5";
  const std::string bytes = ReadText(log);
  WriteText(log, bytes.substr(0, bytes.size() / 2));
  EXPECT_TRUE(IsRefused(Export({"--csv", "out.csv"}), {"run/log.h5: the log is cut short: "}));
  WriteText(log, "no log");
  EXPECT_TRUE(IsRefused(Export({"--csv", "out.csv"}), {"run/log.h5: not a dexcheck log"}));
  std::filesystem::remove(log);
  EXPECT_TRUE(
      IsRefused(Export({"--csv", "out.csv"}), {"run/log.h5: cannot be read: No such file or directory"}));
  EXPECT_EQ(ReadText(folder_.path() / "out.csv"), "before");
}

TEST_F(ExportTest, OutputsThatCannotBeWrittenAreNamed) {
  EXPECT_TRUE(IsRefused(Export({"--csv", "no/out.csv"}), {"no/out.csv: cannot be written: No such file"}));
  testing::ProgramOptions options;
  options.folder = folder_.path();
  options.largest_file = 1000;
  WriteText(folder_.path() / "out.csv", "before");
  EXPECT_TRUE(IsRefused(RunDexcheck({"export", "run", "--csv", "out.csv"}, options),
                        {"out.csv: cannot be written: File too large"}));
  EXPECT_EQ(ReadText(folder_.path() / "out.csv"), "before");
  options.largest_file.reset();
  options.out = "/dev/full";
  EXPECT_TRUE(IsRefused(RunDexcheck({"export", "run", "--csv", "-"}, options),
                        {"standard output: cannot be written: No space left on device"}));
}

}  // namespace
}  // namespace dexcheck::testing::export_command_test
