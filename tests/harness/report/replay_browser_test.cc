// The replay in a browser.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "harness/report/page.h"
#include "renders/renderer.h"
#include "renders/video.h"
#include "renders/viewpoint.h"
#include "tests/common/browser.h"
#include "tests/common/matchers.h"
#include "tests/harness/report/replay_run.h"

namespace dexcheck::testing::replay_browser_test {
namespace {

constexpr double kEnd = 1.0;              // s
constexpr double kFloatTolerance = 2e-6;  // m: poses are 4-byte floats
constexpr double kCentreTolerance = 2.0;  // pixels of 480: edges are smoothed in different ways
constexpr double kAreaTolerance = 0.15;   // of the area: the two light the object's edges differently
constexpr int kMostCalls = 150;           // so that a phone holds 60 frames a second
constexpr int kMostTriangles = 300'000;
constexpr int kWidth = 480;
constexpr int kHeight = 300;

/// A view from the side that sees the whole way.
Viewpoint SideView() { return {{0.7, -0.2, 0.7}, 2.0, DegToRad(120.0), DegToRad(-12.0)}; }

class ReplayBrowserTest : public ::testing::Test {
 protected:
  void SetUp() override {
    run_ = WriteReplayRun(folder_.path(), kEnd);
    WriteRunReport(folder_.path(), MakeReportFiles(folder_.path()));
    browser_.SetViewport(900, 420);  // small, for drawing without a graphics card takes long
    browser_.Open(folder_.path() / "report.html");
    ASSERT_TRUE(browser_.WaitFor("return !!document.getElementById('replay').replay;"));
  }

  /// Runs `body` where r is the replay, box its section.
  nlohmann::json Ask(const std::string& body) const {
    return browser_.Run(
        "const box = document.getElementById('replay'), r = box.replay, find = n => "
        "box.querySelector(`[data-part=${n}]`);" +
        body);
  }

  void ExpectPartsAt(long row) const;
  void ExpectObjectDrawnAt(long row, Renderer* renderer, double* column) const;
  void LookFrom(const Viewpoint& view) const;

  TempFolder folder_;
  RunFrames run_;
  MjModelPtr model_ = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  MjDataPtr data_ = MakeData(*model_);
  Browser& browser_ = Browser::Shared();
};

/// Each body that moves is where a bone is.
void ReplayBrowserTest::ExpectPartsAt(long row) const {
  SetRow(*model_, run_, row, data_.get());
  const nlohmann::json bones = Ask("runClock.set(" + std::to_string(run_.times[static_cast<size_t>(row)]) +
                                   "); r.draw(); return r.bones.map(b => b.position.toArray());");
  size_t moving = 0;
  for (int body = 1; body < model_->nbody; ++body) {
    if (model_->body_weldid[body] != body) continue;
    ++moving;
    const Vector3d p(data_->xpos + 3 * body);
    const bool found = std::ranges::any_of(bones, [&](const nlohmann::json& bone) {
      return (Vector3d(bone[0], bone[1], bone[2]) - p).norm() < kFloatTolerance;
    });
    EXPECT_TRUE(found) << NameOf(*model_, mjOBJ_BODY, body) << " at " << p.transpose();
  }
  EXPECT_EQ(bones.size(), moving + 1);  // and the world
}

void ReplayBrowserTest::LookFrom(const Viewpoint& view) const {
  const Vector3d forward(std::cos(view.elevation) * std::cos(view.azimuth),
                         std::cos(view.elevation) * std::sin(view.azimuth), std::sin(view.elevation));
  const Vector3d eye = view.look_at - view.distance * forward;
  const auto print = [](const Vector3d& p) {
    return std::to_string(p.x()) + "," + std::to_string(p.y()) + "," + std::to_string(p.z());
  };
  Ask("find('follow').checked = false; r.groups.tracks.visible = r.groups.ghost.visible = "
      "r.groups.forces.visible = false; r.renderer.setPixelRatio(1); r.renderer.setSize(" +
      std::to_string(kWidth) + "," + std::to_string(kHeight) +
      ", false); r.camera.aspect = " + std::to_string(static_cast<double>(kWidth) / kHeight) +
      "; r.camera.fov = " + std::to_string(model_->vis.global.fovy) +
      "; r.camera.updateProjectionMatrix(); r.camera.position.set(" + print(eye) +
      "); r.controls.target.set(" + print(view.look_at) + ");");
}

/// @param column where the object is in the picture.
void ReplayBrowserTest::ExpectObjectDrawnAt(long row, Renderer* renderer, double* column) const {
  SetRow(*model_, run_, row, data_.get());
  const Image image = renderer->Render(*data_);
  const Vector3d there = FindTorus(image);
  ASSERT_GT(there.z(), 60.0);
  const nlohmann::json pixels =
      Ask("runClock.set(" + std::to_string(run_.times[static_cast<size_t>(row)]) +
          "); r.draw(); const gl = r.renderer.context, p = new Uint8Array(4 * gl.drawingBufferWidth * "
          "gl.drawingBufferHeight); gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, "
          "gl.RGBA, gl.UNSIGNED_BYTE, p); return [gl.drawingBufferWidth, gl.drawingBufferHeight, [...p]];");
  ASSERT_EQ(pixels[0], kWidth);
  ASSERT_EQ(pixels[1], kHeight);
  const std::vector<int> rgba = pixels[2];
  Image drawn(kWidth, kHeight);  // whose lowest row came first
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int from = 4 * ((kHeight - 1 - y) * kWidth + x) + c;
        drawn.rgb[static_cast<size_t>(3 * (y * kWidth + x) + c)] =
            static_cast<std::uint8_t>(rgba[static_cast<size_t>(from)]);
      }
    }
  }
  const Vector3d here = FindTorus(drawn);
  EXPECT_LT((here - there).head<2>().cwiseAbs().maxCoeff(), kCentreTolerance) << row;
  EXPECT_NEAR(here.z() / there.z(), 1.0, kAreaTolerance) << row;
  *column = here.x();
}

TEST_F(ReplayBrowserTest, DrawsWhatTheOffscreenRendererDrawsAndCostsAPhoneLittle) {
  for (const long row : {0L, 37L, 100L}) ExpectPartsAt(row);
  const nlohmann::json info =
      Ask("const info = r.renderer.info; info.autoReset = false; info.reset(); r.draw();const spent = "
          "[info.render.calls, info.render.triangles]; info.autoReset = true; info.reset(); return spent;");
  EXPECT_GT(info[0], 5);
  EXPECT_LE(info[0], kMostCalls);
  EXPECT_GT(info[1], 20'000);
  EXPECT_LE(info[1], kMostTriangles);
  RecordProperty("calls", info[0].get<int>());
  RecordProperty("triangles", info[1].get<int>());

  RenderOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.camera = kCourseCamera;
  options.course = SideView();
  Renderer renderer(*model_, options);
  LookFrom(SideView());
  double first = 0.0;
  double last = 0.0;
  ExpectObjectDrawnAt(0, &renderer, &first);
  ExpectObjectDrawnAt(100, &renderer, &last);
  EXPECT_GT(std::abs(last - first), 50.0) << "the object moved in the picture";
}

TEST_F(ReplayBrowserTest, SharesItsTimeWithThePlots) {
  // A click on the failing check shows its moment, in the replay and in the plots.
  Ask("document.documentElement.style.scrollBehavior = 'auto'; "
      "document.getElementById('plots').scrollIntoView();");
  ASSERT_TRUE(browser_.WaitFor("return document.querySelectorAll('[data-plot]')[0].chart !== undefined;"));
  EXPECT_EQ(browser_.Run("document.querySelector('#verdict [data-time]').click(); return runClock.time;"),
            0.133);
  EXPECT_EQ(Ask("return [Number(find('time').value), find('clock').textContent];"),
            nlohmann::json({0.133, "t = 0.133 s"}));
  const std::string ask_line =
      "const b = document.querySelectorAll('[data-plot]')[0], i = b.querySelector('.now');return "
      "b.chart.scales.x.getValueForPixel(parseFloat(i.style.left));";
  EXPECT_NEAR(browser_.Run(ask_line).get<double>(), 0.133, 1e-3);
  // The slider moves the plots' line, a click into a plot the replay.
  Ask("find('time').value = 0.5; find('time').dispatchEvent(new Event('input'));");
  EXPECT_NEAR(browser_.Run(ask_line).get<double>(), 0.5, 1e-3);
  const nlohmann::json area = browser_.Run(
      "document.querySelectorAll('[data-plot]')[0].scrollIntoView({block: 'center'});const {canvas, "
      "chartArea: a} = document.querySelectorAll('[data-plot]')[0].chart,  r = "
      "canvas.getBoundingClientRect();return [r.x + a.left + 0.75 * a.width, r.y + a.top + 0.5 * "
      "a.height].map(Math.round);");
  browser_.Drag(area[0], area[1], area[0], area[1]);
  EXPECT_NEAR(Ask("return Number(find('time').value);").get<double>(), 0.75 * kEnd, 0.02 * kEnd);
}

TEST_F(ReplayBrowserTest, PlaysTurnsHidesAndFits) {
  Ask("document.documentElement.style.scrollBehavior = 'auto'; box.scrollIntoView(); find('play').click();");
  ASSERT_TRUE(browser_.WaitFor("return runClock.time > 0.1;"));
  const double stopped = Ask("find('play').click(); return runClock.time;");
  EXPECT_EQ(Ask("return [find('play').textContent, runClock.time];"), nlohmann::json({"Play", stopped}));
  // Dragging turns the camera about what it looks at.
  const std::string ask_camera =
      "r.draw(); return [...r.camera.position.toArray(), r.camera.position.distanceTo(r.controls.target)];";
  const nlohmann::json before = Ask(ask_camera);
  const nlohmann::json middle =
      Ask("const v = box.querySelector('.view').getBoundingClientRect();return [v.x + v.width / 2, v.y + "
          "v.height / 2].map(Math.round);");
  browser_.Drag(middle[0], middle[1], middle[0].get<int>() + 120, middle[1]);
  const nlohmann::json after = Ask(ask_camera);
  EXPECT_GT(std::abs(after[0].get<double>() - before[0].get<double>()), 0.1);
  EXPECT_NEAR(after[3].get<double>(), before[3].get<double>(), 1e-6);
  // The ghost is where the object should be, and can be hidden; arrows and cones stand at the contacts.
  EXPECT_NEAR(Ask("const lag = r.bones.map(b => r.groups.ghost.position.clone().sub(b.position)).filter(d => "
                  "Math.hypot(d.y, d.z) < 1e-6); return Math.min(...lag.map(d => d.x));")
                  .get<double>(),
              kReplayLag, kFloatTolerance);
  EXPECT_EQ(Ask("return r.groups.forces.children.filter(c => c.visible).length;"), 8);
  EXPECT_EQ(Ask("find('ghost').click(); return r.groups.ghost.visible;"), false);

  for (const int width : {360, 390, 641, 768, 850, 1024, 1920, 2560}) {
    browser_.SetViewport(width, 420, width < 500);
    (void)browser_.WaitFor("return document.documentElement.scrollWidth <= innerWidth;", 2.0);
    const nlohmann::json place = browser_.Run(
        "for (const d of document.querySelectorAll('details')) d.open = true;const v = "
        "document.querySelector('#replay .view').getBoundingClientRect();return {overflow: "
        "document.documentElement.scrollWidth - innerWidth, width: v.width, height: v.height};");
    EXPECT_LE(place["overflow"], 0) << width;
    EXPECT_GT(place["width"], 0.75 * std::min(width, 1180)) << width;
    EXPECT_LT(place["height"], 0.7 * 420) << width;
  }
  browser_.SetViewport(900, 420);
  EXPECT_GT(browser_.WorkControls(), 10);
  EXPECT_THAT(browser_.TakeConsole(), IsEmpty());
}

}  // namespace
}  // namespace dexcheck::testing::replay_browser_test
