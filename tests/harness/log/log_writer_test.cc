#include "harness/log/log_writer.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>

#include "tests/common/allocation_counter.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/harness/log/sample_log.h"

namespace dexcheck::testing::log_writer_test {
namespace {

using LogWriterTest = LogFileTest;

TEST_F(LogWriterTest, RowsComeBackExactly) {
  for (const auto& [rows, max_rows] : {std::pair{50L, 50L}, {49L, 49L}, {1L, 1L}, {3L, 50L}, {0L, 50L}}) {
    WriteSampleLog(path_, rows, max_rows);
    EXPECT_TRUE(IsSample(LogReader(path_), rows));
    EXPECT_EQ(CountFiles(), 1);
    std::filesystem::remove(path_);
  }
}

TEST_F(LogWriterTest, UnitsAndDescriptionsComeBack) {
  WriteSampleLog(path_, 5, 5);
  const LogReader log(path_);
  ASSERT_EQ(log.signals().size(), 4U);
  EXPECT_EQ(log.signals()[0].name, "time");
  EXPECT_EQ(log.signals()[0].unit, "s");
  const SignalInfo& pose = log.signals()[1];
  EXPECT_EQ(pose.name, "object/X_o");
  EXPECT_EQ(pose.unit, "m, m, m, rad, rad, rad");
  EXPECT_EQ(pose.description, "Pose of the object");
  EXPECT_THAT(pose.columns, ElementsAre("x", "y", "z", "phi", "theta", "psi"));
  EXPECT_TRUE(pose.attributes.empty());
  const SignalInfo& check = log.signals()[2];
  EXPECT_EQ(check.width, 1);
  EXPECT_TRUE(check.columns.empty());
  EXPECT_EQ(check.attributes, (std::map<std::string, double>{{"bound", 1e-10}, {"kind", 2.0}}));
  EXPECT_THAT(log.ListTexts(), ElementsAre("empty", "scenario"));
  EXPECT_EQ(log.ReadText("empty"), "");
}

TEST_F(LogWriterTest, SameRowsGiveTheSameBytes) {
  WriteSampleLog(path_, 30, 30);
  const std::string bytes = ReadText(path_);
  ::usleep(1100000);  // a time stamp in the file would differ
  WriteSampleLog(folder_.path() / "other.h5", 30, 30);
  EXPECT_TRUE(ReadText(folder_.path() / "other.h5") == bytes);
  // Trimmed: room that was never used leaves no trace.
  WriteSampleLog(folder_.path() / "trimmed.h5", 30, 100000);
  EXPECT_TRUE(ReadText(folder_.path() / "trimmed.h5") == bytes);
}

TEST_F(LogWriterTest, FlushMakesRowsVisible) {
  SampleLog log(path_, 100000, 10);
  EXPECT_TRUE(IsSample(LogReader(path_), 0));
  WriteSampleRows(19, &log);
  EXPECT_TRUE(IsSample(LogReader(path_), 10));
  log.Flush();
  EXPECT_TRUE(IsSample(LogReader(path_), 19));
  log.Flush();
  WriteSampleRows(12, &log);
  EXPECT_TRUE(IsSample(LogReader(path_), 29));
  EXPECT_EQ(log.rows(), 31);
}

TEST_F(LogWriterTest, DestructionKeepsCompleteRows) {
  {
    SampleLog log(path_, 100, 40, 3);
    log.Row(1)[0] = 5.0;  // a row that never ends
  }
  EXPECT_TRUE(IsSample(LogReader(path_), 3));
}

TEST_F(LogWriterTest, WhatARowLeavesOutIsNotANumber) {
  {
    SampleLog log(path_, 10, 2, 3);
    log.Flush();
    for (int row = 3; row < 7; ++row) {
      log.Row(LogWriter::kTime)[0] = kTimeStep * row;
      log.Row(1)[2] = 7.0;
      log.EndRow();
    }
    log.Close();
  }
  const LogReader log(path_);
  ASSERT_EQ(log.rows(), 7);
  const RowMatrixXd pose = log.ReadSignal("object/X_o");
  for (int row = 3; row < 7; ++row) {
    for (int k = 0; k < 6; ++k) EXPECT_EQ(std::isnan(pose(row, k)), k != 2) << row << " " << k;
    EXPECT_EQ(pose(row, 2), 7.0);
  }
}

TEST_F(LogWriterTest, FlushForgetsARowUnderConstruction) {
  {
    SampleLog log(path_, 10, 5);
    WriteSampleRow(&log);
    log.Row(2)[0] = 3.0;
    log.Flush();
    log.Row(LogWriter::kTime)[0] = kTimeStep;
    log.EndRow();
    log.Close();
  }
  EXPECT_TRUE(std::isnan(LogReader(path_).ReadSignal("check/M_bar")(1, 0)));
}

TEST_F(LogWriterTest, LateTextsAndFilesReachTheFile) {
  for (const long max_rows : {20L, 1000L}) {
    SampleLog log(path_, max_rows, 8, 20);
    const std::string long_text(1 << 20, 'x');
    log.SetText("summary", long_text);
    log.SetText("empty", "no longer");
    log.EmbedFile("outputs", "figure.svg", "<svg/>");
    log.Close();
    const LogReader reader(path_);
    EXPECT_TRUE(IsSample(reader, 20));
    EXPECT_TRUE(reader.ReadText("summary") == long_text);
    EXPECT_EQ(reader.ReadText("empty"), "no longer");
    EXPECT_EQ(reader.ReadFile("outputs", "figure.svg"), "<svg/>");
    EXPECT_EQ(CountFiles(), 1);
    std::filesystem::remove(path_);
  }
}

TEST_F(LogWriterTest, RoomCostsNoDiskSpace) {
  struct stat status {};
  LogWriter log(path_, 10000000, 10);  // 960 MB
  log.AddSignal({"wide", "1", "", 11, {}, {}});
  log.StartRows();
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_GT(status.st_size, 900000000);
  // Time alone is filled.
  constexpr long kBlock = 512;
  EXPECT_LT(status.st_blocks * kBlock, 90000000);
  log.Close();
  EXPECT_LT(std::filesystem::file_size(path_), 10000U);
}

TEST_F(LogWriterTest, RowsAllocateNothing) {
  SampleLog log(path_, 1000, 10, 20);
  const AllocationCounter counter;
  WriteSampleRows(500, &log);
  EXPECT_EQ(counter.count(), 0);
  EXPECT_FALSE(ReadText(path_).empty());
  EXPECT_GT(counter.count(), 0) << "the counter does not count";
}

}  // namespace
}  // namespace dexcheck::testing::log_writer_test
