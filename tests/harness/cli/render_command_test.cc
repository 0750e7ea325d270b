// dexcheck render on logs of a run that was only posed, not simulated.

#include <filesystem>
#include <map>
#include <utility>

#include "renders/video.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/report/replay_run.h"
#include "tests/renders/read_png.h"

namespace dexcheck::testing::render_command_test {
namespace {

namespace fs = std::filesystem;

/// Missing or wrong parts of a log.
struct Flaw {
  bool no_qpos = false;
  bool no_mjcf = false;
  bool no_bound = false;
  bool only_what_must_be = false;
};

/// Writes FOLDER/log.h5.
void WriteRun(const fs::path& folder, double duration, const Flaw& flaw = {}) {
  fs::create_directory(folder);
  const MjModelPtr model = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const RunFrames run = MakeKinematicRun(*model, duration);
  LogWriter log(folder / "log.h5", run.rows());
  log.SetText("scenario", "posed");
  if (!flaw.no_mjcf) EmbedScene(&log);
  std::vector<std::pair<SignalInfo, RowMatrixXd>> signals;
  const auto add = [&](const SignalInfo& signal, const RowMatrixXd& rows) {
    signals.emplace_back(signal, rows);
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
  WriteRows(run.times, signals, &log);
  log.Close();
}

class RenderCommand : public CommandTest {
 protected:
  RenderCommand() { WriteRun(Path("run"), 0.1); }
  void WriteLonger(double duration) const {
    fs::remove_all(Path("run"));
    WriteRun(Path("run"), duration);
  }
};

TEST_F(RenderCommand, WritesAVideoIntoTheRunsFolder) {
  WriteLonger(0.5);
  const ProgramResult result = Expect(0, "render run --size 160x90 --fps 10 --forces");
  EXPECT_THAT(result.err, HasSubstr("cut off after")) << "the log has no summary";
  EXPECT_THAT(result.out, StartsWith("run/video.mp4: 5 frames, 0.5 s, 160 x 90, "));
  EXPECT_EQ(Read("run/video.mp4").substr(4, 4), "ftyp");
  EXPECT_EQ(CountFiles("run"), 2);
}

TEST_F(RenderCommand, WritesAStillOfARunWithoutChecks) {
  fs::remove_all(Path("run"));
  WriteRun(Path("run"), 0.3, {.only_what_must_be = true});
  EXPECT_THAT(Expect(0, "render run --still 0.2 --out a.png --size 160x90 --camera follow --inset grasp").out,
              StartsWith("a.png: 0.20 s"));
  const Image image = ReadPng(Path("a.png"));
  EXPECT_EQ(image.width, 160);
  EXPECT_EQ(image.height, 90);
}

// WSL2 exports the first; OSMesa has none of them, and crashed.
TEST_F(RenderCommand, DrawsWhateverDriverTheEnvironmentNames) {
  for (const char* driver : {"d3d12", "zink", "swr"}) {
    Expect(0, "render run --still 0.1 --out a.png --size 160x90",
           {.environment = {{"GALLIUM_DRIVER", driver}}});
    EXPECT_EQ(ReadPng(Path("a.png")).width, 160) << driver;
    fs::remove(Path("a.png"));
  }
}

TEST_F(RenderCommand, AReportWithoutItsReplayIsSmaller) {
  Expect(0, "report run --page page.html");
  Expect(0, "report run --page without.html --no-replay");
  const std::string page = Read("page.html");
  const std::string without = Read("without.html");
  EXPECT_THAT(page, HasSubstr("id=\"replay-scene\""));
  EXPECT_THAT(without, Not(HasSubstr("replay-scene")));
  EXPECT_GT(page.size(), without.size() + 500'000) << "three.js and the robot's shapes";
}

TEST_F(RenderCommand, TheEndOfTheLastStepIsPartOfTheRun) {
  const auto draw = [&](const std::string& time) {
    Expect(0, {"render", "run", "--still", time, "--out", "a.png", "--size", "160x90", "--no-panel",
               "--camera", "course"});
    return Read("a.png");
  };
  EXPECT_EQ(draw("0.11"), draw("0.1"));
  EXPECT_NE(draw("0.05"), draw("0.1"));
}

TEST_F(RenderCommand, RefusesRunsThatCannotBeDrawn) {
  const auto refused = [&](double duration, const Flaw& flaw, const std::vector<std::string>& parts) {
    fs::remove_all(Path("run"));
    WriteRun(Path("run"), duration, flaw);
    return Refused("render run", parts);
  };
  EXPECT_TRUE(refused(0.1, {.no_qpos = true}, {"log.h5: ", "engine/qpos"}));
  EXPECT_TRUE(refused(0.1, {.no_mjcf = true}, {"log.h5: ", "inputs"}));
  EXPECT_TRUE(refused(0.1, {.no_bound = true}, {"log.h5: check/M_bar", "\"bound\""}));
  EXPECT_TRUE(refused(0.0, {}, {"log.h5: time", "0 s"}));
  EXPECT_EQ(CountFiles("run"), 1);
}

}  // namespace
}  // namespace dexcheck::testing::render_command_test
