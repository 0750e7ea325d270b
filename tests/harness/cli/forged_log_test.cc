// Commands on logs that somebody changed: files outside are neither written nor read.

#include "harness/log/log_writer.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/log/change_log.h"

namespace dexcheck::testing::forged_log_test {
namespace {

namespace fs = std::filesystem;

class ForgedLog : public CommandTest {
 protected:
  /// A log whose texts and model are as given.
  void WriteLog(const std::string& mjcf, const std::string& seed, const std::string& model) const {
    fs::remove_all(Path("run"));
    fs::create_directory(Path("run"));
    LogWriter log(Path("run/log.h5"), 10);
    log.SetText("scenario", "hold");
    log.SetText("overrides", "");
    log.SetText("seed", seed);
    log.SetText("robot", "robot.toml");
    log.SetText("mjcf", mjcf);
    log.EmbedFile("inputs", "scenario.toml", ReadText(SourcePath("/harness/shipped/scenarios/hold.toml")));
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
    for (const char* command : {"run --replay run", "render run", "report run --page page.html"}) {
      ::testing::AssertionResult refused = Refused(command, {part});
      if (!refused) return refused << " from " << command;
    }
    if (CountFiles("run") != 1) return ::testing::AssertionFailure() << "something was written";
    return ::testing::AssertionSuccess();
  }

  const std::string model_ =
      "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
};

TEST_F(ForgedLog, WritesNoFilesOutside) {
  WriteLog("scene.xml", "1", model_);
  ChangeLog(Path("run/log.h5"), [&](hid_t file) {
    const hid_t up = H5Gcreate2(file, "inputs/..", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    AddBytes(up, "escaped");
    H5Gclose(up);
  });
  EXPECT_TRUE(AllRefuse("is not a plain relative path"));
  EXPECT_FALSE(Has("escaped"));
}

TEST_F(ForgedLog, ReadsNoFilesOutside) {
  const fs::path secret = Path("secret.xml");
  WriteText(secret, model_);
  WriteLog("../../" + folder_.path().filename().string() + "/secret.xml", "1", model_);
  EXPECT_TRUE(AllRefuse("no embedded file"));
  WriteLog("scene.xml", "1", "<mujoco><include file=\"" + secret.string() + "\"/></mujoco>");
  EXPECT_TRUE(AllRefuse(secret.string()));
}

// Its files are unpacked into a folder that nobody looks into.
TEST_F(ForgedLog, WhatIsWrongInsideNamesTheLog) {
  WriteLog("scene.xml", "1", model_);
  EXPECT_TRUE(Refused("run --replay run", {"dexcheck: run/log.h5: robot/robot.toml:1: missing key"}));
}

TEST_F(ForgedLog, ASeedThatIsNoNumberIsNamed) {
  for (const char* seed : {"", "x", "-1", "1 ", "99999999999999999999999"}) {
    WriteLog("scene.xml", seed, model_);
    EXPECT_TRUE(Refused("run --replay run", {"log.h5: seed: ", seed}));
  }
}

}  // namespace
}  // namespace dexcheck::testing::forged_log_test
