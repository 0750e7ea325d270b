// Writers that the file system refuses.

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>

#include "controller/common/errors.h"
#include "tests/common/files.h"
#include "tests/common/full_disk.h"
#include "tests/common/matchers.h"
#include "tests/common/throws.h"
#include "tests/harness/log/sample_log.h"

namespace dexcheck::testing::log_failures_test {
namespace {

using LogFailures = LogFileTest;

TEST_F(LogFailures, NothingIsOverwritten) {
  WriteText(path_, "before");
  EXPECT_EQ(MessageOf<InputError>([&] { LogWriter(path_, 10); }),
            path_.string() + ": cannot be written: File exists");
  std::filesystem::remove(path_);
  // Not even what appears after construction.
  LogWriter log(path_, 10);
  WriteText(path_, "before");
  EXPECT_EQ(MessageOf<InputError>([&] { log.StartRows(); }),
            path_.string() + ": cannot be written: File exists");
  EXPECT_EQ(ReadText(path_), "before");
  EXPECT_EQ(CountFiles(), 1);
}

TEST_F(LogFailures, NoFileBeforeTheRowsStart) {
  {
    LogWriter log(path_, 10);
    EXPECT_EQ(CountFiles(), 0);
  }
  EXPECT_EQ(CountFiles(), 0);
}

TEST_F(LogFailures, PathsThatCannotBeWrittenAreNamed) {
  const std::filesystem::path missing = folder_.path() / "no/log.h5";
  EXPECT_EQ(MessageOf<InputError>([&] { LogWriter(missing, 10); }),
            missing.string() + ": cannot be written: No such file or directory");
  WriteText(folder_.path() / "file", "");
  const std::filesystem::path below_file = folder_.path() / "file/log.h5";
  EXPECT_EQ(MessageOf<InputError>([&] { LogWriter(below_file, 10); }),
            below_file.string() + ": cannot be written: Not a directory");
}

/// Gives up the superuser's rights for a while: they would let it write anywhere.
class OrdinaryUser {
 public:
  OrdinaryUser() {
    if (::geteuid() == 0) switched_ = ::seteuid(kNobody) == 0;
  }
  ~OrdinaryUser() {
    if (switched_ && ::seteuid(0) != 0) std::abort();
  }

 private:
  static constexpr uid_t kNobody = 65534;
  bool switched_ = false;
};

TEST_F(LogFailures, ForbiddenFoldersAreNamed) {
  std::filesystem::permissions(folder_.path(), std::filesystem::perms(0555));
  {
    const OrdinaryUser user;
    EXPECT_EQ(MessageOf<InputError>([&] { LogWriter(path_, 10); }),
              path_.string() + ": cannot be written: Permission denied");
  }
  std::filesystem::permissions(folder_.path(), std::filesystem::perms(0755));
}

TEST_F(LogFailures, FullDiskAtTheBegin) {
  const std::string reason = path_.string() + ": cannot be written: File too large";
  for (const rlim_t bytes : {0UL, 1UL, 600UL, 2000UL, 5000UL, 9000UL}) {
    LogWriter log(path_, 100, 10);
    {
      const FullDisk full(bytes);
      EXPECT_EQ(MessageOf<InputError>([&] { StartSample(&log); }), reason) << bytes;
    }
    EXPECT_EQ(CountFiles(), 0) << bytes;
  }
  // HDF5 has nothing left that would disturb what follows.
  WriteSampleLog(path_, 20, 20);
  EXPECT_TRUE(IsSample(LogReader(path_), 20));
}

/// HDF5 must not hold anything against the program at its end.
TEST_F(LogFailures, FullDiskLetsTheProgramEnd) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  constexpr int kCaught = 7;
  const auto run = [&] {
    LogWriter log(path_, 100, 10);
    const FullDisk full(3000);
    try {
      StartSample(&log);
    } catch (const InputError&) {
      std::exit(kCaught);
    }
  };
  EXPECT_EXIT(run(), ::testing::ExitedWithCode(kCaught), "");
}

TEST_F(LogFailures, FullDiskKeepsWhatWasFlushed) {
  const std::string reason = path_.string() + ": cannot be written: ";
  SampleLog log(path_, 2000, 10, 25);
  const auto size = static_cast<rlim_t>(std::filesystem::file_size(path_));
  {
    const FullDisk full(size / 2);
    EXPECT_EQ(MessageOf<InputError>([&] { WriteSampleRows(10, &log); }), reason + "File too large");
    EXPECT_TRUE(IsSample(LogReader(path_), 20));
  }
  EXPECT_EQ(MessageOf<InputError>([&] { log.EndRow(); }), reason + "it failed before");
  EXPECT_EQ(MessageOf<InputError>([&] { log.Flush(); }), reason + "it failed before");
  log.Close();
  EXPECT_TRUE(IsSample(LogReader(path_), 20));
}

TEST_F(LogFailures, FullDiskAtTheEndKeepsAllRows) {
  SampleLog log(path_, 2000, 10, 1500);
  log.SetText("summary", "late");
  {
    // The rows' places are there; the trimmed copy, of some 150 kB, fails.
    const rlim_t enough = std::filesystem::file_size(path_);
    ASSERT_GT(enough, 150000U);
    log.Flush();
    const FullDisk full(100000);
    EXPECT_EQ(MessageOf<InputError>([&] { log.Close(); }),
              path_.string() + ": cannot be written: File too large");
  }
  EXPECT_EQ(CountFiles(), 1);
  const LogReader reader(path_);
  EXPECT_TRUE(IsSample(reader, 1500));
  EXPECT_THAT(reader.ListTexts(), Not(Contains("summary")));
}

TEST_F(LogFailures, VanishedFilesAndFoldersAreNoticed) {
  std::filesystem::create_directory(folder_.path() / "run");
  const std::filesystem::path path = folder_.path() / "run/log.h5";
  SampleLog log(path, 100, 10, 10);
  std::filesystem::remove_all(folder_.path() / "run");
  EXPECT_EQ(MessageOf<InputError>([&] { WriteSampleRows(10, &log); }),
            path.string() + ": cannot be written: it was removed");
}

TEST_F(LogFailures, AnotherFileInItsPlaceIsNotReplaced) {
  SampleLog log(path_, 100, 10, 10);
  std::filesystem::rename(path_, folder_.path() / "moved.h5");
  WriteText(path_, "another");
  EXPECT_EQ(MessageOf<InputError>([&] { log.Close(); }),
            path_.string() + ": cannot be written: another file has taken its place");
  EXPECT_EQ(ReadText(path_), "another");
  EXPECT_TRUE(IsSample(LogReader(folder_.path() / "moved.h5"), 10));
}

TEST_F(LogFailures, RelativePathsStayWhereTheyWere) {
  const std::filesystem::path here = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  {
    LogWriter log("log.h5", 100, 10);
    std::filesystem::current_path(here);
    StartSample(&log);
    WriteSampleRows(5, &log);
    log.Close();
  }
  EXPECT_TRUE(IsSample(LogReader(path_), 5));
}

}  // namespace
}  // namespace dexcheck::testing::log_failures_test
