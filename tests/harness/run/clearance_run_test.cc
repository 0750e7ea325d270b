// Bodies that are not meant to touch, in runs: found when they overlap, clear in shipped scenarios, pushing
// when asked to.

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <tuple>

#include "harness/engine/mujoco_release.h"
#include "tests/common/matchers.h"
#include "tests/common/refused_text.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::clearance_run_test {
namespace {

const std::string kRobot = SourcePath("/controller/parameters/assistant_robot.toml");

/// Which geoms of the palm collide with the bench by their masks.
enum class Masks { kNone, kShape, kLooks };

/// Lets a geom and the palm's box, which are what stands for their bodies, or the palm's shell, which is only
/// seen, collide by their masks, and no others.
void CollideByMasks(int top, Masks masks, mjModel* m) {
  LetBothCollide(m);
  const Solids solids = ListSolids(*m);
  const int palm = mj_name2id(m, mjOBJ_BODY, "r_palm");
  for (int geom = 0; geom < m->ngeom; ++geom) {
    const bool is_shape = std::any_of(solids.list.begin(), solids.list.end(),
                                      [&](const Solid& solid) { return solid.geom == geom; });
    const bool is_of_palm = m->geom_bodyid[geom] == palm && is_shape == (masks == Masks::kShape);
    m->geom_contype[geom] = m->geom_conaffinity[geom] = geom == top || is_of_palm ? 1 : 0;
  }
}

/// `hold` beside a bench that is a cube of 4 cm, which is as deep in the right palm as asked, from below.
class HoldAtATable {
 public:
  explicit HoldAtATable(double depth, std::vector<std::string> overrides = {}, Masks masks = Masks::kNone) {
    overrides.insert(overrides.end(), {"duration=0.02", "settle=0.2"});
    const Scenario scenario = ReadShippedScenario("hold", overrides);
    const std::string mjcf = SourcePath("/mjcf/bench_scene.xml");
    MjModelPtr engine = LoadMjcf(mjcf);
    const int bench = mj_name2id(engine.get(), mjOBJ_BODY, "bench");
    const int top = mj_name2id(engine.get(), mjOBJ_GEOM, "bench_top");
    const Pose X_WP = FindPalm();
    // The palm's box is 24 mm thick about 38 mm along its fingers, which is its frame's z; its wide side is
    // below while the hand is level.
    for (int i = 0; i < engine->body_geomnum[bench]; ++i) {
      const int geom = engine->body_geomadr[bench] + i;
      mju_zero3(engine->geom_pos + 3 * geom);
      engine->geom_size[3 * geom] = engine->geom_size[3 * geom + 1] = engine->geom_size[3 * geom + 2] =
          geom == top ? kHalf : 1e-3;
    }
    const Vector3d middle = X_WP * Vector3d(0.0, 0.0, -0.038);
    // Along the palm's side that points to the robot's right.
    const Vector3d side = X_WP.linear().col(1);
    const Vector3d place = middle + (0.042 + kHalf - depth) * side;
    std::copy_n(place.data(), 3, engine->body_pos + 3 * bench);
    const Eigen::Quaterniond turn(X_WP.linear());
    const double quaternion[4] = {turn.w(), turn.x(), turn.y(), turn.z()};
    std::copy_n(quaternion, 4, engine->body_quat + 4 * bench);
    if (masks != Masks::kNone) CollideByMasks(top, masks, engine.get());
    setup_ = std::make_unique<dexcheck::Setup>(scenario, kRobot, mjcf, std::move(engine));
    runner_ = std::make_unique<Runner>(*setup_, /*check=*/true);
    result_ = &runner_->Run([](const StepRecord&) {}, [] { return false; });
  }

  [[nodiscard]] const RunResult& result() const { return *result_; }
  [[nodiscard]] const RunChecks& checks() const { return runner_->loop().checks(); }
  [[nodiscard]] nlohmann::ordered_json summary() const {
    return MakeSummary(*setup_, runner_->loop(), *result_);
  }

 private:
  static constexpr double kHalf = 0.02;  // m

  /// Returns the pose of the palm's body while the object is held.
  static Pose FindPalm() {
    const ShippedRun run("hold");
    const mjModel& m = run.setup().engine();
    const MjDataPtr data = MakeData(m);
    run.setup().adapter().SetPositions(run.setup().start().q, data->qpos);
    mj_kinematics(&m, data.get());
    const int palm = mj_name2id(&m, mjOBJ_BODY, "r_palm");
    Pose X = Pose::Identity();
    X.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data->xmat + 9 * palm);
    X.translation() = Eigen::Map<const Vector3d>(data->xpos + 3 * palm);
    return X;
  }

  std::unique_ptr<dexcheck::Setup> setup_;
  std::unique_ptr<Runner> runner_;
  const RunResult* result_ = nullptr;
};

TEST(ClearanceOfARun, APalmInTheTableIsFound) {
  const HoldAtATable run(0.005);
  EXPECT_EQ(run.result().verdict, Verdict::kDisagreement) << run.result().failure;
  EXPECT_EQ(run.result().attribution.cause, Cause::kCollision) << run.result().attribution.evidence;
  EXPECT_THAT(run.result().attribution.evidence, HasSubstr("r_palm"));
  EXPECT_THAT(run.result().attribution.evidence, HasSubstr("bench"));
  EXPECT_THAT(run.result().attribution.evidence, HasSubstr("t = 0 s"));
  EXPECT_NEAR(run.checks().Find("clearance").worst, 0.005, 1e-4);
  // Before the run, too.
  const std::span<const CheckRecord> settling = run.checks().settling_failures();
  EXPECT_TRUE(std::any_of(settling.begin(), settling.end(),
                          [](const CheckRecord& check) { return check.name == "clearance"; }));
  // It passes through, and pushes nothing.
  EXPECT_FALSE(run.checks().Has("collision"));
  EXPECT_FALSE(run.checks().Find("inverse_dynamics_robot").failed);
  const auto there = run.summary()["clearance"]["robot_surroundings"];
  EXPECT_NEAR(there["smallest_m"].get<double>(), -0.005, 1e-4);
  EXPECT_THAT(there["bodies"].get<std::string>(), HasSubstr("r_palm"));
}

TEST(ClearanceOfARun, ATableBesideThePalmIsNot) {
  const HoldAtATable run(-0.001);
  EXPECT_TRUE(Passes(run.result()));
  EXPECT_NEAR(run.checks().clearance().nearest(PairClass::kRobotSurroundings).distance, 0.001, 1e-4);
  EXPECT_EQ(run.checks().Find("clearance").worst, 0.0);
}

TEST(ClearanceOfARun, WhatMayTouchIsNotTold) {
  const HoldAtATable run(0.005, {"plant.allowed_collision_pairs=[['r_palm', 'bench']]"});
  EXPECT_TRUE(Passes(run.result()));
}

TEST(ClearanceOfARun, BodiesThatCollidePush) {
  const auto find = [](const HoldAtATable& run) {
    return run.checks().clearance().nearest(PairClass::kRobotSurroundings).distance;
  };
  // While everything settles the table pushes the palm out, or does not.
  EXPECT_LT(find(HoldAtATable(1e-4)), -9e-5);
  EXPECT_GT(find(HoldAtATable(1e-4, {"plant.collide=true"})), -2e-5);
  // With the table out of reach, the same plant is the plant that it was.
  const HoldAtATable apart(-0.01, {"plant.collide=true"});
  EXPECT_TRUE(Passes(apart.result()));
  EXPECT_EQ(apart.checks().Find("collision").count, 20);
}

// MJCFs of others let bodies push by their masks, whatever the scenario says: the run knows that they do, and
// explains nothing by other forces.
TEST(ClearanceOfARun, BodiesThatCollideByTheirMasksPush) {
  for (const Masks masks : {Masks::kShape, Masks::kLooks}) {
    const HoldAtATable run(5e-3, {}, masks);
    EXPECT_TRUE(run.checks().Find("collision").failed);
    EXPECT_EQ(run.checks().Find("collision").part, "r_palm and bench");
    EXPECT_EQ(run.result().attribution.cause, Cause::kCollision) << run.result().attribution.evidence;
    for (const Explanation& one : run.result().causes)
      EXPECT_NE(one.channel, CauseChannel::kBalance) << one.Describe();
  }
}

// A ball that lies on the floor, beside an arm that rests: with their declared contact taken away the ball
// falls through, or, when bodies collide, pushes by its weight.
TEST(ClearanceOfARun, ABodyAtRestPushesByItsWeight) {
  constexpr double kTolerance = 1e-6;  // of the weight
  const auto run = [](const std::string& collide) {
    const Scenario scenario = ParseScenario(
        "name = 'rest'\nduration = 0.05\nsettle = 0.2\nstart = 'rest'\nplant.collide = " + collide +
            "\n[joint_motion]\nstart_deg = { panda_joint4 = -90, panda_joint6 = 90, h4_1 = 30 }\n[control]\n"
            "natural_frequency = 20\ndamping_ratio = 1\n",
        "rest.toml", SourcePath(), {});
    const std::string mjcf = SourcePath("/mjcf/panda_hand_scene.xml");
    MjModelPtr engine = LoadMjcf(mjcf);
    const auto geom = [&](const char* name) { return mj_name2id(engine.get(), mjOBJ_GEOM, name); };
    const int tip = geom("h1_tip_geom");
    bool is_found = false;
    for (int i = 0; i < engine->npair; ++i) {
      if (engine->pair_geom1[i] != geom("floor") && engine->pair_geom2[i] != geom("floor")) continue;
      is_found = true;
      engine->pair_geom1[i] = geom("floor");
      engine->pair_geom2[i] = tip;
      engine->pair_signature[i] = ((engine->geom_bodyid[tip] + 1) << 16) + 1;
    }
    EXPECT_TRUE(is_found);
    const dexcheck::Setup setup(scenario, SourcePath("/controller/parameters/panda_hand.toml"), mjcf,
                                std::move(engine));
    Runner runner(setup, /*check=*/true);
    runner.Run([](const StepRecord&) {}, [] { return false; });
    const Collision collision = runner.loop().record().response.collision;
    const RunChecks& checks = runner.loop().checks();
    const CheckRecord check = checks.Has("collision") ? checks.Find("collision") : CheckRecord{};
    const double fallen = -runner.loop().record().reading.state.X_Bo.translation().z();
    return std::tuple(collision.force, check, fallen);
  };
  const auto [force, check, fallen] = run("true");
  const double weight = 0.15 * 9.81;
  EXPECT_NEAR(force, weight, kTolerance * weight);
  EXPECT_EQ(check.count, 50);
  EXPECT_TRUE(check.failed);
  EXPECT_NEAR(fallen, -0.035, 1e-5);
  const auto [none, unasked, through] = run("false");
  EXPECT_EQ(none, 0.0);
  EXPECT_TRUE(unasked.name.empty());
  EXPECT_GT(through, 0.1);
}

TEST(ClearanceOfARun, UnknownBodiesAreRefused) {
  EXPECT_TRUE(
      IsRefused([] { return HoldAtATable(0.0, {"plant.allowed_collision_pairs=[['r_plam', 'bench']]"}); },
                {"plant.allowed_collision_pairs: \"r_plam\" is no body"}));
  EXPECT_THROW(ReadShippedScenario("hold", {"plant.allowed_collision_pairs=[['r_palm']]"}), InputError);
  EXPECT_THROW(ReadShippedScenario("hold", {"plant={ type = 'rigid', collide = true }"}), InputError);
}

TEST(ClearanceOfARun, ShippedScenariosKeepTheirBodiesApart) {
  for (const char* scenario : {"hold", "two-hands", "hand-hold", "panda-reach", "paper-rigid"}) {
    SCOPED_TRACE(scenario);
    ShippedRun run(scenario, {"duration=0.02", "settle=0.2"});
    const RunResult& result = run.Run();
    const Clearance& clearance = run.loop().checks().clearance();
    EXPECT_GT(run.loop().checks().Find("clearance").count, 0);
    for (int i = 0; i < kPairClassCount; ++i) {
      const Clearance::Nearest& nearest = clearance.nearest(static_cast<PairClass>(i));
      if (nearest.pair < 0) continue;
      EXPECT_GT(nearest.distance, 0.0)
          << NameOf(static_cast<PairClass>(i)) << ": " << clearance.Describe(nearest.pair);
    }
    EXPECT_TRUE(result.failure.empty()) << result.failure;
  }
}

}  // namespace
}  // namespace dexcheck::testing::clearance_run_test
