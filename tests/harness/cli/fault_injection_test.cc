// What can go wrong around a run: plants that explode, models that the engine rejects, disks that fill,
// folders that may not be written, logs that were cut or damaged. Exit codes and one line say so; nothing
// crashes.

#include <gmock/gmock.h>
#include <sys/mount.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <random>

#include "harness/log/log_reader.h"
#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::fault_injection_test {
namespace {

namespace fs = std::filesystem;

/// Arguments of a run of some hundred steps without the report, whose drawing takes most of the time.
std::vector<std::string> RunArguments(const std::string& scenario, const fs::path& out,
                                      const std::vector<std::string>& settings = {}) {
  std::vector<std::string> arguments = {"run", scenario, "--no-report", "--out", out.string()};
  for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
  return arguments;
}

long CountLines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

class FaultInjection : public ::testing::Test {
 protected:
  [[nodiscard]] fs::path run_dir() const { return folder_.path() / "run"; }
  [[nodiscard]] std::vector<std::string> ListFiles() const {
    std::vector<std::string> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_.path())) {
      files.push_back(entry.path().filename());
    }
    return files;
  }
  ProgramResult Run(const std::string& scenario, const std::vector<std::string>& settings) const {
    ProgramOptions options;
    options.folder = folder_.path();
    return RunDexcheck(RunArguments(scenario, run_dir(), settings), options);
  }

  TempFolder folder_;
};

/// A run that fails, with its reason.
struct Explosion {
  const char* name;
  const char* scenario;
  std::vector<std::string> settings;
  const char* reason;
};

void PrintTo(const Explosion& explosion, std::ostream* out) { *out << explosion.name; }

class Explosions : public FaultInjection, public ::testing::WithParamInterface<Explosion> {};

/// Whether the run failed for that reason, left a log and a summary, and nothing else.
::testing::AssertionResult HasFailed(const ProgramResult& result, const fs::path& run, const char* reason) {
  const auto fail = [&](const std::string& what) {
    return ::testing::AssertionFailure()
           << what << "; exit code " << result.exit_code << ", " << result.out << result.err;
  };
  if (result.exit_code != 3) return fail("exit code must be 3");
  if (CountLines(result.err) != 1 || result.err.find(reason) == std::string::npos) {
    return fail("standard error must be the reason, in one line");
  }
  const size_t at = result.out.find("FAILED: ");
  const std::string line =
      at == std::string::npos ? "" : result.out.substr(at, result.out.find('\n', at) - at);
  if (line.find(reason) == std::string::npos) return fail(std::string("the line lacks ") + reason);
  if (LogReader(run / "log.h5").ReadText("summary").find("\"verdict\": \"failed\"") == std::string::npos) {
    return fail("the log has no verdict");
  }
  return ::testing::AssertionSuccess();
}

TEST_P(Explosions, EndWithTheirReasonAndAReadableLog) {
  EXPECT_TRUE(HasFailed(Run(GetParam().scenario, GetParam().settings), run_dir(), GetParam().reason));
  EXPECT_THAT(ListFiles(), ::testing::ElementsAre("run")) << "the engine writes no files of its own";
  const LogReader log(run_dir() / "log.h5");
  EXPECT_GE(log.rows(), 10);
  EXPECT_TRUE(log.ReadSignal("engine/qpos").allFinite());
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"run", "--replay", run_dir().string()},
        {"export", run_dir().string(), "--csv", "-"},
        {"report", run_dir().string()}}) {
    const ProgramResult later = RunDexcheck(command);
    EXPECT_EQ(later.exit_code, 0) << command[0] << ": " << later.out << later.err;
  }
}

class StillBirths : public Explosions {};

TEST_P(StillBirths, LeaveALogWithoutRows) {
  EXPECT_TRUE(HasFailed(Run(GetParam().scenario, GetParam().settings), run_dir(), GetParam().reason));
  EXPECT_THAT(ListFiles(), ::testing::ElementsAre("run"));
  EXPECT_EQ(LogReader(run_dir() / "log.h5").rows(), 0);
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "--replay", run_dir().string()}), {"log.h5: "}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"report", run_dir().string()}), {"log.h5: the run has no steps"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"render", run_dir().string(), "--still", "0"}), {"log.h5: "}));
}

INSTANTIATE_TEST_SUITE_P(
    All, Explosions,
    ::testing::Values(
        // h K_v > 2: the sampled error dynamics are unstable.
        Explosion{"Unstable",
                  "offset",
                  {"duration=1", "settle=0.05", "control.K_p=100", "control.K_v=2050"},
                  "is at its limit"},
        Explosion{"Slippery", "paper-ramp", {"duration=2", "plant.floor_friction=0.1"}, "is at its limit"}),
    [](const auto& info) { return info.param.name; });

/// Runs that fail before their first step.
INSTANTIATE_TEST_SUITE_P(All, StillBirths,
                         ::testing::Values(Explosion{"NotFinite",
                                                     "hold",
                                                     {"duration=0.1", "settle=0.3",
                                                      "start_error.xyz=[1e308, 0, 0]"},
                                                     "are not finite at t = 0 s"},
                                           Explosion{"LostGrasp",
                                                     "paper-ramp",
                                                     {"duration=1", "plant.finger_friction=0.15",
                                                      "control.weight={ platform = 1e8, arm = 1e8 }"},
                                                     "no longer touches the object while settling"}),
                         [](const auto& info) { return info.param.name; });

TEST_F(FaultInjection, ModelsThatTheEngineRejectsAreRefused) {
  fs::copy(testing::kMjcf, folder_.path() / "mjcf", fs::copy_options::recursive);
  const fs::path robot = folder_.path() / "mjcf/robot.xml";
  const std::string good = ReadText(robot);
  const std::string setting = "plant.mjcf=" + (folder_.path() / "mjcf/scene.xml").string();
  const auto is_refused = [&](const std::vector<std::string>& parts) {
    return IsRefused(Run("hold", {"duration=0.01", "settle=0.1", setting}), parts);
  };
  WriteText(robot, good.substr(0, good.size() / 2));
  EXPECT_TRUE(is_refused({"robot.xml:280: is not XML"}));
  WriteText(robot, testing::ReplaceOnce(good, "<freejoint name=\"base\"/>",
                                        "<freejoint name=\"base\" mass=\"1\"/>"));
  EXPECT_TRUE(is_refused({"robot.xml:109: <freejoint mass>"}));
  WriteText(robot, "");
  EXPECT_TRUE(is_refused({"robot.xml:1: is not XML"}));
  fs::remove(robot);
  EXPECT_TRUE(is_refused({"scene.xml:3: ", "robot.xml"}));
  EXPECT_FALSE(fs::exists(run_dir())) << "nothing was begun";
}

// Sizes at which the log's begin, its first rows and its later rows do not fit.
TEST_F(FaultInjection, FilesThatMayNotGrowEndARun) {
  for (const rlim_t bytes : {1000UL, 50'000UL, 1'000'000UL}) {
    ProgramOptions options;
    options.largest_file = bytes;
    const fs::path out = folder_.path() / std::to_string(bytes);
    EXPECT_TRUE(IsRefused(RunDexcheck(RunArguments("hold", out, {"duration=0.3", "settle=0.1"}), options),
                          {"log.h5: cannot be written: File too large"}));
    EXPECT_FALSE(fs::exists(out / "summary.json"));
    if (fs::exists(out / "log.h5")) EXPECT_GE(LogReader(out / "log.h5").rows(), 0);
  }
}

/// A small file system in memory; only root can make one, and not everywhere.
class SmallDisk {
 public:
  SmallDisk(const fs::path& folder, const char* size) : folder_(folder) {
    fs::create_directory(folder);
    mounted_ =
        ::mount("dexcheck-test", folder.c_str(), "tmpfs", 0, (std::string("size=") + size).c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  [[nodiscard]] bool is_mounted() const { return mounted_; }

 private:
  fs::path folder_;
  bool mounted_ = false;
};

TEST_F(FaultInjection, AFullDiskEndsARunAndKeepsItsRows) {
  const fs::path disk = folder_.path() / "disk";
  const SmallDisk small(disk, "4m");
  if (!small.is_mounted()) GTEST_SKIP() << "no file system can be mounted here";
  const fs::path out = disk / "run";
  EXPECT_TRUE(IsRefused(RunDexcheck(RunArguments("hold", out, {"duration=5", "settle=0.1"})),
                        {"log.h5: cannot be written: No space left on device"}));
  {
    const LogReader log(out / "log.h5");
    EXPECT_GE(log.rows(), 100);
    EXPECT_LT(log.rows(), 5000);
    EXPECT_TRUE(log.ReadSignal("engine/qpos").allFinite());
  }
  EXPECT_FALSE(fs::exists(out / "summary.json"));
  const std::string before = ReadText(out / "log.h5");
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"report", out.string()}), {"cannot be written: No space left on device"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"export", out.string(), "--csv", (disk / "all.csv").string()}),
                        {"all.csv: cannot be written: No space left on device"}));
  EXPECT_TRUE(ReadText(out / "log.h5") == before);
  long files = 0;
  for ([[maybe_unused]] const auto& entry : fs::recursive_directory_iterator(disk)) ++files;
  EXPECT_EQ(files, 2) << "the run's folder and its log, no half-written file";
}

/// The program as a user who may not write everywhere, as root may.
ProgramResult RunAsNobody(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = DexcheckCommand(arguments);
  if (::geteuid() == 0) command.insert(command.begin(), {"setpriv", "--reuid=65534", "--clear-groups"});
  return testing::RunProgram(command);
}

TEST_F(FaultInjection, FoldersThatMayNotBeWrittenAreNamed) {
  ASSERT_EQ(Run("hold", {"duration=0.02", "settle=0.1"}).exit_code, 0);
  fs::permissions(run_dir(), fs::perms(0555));
  fs::permissions(folder_.path(), fs::perms(0555));
  EXPECT_TRUE(IsRefused(RunAsNobody(RunArguments("hold", folder_.path() / "new", {"duration=0.02"})),
                        {(folder_.path() / "new").string(), "cannot be made: Permission denied"}));
  EXPECT_TRUE(IsRefused(RunAsNobody({"report", run_dir().string()}), {"report.html: cannot be written: "}));
  EXPECT_TRUE(IsRefused(RunAsNobody({"render", run_dir().string(), "--still", "0", "--size", "64x64"}),
                        {"still.png: cannot be written: "}));
  EXPECT_TRUE(IsRefused(RunAsNobody({"export", run_dir().string(), "--csv", (run_dir() / "a.csv").string()}),
                        {"a.csv: cannot be written: "}));
  // Reading needs no right to write.
  const ProgramResult replay = RunAsNobody({"run", "--replay", run_dir().string()});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  fs::permissions(folder_.path(), fs::perms(0755));
  fs::permissions(run_dir(), fs::perms(0755));
  EXPECT_EQ(std::distance(fs::directory_iterator(run_dir()), fs::directory_iterator()), 2)
      << "log and summary, as before";
}

/// What reads a run's log.
std::vector<std::vector<std::string>> ListReaders(const fs::path& run) {
  const fs::path scratch = run.parent_path();
  return {{"run", "--replay", run.string()},
          {"report", run.string(), "--out", (scratch / "page.html").string()},
          {"export", run.string(), "--csv", (scratch / "all.csv").string()},
          {"render", run.string(), "--still", "0", "--size", "64x64", "--forces", "--tracks", "--out",
           (scratch / "still.png").string()}};
}

/// Whatever the log makes it do, a reader ends; busy machines get time.
ProgramResult RunReader(const std::vector<std::string>& command) {
  ProgramOptions options;
  options.seconds = 300;
  return RunDexcheck(command, options);
}

class DamagedLogs : public FaultInjection {
 protected:
  DamagedLogs() {
    EXPECT_EQ(Run("hold", {"duration=0.05", "settle=0.1"}).exit_code, 0);
    bytes_ = ReadText(log());
  }
  [[nodiscard]] fs::path log() const { return run_dir() / "log.h5"; }

  std::string bytes_;
  std::mt19937 random_{17};
};

TEST_F(DamagedLogs, CutAnywhereAreRefusedByAllReaders) {
  std::vector<size_t> lengths = {0, 1, 12, 300, 511, 512, 513, bytes_.size() / 2, bytes_.size() - 1};
  for (int i = 0; i < 3; ++i) lengths.push_back(random_() % bytes_.size());
  for (const size_t length : lengths) {
    WriteText(log(), bytes_.substr(0, length));
    for (const std::vector<std::string>& command : ListReaders(run_dir())) {
      EXPECT_TRUE(IsRefused(RunReader(command), {"log.h5: "})) << command[0] << ", " << length << " bytes";
    }
  }
  EXPECT_THAT(ListFiles(), ::testing::ElementsAre("run")) << "nothing was written";
}

TEST_F(DamagedLogs, WithChangedBytesAreRefusedOrReadToTheEnd) {
  constexpr int kTrials = 12;
  int refused = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::string damaged = bytes_;
    // From a single bit to a whole block.
    const size_t count = trial % 3 == 0 ? 1 : trial % 3 == 1 ? 16 : 4096;
    const size_t begin = random_() % (damaged.size() - count);
    for (size_t i = 0; i < count; ++i)
      damaged[begin + i] = static_cast<char>(damaged[begin + i] + 1 + static_cast<int>(random_() % 255));
    WriteText(log(), damaged);
    for (const std::vector<std::string>& command : ListReaders(run_dir())) {
      const ProgramResult result = RunReader(command);
      // 1: a replay that differs.
      EXPECT_THAT(result.exit_code, ::testing::AnyOf(0, 1, 2)) << command[0] << ": " << result.err;
      EXPECT_LE(CountLines(result.err), 1) << result.err;
      refused += result.exit_code == 2 ? 1 : 0;
    }
  }
  EXPECT_GT(refused, 0);
}

// The seal says where the rows' numbers are; any number can stand there.
TEST_F(DamagedLogs, WithImpossibleNumbersAreRefusedOrReadToTheEnd) {
  unsigned long long begin = 0;
  unsigned long long end = 0;
  const size_t line = bytes_.find("variable ");
  ASSERT_NE(line, std::string::npos);
  ASSERT_EQ(std::sscanf(bytes_.c_str() + line, "variable %llu %llu", &begin, &end), 2);
  ASSERT_GT(end, begin + 50 * 8 * 100);
  using Limits = std::numeric_limits<double>;
  constexpr std::array<double, 8> kNumbers = {Limits::quiet_NaN(),
                                              Limits::infinity(),
                                              -Limits::infinity(),
                                              Limits::max(),
                                              Limits::lowest(),
                                              Limits::denorm_min(),
                                              0.0,
                                              -1e-300};
  int differing = 0;
  for (const double fraction : {0.001, 0.05, 1.0}) {
    std::string damaged = bytes_;
    for (unsigned long long at = begin; at + 8 <= end; at += 8) {
      if (std::uniform_real_distribution<>()(random_) >= fraction) continue;
      std::memcpy(damaged.data() + at, &kNumbers[random_() % kNumbers.size()], 8);
    }
    WriteText(log(), damaged);
    for (const std::vector<std::string>& command : ListReaders(run_dir())) {
      const ProgramResult result = RunReader(command);
      EXPECT_THAT(result.exit_code, ::testing::AnyOf(0, 1, 2)) << command[0] << ": " << result.err;
      EXPECT_LE(CountLines(result.err), 1) << result.err;
      differing += result.exit_code == 1 ? 1 : 0;
    }
  }
  EXPECT_GE(differing, 1) << "a replay sees what was changed";
}

}  // namespace
}  // namespace dexcheck::testing::fault_injection_test
