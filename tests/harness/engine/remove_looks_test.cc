// A model without looks moves as the one that is drawn, bit for bit.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "harness/engine/compiled_model.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::remove_looks_test {
namespace {

/// Whether two arrays have the same bits.
::testing::AssertionResult SameBits(const char* name, const mjtNum* a, const mjtNum* b, EngineSize count) {
  for (int i = 0; i < count; ++i) {
    if (std::memcmp(a + i, b + i, sizeof(mjtNum)) != 0)
      return ::testing::AssertionFailure() << name << "[" << i << "]: " << a[i] << " against " << b[i];
  }
  return ::testing::AssertionSuccess();
}

class SameMotion : public ::testing::TestWithParam<const char*> {};

TEST_P(SameMotion, WithAndWithoutLooks) {
  const MjModelPtr full = LoadMjcf(testing::SourcePath(GetParam()));
  MjModelPtr bare(mj_copyModel(nullptr, full.get()));
  const int removed = RemoveLooks(&bare);
  EXPECT_GT(removed, 10);
  EXPECT_EQ(bare->ngeom + removed, full->ngeom);
  EXPECT_EQ(RemoveLooks(&bare), 0) << "nothing is left to remove";
  const size_t pictures = RemovePictures(&bare);
  EXPECT_GE(pictures, static_cast<size_t>(full->ntexdata));
  EXPECT_EQ(pictures > 0, full->ntex > 0);
  EXPECT_EQ(RemovePictures(&bare), 0U) << "likewise";
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

INSTANTIATE_TEST_SUITE_P(Scenes, SameMotion, ::testing::Values("/mjcf/scene.xml", "/mjcf/panda.xml"));

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

// What follows the array of the materials, which has no rows, stays as it is.
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

}  // namespace
}  // namespace dexcheck::testing::remove_looks_test
