// Failures around a run: plants that explode, models that the engine rejects, disks that fill, folders
// without permission, logs that were cut or damaged. Each gives an exit code and one line; nothing crashes.

#include <sys/mount.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <limits>
#include <random>

#include "harness/log/log_reader.h"
#include "tests/common/refused_text.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/log/change_log.h"

namespace dexcheck::testing::fault_injection_test {
namespace {

namespace fs = std::filesystem;

class FaultInjection : public CommandTest {
 protected:
  [[nodiscard]] std::vector<std::string> ListFiles() const {
    std::vector<std::string> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_.path()))
      files.push_back(entry.path().filename());
    return files;
  }
  /// A short run without the report, whose drawing takes most of the time, into the folder `run`.
  static Words Scenario(const std::string& scenario, const std::vector<std::string>& settings,
                        const std::string& out = "run") {
    Words arguments = {"run", scenario, "--no-report", "--out", out};
    for (const std::string& setting : settings) arguments = arguments + Words{"--set", setting};
    return arguments;
  }
  [[nodiscard]] LogReader ReadLog(const std::string& run = "run") const {
    return LogReader(Path(run + "/log.h5"));
  }
};

/// A run that fails, with its reason.
struct Explosion {
  std::string name;
  std::string scenario;
  std::vector<std::string> settings;
  std::string reason;
};

void PrintTo(const Explosion& explosion, std::ostream* out) { *out << explosion.name; }

class Explosions : public FaultInjection, public ::testing::WithParamInterface<Explosion> {
 protected:
  /// The run fails for its reason, and leaves a log and a summary, and nothing else.
  void RunAndFail() const {
    const auto& [name, scenario, settings, reason] = GetParam();
    EXPECT_TRUE(IsOneLineWith(Expect(3, Scenario(scenario, settings)).err, {reason}));
    const Json summary = ReadJson("run/summary.json");
    EXPECT_EQ(summary.at("verdict"), "failed");
    EXPECT_THAT(summary.at("failure"), HasSubstr(reason));
    EXPECT_EQ(Json::parse(ReadLog().ReadText("summary")), summary);
    EXPECT_THAT(ListFiles(), ElementsAre("run")) << "the engine writes no files of its own";
  }
};

TEST_P(Explosions, EndWithTheirReasonAndAReadableLog) {
  RunAndFail();
  EXPECT_GE(ReadLog().rows(), 10);
  EXPECT_TRUE(ReadLog().ReadSignal("engine/qpos").allFinite());
  for (const char* command : {"run --replay run", "export run --csv -", "report run"}) Expect(0, command);
}

class StillBirths : public Explosions {};

TEST_P(StillBirths, LeaveALogWithoutRows) {
  RunAndFail();
  EXPECT_EQ(ReadLog().rows(), 0);
  for (const char* command : {"run --replay run", "report run", "render run --still 0"})
    EXPECT_TRUE(Refused(command, {"log.h5: "}));
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
    CaseName());

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
                         CaseName());

TEST_F(FaultInjection, ModelsThatTheEngineRejectsAreRefused) {
  fs::copy(kMjcf, Path("mjcf"), fs::copy_options::recursive);
  const std::string good = Read("mjcf/robot.xml");
  const Words command =
      Scenario("hold", {"duration=0.01", "settle=0.1", "plant.mjcf=" + Path("mjcf/scene.xml").string()});
  const std::string freejoint = "<freejoint name=\"base\"";
  for (const auto& [text, part] :
       {std::pair(good.substr(0, good.size() / 2), "robot.xml:280: "),
        {ReplaceOnce(good, freejoint, freejoint + " mass=\"1\""), "robot.xml:109: <freejoint mass>"},
        {std::string(), "robot.xml:1: "}}) {
    Write("mjcf/robot.xml", text);
    EXPECT_TRUE(Refused(command, {part}));
  }
  fs::remove(Path("mjcf/robot.xml"));
  EXPECT_TRUE(Refused(command, {"scene.xml:3: ", "robot.xml"}));
  EXPECT_FALSE(Has("run")) << "nothing was begun";
}

// Sizes at which the log's begin, its first rows and its later rows do not fit.
TEST_F(FaultInjection, FilesThatMayNotGrowEndARun) {
  for (const rlim_t bytes : {1000UL, 50'000UL, 1'000'000UL}) {
    const std::string out = std::to_string(bytes);
    EXPECT_TRUE(IsRefused(Run(Scenario("hold", {"duration=0.3", "settle=0.1"}, out), {.largest_file = bytes}),
                          {"log.h5: ", "File too large"}));
    EXPECT_FALSE(Has(out + "/summary.json"));
    if (Has(out + "/log.h5")) EXPECT_GE(ReadLog(out).rows(), 0);
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
  const SmallDisk small(Path("disk"), "4m");
  if (!small.is_mounted()) GTEST_SKIP() << "no file system can be mounted here";
  const std::string full = "No space left on device";
  EXPECT_TRUE(Refused(Scenario("hold", {"duration=5", "settle=0.1"}, "disk/run"), {"log.h5: ", full}));
  {
    const LogReader log = ReadLog("disk/run");
    EXPECT_GE(log.rows(), 100);
    EXPECT_LT(log.rows(), 5000);
    EXPECT_TRUE(log.ReadSignal("engine/qpos").allFinite());
  }
  EXPECT_FALSE(Has("disk/run/summary.json"));
  const std::string before = Read("disk/run/log.h5");
  EXPECT_TRUE(Refused("report disk/run", {full}));
  EXPECT_TRUE(Refused("export disk/run --csv disk/all.csv", {"all.csv: ", full}));
  EXPECT_TRUE(Read("disk/run/log.h5") == before);
  EXPECT_EQ(CountFiles("disk"), 1) << "no half-written file";
  EXPECT_EQ(CountFiles("disk/run"), 1) << "the log";
}

TEST_F(FaultInjection, FoldersThatMayNotBeWrittenAreNamed) {
  Expect(0, Scenario("hold", {"duration=0.02", "settle=0.1"}));
  // A user who may not write everywhere, as root may.
  const auto run = [&](const Words& arguments) {
    Words command = DexcheckCommand(arguments);
    if (::geteuid() == 0) command = Words("setpriv --reuid=65534 --clear-groups") + command;
    return RunProgram(command, {.folder = folder_.path()});
  };
  for (const char* folder : {"run", "."}) fs::permissions(Path(folder), fs::perms(0555));
  EXPECT_TRUE(IsRefused(run(Scenario("hold", {"duration=0.02"}, "new")),
                        {"new", "cannot be made: Permission denied"}));
  for (const auto& [command, file] : {std::pair("report run", "report.html: "),
                                      {"render run --still 0 --size 64x64", "still.png: "},
                                      {"export run --csv run/a.csv", "a.csv: "}})
    EXPECT_TRUE(IsRefused(run(command), {file, "cannot be written"}));
  // Reading needs no right to write.
  const ProgramResult replay = run("run --replay run");
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  for (const char* folder : {".", "run"}) fs::permissions(Path(folder), fs::perms(0755));
  EXPECT_EQ(CountFiles("run"), 2) << "log and summary, as before";
}

/// Commands that read a run's log.
constexpr const char* kReaders[] = {"run --replay run", "report run --page page.html",
                                    "export run --csv all.csv",
                                    "render run --still 0 --size 64x64 --forces --out still.png"};

class DamagedLogs : public FaultInjection {
 protected:
  DamagedLogs() {
    Expect(0, Scenario("hold", {"duration=0.05", "settle=0.1"}));
    bytes_ = Read("run/log.h5");
  }
  /// Puts these bytes in place of the log; every reader refuses it or reads it to the end.
  /// @return how many ended with this exit code.
  [[nodiscard]] int CountEnds(const std::string& damaged, int exit_code) const {
    Write("run/log.h5", damaged);
    int count = 0;
    for (const char* command : kReaders) {
      const ProgramResult result = Run(command);
      // 1: a replay that differs.
      EXPECT_THAT(result.exit_code, ::testing::AnyOf(0, 1, 2)) << command << ": " << result.err;
      EXPECT_LE(CountErrors(result.err), 1) << result.err;
      count += result.exit_code == exit_code ? 1 : 0;
    }
    return count;
  }

  /// @return the number of lines that are not notes on what a damaged scene or mesh cannot give.
  [[nodiscard]] static int CountErrors(const std::string& lines) {
    std::istringstream stream(lines);
    int count = 0;
    for (std::string line; std::getline(stream, line);) count += line.find(": left out") == std::string::npos;
    return count;
  }

  std::string bytes_;
  std::mt19937 random_{17};
};

TEST_F(DamagedLogs, CutAnywhereAreRefusedByAllReaders) {
  std::vector<size_t> lengths = {0, 1, 12, 300, 511, 512, 513, bytes_.size() / 2, bytes_.size() - 1};
  for (int i = 0; i < 3; ++i) lengths.push_back(random_() % bytes_.size());
  for (const size_t length : lengths) {
    Write("run/log.h5", bytes_.substr(0, length));
    for (const char* command : kReaders) EXPECT_TRUE(Refused(command, {"log.h5: "})) << length << " bytes";
  }
  EXPECT_THAT(ListFiles(), ElementsAre("run")) << "nothing was written";
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
    refused += CountEnds(damaged, 2);
  }
  EXPECT_GT(refused, 0);
}

TEST_F(DamagedLogs, WithImpossibleNumbersAreRefusedOrReadToTheEnd) {
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
    Write("run/log.h5", bytes_);
    ChangeLog(Path("run/log.h5"), [&](hid_t file) {
      for (const char* signal : {"time", "engine/qpos", "engine/qvel", "q", "xi", "tau"}) {
        const hid_t set = H5Dopen2(file, signal, H5P_DEFAULT);
        ASSERT_GE(set, 0) << signal;
        const hid_t space = H5Dget_space(set);
        std::vector<double> numbers(static_cast<size_t>(H5Sget_simple_extent_npoints(space)));
        ASSERT_GE(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()), 0);
        for (double& number : numbers) {
          if (std::uniform_real_distribution<>()(random_) < fraction)
            number = kNumbers[random_() % kNumbers.size()];
        }
        ASSERT_GE(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()), 0);
        H5Sclose(space);
        H5Dclose(set);
      }
    });
    const std::string damaged = Read("run/log.h5");
    differing += CountEnds(damaged, 1);
  }
  EXPECT_GE(differing, 1) << "a replay sees what was changed";
}

}  // namespace
}  // namespace dexcheck::testing::fault_injection_test
