// Bodies that touch where nobody looks.

#include "harness/engine/clearance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "tests/common/allocation_counter.h"
#include "tests/common/paths.h"

namespace dexcheck {
namespace {

using testing::AllocationCounter;

/// A fixed arm of four links on a stand, a table, a ball.
constexpr const char* kScene = R"(<mujoco><compiler angle="radian"/><option collision="predefined"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="stand"><geom type="box" size="0.1 0.1 0.1" pos="0 0 0.1"/>
      <body name="a" pos="0 0 0.3"><joint name="ja" axis="0 1 0"/><geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/>
        <body name="b" pos="0.3 0 0"><joint name="jb" axis="0 1 0"/><geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/>
          <body name="c" pos="0.3 0 0"><joint name="jc" axis="0 1 0"/><geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0"/>
            <body name="d" pos="0.3 0 0"><joint name="jd" axis="0 1 0"/><geom name="tip" type="sphere" size="0.03"/></body>
          </body>
        </body>
      </body>
    </body>
    <body name="table" pos="1.5 0 0.05"><geom type="box" size="0.2 0.2 0.05"/></body>
    <body name="ball" pos="0 1 0.5"><freejoint/><geom name="ball" size="0.05"/></body>
  </worldbody>
  <contact><pair geom1="tip" geom2="ball"/></contact></mujoco>)";

class ClearanceTest : public ::testing::Test {
 protected:
  ClearanceTest() : model_(LoadMjcfText(kScene, "scene")), data_(MakeData(*model_)), clearance_(*model_) {}

  const Overlap& Find() {
    mj_kinematics(model_.get(), data_.get());
    return clearance_.Find(data_->xpos, data_->xmat);
  }
  void Bend(double a, double b, double c, double d) {
    const double q[] = {a, b, c, d};
    std::copy_n(q, 4, data_->qpos);
  }
  void PlaceBall(double x, double y, double z) {
    const double p[] = {x, y, z};
    std::copy_n(p, 3, data_->qpos + 4);
  }
  [[nodiscard]] std::pair<std::string, std::string> Names(const Overlap& overlap) const {
    return {NameOf(*model_, mjOBJ_BODY, overlap.body1), NameOf(*model_, mjOBJ_BODY, overlap.body2)};
  }

  MjModelPtr model_;
  MjDataPtr data_;
  Clearance clearance_;
};

TEST_F(ClearanceTest, SaysNothingOfWhatIsApart) {
  EXPECT_GT(clearance_.num_pairs(), 8U);
  EXPECT_EQ(Find().depth, 0.0);
}

TEST_F(ClearanceTest, SeesALinkInTheFloor) {
  // Straight down from 0.3 m: the second link begins at the floor and goes through it.
  Bend(0.5 * kPi, 0.0, 0.0, 0.0);
  const Overlap& overlap = Find();
  EXPECT_EQ(Names(overlap).first, "world");
  EXPECT_NEAR(overlap.depth, 0.63, 1e-12);  // 0.9 m of links from 0.3 m, and their radius
}

TEST_F(ClearanceTest, SeesALinkInTheBallButNotTheTip) {
  PlaceBall(0.75, 0.0, 0.37);  // above link c, 70 mm from its axis
  Overlap overlap = Find();
  EXPECT_NEAR(overlap.depth, 0.01, 1e-12);
  EXPECT_EQ(Names(overlap), std::pair(std::string("c"), std::string("ball")));
  PlaceBall(0.97, 0.0, 0.3);  // in the tip, which the engine collides, 70 mm beyond link c
  EXPECT_EQ(Find().depth, 0.0);
}

TEST_F(ClearanceTest, SeesLinksThreeJointsApartAndNoNearerOnes) {
  Bend(0.0, kPi, 0.0, 0.0);  // b lies on a
  EXPECT_EQ(Find().depth, 0.0);
  Bend(0.0, 0.0, kPi, 0.0);  // c lies on b, and the tip comes to the end of a
  const Overlap& overlap = Find();
  EXPECT_EQ(Names(overlap), std::pair(std::string("a"), std::string("d")));
  EXPECT_NEAR(overlap.depth, 0.06, 1e-12);
}

/// Whatever the way there, an overlap is found at the step at which it is: against an instance that begins
/// anew.
TEST_F(ClearanceTest, WaitsForNothingThatTouches) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> rate(-0.02, 0.02);
  Bend(0.2, 0.4, 0.3, 0.1);
  int overlaps = 0;
  for (int i = 0; i < 3000; ++i) {
    for (int k = 0; k < 4; ++k) data_->qpos[k] += rate(random);
    for (int k = 4; k < 7; ++k) data_->qpos[k] += 0.1 * rate(random);
    const double found = Find().depth;
    if (i % 10 != 0) continue;
    Clearance fresh(*model_);
    const double expected = fresh.Find(data_->xpos, data_->xmat).depth;
    ASSERT_DOUBLE_EQ(found, expected) << i;
    overlaps += expected > 0.0 ? 1 : 0;
  }
  EXPECT_GT(overlaps, 20);
}

TEST_F(ClearanceTest, AllocatesNothing) {
  Find();
  const AllocationCounter counter;
  Bend(0.5 * kPi, 0.0, 0.0, 0.0);
  Find();
  EXPECT_EQ(counter.count(), 0);
}

TEST(ClearanceOfShippedRobot, SeesATorusOnAForearmAndTheHoleInIt) {
  const MjModelPtr model = LoadMjcf(testing::SourcePath("/mjcf/scene.xml"));
  const MjDataPtr data = MakeData(*model);
  Clearance clearance(*model);
  const int key = mj_name2id(model.get(), mjOBJ_KEY, "grasp_ready");
  mj_resetDataKeyframe(model.get(), data.get(), key);
  mj_kinematics(model.get(), data.get());
  EXPECT_EQ(clearance.Find(data->xpos, data->xmat).depth, 0.0);
  const int torus = mj_name2id(model.get(), mjOBJ_BODY, "torus");
  const int palm = mj_name2id(model.get(), mjOBJ_BODY, "r_palm");
  mju_copy3(data->qpos + model->jnt_qposadr[model->body_jntadr[torus]], data->xpos + 3 * palm);
  mj_kinematics(model.get(), data.get());
  const Overlap& overlap = clearance.Find(data->xpos, data->xmat);
  EXPECT_GT(overlap.depth, 1e-3);
  EXPECT_TRUE(overlap.body1 == torus || overlap.body2 == torus);
}

}  // namespace
}  // namespace dexcheck
