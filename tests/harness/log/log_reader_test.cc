#include "harness/log/log_reader.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>

#include "controller/common/errors.h"
#include "harness/log/log_content.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/common/run_program.h"
#include "tests/common/throws.h"
#include "tests/harness/log/change_log.h"
#include "tests/harness/log/sample_log.h"

namespace dexcheck::testing::log_reader_test {
namespace {

class LogReaderTest : public LogFileTest {
 protected:
  [[nodiscard]] std::string Open() const {
    return MessageOf<InputError>([&] { const LogReader log(path_); });
  }
};

TEST_F(LogReaderTest, FilesComeBackWithTheirBytes) {
  std::string all_bytes;
  for (unsigned i = 0; i < 100000; ++i) all_bytes += static_cast<char>(i * i / 7);
  {
    LogWriter log(path_, 10);
    log.EmbedFile("inputs/a", "all", all_bytes);
    log.EmbedFile("inputs/a", "none", "");
    log.EmbedFile("inputs", "b/c d/\xc3\xa4.xml", "<mujoco/>");
    log.StartRows();
    log.Close();
  }
  const LogReader log(path_);
  EXPECT_EQ(log.rows(), 0);
  EXPECT_THAT(log.ListFiles("inputs"), ElementsAre("a/all", "a/none", "b/c d/\xc3\xa4.xml"));
  EXPECT_THAT(log.ListFiles("inputs/a"), ElementsAre("all", "none"));
  EXPECT_TRUE(log.ReadFile("inputs", "a/all") == all_bytes);
  EXPECT_EQ(log.ReadFile("inputs/a", "none"), "");

  log.ExtractFiles("inputs", folder_.path() / "out/of the log");
  EXPECT_TRUE(ReadText(folder_.path() / "out/of the log/a/all") == all_bytes);
  EXPECT_EQ(ReadText(folder_.path() / "out/of the log/b/c d/\xc3\xa4.xml"), "<mujoco/>");
  EXPECT_EQ(std::filesystem::file_size(folder_.path() / "out/of the log/a/none"), 0U);
  EXPECT_EQ(MessageOf<InputError>([&] { log.ExtractFiles("inputs", folder_.path() / "out/of the log"); }),
            (folder_.path() / "out/of the log/a/all").string() + ": cannot be written: File exists");
  EXPECT_THAT(MessageOf<InputError>([&] { log.ExtractFiles("inputs", path_); }),
              HasSubstr("log.h5/a: cannot be made: Not a directory"));
}

TEST_F(LogReaderTest, FilesThatAreNoLogsAreRefused) {
  const std::string file = path_.string() + ": ";
  EXPECT_EQ(Open(), file + "cannot be read: No such file or directory");
  std::filesystem::create_directory(path_);
  EXPECT_EQ(Open(), file + "cannot be read: Is a directory");
  std::filesystem::remove(path_);
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  EXPECT_EQ(Open(), file + "not a dexcheck log: not a regular file");
  std::filesystem::remove(path_);
  WriteText(path_, "");
  EXPECT_EQ(Open(), file + "not a dexcheck log: the file is empty");
  for (const std::string& text : {std::string("x"), std::string("time,x\n0,1\n"), std::string(5000, '\0')}) {
    WriteText(path_, text);
    EXPECT_EQ(Open(), file + "not a dexcheck log");
  }
}

/// Bits flipped, bytes put in or replaced, at random: one line, or a log that is read.
void ReadRandomDamage(const std::filesystem::path& path) {
  constexpr int kTrials = 200;
  WriteSampleLog(path, 20, 20);
  const std::string good = ReadText(path);
  std::mt19937 random(5);
  int refused = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::string damaged = good;
    for (size_t count = size_t{1} << (random() % 6); count > 0; --count) {
      const size_t at = random() % damaged.size();
      if (trial % 3 == 0) damaged[at] = static_cast<char>(damaged[at] ^ (1 << (random() % 8)));
      if (trial % 3 == 1) damaged.insert(at, 1, static_cast<char>(random()));
      if (trial % 3 == 2) damaged[at] = static_cast<char>(random());
    }
    WriteText(path, damaged);
    const std::string message = MessageOf<InputError>([&] {
      const LogReader log(path);
      for (const SignalInfo& signal : log.signals()) (void)log.ReadSignal(signal.name);
      for (const std::string& text : log.ListTexts()) (void)log.ReadText(text);
      for (const std::string& file : log.ListFiles("inputs")) (void)log.ReadFile("inputs", file);
    });
    if (message == "accepted") continue;
    ++refused;
    EXPECT_THAT(message, StartsWith(path.string() + ": "));
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
  EXPECT_GE(refused, kTrials / 2);
}

TEST_F(LogReaderTest, RandomDamageIsOneLine) {
  // In a process of its own: HDF5 leaves a damaged heap to one that has read some of these.
  const auto read = [&] {
    ReadRandomDamage(path_);
    std::_Exit(HasFailure() ? 1 : 0);
  };
  EXPECT_EXIT(read(), ::testing::ExitedWithCode(0), "");
}

TEST_F(LogReaderTest, WrongAndMissingPartsAreNamed) {
  const std::string damaged = path_.string() + ": the log is damaged: ";
  const auto change = [&](const std::function<void(hid_t)>& what) {
    std::filesystem::remove(path_);
    WriteSampleLog(path_, 3, 3);
    ChangeLog(path_, what);
    return Open();
  };
  EXPECT_EQ(change([](hid_t file) { H5Adelete(file, "signals"); }), damaged + "it has no list of signals");
  EXPECT_THAT(change([](hid_t file) { H5Ldelete(file, "object/X_o", H5P_DEFAULT); }), StartsWith(damaged));
  EXPECT_THAT(change([](hid_t file) { H5Ldelete(file, "meta", H5P_DEFAULT); }), StartsWith(damaged));
  for (const hid_t type : {H5T_IEEE_F64LE, H5T_STD_I32LE}) {
    const std::string message = change([&](hid_t file) {
      H5Ldelete(file, "check/M_bar", H5P_DEFAULT);
      AddBytes(file, "check/M_bar", type);
    });
    EXPECT_EQ(message, damaged + "\"check/M_bar\" " +
                           (type == H5T_STD_I32LE ? "is not rows of numbers" : "has other rows"));
  }
  EXPECT_EQ(change([](hid_t file) { AddBytes(file, "inputs/numbers", H5T_STD_I32LE); }),
            damaged + "\"inputs/numbers\" is not a file");
  EXPECT_EQ(change([](hid_t file) { AddBytes(file, "meta/numbers", H5T_STD_I32LE); }),
            damaged + "\"meta/numbers\" is not a file");
  EXPECT_EQ(change([](hid_t file) { H5Arename(file, "format", "form"); }), "accepted")
      << "as one of format 1";
}

/// A log of format 1 reads with today's names of signals, checks and keys, and with the same numbers.
TEST_F(LogReaderTest, FormatOneHasTodaysNames) {
  const ProgramResult unpacked = RunProgram({"xz", "-dc", SourcePath("/tests/harness/log/format_1.h5.xz")});
  ASSERT_EQ(unpacked.exit_code, 0) << unpacked.err;
  WriteText(path_, unpacked.out);
  const LogReader log(path_);
  EXPECT_EQ(log.rows(), 10);
  for (const OldName& name : ListOldNames()) {
    if (name.of != OldName::Of::kCheck) continue;
    EXPECT_EQ(log.Find("check/" + std::string(name.old)), nullptr) << name.old;
  }
  ASSERT_NE(log.Find("check/inverse_dynamics_robot"), nullptr);
  EXPECT_EQ(log.ReadSignal("check/inverse_dynamics_robot").rows(), 10);
  EXPECT_GT(log.ReadSignal("q").cwiseAbs().maxCoeff(), 0.0);
  const nlohmann::json summary = nlohmann::json::parse(log.ReadText("summary"));
  EXPECT_EQ(summary["checks"]["inverse_dynamics_robot"]["kind"], "inverse_dynamics");
  EXPECT_FALSE(summary["checks"].contains("balance_robot"));
}

}  // namespace
}  // namespace dexcheck::testing::log_reader_test
