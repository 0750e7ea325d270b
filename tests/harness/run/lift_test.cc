// The task: take the torus from the bench, carry it, put it down.

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/common/allocation_counter.h"
#include "tests/common/refused_text.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::lift_test {
namespace {

std::vector<std::string> ListPhases(const PickAndPlace& task) {
  std::vector<std::string> phases;
  for (const PhaseEntry& entry : task.history()) phases.emplace_back(NameOf(entry.phase));
  return phases;
}

const std::vector<std::string> kWholeTask = {"approach",  "close",   "grip",     "take over", "carry",
                                             "hand over", "release", "withdraw", "done"};

// The shipped task takes 1 ms a step; it succeeds and fails in the same way with half as many.
const std::string kCoarse = "plant.time_step=0.002";

class LiftTest : public ::testing::Test {
 protected:
  const RunResult& LiftCoarsely(std::vector<std::string> overrides, std::uint64_t seed = 0) {
    overrides.push_back(kCoarse);
    return Lift(overrides, seed);
  }
  /// Runs with highest place of the object and largest support force while it is carried.
  const RunResult& Lift(const std::vector<std::string>& overrides, std::uint64_t seed = 0) {
    run_ = std::make_unique<ShippedRun>("lift", overrides, seed);
    start_ = run_->setup().start().X_Bo.translation();
    return run_->Run([&] {
      const ClosedLoop& loop = run_->loop();
      highest_ = std::max(highest_, loop.record().reading.state.X_Bo.translation().z());
      const bool apart =
          std::all_of(loop.record().reading.state.overlap.begin(), loop.record().reading.state.overlap.end(),
                      [](double depth) { return depth < 0.0; });
      if (loop.task()->task().phase() == Phase::kApproach && !apart) touched_early_ = true;
    });
  }

  [[nodiscard]] const PickAndPlace& task() const { return run_->loop().task()->task(); }
  [[nodiscard]] Vector3d Way() const { return run_->step().reading.state.X_Bo.translation() - start_; }

  std::unique_ptr<ShippedRun> run_;
  Vector3d start_ = Vector3d::Zero();
  double highest_ = 0.0;
  bool touched_early_ = false;
};

TEST_F(LiftTest, TakesCarriesAndPutsDown) {
  const RunResult& result = Lift({});
  EXPECT_TRUE(Passes(result));
  EXPECT_EQ(ListPhases(task()), kWholeTask);
  EXPECT_FALSE(touched_early_);
  // 0.15 m up and 1 m along, and it lies where it should.
  EXPECT_NEAR(highest_ - start_.z(), 0.15, 1e-4);
  EXPECT_NEAR(Way().x(), 1.0, 1e-4);
  EXPECT_NEAR(Way().tail<2>().norm(), 0.0, 1e-4);
  EXPECT_LE(result.tracking.position.max, 1e-4);  // measured 1.3e-7
  EXPECT_GT(result.tracking.position.max, 0.0);
  const ClosedLoop& loop = run_->loop();
  for (const CheckRecord& check : loop.checks().model_checks()) EXPECT_LE(check.worst, 1e-10) << check.name;
  // While the hand is far from the object nothing is said of contacts, but that is the smaller part.
  const auto count = [&](std::string_view name) {
    for (const CheckRecord& check : loop.checks().model_checks()) {
      if (check.name == name) return check.count;
    }
    return 0L;
  };
  EXPECT_GE(count("M_bar"), loop.record().step);
  EXPECT_GT(count("G"), loop.record().step / 2);
  EXPECT_LT(count("G"), loop.record().step);
  // Every step is judged, also where contacts come and go.
  EXPECT_EQ(loop.checks().Find("equations_of_motion").count, loop.record().step);
  // A check that has the name of another would hide it in the summary.
  std::set<std::string> names;
  for (const CheckRecord& record : run_->setup().constants().records)
    EXPECT_TRUE(names.insert(record.name).second) << record.name;
  for (const CheckRecord& check : loop.checks().model_checks())
    EXPECT_TRUE(names.insert(check.name).second) << check.name;
  for (const CheckRecord& check : loop.checks().motion_checks())
    EXPECT_TRUE(names.insert(check.name).second) << check.name;
  EXPECT_LE(task().push(), 1e-6);
  // Torques of some 50 N m; measured 3e-3.
  EXPECT_LE(loop.task()->torque_jump(), 0.02);
  EXPECT_GT(loop.task()->torque_jump(), 0.0);
}

TEST_F(LiftTest, WeighsAHeavierObjectAndLiftsIt) {
  // The torus is 30 % heavier than the model has it: lifted well, and the models disagree.
  const RunResult& result = LiftCoarsely({"model.object.mass=0.153846153846"});
  EXPECT_EQ(result.failure, "");
  EXPECT_EQ(ListPhases(task()), kWholeTask);
  EXPECT_NEAR(task().scale(), 1.3, 0.01);
  EXPECT_LE(result.tracking.position.max, 1e-4);
  EXPECT_EQ(result.verdict, Verdict::kDisagreement);
  EXPECT_EQ(result.attribution.cause, Cause::kModel);
}

TEST_F(LiftTest, LiftsWithLessFrictionThanStated) {
  const RunResult& result = LiftCoarsely({"mismatch.friction=0.56"});
  EXPECT_TRUE(Passes(result));
  EXPECT_EQ(ListPhases(task()), kWholeTask);
  EXPECT_GT(run_->Worst("cone_use"), 0.7);
}

TEST_F(LiftTest, RefusesWhatIsTooHeavyAndLeavesItWhereItLies) {
  const RunResult& result = LiftCoarsely({"model.object.mass=0.1"});
  EXPECT_EQ(result.verdict, Verdict::kFailed);
  EXPECT_NE(result.failure.find("refused to lift: the object weighs more than 1.5 times"), std::string::npos)
      << result.failure;
  EXPECT_EQ(ListPhases(task()), (std::vector<std::string>{"approach", "close", "grip", "take over",
                                                          "hand over", "release", "withdraw", "done"}));
  EXPECT_LE(Way().norm(), 1e-4);
  EXPECT_LE(highest_ - start_.z(), 1e-4);
}

TEST_F(LiftTest, RefusesWhatItsFingersCannotHold) {
  const RunResult& result = LiftCoarsely({"control.f_max=1.2"});
  EXPECT_EQ(result.verdict, Verdict::kFailed);
  EXPECT_NE(result.failure.find("refused to lift: no contact forces inside the friction cones"),
            std::string::npos)
      << result.failure;
  EXPECT_LE(Way().norm(), 1e-4);
}

TEST_F(LiftTest, TriesAgainAndSaysWhichFingerMissed) {
  // The model's torus is thicker than the real one: the fingers close on air.
  const RunResult& result = LiftCoarsely({"model.object.tube_radius=0.016"});
  EXPECT_EQ(result.verdict, Verdict::kFailed);
  EXPECT_EQ(task().history().back().attempt, 2);
  EXPECT_NE(task().first_failure().find("found no object"), std::string::npos) << task().first_failure();
  EXPECT_NE(result.failure.find("_tip\" found no object where it should be, attempt 2 of 2"),
            std::string::npos)
      << result.failure;
  EXPECT_LE(Way().norm(), 5e-3);
}

TEST_F(LiftTest, LosesTheGraspWhereFrictionIsFarLessThanStated) {
  const RunResult& result = LiftCoarsely({"mismatch.friction=0.3"});
  EXPECT_EQ(result.verdict, Verdict::kFailed);
  EXPECT_TRUE(result.grasp_lost);
  EXPECT_EQ(result.attribution.cause, Cause::kFingertipSlip);
}

TEST_F(LiftTest, SucceedsFromOtherPlaces) {
  for (const std::uint64_t seed : {3U, 14U}) {
    SCOPED_TRACE(seed);
    const RunResult& result = LiftCoarsely({}, seed);
    EXPECT_TRUE(Passes(result));
    EXPECT_EQ(ListPhases(task()), kWholeTask);
    EXPECT_NEAR(Way().x(), 1.0, 1e-4);
    EXPECT_GT((start_ - Vector3d(0.25, -0.5, 0.631)).norm(), 1e-3);
  }
}

// Another robot: a fixed base, so that the arm carries the object, and fingers that do not stand around the
// palm. In haste and not far; the scenario takes 26 s.
TEST(HandLiftScenario, TheArmCarriesWhereNoPlatformDrives) {
  ShippedRun run("hand-lift", {"settle=0.1", "task.raise=0.03", "task.transport=[0, 0.05, 0]",
                               "task.approach_time=0.8", "task.lower_time=0.6", "task.close_time=0.3",
                               "task.search_speed=0.01", "task.grip_time=0.5", "task.take_over_time=0.6",
                               "task.raise_time=1", "task.arm_rate=0.5", "task.transport_time=1"});
  const Vector3d start = run.setup().start().X_Bo.translation();
  double highest = 0.0;
  const RunResult& result =
      run.Run([&] { highest = std::max(highest, run.loop().record().reading.state.X_Bo.translation().z()); });
  EXPECT_TRUE(Passes(result));
  const PickAndPlace& task = run.loop().task()->task();
  EXPECT_EQ(ListPhases(task), kWholeTask);
  EXPECT_NEAR(highest - start.z(), 0.03, 1e-4);
  const Vector3d way = run.step().reading.state.X_Bo.translation() - start;
  EXPECT_NEAR((way - Vector3d(0.0, 0.05, 0.0)).norm(), 0.0, 1e-4);
  EXPECT_LE(result.tracking.position.max, 1e-5);  // measured 2.5e-7
  EXPECT_GT(run.loop().checks().Find("fingertip_rim").count, 0);
  // The arm's way is planned from where it takes to where it puts down, and it comes back to where it began.
  const PickPlan& plan = task.plan();
  EXPECT_EQ(plan.along.size(), 23);
  EXPECT_GT((plan.landing.Evaluate(0.0) - plan.q_open).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LE((plan.rise.Evaluate(1.0) - plan.along.Evaluate(0.0)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LE((plan.landing.Evaluate(1.0) - plan.along.Evaluate(1.0)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LE((run.step().reading.state.q - run.setup().start().q).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(LiftScenario, AllocatesOnlyWherePhasesChange) {
  const ShippedRun run("lift", {kCoarse});
  ClosedLoop loop(run.setup(), /*check=*/false);
  loop.Settle();
  long allocating = 0;
  while (!loop.is_finished()) {
    const AllocationCounter counter;
    loop.Step();
    if (counter.count() > 0) ++allocating;
  }
  // Some of 12 000 steps allocate: those that begin a phase or a movement, or see a set of contacts first.
  EXPECT_GT(allocating, 0);
  EXPECT_LT(allocating, 40);
}

TEST(LiftScenario, RefusesWhatDoesNotFitATask) {
  for (const auto& [override, part] :
       {std::pair("start=moving", "start: must be \"rest\""),
        {"control.orientation=angles", "control.orientation: must be \"rotation\""},
        {"plant.bonded=true", "plant.bonded"},
        {"plant.control_step=0.002", "plant.control_step"},
        {"task.attempts=0", "task.attempts"},
        {"task.raise=-1", "task.raise"},
        {"grasp.frame=nowhere", "grasp.frame"}})
    EXPECT_TRUE(IsRefused([key = override] { return ShippedRun("lift", {key}); }, {part}));
}

TEST(LiftScenario, SaysWhyThereIsNoPlan) {
  for (const auto& [scenario, override, part] :
       {std::tuple("lift", "task.xyz=[0.9, -0.5, 0.631]", "the arm does not reach"),
        {"lift", "task.arm_joints=[\"l_elbow\"]", "each must move frame r_palm_frame"},
        {"hand-lift", "task.transport=[0.6, 0, 0]", "the arm cannot go straight along"}}) {
    ShippedRun run(scenario, {override, "settle=0.1"});
    EXPECT_TRUE(IsRefused([&] { return run.Run(); }, {std::string(scenario) + ".toml: task: ", part}));
  }
}

}  // namespace
}  // namespace dexcheck::testing::lift_test
