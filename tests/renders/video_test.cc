// A run as a video: what moved, moved; the same run gives the same video.

#include "renders/video.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <vector>

#include "controller/common/errors.h"
#include "harness/engine/engine.h"
#include "renders/renderer.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"
#include "tests/renders/decode.h"
#include "tests/renders/kinematic_run.h"

namespace dexcheck::testing::video_test {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 320;
constexpr int kHeight = 180;

class VideoTest : public ::testing::Test {
 protected:
  static VideoOptions MakeOptions(bool panel = true) {
    VideoOptions options;
    options.panel = panel;
    options.width = kWidth;
    options.height = kHeight;
    options.fps = 10;
    options.samples = 1;
    options.shadow_size = 512;
    return options;
  }

  bool Video(const fs::path& path, const RunView& run, const VideoOptions& options,
             const std::function<bool(long, long)>& progress = {}) {
    VideoWriter video(path, options);
    if (!RenderVideo(run, options, &video, progress)) return false;
    video.Finish();
    return true;
  }

  Image Paint(const VideoOptions& options, double time) const { return MakePainter(view_, options)(time); }

  MjModelPtr model_ = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  RunFrames run_ = MakeKinematicRun(*model_, 0.5);
  RunView view_ = {model_.get(), &run_};
  TempFolder folder_;
};

/// Mean difference of two frames over a rectangle given in hundredths of the picture.
template <typename Byte>
double Difference(const Byte* a, const Byte* b, int left, int right, int top, int bottom) {
  double sum = 0.0;
  int count = 0;
  for (int y = kHeight * top / 100; y < kHeight * bottom / 100; ++y) {
    for (int x = kWidth * left / 100; x < kWidth * right / 100; ++x) {
      for (int c = 0; c < 3; ++c, ++count) {
        const int i = 3 * (y * kWidth + x) + c;
        sum += std::abs(static_cast<unsigned char>(a[i]) - static_cast<unsigned char>(b[i]));
      }
    }
  }
  return sum / count;
}

TEST_F(VideoTest, DecodedFramesDifferWhereTheRobotMoved) {
  // The robot stands; its right elbow stretches by a radian. "overview" sees the forearm left of the
  // picture's middle.
  const int elbow = model_->jnt_qposadr[mj_name2id(model_.get(), mjOBJ_JOINT, "r_elbow")];
  for (long row = 0; row < run_.rows(); ++row) {
    run_.qpos.row(row) = run_.qpos.row(0).eval();
    run_.qpos(row, elbow) -= 2.0 * run_.times[static_cast<size_t>(row)];
  }
  VideoOptions options = MakeOptions(/*panel=*/false);
  ASSERT_TRUE(Video(folder_.path() / "a.mp4", view_, options));
  const std::string decoded = Decode(folder_.path() / "a.mp4");
  constexpr size_t kFrame = 3UL * kWidth * kHeight;
  ASSERT_EQ(decoded.size(), 5 * kFrame);
  const char* first = decoded.data();
  const char* last = first + 4 * kFrame;
  EXPECT_GT(Difference(first, last, 41, 57, 45, 65), 15.0) << "forearm and torus";
  EXPECT_LT(Difference(first, last, 44, 56, 2, 30), 2.0) << "head";
  EXPECT_LT(Difference(first, last, 75, 100, 0, 100), 2.0) << "floor and sky";
}

TEST_F(VideoTest, CamerasOfItsOwnAreNearToRobotAndObject) {
  run_ = MakeKinematicRun(*model_, 6.0, 0.1);
  VideoOptions options = MakeOptions(/*panel=*/false);
  const auto find = [&](const char* camera, double time) {
    options.camera = camera;
    return FindTorus(Paint(options, time));
  };
  const double far = find(kCourseCamera, 0.0).z();
  EXPECT_GT(find(kRobotCamera, 0.0).z(), 3.0 * far);
  EXPECT_GT(find(kRobotCamera, 6.0).z(), 3.0 * far);
  const Vector3d torus = find(kObjectCamera, 6.0);
  EXPECT_GT(torus.z(), 0.02 * kWidth * kHeight);
  EXPECT_NEAR(torus.x(), 0.5 * kWidth, 0.08 * kWidth) << "fingers hide parts of it";
  EXPECT_NEAR(torus.y(), 0.5 * kHeight, 0.1 * kHeight);
  // The inset, too, leaves the picture's own camera in place.
  options.camera = kCourseCamera;
  const Image plain = Paint(options, 6.0);
  options.inset = kObjectCamera;
  const Image with_inset = Paint(options, 6.0);
  EXPECT_EQ(Difference(plain.rgb.data(), with_inset.rgb.data(), 0, 50, 0, 100), 0.0);
  EXPECT_GT(FindTorus(with_inset).z(), FindTorus(plain).z() + 0.001 * kWidth * kHeight);
}

TEST_F(VideoTest, TheCourseCameraStandsStill) {
  run_ = MakeKinematicRun(*model_, 3.0);
  VideoOptions options = MakeOptions(/*panel=*/false);
  const auto differences = [&](const char* camera) {
    options.camera = camera;
    const RunPainter paint = MakePainter(view_, options);
    const Image first = paint(0.0);
    const Image last = paint(2.7);  // the floor's pattern repeats each metre
    // Places of the robot at either end, and the left border.
    return std::array<double, 3>{Difference(first.rgb.data(), last.rgb.data(), 0, 50, 0, 100),
                                 Difference(first.rgb.data(), last.rgb.data(), 50, 100, 0, 100),
                                 Difference(first.rgb.data(), last.rgb.data(), 0, 4, 0, 100)};
  };
  const auto [left, right, border] = differences(kCourseCamera);
  constexpr double kSeen = 1.0;  // the robot, a twentieth of a half, differs from the floor by some 50
  EXPECT_GT(left, kSeen) << "gone from here";
  EXPECT_GT(right, kSeen) << "come here";
  EXPECT_EQ(border, 0.0);
  EXPECT_GT(differences("overview")[2], 0.0) << "a camera that moves along";
}

TEST_F(VideoTest, VideoDoesNotDependOnTheNumberOfProcesses) {
  VideoOptions options = MakeOptions();
  options.forces = true;
  options.inset = "grasp";
  options.workers = 1;
  ASSERT_TRUE(Video(folder_.path() / "one.mp4", view_, options));
  options.workers = 3;
  ASSERT_TRUE(Video(folder_.path() / "three.mp4", view_, options));
  EXPECT_TRUE(ReadText(folder_.path() / "one.mp4") == ReadText(folder_.path() / "three.mp4"));
}

TEST_F(VideoTest, FramesAreTheStillsOfTheirTimes) {
  const RunPainter paint = MakePainter(view_, MakeOptions());
  const Image start = paint(0.0);
  EXPECT_NE(paint(0.3).rgb, start.rgb);
  EXPECT_EQ(paint(0.0).rgb, start.rgb);
  EXPECT_EQ(paint(9.0).rgb, paint(0.5).rgb) << "after its end a run stands still";
}

TEST_F(VideoTest, LostContactsAreNotDrawn) {
  VideoOptions options = MakeOptions(/*panel=*/false);
  options.camera = "grasp";
  options.forces = true;
  const Image all = Paint(options, 0.5);
  run_.contact_positions.block(20, 0, 31, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  const Image fewer = Paint(options, 0.5);
  EXPECT_NE(all.rgb, fewer.rgb);
  run_.contact_forces.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_NO_THROW(Paint(options, 0.5));
}

TEST_F(VideoTest, ReportsItsProgressAndStopsOnRequest) {
  std::vector<long> reported;
  EXPECT_TRUE(Video(folder_.path() / "a.mp4", view_, MakeOptions(), [&](long done, long total) {
    EXPECT_EQ(total, 5);
    reported.push_back(done);
    return true;
  }));
  EXPECT_EQ(reported, (std::vector<long>{1, 2, 3, 4, 5}));
  EXPECT_FALSE(
      Video(folder_.path() / "b.mp4", view_, MakeOptions(), [](long done, long) { return done < 2; }));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1) << "nothing of the stopped video";
}

TEST_F(VideoTest, BadInputIsRefusedAndLeavesNothing) {
  const auto video = [&](const VideoOptions& options) {
    return [&, options] { return Video(folder_.path() / "a.mp4", view_, options); };
  };
  VideoOptions options = MakeOptions();
  options.camera = "sideways";
  EXPECT_TRUE(Throws<InputError>(video(options), "camera: no \"sideways\""));
  options = MakeOptions();
  options.inset = "sideways";
  EXPECT_TRUE(Throws<InputError>(video(options), "camera: no \"sideways\""));
  run_.object_body = "teapot";
  options = MakeOptions();
  options.camera = kObjectCamera;
  EXPECT_TRUE(Throws<InputError>(video(options), "kinematic run: object: no body \"teapot\" in the model"));
  run_.times.clear();
  EXPECT_TRUE(
      Throws<InputError>(video(MakeOptions()), "kinematic run: time: the run has no recorded instants"));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

}  // namespace
}  // namespace dexcheck::testing::video_test
