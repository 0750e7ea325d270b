// dexcheck export: a run's log as a table.

#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "harness/log/log_writer.h"
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

class ExportTest : public CommandTest {
 protected:
  ExportTest() {
    std::filesystem::create_directory(folder_.path() / "run");
    LogWriter log(Path("run/log.h5"), 100);
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

  [[nodiscard]] ProgramResult Export(const Words& arguments) const {
    return Run(Words("export run") + arguments);
  }

  /// The first line of what goes to standard output.
  [[nodiscard]] std::string HeaderOf(const std::string& signals) const {
    return SplitLines(Expect(0, {"export", "run", "--csv", "-", "--signals", signals}).out).at(0);
  }
};

TEST_F(ExportTest, EveryNumberReadsBackExactly) {
  const ProgramResult result = Expect(0, "export run --csv out.csv");
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("cut off after")) << "the log has no summary";
  const std::string text = Read("out.csv");
  EXPECT_THAT(text, StartsWith(kHeader));
  const std::vector<std::string> lines = SplitLines(text);
  ASSERT_EQ(lines.size(), kRows + 1U);
  for (long row = 0; row < kRows; ++row) {
    const std::vector<double> numbers = ReadNumbers(lines[static_cast<size_t>(row) + 1]);
    ASSERT_EQ(numbers.size(), 9U);
    EXPECT_EQ(numbers[0], 1e-3 * static_cast<double>(row));
    for (int k = 1; k < 8; ++k) EXPECT_EQ(numbers[static_cast<size_t>(k)], Number(row, k)) << row << " " << k;
  }
  EXPECT_THAT(lines[4], EndsWith(",nan"));
  EXPECT_THAT(lines[5], EndsWith(",-inf"));
  EXPECT_EQ(Export("--csv -").out, text);
}

TEST_F(ExportTest, SignalsAreChosenByPattern) {
  EXPECT_EQ(HeaderOf("check/M_bar"), "time [s],check/M_bar [1]");
  EXPECT_EQ(HeaderOf("object/f,check/M_bar"), "time [s],object/f.0 [N],object/f.1 [N],check/M_bar [1]");
  EXPECT_EQ(HeaderOf("check/M_bar,object/f"), HeaderOf("object/f,check/M_bar")) << "the log's order counts";
  EXPECT_EQ(HeaderOf("*bar,time"), "time [s],check/M_bar [1]");
  EXPECT_EQ(HeaderOf("object/?"), "time [s],object/f.0 [N],object/f.1 [N]");
  EXPECT_EQ(HeaderOf("*") + "\n", kHeader);
  // The option takes one word: the folder may follow it.
  EXPECT_THAT(Expect(0, "export --csv - --signals check/M_bar run").out,
              StartsWith("time [s],check/M_bar [1]\n"));
}

TEST_F(ExportTest, RowsAreThinnedOut) {
  const std::vector<std::string> all = SplitLines(Export("--csv -").out);
  EXPECT_THAT(SplitLines(Export("--csv - --every 10").out), ElementsAre(all[0], all[1], all[11], all[21]));
  EXPECT_THAT(SplitLines(Export("--csv - --every 1000").out), ElementsAre(all[0], all[1]));
}

TEST_F(ExportTest, ListNamesUnitsAndDescriptions) {
  const std::vector<std::string> lines = SplitLines(Expect(0, "export run --list").out);
  ASSERT_EQ(lines.size(), 7U);
  EXPECT_THAT(lines[0], StartsWith("25 "));
  EXPECT_THAT(lines[3], AllOf(StartsWith("object/X_o "), EndsWith(" 2  [m, rad] Pose of the object")));
  EXPECT_EQ(SplitLines(Export("--list --signals object/f").out).size(), 4U);
}

/// More text than is handed on at a time.
TEST_F(ExportTest, LongLogsAreWhole) {
  constexpr long kManyRows = 60000;
  std::filesystem::remove(Path("run/log.h5"));
  LogWriter log(Path("run/log.h5"), kManyRows);
  log.AddSignal({"x", "m", "", 1, {}, {}});
  log.StartRows();
  for (long row = 0; row < kManyRows; ++row) {
    log.Row(LogWriter::kTime)[0] = static_cast<double>(row);
    log.Row(1)[0] = Number(row, 1);
    log.EndRow();
  }
  log.Close();
  Expect(0, "export run --csv out.csv");
  const std::vector<std::string> lines = SplitLines(Read("out.csv"));
  ASSERT_EQ(lines.size(), kManyRows + 1U);
  for (long row = 0; row < kManyRows; ++row) {
    ASSERT_EQ(ReadNumbers(lines[static_cast<size_t>(row) + 1]),
              (std::vector<double>{static_cast<double>(row), Number(row, 1)}));
  }
}

TEST_F(ExportTest, LogsWithoutRowsGiveAHeader) {
  std::filesystem::remove(Path("run/log.h5"));
  {
    LogWriter log(Path("run/log.h5"), 10);
    log.StartRows();
    log.Close();
  }
  EXPECT_EQ(Export("--csv -").out, "time [s]\n");
}

TEST_F(ExportTest, BadLogsAreRefusedInOneLine) {
  Write("out.csv", "before");
  const std::string log = Read("run/log.h5");
  for (const auto& [text, part] : {std::pair(log.substr(0, log.size() / 2), "cut short"),
                                   {std::string("no log"), "not a dexcheck log"}}) {
    Write("run/log.h5", text);
    EXPECT_TRUE(IsRefused(Export("--csv out.csv"), {"run/log.h5: ", part}));
  }
  std::filesystem::remove(Path("run/log.h5"));
  EXPECT_TRUE(IsRefused(Export("--csv out.csv"), {"run/log.h5: ", "No such file"}));
  EXPECT_EQ(Read("out.csv"), "before");
}

TEST_F(ExportTest, OutputsThatCannotBeWrittenAreNamed) {
  Write("out.csv", "before");
  EXPECT_TRUE(
      IsRefused(Run("export run --csv out.csv", {.largest_file = 1000}), {"out.csv: ", "File too large"}));
  EXPECT_EQ(Read("out.csv"), "before");
  EXPECT_TRUE(
      IsRefused(Run("export run --csv -", {.out = "/dev/full"}), {"standard output: ", "No space left"}));
}

}  // namespace
}  // namespace dexcheck::testing::export_command_test
