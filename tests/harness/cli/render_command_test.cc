// dexcheck render on logs of a run that was only posed, not simulated.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "harness/engine/engine.h"
#include "harness/log/log_writer.h"
#include "renders/picture_file.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/renders/kinematic_run.h"

namespace dexcheck::testing::render_command_test {
namespace {

namespace fs = std::filesystem;

/// What a log leaves out, or has wrong.
struct Flaw {
  bool no_qpos = false;
  bool no_mjcf = false;
  bool no_bound = false;
  bool only_what_must_be = false;
};

void EmbedModel(LogWriter* log) {
  const fs::path mjcf = testing::SourcePath("/mjcf");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(mjcf)) {
    const std::string extension = entry.path().extension();
    if (extension != ".xml" && extension != ".msh") continue;
    log->EmbedFile("inputs", "mjcf/" + fs::relative(entry.path(), mjcf).string(),
                   testing::ReadText(entry.path()));
  }
}

/// Writes FOLDER/log.h5.
void WriteRun(const fs::path& folder, double duration, const Flaw& flaw = {}) {
  fs::create_directory(folder);
  const MjModelPtr model = LoadMjcf(testing::SourcePath("/mjcf/scene.xml"));
  const RunFrames run = testing::MakeKinematicRun(*model, duration);
  LogWriter log(folder / "log.h5", run.rows());
  log.SetText("scenario", "posed");
  if (!flaw.no_mjcf) {
    log.SetText("mjcf", "scene.xml");
    EmbedModel(&log);
  }
  std::vector<std::pair<int, RowMatrixXd>> channels;
  const auto add = [&](const SignalInfo& signal, const RowMatrixXd& values) {
    channels.emplace_back(log.AddSignal(signal), values);
  };
  const auto as_column = [](const std::vector<double>& values) -> RowMatrixXd {
    return Eigen::Map<const VectorXd>(values.data(), static_cast<long>(values.size()));
  };
  if (!flaw.no_qpos) add({"engine/qpos", "m, rad, 1", "positions", model->nq, {}, {}}, run.qpos);
  if (!flaw.only_what_must_be) {
    RowMatrixXd X_d = RowMatrixXd::Zero(run.rows(), 6);
    X_d.leftCols<3>() = run.desired_positions;
    add({"object/X_d", "m, rad", "desired", 6, {}, {}}, X_d);
    add({"object/position_error", "m", "error", 1, {}, {}}, as_column(run.position_errors));
    add({"object/orientation_error", "rad", "error", 1, {}, {}}, as_column(run.orientation_errors));
    add({"contact/position", "m", "places", 12, {}, {}}, run.contact_positions);
    add({"contact/normal", "1", "normals", 12, {}, {}}, run.contact_normals);
    add({"contact/force", "N", "forces", 12, {}, {{"mu", run.friction}}}, run.contact_forces);
    for (const CheckSeries& check : run.checks) {
      std::map<std::string, double> attributes = {{"kind", static_cast<double>(check.kind)}};
      if (!flaw.no_bound) attributes["bound"] = check.bound;
      add({"check/" + check.name, "1", "check", 1, {}, attributes}, as_column(check.residuals));
    }
  }
  log.StartRows();
  for (long row = 0; row < run.rows(); ++row) {
    log.Row(LogWriter::kTime)[0] = run.times[static_cast<size_t>(row)];
    for (const auto& [signal, values] : channels) {
      std::copy(values.row(row).begin(), values.row(row).end(), log.Row(signal).begin());
    }
    log.EndRow();
  }
  log.Close();
}

class RenderCommandTest : public ::testing::Test {
 protected:
  testing::TempFolder folder_;
  std::string run_ = folder_.path() / "run";

  /// Files of the run's folder beside the log.
  [[nodiscard]] long CountOutputs() const { return std::distance(fs::directory_iterator(run_), {}) - 1; }
};

TEST_F(RenderCommandTest, WritesAVideoIntoTheRunsFolder) {
  WriteRun(run_, 0.5);
  const testing::ProgramResult result =
      RunDexcheck({"render", run_, "--size", "160x90", "--fps", "10", "--forces", "--tracks", "--frames"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("cut off after")) << "the log has no summary";
  EXPECT_THAT(result.out, HasSubstr("run/video.mp4: 5 frames, 0.5 s, 160 x 90, "));
  const std::string video = testing::ReadText(run_ + "/video.mp4");
  EXPECT_EQ(video.substr(4, 4), "ftyp");
  EXPECT_EQ(CountOutputs(), 1);
  EXPECT_EQ(RunDexcheck({"render", run_, "--size", "160x90", "--fps", "10", "--forces", "--tracks",
                         "--frames", "--jobs", "1", "--out", run_ + "/again.mp4", "--quiet"})
                .out,
            "");
  EXPECT_EQ(testing::ReadText(run_ + "/again.mp4"), video) << "the number of processes does not matter";
}

TEST_F(RenderCommandTest, WritesAStillOfTwoRuns) {
  WriteRun(run_, 0.5);
  const std::string other = folder_.path() / "other";
  WriteRun(other, 0.3, {.only_what_must_be = true});
  const std::string out = folder_.path() / "a.png";
  const testing::ProgramResult result =
      RunDexcheck({"render", run_, "--beside", other, "--still", "0.4", "--out", out, "--size", "320x90",
                   "--camera", "follow", "--inset", "grasp"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, out + ": 0.40 s of the run, 320 x 90\n");
  const Image image = ReadPng(out);
  EXPECT_EQ(image.width, 320);
  EXPECT_EQ(image.height, 90);
}

TEST_F(RenderCommandTest, TwoRunsInOneScene) {
  WriteRun(run_, 0.1);
  const std::string other = folder_.path() / "other";
  WriteRun(other, 0.1);
  const std::string still = folder_.path() / "a.png";
  EXPECT_EQ(RunDexcheck({"render", run_, "--ghost", other, "--still", "0.1", "--out", still, "--size",
                         "160x90", "--camera", "robot", "--inset", "object"})
                .exit_code,
            0);
  EXPECT_EQ(ReadPng(still).width, 160) << "not two pictures";
  const std::string video = folder_.path() / "video.gif";
  const testing::ProgramResult result = RunDexcheck({"compare", run_, other, "--video", video});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr(video + ": 3 frames"));
  EXPECT_THAT(testing::ReadText(video), ::testing::StartsWith("GIF89a"));
  EXPECT_TRUE(IsRefused(RunDexcheck({"render", run_, "--ghost", other, "--beside", other}), {"--beside"}));
}

TEST_F(RenderCommandTest, AReportWithoutItsReplayIsSmaller) {
  WriteRun(run_, 0.1);
  const auto write = [&](std::vector<std::string> options) {
    const std::string page = folder_.path() / "page.html";
    options.insert(options.begin(), {"report", run_, "--out", page});
    EXPECT_EQ(RunDexcheck(options).exit_code, 0);
    return testing::ReadText(page);
  };
  const std::string page = write({});
  const std::string without = write({"--no-replay"});
  EXPECT_THAT(page, HasSubstr("id=\"replay-scene\""));
  EXPECT_THAT(without, ::testing::Not(HasSubstr("replay-scene")));
  EXPECT_GT(page.size(), without.size() + 500'000) << "three.js and the robot's shapes";
}

TEST_F(RenderCommandTest, WritesWhatTheNameSays) {
  WriteRun(run_, 0.2);
  struct Output {
    const char* name;
    const char* begin;  // of the file's bytes
    bool still;
  };
  for (const Output& output :
       {Output{"/a.gif", "GIF89a", false}, Output{"/a.WEBM", "\x1a\x45\xdf\xa3", false},
        Output{"/a.png", "\x89PNG", true}, Output{"/a.jpg", "\xff\xd8\xff", true},
        Output{"/a.JPEG", "\xff\xd8\xff", true}}) {
    std::vector<std::string> command = {"render", run_, "--size", "64x64",
                                        "--fps",  "10", "--out",  run_ + output.name};
    if (output.still) command.insert(command.end(), {"--still", "0.1"});
    const testing::ProgramResult result = RunDexcheck(command);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(testing::ReadText(run_ + output.name), ::testing::StartsWith(output.begin)) << output.name;
  }
}

TEST_F(RenderCommandTest, TheEndOfTheLastStepIsPartOfTheRun) {
  WriteRun(run_, 0.1);
  const auto draw = [&](const char* time, const char* out) {
    EXPECT_EQ(RunDexcheck({"render", run_, "--still", time, "--out", run_ + out, "--size", "160x90",
                           "--no-panel", "--camera", "course"})
                  .exit_code,
              0);
    return testing::ReadText(run_ + out);
  };
  EXPECT_EQ(draw("0.11", "/a.png"), draw("0.1", "/b.png"));
  EXPECT_NE(draw("0.05", "/c.png"), draw("0.1", "/b.png"));
}

TEST_F(RenderCommandTest, RefusesBadRequestsAndLeavesNothing) {
  WriteRun(run_, 0.1);
  const auto refused = [&](std::vector<std::string> arguments, const std::vector<std::string>& parts) {
    arguments.insert(arguments.begin(), {"render", run_});
    return IsRefused(RunDexcheck(arguments), parts);
  };
  EXPECT_TRUE(refused({"--camera", "sideways"}, {"camera: no \"sideways\"", "overview, follow, top, grasp"}));
  EXPECT_TRUE(refused({"--from", "1,2,3", "--look-at", "1,2,3"}, {"--look-at", "--from"}));
  EXPECT_TRUE(refused({"--inset", "sideways"}, {"camera: no \"sideways\""}));
  EXPECT_TRUE(refused({"--out", "/nowhere/a.mp4"}, {"/nowhere/a.mp4: cannot be written: No such file"}));
  EXPECT_TRUE(refused({"--out", run_}, {"cannot be written: Is a directory"}));
  EXPECT_TRUE(
      refused({"--still", "1", "--out", "/nowhere/a.png"}, {"--still: must be from 0 to 0.1 s, got 1"}));
  EXPECT_TRUE(refused({"--still", "-0.01"}, {"--still: must be from 0 to 0.1 s, got -0.01"}));
  EXPECT_TRUE(refused({"--still", "0", "--out", "/nowhere/a.png"}, {"/nowhere/a.png: cannot be written"}));
  for (const char* size : {"1280", "x", "1280x721", "0x720", "1280x720x3", "99999x99999", "-2x4"}) {
    EXPECT_TRUE(refused({std::string("--size=") + size}, {"--size: must be WIDTHxHEIGHT", size}));
  }
  for (const char* name : {"/video.avi", "/video", "/video.png", "/video.jpg"}) {
    EXPECT_TRUE(refused({"--out", run_ + name}, {name, "a video's name must end in .mp4, .webm or .gif"}));
  }
  for (const char* name : {"/still.mp4", "/still", "/still.tiff"}) {
    EXPECT_TRUE(refused({"--still", "0", "--out", run_ + name},
                        {name, "a picture's name must end in .png, .jpg or .jpeg"}));
  }
  EXPECT_TRUE(
      refused({"--out", run_ + "/video.gif", "--fps", "60"}, {"--fps: must be at most 50 for a GIF"}));
  EXPECT_TRUE(refused({"--fps", "0"}, {"--fps", "must be a whole number from 1 to 120"}));
  EXPECT_TRUE(refused({"--beside", "/nowhere"}, {"/nowhere/log.h5"}));
  EXPECT_TRUE(refused({"--camra", "top"}, {"did you mean \"--camera\"?"}));
  EXPECT_EQ(CountOutputs(), 0);
}

TEST_F(RenderCommandTest, RefusesRunsThatCannotBeDrawn) {
  const auto refused = [&](double duration, const Flaw& flaw, const std::vector<std::string>& parts) {
    fs::remove_all(run_);
    WriteRun(run_, duration, flaw);
    return IsRefused(RunDexcheck({"render", run_}), parts);
  };
  EXPECT_TRUE(IsRefused(RunDexcheck({"render", "/nowhere"}), {"/nowhere/log.h5: "}));
  EXPECT_TRUE(refused(0.1, {.no_qpos = true}, {"log.h5: ", "engine/qpos"}));
  EXPECT_TRUE(refused(0.1, {.no_mjcf = true}, {"log.h5: ", "inputs"}));
  EXPECT_TRUE(refused(0.1, {.no_bound = true}, {"log.h5: check/M_bar: has no attribute \"bound\""}));
  EXPECT_TRUE(refused(0.0, {}, {"log.h5: time: the run ends where it begins, at 0 s"}));
  EXPECT_EQ(CountOutputs(), 0);
}

TEST_F(RenderCommandTest, StoppedItLeavesNothing) {
  WriteRun(run_, 20.0);
  testing::Program program(testing::DexcheckCommand({"render", run_, "--size", "160x90"}), {});
  // Until the drawing has begun, by the temporary file.
  for (int k = 0; k < 600 && CountOutputs() == 0; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  program.Signal(SIGINT);
  const testing::ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("of 600 frames"));
  EXPECT_EQ(CountOutputs(), 0);
}

}  // namespace
}  // namespace dexcheck::testing::render_command_test
