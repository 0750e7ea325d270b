// Logs that were forged together with their checksum: nothing that stands in them leads out of the log or of
// the folder that its files are unpacked into, and no crash of HDF5 takes the reader down.

#include <gmock/gmock.h>

#include <array>
#include <random>

#include "controller/common/errors.h"
#include "tests/harness/log/forge.h"
#include "tests/harness/log/sample_log_check.h"

namespace dexcheck::log_forgery_test {
namespace {

namespace fs = std::filesystem;
using testing::AddForgedFile;
using testing::ForgeBytes;
using testing::ForgeStructure;
using ::testing::HasSubstr;
using testing::ReadText;
using testing::ReplaceOnce;
using testing::TempFolder;
using testing::WriteSampleLog;
using testing::WriteText;

class LogForgeryTest : public ::testing::Test {
 protected:
  LogForgeryTest() { WriteSampleLog(path_, kRows, kRows); }

  /// Opens the log, reads all that is in it and unpacks its files. @return why not, or "".
  [[nodiscard]] std::string ReadAll(const fs::path& folder) const {
    try {
      const LogReader log(path_);
      for (const SignalInfo& signal : log.signals()) (void)log.ReadSignal(signal.name);
      for (const std::string& text : log.ListTexts()) (void)log.ReadText(text);
      log.ExtractFiles("inputs", folder);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  /// Whether the log is refused when it is opened, for a reason with this text.
  ::testing::AssertionResult IsRefused(const std::string& reason) const {
    const std::string message = ReadAll(unpacked());
    if (fs::exists(unpacked())) return ::testing::AssertionFailure() << "something was unpacked";
    if (!message.starts_with(path_.string() + ": the log is damaged: ")) {
      return ::testing::AssertionFailure() << "wrong message: " << message;
    }
    if (message.find(reason) == std::string::npos) {
      return ::testing::AssertionFailure() << message << " lacks " << reason;
    }
    return ::testing::AssertionSuccess();
  }

  [[nodiscard]] fs::path unpacked() const { return folder_.path() / "unpacked"; }

  static constexpr long kRows = 20;
  TempFolder folder_;
  fs::path path_ = folder_.path() / "log.h5";
};

TEST_F(LogForgeryTest, ALogThatIsOnlySealedAgainIsReadAsBefore) {
  ForgeBytes(path_, ReadText(path_));
  EXPECT_EQ(ReadAll(unpacked()), "");
  EXPECT_TRUE(testing::IsSample(LogReader(path_), kRows));
}

TEST_F(LogForgeryTest, NamesThatHdf5TakesAndNoFolderShouldAreRefused) {
  // Group and file below "inputs"; the second list is what the message must show.
  const std::vector<std::array<std::string, 2>> names = {{"..", "escaped"}, {"mjcf", ".."},
                                                         {"mjcf", "a\\b"},  {"a\\..\\b", "c"},
                                                         {"mjcf", "a\nb"},  {"mjcf", "\x7f"}};
  const std::string good = ReadText(path_);
  for (const auto& [group, name] : names) {
    WriteText(path_, good);
    ForgeStructure(path_, [&, group = group, name = name](hid_t file) {
      const hid_t inputs = H5Gopen2(file, "inputs", H5P_DEFAULT);
      const bool is_there = H5Lexists(inputs, group.c_str(), H5P_DEFAULT) > 0;
      const hid_t folder = is_there
                               ? H5Gopen2(inputs, group.c_str(), H5P_DEFAULT)
                               : H5Gcreate2(inputs, group.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      ASSERT_GE(folder, 0);
      AddForgedFile(folder, name.c_str());
      H5Gclose(folder);
      H5Gclose(inputs);
    });
    EXPECT_TRUE(IsRefused("must be a plain relative path")) << group << "/" << name;
    EXPECT_FALSE(fs::exists(folder_.path() / "escaped"));
  }
}

/// What HDF5 writes of no name: bytes of the same length in the place of a name of the sample log.
TEST_F(LogForgeryTest, NamesThatHdf5WouldNotWriteAreRefused) {
  const std::string good = ReadText(path_);
  const std::string zero(1, '\0');
  const std::vector<std::array<std::string, 2>> renamings = {
      {"scenario.toml" + zero, "/etc/passwd12" + zero},  // absolute
      {"scenario.toml" + zero, "../../escaped" + zero},  // upwards in one name
      {"scenario.toml" + zero, std::string(14, '\0')},   // empty
      {"assets" + zero, std::string(7, '\0')},           // an empty folder's name: "mjcf//torus.msh"
      {"assets" + zero, ".." + std::string(5, '\0')},
      {"empty" + zero + zero + zero, "mjcf" + std::string(4, '\0')},  // a file and a folder
      {"scenario.toml" + zero, "empty" + std::string(9, '\0')},       // two files
  };
  for (const auto& [from, to] : renamings) {
    ASSERT_EQ(from.size(), to.size());
    std::string forged = good;
    size_t changed = 0;
    for (size_t at = forged.find(from); at != std::string::npos; at = forged.find(from, at + 1)) {
      forged.replace(at, to.size(), to);
      ++changed;
    }
    ASSERT_GE(changed, 1U) << from;
    ForgeBytes(path_, forged);
    EXPECT_TRUE(IsRefused("")) << from << " " << to;
    EXPECT_FALSE(fs::exists(folder_.path() / "escaped"));
  }
}

TEST_F(LogForgeryTest, WhatLiesElsewhereIsRefused) {
  const std::string good = ReadText(path_);
  const std::string secret = folder_.path() / "secret";
  WriteText(secret, "secret");
  const auto forge = [&](const std::function<void(hid_t file)>& change) {
    WriteText(path_, good);
    ForgeStructure(path_, change);
  };
  forge([&](hid_t file) {
    ASSERT_GE(H5Lcreate_soft("/inputs/scenario.toml", file, "inputs/soft", H5P_DEFAULT, H5P_DEFAULT), 0);
  });
  EXPECT_TRUE(IsRefused("is a link to elsewhere"));
  forge([&](hid_t file) {
    ASSERT_GE(H5Lcreate_external("other.h5", "/x", file, "inputs/external", H5P_DEFAULT, H5P_DEFAULT), 0);
  });
  EXPECT_TRUE(IsRefused("is a link to elsewhere"));
  forge([&](hid_t file) {
    ASSERT_GE(H5Lcreate_hard(file, "inputs", file, "inputs/loop", H5P_DEFAULT, H5P_DEFAULT), 0);
  });
  EXPECT_TRUE(IsRefused("\""));
  forge([&](hid_t file) {
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    ASSERT_GE(H5Pset_external(creation, secret.c_str(), 0, 6), 0);
    AddForgedFile(file, "inputs/stolen", creation, 6, /*write=*/false);
    H5Pclose(creation);
  });
  EXPECT_TRUE(IsRefused(""));
  forge([&](hid_t file) {
    AddForgedFile(file, "inputs/endless", H5P_DEFAULT, hsize_t{1} << 50, /*write=*/false);
  });
  EXPECT_TRUE(IsRefused("lies outside the file"));
}

/// What a hostile process could tell.
TEST_F(LogForgeryTest, PartsOutsideTheFileAreRefused) {
  const LogStructure good = [&] {
    const FileDescriptor file(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
    return WalkStructure(file.get());
  }();
  const std::uint64_t size = fs::file_size(path_);
  CheckStructure(UnpackStructure(PackStructure(good)), size);
  const auto refused = [&](const std::function<void(LogStructure*)>& spoil) {
    LogStructure spoilt = good;
    spoil(&spoilt);
    EXPECT_THROW(CheckStructure(UnpackStructure(PackStructure(spoilt)), size), InputError);
  };
  refused([](LogStructure* log) { log->signals.clear(); });
  refused([](LogStructure* log) { log->signals[1].info.width = 0; });
  refused([](LogStructure* log) { log->signals[1].info.width = -1; });
  refused([](LogStructure* log) { log->signals[1].rows += 1; });
  refused([](LogStructure* log) { log->signals[1].bytes.begin = 0; });
  refused([](LogStructure* log) { log->signals[1].bytes.size = ~std::uint64_t{7}; });
  refused([&](LogStructure* log) { log->signals[1].bytes.begin = size - 8; });
  refused([](LogStructure* log) { log->signals[1].bytes.begin = ~std::uint64_t{0}; });
  refused([](LogStructure* log) { log->signals[1].info.name = "time"; });
  refused([](LogStructure* log) { log->signals[1].info.columns.pop_back(); });
  refused([&](LogStructure* log) { log->files[1].second.begin = size; });
  refused([](LogStructure* log) { log->files[1].second.size = ~std::uint64_t{0}; });
  const std::string bytes = PackStructure(good);
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW((void)UnpackStructure(std::string_view(bytes).substr(0, length)), InputError) << length;
  }
  EXPECT_THROW((void)UnpackStructure(bytes + "x"), InputError);
}

/// Random damage everywhere but in the numbers, sealed again. HDF5 crashes on some of it, and loops over
/// some.
TEST_F(LogForgeryTest, NoDamageCrashesTheReader) {
  constexpr int kTrials = 120;
  const std::string good = ReadText(path_);
  const auto [begin, end] = testing::ReadVariablePart(good);
  std::mt19937 random(5);
  int refused = 0;
  int survived_crashes = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::string damaged = good;
    const size_t count = size_t{1} << (random() % 6);
    for (size_t k = 0; k < count; ++k) {
      size_t at = kSealSize + random() % (good.size() - kSealSize);
      if (at >= begin && at < end) at = kSealSize + random() % (begin - kSealSize);
      damaged[at] = static_cast<char>(random() % 3 == 0 ? 0xff : random());
    }
    ForgeBytes(path_, damaged);
    const TempFolder unpacked;
    const std::string message = ReadAll(unpacked.path());
    refused += message.empty() ? 0 : 1;
    survived_crashes += message.find("HDF5 fails on it") == std::string::npos ? 0 : 1;
    if (!message.empty()) EXPECT_THAT(message, ::testing::StartsWith(path_.string() + ": "));
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
  EXPECT_GE(refused, kTrials / 4);
  EXPECT_GE(survived_crashes, 1) << "this would show nothing";
}

TEST_F(LogForgeryTest, LinksInTheFolderAreNotFollowed) {
  const fs::path elsewhere = folder_.path() / "elsewhere";
  fs::create_directory(elsewhere);
  const LogReader log(path_);
  const auto message = [&] {
    try {
      log.ExtractFiles("inputs", unpacked());
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  // A folder's place, a file's place, and a file's place that leads nowhere yet.
  const std::vector<std::array<fs::path, 2>> links = {
      {"mjcf", elsewhere}, {"mjcf/assets", elsewhere}, {"scenario.toml", elsewhere / "new"}};
  for (const auto& [name, target] : links) {
    fs::remove_all(unpacked());
    fs::create_directories((unpacked() / name).parent_path());
    fs::create_symlink(target, unpacked() / name);
    EXPECT_THAT(message(), HasSubstr("cannot be written: ")) << name;
    EXPECT_TRUE(fs::is_empty(elsewhere)) << name;
  }
  // The folder itself may be a link, as a temporary folder often is.
  fs::remove_all(unpacked());
  fs::create_symlink(elsewhere, unpacked());
  EXPECT_EQ(message(), "nothing was thrown");
  EXPECT_TRUE(fs::exists(elsewhere / "mjcf/assets/torus.msh"));
}

}  // namespace
}  // namespace dexcheck::log_forgery_test
