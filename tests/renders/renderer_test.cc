// The picture shows what the camera should see.

#include "renders/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "controller/common/errors.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "renders/video.h"
#include "renders/viewpoint.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"
#include "tests/renders/kinematic_run.h"
#include "tests/renders/read_png.h"

namespace dexcheck::testing::renderer_test {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 180;
constexpr double kRing = 0.035;
constexpr double kTube = 0.011;

class RendererTest : public ::testing::Test {
 protected:
  void SetUp() override {
    run_ = MakeKinematicRun(*model_, 0.1);
    SetRow(*model_, run_, 0, data_.get());
  }

  static RenderOptions MakeOptions(const std::string& camera) {
    RenderOptions options;
    options.width = kWidth;
    options.height = kHeight;
    options.camera = camera;
    return options;
  }

  /// Pixel of a world point, by the pinhole of the MJCF's camera.
  [[nodiscard]] Vector2d Project(const std::string& camera, const Vector3d& p_W) const {
    const int id = mj_name2id(model_.get(), mjOBJ_CAMERA, camera.c_str());
    const Vector3d eye(data_->cam_xpos + 3 * id);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(data_->cam_xmat + 9 * id);
    const Vector3d p = R.transpose() * (p_W - eye);
    const double focal = 0.5 * kHeight / std::tan(0.5 * DegToRad(model_->cam_fovy[id]));
    return {0.5 * kWidth + focal * p.x() / -p.z(), 0.5 * kHeight - focal * p.y() / -p.z()};
  }

  /// Points of the torus's surface that face a camera.
  [[nodiscard]] std::vector<Vector3d> MakeTorusPoints(const std::string& camera) const {
    const Vector3d eye(data_->cam_xpos + 3 * mj_name2id(model_.get(), mjOBJ_CAMERA, camera.c_str()));
    const Pose X_WO = BodyPose(*data_, mj_name2id(model_.get(), mjOBJ_BODY, "torus"));
    std::vector<Vector3d> points;
    for (int k = 0; k < 32; ++k) {
      const double angle = 2.0 * kPi * k / 32;
      const Vector3d circle = X_WO * Vector3d(kRing * std::cos(angle), kRing * std::sin(angle), 0.0);
      const Vector3d tangent = X_WO.linear() * Vector3d(-std::sin(angle), std::cos(angle), 0.0);
      Vector3d to_eye = eye - circle;
      to_eye -= tangent.dot(to_eye) * tangent;
      points.emplace_back(circle + kTube * to_eye.normalized());
    }
    return points;
  }

  static bool IsOrange(const Image& image, const Vector2d& at) {
    const std::uint8_t* p = image.Pixel(static_cast<int>(at.x()), static_cast<int>(at.y()));
    return p[0] > 120 && p[0] > 1.5 * p[1] && p[1] > 1.3 * p[2];
  }

  int CountOrange(const Image& image, const std::string& camera, const std::vector<Vector3d>& points) {
    int count = 0;
    for (const Vector3d& point : points) {
      if (IsOrange(image, Project(camera, point))) ++count;
    }
    return count;
  }

  MjModelPtr model_ = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  MjDataPtr data_ = MakeData(*model_);
  RunFrames run_;
};

TEST_F(RendererTest, TorusIsOrangeWhereTheCameraProjectsIt) {
  Renderer renderer(*model_, MakeOptions("grasp"));
  const std::vector<Vector3d> points = MakeTorusPoints("grasp");
  // Fingers hide a few points.
  EXPECT_GE(CountOrange(renderer.Render(*data_), "grasp", points), 26);
  // Elsewhere in space the same torus does not colour these pixels.
  run_.qpos(0, model_->jnt_qposadr[mj_name2id(model_.get(), mjOBJ_JOINT, "torus_free")]) -= 1.0;
  SetRow(*model_, run_, 0, data_.get());
  EXPECT_EQ(CountOrange(renderer.Render(*data_), "grasp", points), 0);
}

TEST_F(RendererTest, CamerasCanBeChangedFromPictureToPicture) {
  Renderer renderer(*model_, MakeOptions("grasp"));
  const Image first = renderer.Render(*data_);
  const Image other = renderer.Render(*data_, "overview", kWidth, kHeight);
  EXPECT_NE(other.rgb, first.rgb);
  Renderer overview(*model_, MakeOptions("overview"));
  EXPECT_EQ(overview.Render(*data_).rgb, other.rgb) << "independent of what was drawn before, and where";
  EXPECT_EQ(renderer.Render(*data_).rgb, first.rgb);
  EXPECT_EQ(renderer.Render(*data_, "top", 64, 36).width, 64);
}

TEST_F(RendererTest, PictureCanBeShifted) {
  RenderOptions options = MakeOptions("grasp");
  const Image plain = Renderer(*model_, options).Render(*data_);
  options.shift_right = 0.25;
  const Image shifted = Renderer(*model_, options).Render(*data_);
  double difference = 0.0;
  constexpr int kShift = kWidth / 4;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = kShift; x < kWidth; ++x) {
      difference += std::abs(shifted.Pixel(x, y)[0] - plain.Pixel(x - kShift, y)[0]);
    }
  }
  // Rounding of pixel positions moves a few edges.
  EXPECT_LT(difference / (kHeight * (kWidth - kShift)), 1.0);
  EXPECT_NE(shifted.rgb, plain.rgb);
}

/// Mean of red minus blue over the pixels around a point.
double Redness(const Image& image, const Vector2d& at) {
  double sum = 0.0;
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      const std::uint8_t* p = image.Pixel(static_cast<int>(at.x()) + dx, static_cast<int>(at.y()) + dy);
      sum += (p[0] - p[2]) / 25.0;
    }
  }
  return sum;
}

TEST_F(RendererTest, DecorationsAppearWhereTheyAre) {
  Renderer renderer(*model_, MakeOptions("overview"));
  const Image plain = renderer.Render(*data_);
  const Color red = {1.0F, 0.0F, 0.0F, 1.0F};
  // Beside the robot, where the floor is seen.
  const Vector3d place(0.3, -0.8, 0.3);
  const Vector3d up = 0.2 * Vector3d::UnitZ();
  const Vector2d middle = Project("overview", place + 0.5 * up);
  const Vector2d beyond = Project("overview", place + 1.2 * up);
  ASSERT_LT(std::abs(Redness(plain, middle)), 30.0);
  struct Case {
    const char* name;
    Decoration decoration;
    Vector2d covered;
  };
  const std::vector<Case> cases = {
      {"arrow", Arrow{place, place + up, 0.012, red}, middle},
      {"arrow's head", Arrow{place, place + up, 0.012, red}, Project("overview", place + 0.86 * up)},
      {"cone", Cone{place, Vector3d::UnitZ(), 0.2, 0.2, red}, middle}};
  for (const Case& c : cases) {
    const Image image = renderer.Render(*data_, {&c.decoration, 1});
    EXPECT_GT(Redness(image, c.covered), 60.0) << c.name;
    EXPECT_LT(std::abs(Redness(image, beyond)), 30.0) << c.name << " is longer than it should be";
  }
  EXPECT_EQ(renderer.Render(*data_).rgb, plain.rgb) << "decorations are for one picture";
}

TEST_F(RendererTest, TranslucentConeLetsSeeThrough) {
  Renderer renderer(*model_, MakeOptions("overview"));
  const Vector3d place(0.3, -0.8, 0.3);
  const Vector2d middle = Project("overview", place + Vector3d(0.0, 0.0, 0.1));
  const auto redness = [&](float opacity) {
    const Decoration cone = Cone{place, Vector3d::UnitZ(), 0.2, 0.5, {1.0F, 0.0F, 0.0F, opacity}};
    return Redness(renderer.Render(*data_, {&cone, 1}), middle);
  };
  const double faint = redness(0.2F);
  EXPECT_GT(faint, Redness(renderer.Render(*data_), middle) + 15.0);
  EXPECT_LT(faint, redness(1.0F) - 30.0);
}

TEST_F(RendererTest, TranslucentBodyShowsWhatIsInside) {
  RenderOptions options = MakeOptions("grasp");
  Renderer opaque(*model_, options);
  options.translucent_body = "torus";
  Renderer translucent(*model_, options);
  // A blue arrow inside of the tube, on the side of the camera.
  const Vector3d inside = 0.5 * (MakeTorusPoints("grasp")[4] + MakeTorusPoints("grasp")[3]);
  const Pose X_WO = BodyPose(*data_, mj_name2id(model_.get(), mjOBJ_BODY, "torus"));
  const Vector3d center = inside + 0.25 * kTube * (X_WO.translation() - inside).normalized();
  const Vector3d half = 0.005 * Vector3d::UnitZ();
  const Decoration arrow = Arrow{center - half, center + half, 0.004, {0.0F, 0.0F, 1.0F, 1.0F}};
  const Vector2d at = Project("grasp", center);
  EXPECT_GT(Redness(opaque.Render(*data_), at), 60.0);
  EXPECT_LT(Redness(translucent.Render(*data_, {&arrow, 1}), at),
            Redness(translucent.Render(*data_), at) - 20.0);
}

TEST_F(RendererTest, NamesCamerasThatExist) {
  EXPECT_TRUE(
      Throws<InputError>([&] { Renderer renderer(*model_, MakeOptions("sideways")); },
                         "camera: no \"sideways\" in the model, which has overview, follow, top, grasp"));
  Renderer renderer(*model_, MakeOptions("grasp"));
  EXPECT_TRUE(
      Throws<InputError>([&] { renderer.Render(*data_, "", 64, 36); }, "camera: no \"\" in the model"));
  const MjModelPtr empty = LoadMjcfText("<mujoco><worldbody><geom size=\"1\"/></worldbody></mujoco>", "ball");
  EXPECT_TRUE(Throws<InputError>([&] { Renderer r(*empty, MakeOptions("top")); }, "which has no cameras"));
}

// A frame as a video shows it. With DEXCHECK_WRITE_GOLDEN in the environment the picture is written anew
// instead: look at it.
TEST_F(RendererTest, StillLooksAsItDid) {
  VideoOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.inset = "grasp";
  const auto paint = [&](const RunFrames& run) { return MakePainter({model_.get(), &run}, options)(0.1); };
  const Image image = paint(run_);
  const std::string path = SourcePath("/tests/renders/golden_still.png");
  if (std::getenv("DEXCHECK_WRITE_GOLDEN") != nullptr) WritePng(path, image);
  const Image golden = ReadPng(path);
  ASSERT_EQ(golden.rgb.size(), image.rgb.size());
  const auto share_that_differs = [&](const Image& other) {
    constexpr int kVisible = 24;
    size_t count = 0;
    for (size_t i = 0; i < golden.rgb.size(); ++i) {
      if (std::abs(golden.rgb[i] - other.rgb[i]) > kVisible) ++count;
    }
    return static_cast<double>(count) / static_cast<double>(golden.rgb.size());
  };
  // Another processor's rounding moves edges by a fraction of a pixel: the robot's outline and the floor's
  // lines are about 2 % of the pixels, of which a small part passes the threshold.
  constexpr double kFraction = 0.004;
  EXPECT_LE(share_that_differs(image), kFraction);
  // An elbow bent 5 degrees further shows.
  RunFrames bent = run_;
  bent.qpos.col(model_->jnt_qposadr[mj_name2id(model_.get(), mjOBJ_JOINT, "r_elbow")]).array() +=
      DegToRad(5.0);
  EXPECT_GT(share_that_differs(paint(bent)), 2.0 * kFraction);
}

}  // namespace
}  // namespace dexcheck::testing::renderer_test
