#include "harness/log/log_reader.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <random>

#include "controller/common/errors.h"
#include "tests/common/matchers.h"
#include "tests/common/run_program.h"
#include "tests/harness/log/forge.h"
#include "tests/harness/log/sample_log_check.h"

namespace dexcheck::testing::log_reader_test {
namespace {

template <typename Function>
std::string MessageOf(const Function& function) {
  try {
    function();
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

class LogReaderTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::string Open() const {
    return MessageOf([&] { const LogReader log(path_); });
  }

  TempFolder folder_;
  std::filesystem::path path_ = folder_.path() / "log.h5";
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
  EXPECT_EQ(MessageOf([&] { log.ExtractFiles("inputs", folder_.path() / "out/of the log"); }),
            (folder_.path() / "out/of the log/a/all").string() + ": cannot be written: File exists");
  EXPECT_THAT(MessageOf([&] { log.ExtractFiles("inputs", path_); }),
              HasSubstr("log.h5/a: cannot be written: Not a directory"));
}

TEST_F(LogReaderTest, UnknownNamesAreNamed) {
  WriteSampleLog(path_, 3, 3);
  const LogReader log(path_);
  const std::string file = path_.string() + ": ";
  EXPECT_EQ(MessageOf([&] { (void)log.ReadSignal("object/X"); }), file +
                                                                      "no signal \"object/X\", did you mean "
                                                                      "\"object/X_o\"?");
  EXPECT_EQ(MessageOf([&] { (void)log.ReadSignal("object"); }), file + "no signal \"object\"");
  EXPECT_EQ(MessageOf([&] { (void)log.ReadText("scenari"); }),
            file + "no text \"scenari\", did you mean \"scenario\"?");
  for (const char* group : {"outputs", "object", "check/M_bar", "inputs/scenario.toml", "meta", ""}) {
    EXPECT_EQ(MessageOf([&] { (void)log.ListFiles(group); }), file + "no group of files \"" + group + "\"");
  }
  EXPECT_EQ(MessageOf([&] { (void)log.ReadFile("inputs", "mjcf"); }),
            file + "no embedded file \"inputs/mjcf\"");
}

TEST_F(LogReaderTest, ManySignalsOfManySizes) {
  constexpr int kSignals = 700;
  {
    LogWriter log(path_, 3, 2);
    for (int i = 1; i <= kSignals; ++i) {
      log.AddSignal({"group_" + std::to_string(i % 13) + "/signal_" + std::to_string(i),
                     "m",
                     "",
                     i % 41 + 1,
                     std::vector<std::string>(static_cast<size_t>(i % 41 + 1), "a column"),
                     {}});
    }
    log.AddSignal({"wide", "m", "", 20000, {}, {}});
    log.StartRows();
    for (int row = 0; row < 3; ++row) {
      log.Row(0)[0] = row;
      for (int i = 1; i <= kSignals; ++i) log.Row(i).back() = i + 1e-3 * row;
      log.Row(kSignals + 1).front() = row;
      log.EndRow();
    }
    log.Close();
  }
  const LogReader log(path_);
  ASSERT_EQ(log.signals().size(), kSignals + 2U);
  for (int i = 1; i <= kSignals; ++i) {
    const SignalInfo& signal = log.signals()[static_cast<size_t>(i)];
    ASSERT_EQ(signal.width, i % 41 + 1);
    ASSERT_EQ(log.ReadSignal(signal.name)(2, i % 41), i + 2e-3);
    ASSERT_EQ(signal.columns.size(), static_cast<size_t>(signal.width));
  }
  EXPECT_EQ(log.ReadSignal("wide").cols(), 20000);
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
  WriteText(path_, "dexcheck log 2\n" + std::string(5000, ' '));
  EXPECT_EQ(Open(), file + "written by another version of dexcheck, or damaged");
  WriteText(path_, "dexcheck log 1\n" + std::string(5000, ' '));
  EXPECT_EQ(Open(), file + "the log's first 512 bytes are damaged");
  // Another program's HDF5.
  std::filesystem::remove(path_);
  WriteSampleLog(path_, 3, 3);
  WriteText(path_, ReadText(path_).substr(kSealSize));
  EXPECT_EQ(testing::RunProgram({DEXCHECK_H5DUMP, path_}).exit_code, 0);
  EXPECT_EQ(Open(), file + "not a dexcheck log");
}

TEST_F(LogReaderTest, EveryTruncationIsNoticed) {
  WriteSampleLog(path_, 20, 20);
  const std::uintmax_t size = std::filesystem::file_size(path_);
  ASSERT_TRUE(IsSample(LogReader(path_), 20));
  ASSERT_GT(size, 5000U);
  for (std::uintmax_t length = size; length-- > 0;) {
    std::filesystem::resize_file(path_, length);
    ASSERT_THAT(Open(), HasSubstr(length == 0                                    ? "the file is empty"
                                  : length < std::string("dexcheck log ").size() ? "not a dexcheck log"
                                                                                 : "the log is cut short"))
        << length;
  }
}

/// Each byte but those of the numbers; what is wrong with the numbers cannot be known.
TEST_F(LogReaderTest, EveryDamageIsNoticed) {
  constexpr long kRows = 20;
  WriteSampleLog(path_, kRows, kRows);
  const std::string bytes = ReadText(path_);
  const size_t numbers = 12 * kRows * sizeof(double);
  size_t noticed = 0;
  const int file = ::open(path_.c_str(), O_RDWR);
  ASSERT_GE(file, 0);
  const auto [begin, end] = testing::ReadVariablePart(bytes);
  ASSERT_EQ(end - begin, numbers);
  for (size_t i = 0; i < bytes.size(); ++i) {
    constexpr size_t kStride =
        61;  // of the numbers a sample will do: such logs are opened, which takes longer
    if (begin <= i && i < end && i % kStride != 0) continue;
    const auto damaged = static_cast<char>(bytes[i] ^ (1 << (i % 8)));
    ASSERT_EQ(::pwrite(file, &damaged, 1, static_cast<off_t>(i)), 1);
    const std::string message = Open();
    if (message != "nothing was thrown") {
      ASSERT_THAT(message, StartsWith(path_.string() + ": "));
      ++noticed;
    }
    ASSERT_EQ(::pwrite(file, &bytes[i], 1, static_cast<off_t>(i)), 1);
  }
  ::close(file);
  EXPECT_EQ(noticed, bytes.size() - numbers);
  EXPECT_TRUE(IsSample(LogReader(path_), kRows));
}

/// Cut short, bits flipped, bytes put in or replaced, at random: all is noticed but changes of numbers.
TEST_F(LogReaderTest, RandomDamageIsOneLine) {
  constexpr int kTrials = 400;
  WriteSampleLog(path_, 20, 20);
  const std::string good = ReadText(path_);
  const auto [begin, end] = testing::ReadVariablePart(good);
  std::mt19937 random(5);
  int refused = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::string damaged = good;
    for (size_t count = size_t{1} << (random() % 6); count > 0; --count) {
      const size_t at = random() % damaged.size();
      if (trial % 4 == 0) damaged.resize(at + 1);
      if (trial % 4 == 1) damaged[at] = static_cast<char>(damaged[at] ^ (1 << (random() % 8)));
      if (trial % 4 == 2) damaged.insert(at, 1, static_cast<char>(random()));
      if (trial % 4 == 3) damaged[at] = static_cast<char>(random());
    }
    WriteText(path_, damaged);
    const bool is_whole = damaged.size() >= good.size() && damaged.compare(0, begin, good, 0, begin) == 0 &&
                          damaged.compare(end, good.size() - end, good, end, good.size() - end) == 0;
    const std::string message = Open();
    EXPECT_EQ(message == "nothing was thrown", is_whole) << trial << ": " << message;
    if (is_whole) continue;
    ++refused;
    EXPECT_THAT(message, StartsWith(path_.string() + ": "));
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
  EXPECT_GE(refused, kTrials / 2);
}

TEST_F(LogReaderTest, LinksInTheFolderAreNotFollowed) {
  namespace fs = std::filesystem;
  WriteSampleLog(path_, 20, 20);
  const fs::path elsewhere = folder_.path() / "elsewhere";
  const fs::path unpacked = folder_.path() / "unpacked";
  fs::create_directory(elsewhere);
  const LogReader log(path_);
  const auto extract = [&] { return MessageOf([&] { log.ExtractFiles("inputs", unpacked); }); };
  // A folder's place, a file's place, and a file's place that leads nowhere yet.
  const std::vector<std::pair<fs::path, fs::path>> links = {
      {"mjcf", elsewhere}, {"mjcf/assets", elsewhere}, {"scenario.toml", elsewhere / "new"}};
  for (const auto& [name, target] : links) {
    fs::remove_all(unpacked);
    fs::create_directories((unpacked / name).parent_path());
    fs::create_symlink(target, unpacked / name);
    EXPECT_THAT(extract(), HasSubstr("cannot be written: ")) << name;
    EXPECT_TRUE(fs::is_empty(elsewhere)) << name;
  }
  // The folder itself may be a link, as a temporary folder often is.
  fs::remove_all(unpacked);
  fs::create_symlink(elsewhere, unpacked);
  EXPECT_EQ(extract(), "nothing was thrown");
  EXPECT_TRUE(fs::exists(elsewhere / "mjcf/assets/torus.msh"));
}

}  // namespace
}  // namespace dexcheck::testing::log_reader_test
