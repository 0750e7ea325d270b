// A model without looks moves as the one that is drawn, bit for bit; and what is drawn of a robot without
// shapes.

#include "harness/engine/compiled_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "controller/common/types.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::compiled_model_test {
namespace {

/// Whether two arrays have the same bits.
::testing::AssertionResult SameBits(const char* name, const mjtNum* a, const mjtNum* b, EngineSize count) {
  for (int i = 0; i < count; ++i) {
    if (std::memcmp(a + i, b + i, sizeof(mjtNum)) != 0)
      return ::testing::AssertionFailure() << name << "[" << i << "]: " << a[i] << " against " << b[i];
  }
  return ::testing::AssertionSuccess();
}

TEST(RemoveLooks, LeavesTheSameMotion) {
  for (const char* const scene : {"/mjcf/scene.xml", "/mjcf/panda.xml"}) {
    SCOPED_TRACE(scene);
    const MjModelPtr full = LoadMjcf(SourcePath(scene));
    MjModelPtr bare(mj_copyModel(nullptr, full.get()));
    const int removed = RemoveLooks(&bare);
    EXPECT_GT(removed, 10);
    EXPECT_EQ(bare->ngeom + removed, full->ngeom);
    EXPECT_EQ(RemoveLooks(&bare), 0) << "nothing is left to remove";
    const size_t pictures = RemovePictures(&bare);
    EXPECT_GE(pictures, static_cast<size_t>(full->ntexdata));
    EXPECT_EQ(pictures > 0, full->ntex > 0);
    EXPECT_EQ(RemovePictures(&bare), 0U);
    for (int i = 0; i < bare->nmat; ++i) EXPECT_EQ(bare->mat_texid[i], -1);
    const MjModelPtr copy(mj_copyModel(nullptr, bare.get()));  // as the plant does
    const MjDataPtr a = MakeData(*full);
    const MjDataPtr b = MakeData(*copy);
    const int key = mj_name2id(full.get(), mjOBJ_KEY, "grasp_ready");
    if (key >= 0) {
      mj_resetDataKeyframe(full.get(), a.get(), key);
      mj_resetDataKeyframe(copy.get(), b.get(), key);
    }
    int contacts = 0;
    constexpr int kSteps = 300;
    for (int step = 0; step < kSteps; ++step) {
      for (int i = 0; i < full->nu; ++i) a->ctrl[i] = b->ctrl[i] = 0.3 * std::sin(0.01 * step + i);
      mj_step(full.get(), a.get());
      mj_step(copy.get(), b.get());
      ASSERT_TRUE(SameBits("qpos", a->qpos, b->qpos, full->nq)) << "step " << step;
      ASSERT_TRUE(SameBits("qvel", a->qvel, b->qvel, full->nv)) << "step " << step;
      ASSERT_TRUE(SameBits("qacc", a->qacc, b->qacc, full->nv)) << "step " << step;
      ASSERT_EQ(a->ncon, b->ncon) << "step " << step;
      contacts += a->ncon;
      for (int i = 0; i < a->ncon; ++i) {
        EXPECT_EQ(NameOf(*full, mjOBJ_GEOM, a->contact[i].geom1),
                  NameOf(*copy, mjOBJ_GEOM, b->contact[i].geom1));
        ASSERT_TRUE(SameBits("contact", a->contact[i].pos, b->contact[i].pos, 3)) << "step " << step;
      }
    }
    if (key >= 0) EXPECT_GT(contacts, kSteps) << "without contacts this says little";
  }
}

// Each geom of a body that falls on a floor is used by something other than drawing, but for one.
TEST(RemoveLooks, KeepsWhatAnythingRefersTo) {
  MjModelPtr model = LoadMjcfText(R"(
    <mujoco>
      <default><geom contype="0" conaffinity="0" size="0.1"/></default>
      <worldbody>
        <geom name="floor" type="plane" size="5 5 1" conaffinity="1"/>
        <geom name="drawn_first"/>
        <body name="first">
          <freejoint/>
          <geom name="touches" contype="1"/>
          <geom name="drawn"/>
          <geom name="wrapped" type="cylinder" size="0.1 0.1"/>
          <site name="one"/>
        </body>
        <body name="only_drawn"><geom name="drawn_too" rgba="1 0 0 1"/></body>
        <body name="second" pos="0 0 1">
          <freejoint/>
          <geom name="in_pair" rgba="0 1 0 1"/>
          <geom name="sensed"/>
          <geom name="in_tuple"/>
          <geom name="in_fluid" fluidshape="ellipsoid"/>
          <site name="two"/>
        </body>
      </worldbody>
      <contact><pair geom1="in_pair" geom2="floor"/></contact>
      <tendon><spatial><site site="one"/><geom geom="wrapped"/><site site="two"/></spatial></tendon>
      <sensor><framepos objtype="geom" objname="sensed"/></sensor>
      <custom><tuple name="t"><element objtype="geom" objname="in_tuple"/></tuple></custom>
    </mujoco>)",
                                  "text");
  EXPECT_EQ(RemoveLooks(&model), 3);
  const auto id = [&](const char* name) { return mj_name2id(model.get(), mjOBJ_GEOM, name); };
  for (const char* name : {"drawn", "drawn_first", "drawn_too"}) EXPECT_EQ(id(name), -1) << name;
  for (const char* name : {"floor", "touches", "wrapped", "in_pair", "sensed", "in_tuple", "in_fluid"}) {
    EXPECT_GE(id(name), 0) << name;
  }
  EXPECT_EQ(model->sensor_objid[0], id("sensed"));
  EXPECT_EQ(model->tuple_objid[0], id("in_tuple"));
  EXPECT_EQ(model->wrap_objid[1], id("wrapped"));
  EXPECT_EQ(model->pair_geom1[0] + model->pair_geom2[0], id("in_pair") + id("floor"));
  EXPECT_EQ(model->geom_rgba[4 * id("in_pair") + 1], 1.0F) << "rows move with their geom";
  EXPECT_EQ(model->geom_type[id("wrapped")], mjGEOM_CYLINDER);
  const int second = mj_name2id(model.get(), mjOBJ_BODY, "second");
  EXPECT_EQ(model->body_geomadr[second], id("in_pair"));
  EXPECT_EQ(model->body_geomnum[second], 4);
  EXPECT_EQ(model->body_geomnum[mj_name2id(model.get(), mjOBJ_BODY, "only_drawn")], 0);
  const MjDataPtr data = MakeData(*model);
  int contacts = 0;
  for (int step = 0; step < 100; ++step) {
    mj_step(model.get(), data.get());
    contacts += data->ncon;
  }
  EXPECT_GT(contacts, 0);
}

// The arrays after that of the materials, which has no rows, stay as they are.
TEST(RemovePictures, OfAModelWithoutMaterialsLeavesItsMotors) {
  MjModelPtr model = LoadMjcfText(R"(
    <mujoco>
      <asset><texture type="skybox" builtin="gradient" width="8" height="48"/></asset>
      <worldbody><body><joint name="j"/><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/></body></worldbody>
      <actuator><motor joint="j"/></actuator>
    </mujoco>)",
                                  "text");
  ASSERT_EQ(model->nmat, 0);
  EXPECT_GT(RemovePictures(&model), 8U * 48U * 3U);
  EXPECT_EQ(model->actuator_trntype[0], mjTRN_JOINT);
  EXPECT_EQ(model->actuator_trnid[0], 0);
}

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

/// The two ends of a capsule, world, m.
std::pair<Vector3d, Vector3d> EndsOf(const mjModel& model, const mjData& data, int geom) {
  const Vector3d middle(data.geom_xpos + 3 * geom);
  const mjtNum* R = data.geom_xmat + 9 * geom;
  const Vector3d half = model.geom_size[3 * geom + 1] * Vector3d(R[2], R[5], R[8]);
  return {middle - half, middle + half};
}

TEST(Skeleton, JoinsBodiesOfARobotWithoutShapes) {
  const MjModelPtr plain = LoadMjcfText(kArm, "arm");
  const MjModelPtr model = MakeVisible(LoadMjcfText(kArm, "arm"));
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
    EXPECT_GE(geom, model->body_geomadr[model->geom_bodyid[geom]]);
    EXPECT_LT(geom,
              model->body_geomadr[model->geom_bodyid[geom]] + model->body_geomnum[model->geom_bodyid[geom]]);
    if (model->geom_type[geom] != mjGEOM_CAPSULE) continue;
    const auto [from, to] = EndsOf(*model, *data, geom);
    to_forearm += (from - place("upper")).norm() < 1e-12 && (to - place("fore")).norm() < 1e-12 ? 1 : 0;
    const Vector3d tool(data->site_xpos);
    to_tool += (from - place("fore")).norm() < 1e-12 && (to - tool).norm() < 1e-12 ? 1 : 0;
  }
  EXPECT_EQ(to_forearm, 1);
  EXPECT_EQ(to_tool, 1);
  EXPECT_EQ(model->body_geomnum[body("stone")], 1);
  mj_forward(model.get(), data.get());  // reads every array of geoms
  mj_step(model.get(), data.get());
}

TEST(Skeleton, LeavesARobotWithShapesAlone) {
  const MjModelPtr plain = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const MjModelPtr model = MakeVisible(LoadMjcf(SourcePath("/mjcf/scene.xml")));
  ASSERT_EQ(model->ngeom, plain->ngeom);
  for (int geom = 0; geom < model->ngeom; ++geom) EXPECT_EQ(model->geom_group[geom], plain->geom_group[geom]);
}

// A lamp over one place leaves the floor dark; what shines everywhere is as its author wants it.
TEST(Skeleton, BrightensWhatLampsLeaveDark) {
  const std::string world = "<worldbody>";
  const auto ambient = [&](const std::string& light) {
    return MakeVisible(LoadMjcfText(ReplaceOnce(kArm, world, world + light), "arm"))
        ->vis.headlight.ambient[0];
  };
  EXPECT_GT(ambient(""), 0.3);
  EXPECT_EQ(ambient(R"(<light pos="0 0 2"/>)"), ambient(""));
  EXPECT_LT(ambient(R"(<light pos="0 0 2"/><light pos="0 0 2" directional="true"/>)"), 0.2);
}

TEST(Skeleton, ShowsShapesThatAreAllHidden) {
  const std::string joint = R"(<joint name="elbow" axis="0 1 0"/>)";
  const MjModelPtr model = MakeVisible(LoadMjcfText(
      ReplaceOnce(kArm, joint, joint + R"(<geom name="collides" size="0.1" group="3"/>)"), "arm"));
  EXPECT_EQ(model->geom_group[mj_name2id(model.get(), mjOBJ_GEOM, "collides")], 0);
}

}  // namespace
}  // namespace dexcheck::testing::compiled_model_test
