// Data of the replay in a run's page.

#include "harness/report/replay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "harness/report/page_frame.h"
#include "tests/harness/report/replay_run.h"

namespace dexcheck::testing::replay_test {
namespace {

constexpr size_t kMostBytes = 3'000'000;  // that the replay of 10 s may add to a page

TEST(MakeReplayData, AddsAtMostThreeMegabytesForTenSeconds) {
  const MjModelPtr model = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const ReplayData replay = MakeReplayData(*model, MakeReplayRun(*model, 10.0, 0.001));
  const size_t size = EmbedJson("", replay.json).size() + EmbedBytes("", replay.values).size() +
                      std::string(kThreeJs).size() + std::string(kReplayJs).size();
  RecordProperty("bytes", static_cast<int>(size));
  EXPECT_LT(size, kMostBytes);
  EXPECT_EQ(replay.json.at("times").size(), kMostReplayFrames);
}

TEST(MakeReplayData, ShowsWhatTheEngineShows) {
  // One of the six geoms is in a hidden group and one is transparent; the bodies b and c are welded together.
  const MjModelPtr model = LoadMjcfText(R"(<mujoco>
    <asset><material name="red" rgba="1 0 0 1"/></asset>
    <worldbody>
      <geom type="plane" size="1 2 1"/>
      <body name="b"><freejoint/>
        <geom name="g" size="0.1" material="red"/>
        <geom size="0.1" group="3"/>
        <geom size="0.1" rgba="1 1 1 0"/>
        <body name="c" pos="0 0 0.5" euler="0 0 90"><geom type="box" size="0.1 0.2 0.3" pos="1 0 0" rgba="0 0 1 0.5"/></body>
      </body>
    </worldbody></mujoco>)",
                                        "test");
  RunFrames run;
  run.times = {0.0, 0.5, 1.0};
  run.qpos = RowMatrixXd::Zero(3, 7);
  run.qpos.col(3).setOnes();
  run.qpos(2, 0) = 3.0;
  const nlohmann::json scene = MakeReplayData(*model, run).json;
  EXPECT_EQ(scene["parts"], 2);
  EXPECT_EQ(scene["times"], nlohmann::json({0.0, 0.5, 1.0}));
  ASSERT_EQ(scene["shapes"].size(), 3U);
  EXPECT_EQ(scene["shapes"][0]["part"], 0);
  EXPECT_EQ(scene["shapes"][0]["type"], "plane");
  EXPECT_EQ(scene["shapes"][1]["part"], 1);
  EXPECT_EQ(scene["shapes"][1]["color"], nlohmann::json({1.0, 0.0, 0.0, 1.0}));
  EXPECT_EQ(scene["shapes"][2]["part"], 1);
  EXPECT_EQ(scene["shapes"][2]["type"], "box");
  // c is turned by a quarter turn, so that its x is b's y.
  EXPECT_EQ(scene["shapes"][2]["position"], nlohmann::json({0.0, 1.0, 0.5}));
  EXPECT_FALSE(scene.contains("contacts"));
  EXPECT_FALSE(scene.contains("object"));
}

/// A sphere of about 2 rings^2 faces.
TriangleMesh MakeSphere(int rings) {
  TriangleMesh mesh;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k < rings; ++k) {
      const double polar = kPi * i / rings;
      const double turn = 2.0 * kPi * k / rings;
      mesh.vertices.push_back({static_cast<float>(std::sin(polar) * std::cos(turn)),
                               static_cast<float>(std::sin(polar) * std::sin(turn)),
                               static_cast<float>(std::cos(polar))});
    }
  }
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < rings; ++k) {
      const int next = (k + 1) % rings;
      mesh.faces.push_back({rings * i + k, rings * (i + 1) + k, rings * (i + 1) + next});
      mesh.faces.push_back({rings * i + k, rings * (i + 1) + next, rings * i + next});
    }
  }
  return mesh;
}

TEST(SimplifyMesh, KeepsTheShapeWithFewFaces) {
  const TriangleMesh sphere = MakeSphere(200);
  const TriangleMesh coarse = SimplifyMesh(sphere, 5000);
  EXPECT_LE(coarse.faces.size(), 5000U);
  EXPECT_GT(coarse.faces.size(), 2000U);  // not coarser than a factor of 1.3 in each direction
  EXPECT_LT(coarse.vertices.size(), coarse.faces.size());
  // Means of points of a unit sphere in cells of 1/20 are less than 1 % below its surface.
  for (const auto& p : coarse.vertices) EXPECT_NEAR(std::hypot(p[0], p[1], p[2]), 1.0, 0.01);
  std::set<int> used;
  for (const auto& face : coarse.faces) used.insert(face.begin(), face.end());
  EXPECT_LT(*used.rbegin(), static_cast<int>(coarse.vertices.size()));
}

TEST(SimplifyMesh, LeavesAMeshThatIsSmallEnough) {
  const TriangleMesh sphere = MakeSphere(10);
  EXPECT_EQ(SimplifyMesh(sphere, 200).vertices, sphere.vertices);
  EXPECT_EQ(SimplifyMesh(sphere, 200).faces, sphere.faces);
}

}  // namespace
}  // namespace dexcheck::testing::replay_test
