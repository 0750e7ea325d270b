// Commands on logs that somebody changed: files outside are neither written nor read.

#include <gmock/gmock.h>

#include "harness/log/log_writer.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/log/change_log.h"

namespace dexcheck::testing::forged_log_test {
namespace {

namespace fs = std::filesystem;

class ForgedLog : public ::testing::Test {
 protected:
  [[nodiscard]] fs::path run_dir() const { return folder_.path() / "run"; }

  /// A log whose texts and model are as given.
  void Write(const std::string& mjcf, const std::string& seed, const std::string& model) const {
    fs::remove_all(run_dir());
    fs::create_directory(run_dir());
    LogWriter log(run_dir() / "log.h5", 10);
    log.SetText("scenario", "hold");
    log.SetText("overrides", "");
    log.SetText("seed", seed);
    log.SetText("robot", "robot.toml");
    log.SetText("mjcf", mjcf);
    log.EmbedFile("inputs", "scenario.toml",
                  testing::ReadText(testing::SourcePath("/harness/shipped/scenarios/hold.toml")));
    log.EmbedFile("inputs", "robot/robot.toml", "name = \"robot\"\n");
    log.EmbedFile("inputs", "mjcf/scene.xml", model);
    const int qpos = log.AddSignal({"engine/qpos", "1", "positions", 7, {}, {}});
    log.StartRows();
    for (int row = 0; row < 10; ++row) {
      log.Row(LogWriter::kTime)[0] = 0.01 * row;
      log.Row(qpos)[3] = 1.0;
      log.EndRow();
    }
    log.Close();
  }

  /// Whether all commands that unpack the log refuse it, and leave nothing.
  ::testing::AssertionResult AllRefuse(const std::string& part) const {
    const std::string run = run_dir().string();
    const std::string page = (folder_.path() / "page.html").string();
    for (const std::vector<std::string>& command : {std::vector<std::string>{"run", "--replay", run},
                                                    {"render", run},
                                                    {"report", run, "--out", page}}) {
      ::testing::AssertionResult refused = IsRefused(RunDexcheck(command), {part});
      if (!refused) return refused << " from " << command[0];
    }
    const auto left = std::distance(fs::directory_iterator(run_dir()), fs::directory_iterator());
    if (left != 1) return ::testing::AssertionFailure() << "something was written";
    return ::testing::AssertionSuccess();
  }

  const std::string model_ =
      "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
  testing::TempFolder folder_;
};

TEST_F(ForgedLog, WritesNoFilesOutside) {
  Write("scene.xml", "1", model_);
  ChangeLog(run_dir() / "log.h5", [&](hid_t file) {
    const hid_t up = H5Gcreate2(file, "inputs/..", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    AddBytes(up, "escaped");
    H5Gclose(up);
  });
  EXPECT_TRUE(AllRefuse("is not a plain relative path"));
}

TEST_F(ForgedLog, ReadsNoFilesOutside) {
  const fs::path secret = folder_.path() / "secret.xml";
  WriteText(secret, model_);
  Write("../../" + folder_.path().filename().string() + "/secret.xml", "1", model_);
  EXPECT_TRUE(AllRefuse("no embedded file"));
  Write("scene.xml", "1", "<mujoco><include file=\"" + secret.string() + "\"/></mujoco>");
  EXPECT_TRUE(AllRefuse(secret.string()));
}

TEST_F(ForgedLog, ASeedThatIsNoNumberIsNamed) {
  for (const char* seed : {"", "x", "-1", "1 ", "99999999999999999999999"}) {
    Write("scene.xml", seed, model_);
    EXPECT_TRUE(IsRefused(RunDexcheck({"run", "--replay", run_dir().string()}),
                          {"log.h5: seed: must be a whole number", seed}))
        << seed;
  }
}

}  // namespace
}  // namespace dexcheck::testing::forged_log_test
