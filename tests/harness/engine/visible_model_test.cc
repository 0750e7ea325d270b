// Robots without shapes are drawn as skeletons.

#include <gtest/gtest.h>

#include <string>

#include "controller/common/types.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_passes.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::visible_model_test {
namespace {

constexpr const char* kArm = R"(<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="upper" pos="0 0 0.5">
      <inertial pos="0 0 0.1" mass="1" diaginertia="0.1 0.1 0.1"/>
      <joint name="shoulder" axis="0 1 0"/>
      <body name="fore" pos="0.3 0 0.2" euler="20 0 0">
        <inertial pos="0 0 0.1" mass="1" diaginertia="0.1 0.1 0.1"/>
        <joint name="elbow" axis="0 1 0"/>
        <site name="tool" pos="0 0.05 0.4"/>
      </body>
    </body>
    <body name="stone" pos="1 0 0"><freejoint/>
      <inertial pos="0.02 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
    </body>
  </worldbody>
</mujoco>)";

MjModelPtr LoadVisibleText(const std::string& text) {
  MjcfFile mjcf(text, "arm");
  return LoadVisible(&mjcf);
}

/// The two ends of a capsule, world, m.
std::pair<Vector3d, Vector3d> EndsOf(const mjModel& model, const mjData& data, int geom) {
  const Vector3d middle(data.geom_xpos + 3 * geom);
  const mjtNum* R = data.geom_xmat + 9 * geom;
  const Vector3d half = model.geom_size[3 * geom + 1] * Vector3d(R[2], R[5], R[8]);
  return {middle - half, middle + half};
}

TEST(Skeleton, JoinsBodiesOfARobotWithoutShapes) {
  const MjModelPtr plain = LoadMjcfText(kArm, "arm");
  const MjModelPtr model = LoadVisibleText(kArm);
  ASSERT_EQ(model->nbody, plain->nbody);
  ASSERT_EQ(model->nq, plain->nq);
  // A ball at each joint, and of the stone; rods to the forearm, to the tool and to the forearm's mass.
  ASSERT_EQ(model->ngeom, plain->ngeom + 6);
  EXPECT_EQ(mj_name2id(model.get(), mjOBJ_GEOM, "floor"), 0);
  const MjDataPtr data = MakeData(*model);
  data->qpos[0] = 0.3;
  data->qpos[1] = -0.7;
  mj_kinematics(model.get(), data.get());
  const auto body = [&](const char* name) { return mj_name2id(model.get(), mjOBJ_BODY, name); };
  const auto place = [&](const char* name) { return Vector3d(data->xpos + 3 * body(name)); };
  int to_forearm = 0;
  int to_tool = 0;
  for (int geom = static_cast<int>(plain->ngeom); geom < model->ngeom; ++geom) {
    EXPECT_EQ(model->geom_contype[geom], 0);
    EXPECT_GT(model->geom_rbound[geom], 0.0);
    if (model->geom_type[geom] != mjGEOM_CAPSULE) continue;
    const auto [from, to] = EndsOf(*model, *data, geom);
    to_forearm += (from - place("upper")).norm() < 1e-12 && (to - place("fore")).norm() < 1e-12 ? 1 : 0;
    const Vector3d tool(data->site_xpos);
    to_tool += (from - place("fore")).norm() < 1e-12 && (to - tool).norm() < 1e-12 ? 1 : 0;
  }
  EXPECT_EQ(to_forearm, 1);
  EXPECT_EQ(to_tool, 1);
  EXPECT_EQ(model->body_geomnum[body("stone")], 1);
  for (int body = 1; body < model->nbody; ++body) EXPECT_EQ(model->body_mass[body], plain->body_mass[body]);
}

TEST(Skeleton, IsOfNoMassWhereInertiasAreFromShapes) {
  const std::string head = "<mujoco>";
  const MjModelPtr model =
      LoadVisibleText(ReplaceOnce(kArm, head, head + R"(<compiler inertiafromgeom="true"/>)"));
  EXPECT_EQ(model->ngeom, 7);
  EXPECT_EQ(model->body_mass[1], 1.0);
}

TEST(Skeleton, LeavesARobotWithShapesAlone) {
  const MjModelPtr plain = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  MjcfFile scene(std::filesystem::path(SourcePath("/mjcf/scene.xml")));
  const MjModelPtr model = LoadVisible(&scene);
  ASSERT_EQ(model->ngeom, plain->ngeom);
  for (int geom = 0; geom < model->ngeom; ++geom) EXPECT_EQ(model->geom_group[geom], plain->geom_group[geom]);
}

// A lamp over one place leaves the floor dark; what shines everywhere is as its author wants it.
TEST(Skeleton, BrightensWhatLampsLeaveDark) {
  const std::string world = "<worldbody>";
  const auto ambient = [&](const std::string& light) {
    return LoadVisibleText(ReplaceOnce(kArm, world, world + light))->vis.headlight.ambient[0];
  };
  EXPECT_GT(ambient(""), 0.3);
  EXPECT_EQ(ambient(R"(<light pos="0 0 2"/>)"), ambient(""));
  EXPECT_LT(ambient(R"(<light pos="0 0 2"/><light pos="0 0 2" directional="true"/>)"), 0.2);
}

TEST(Skeleton, ShowsShapesThatAreAllHidden) {
  const std::string joint = R"(<joint name="elbow" axis="0 1 0"/>)";
  const MjModelPtr model =
      LoadVisibleText(ReplaceOnce(kArm, joint, joint + R"(<geom name="collides" size="0.1" group="3"/>)"));
  EXPECT_EQ(model->geom_group[mj_name2id(model.get(), mjOBJ_GEOM, "collides")], 0);
}

}  // namespace
}  // namespace dexcheck::testing::visible_model_test
