// The shipped scenarios, at the accuracy that they promise.

#include <gtest/gtest.h>

#include <cmath>

#include "controller/object/so3.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::scenarios_test {
namespace {

// Rounding: the terms' own bounds are a hundred times smaller.
constexpr double kModelBound = 1e-10;

void ExpectModelAgrees(const ClosedLoop& loop) {
  ASSERT_GE(loop.checks().model_checks().size(), 20U);
  for (const CheckRecord& check : loop.checks().model_checks()) {
    // At each step, and now and then while everything settled.
    EXPECT_GE(check.count, loop.record().step) << check.name;
    EXPECT_LE(check.worst, kModelBound) << check.name;
    EXPECT_FALSE(check.failed) << check.name << " " << check.worst;
  }
}

void ExpectPass(const ShippedRun& run, const RunResult& result) {
  EXPECT_TRUE(Passes(result));
  EXPECT_EQ(run.step().step, run.loop().num_steps());
  EXPECT_EQ(run.step().findings.contacts_lost, 0);
  EXPECT_GT(run.step().findings.least_cone_margin, 0.0);
  ExpectModelAgrees(run.loop());
  // The fingers do push.
  EXPECT_GT(run.step().findings.f_c.cwiseAbs().maxCoeff(), 0.5);
}

void ExpectBondedPass(const ShippedRun& run, const RunResult& result) {
  EXPECT_TRUE(Passes(result));
  EXPECT_LE(result.tracking.position.max, 1e-6);
  EXPECT_LE(run.Worst("reduced_acceleration"), 1e-5);
  EXPECT_LE(run.Worst("contact_force"), 1e-6);
  EXPECT_LE(run.Worst("fingertip_slip"), 1e-5);  // measured 1.2e-6: the bonds' give
  EXPECT_FALSE(run.loop().checks().Has("penetration"));
  EXPECT_GT(run.step().findings.f_c.cwiseAbs().maxCoeff(), 0.5);
}

TEST(ShippedScenarios, PaperFollowsTheLine) {
  ShippedRun run("paper");
  const RunResult& result = run.Run();
  ExpectPass(run, result);
  EXPECT_LE(result.tracking.position.max, 1e-8);     // measured 8e-11
  EXPECT_LE(result.tracking.orientation.max, 1e-6);  // measured 6e-10
  EXPECT_LE(run.Worst("reduced_acceleration"), 1e-5);
  EXPECT_LE(run.Worst("contact_force"), 1e-6);
  EXPECT_LE(run.Worst("idle_joints"), 1e-5);
  const double way = run.step().reading.state.X_Bo.translation().x() - run.setup().start().X_o[0];
  EXPECT_NEAR(way, 10.0 - 1e-3, 1e-6);
}

TEST(ShippedScenarios, PaperRampEndsAtItsSpeed) {
  ShippedRun run("paper-ramp", {"duration=5"});
  const RunResult& result = run.Run();
  ExpectPass(run, result);
  EXPECT_LE(result.tracking.position.max, 1e-7);  // measured 7e-9
  EXPECT_NEAR(run.step().reading.state.xi[0], 1.0, 1e-4);
}

TEST(ShippedScenarios, PaperRigidFollowsTheLineToRounding) {
  ShippedRun run("paper-rigid", {"duration=1"});
  const RunResult& result = run.Run();
  ExpectPass(run, result);
  EXPECT_LE(result.tracking.position.max, 1e-11);    // measured 5e-13
  EXPECT_LE(result.tracking.orientation.max, 1e-9);  // measured 4e-11
  EXPECT_FALSE(run.loop().checks().Has("traction_use"));
  EXPECT_GT(run.loop().checks().Find("law_torque").count, 0);
}

// Another robot: fixed base, 23 joints, other names, a sphere.
TEST(ShippedScenarios, AHandOnThePandaHoldsTurnsAndCarriesABall) {
  for (const char* name : {"hand-hold", "hand-reorient", "hand-curve"}) {
    SCOPED_TRACE(name);
    ShippedRun run(name, {"duration=2", "settle=0.5"});
    const Pose start = run.setup().start().X_Bo;
    const RunResult& result = run.Run();
    ExpectPass(run, result);
    EXPECT_EQ(run.step().reading.state.q.size(), 23);
    EXPECT_LE(result.tracking.position.max, 1e-7);  // measured 5e-9
    EXPECT_LE(run.Worst("contact_force"), 1e-6);    // measured 2.3e-7
    const Pose& end = run.step().reading.state.X_Bo;
    const double turned = LogSo3(start.linear().transpose() * end.linear()).norm();
    const double moved = (end.translation() - start.translation()).norm();
    const std::string motion = name;
    EXPECT_EQ(turned > 0.01, motion != "hand-hold");
    EXPECT_EQ(moved > 0.01, motion == "hand-curve");
  }
}

// The remaining slip is the softness of contacts alone, where the object moves along and turns (w x v).
TEST(ShippedScenarios, SlipOfAMovedObjectGoesWithSoftness) {
  const auto slip = [](const std::string& impedance) {
    ShippedRun run("hand-curve", {"duration=1.5", "settle=0.5", "plant.time_step=0.002",
                                  "plant.contact_impedance=" + impedance});
    const RunResult& result = run.Run();
    EXPECT_TRUE(Passes(result));
    return Eigen::Vector2d(run.Worst("fingertip_slip"), run.Worst("fingertip_slip_rate"));
  };
  const Eigen::Vector2d ratio = slip("0.99").cwiseQuotient(slip("0.999"));
  EXPECT_NEAR(ratio[0], 10.0, 0.5);
  EXPECT_NEAR(ratio[1], 10.0, 0.5);
}

TEST(ShippedScenarios, CurveTurnsWithItsPath) {
  ShippedRun run("curve");
  double largest_turn = 0.0;
  const RunResult& result =
      run.Run([&] { largest_turn = std::max(largest_turn, std::abs(run.step().reading.state.q[2])); });
  ExpectPass(run, result);
  EXPECT_GT(largest_turn, 0.1);
  EXPECT_LE(result.tracking.position.max, 1e-6);     // measured 3e-9
  EXPECT_LE(result.tracking.orientation.max, 1e-5);  // measured 3e-8
  EXPECT_LE(run.Worst("reduced_acceleration"), 1e-5);
  EXPECT_LE(run.Worst("contact_force"), 1e-6);
  EXPECT_LE(run.Worst("fingertip_slip"), 2e-4);
  EXPECT_LE(run.Worst("wheel_slip"), 1e-3);
}

TEST(ShippedScenarios, ReorientRollsTheObjectInPlace) {
  ShippedRun run("reorient", {"duration=4"});
  std::vector<Vector5d> first;
  double rolled = 0.0;
  double platform = 0.0;
  const RunResult& result = run.Run([&] {
    const MeasuredState& state = run.step().reading.state;
    for (size_t i = 0; i < state.kappa.size(); ++i) {
      if (first.size() <= i) first.push_back(state.kappa[i].CalcVector());
      rolled = std::max(rolled, std::abs(state.kappa[i].alpha_o.u - first[i][2]));
    }
    platform = std::max(platform, state.q.head<3>().norm());
  });
  ExpectPass(run, result);
  EXPECT_GT(rolled, 0.03);    // rad around the torus
  EXPECT_LT(platform, 1e-4);  // measured 3e-6
  EXPECT_LE(result.tracking.position.max, 1e-6);
}

TEST(ShippedScenarios, PaperRestSpinsTheWheels) {
  ShippedRun run("paper-rest", {"duration=4"});
  const RunResult& result = run.Run();
  EXPECT_EQ(result.verdict, Verdict::kDisagreement) << result.failure;
  EXPECT_EQ(result.attribution.cause, Cause::kWheelSlip) << result.attribution.evidence;
  EXPECT_GT(run.Worst("wheel_slip"), 5e-3);
  ExpectModelAgrees(run.loop());
}

// J_B_dot' counts where the object turns against the fingertips about the bonds.
TEST(ShippedScenarios, BondedFingertipsNeitherSlipNorRoll) {
  ShippedRun straight("bonded", {"duration=3"});
  ExpectBondedPass(straight, straight.Run());
  EXPECT_GT(straight.step().reading.state.q[0], 0.1);
  ShippedRun turning("reorient", {"duration=2.5", "plant.bonded=true"});
  double turned = 0.0;
  const double start = turning.setup().start().X_o[5];
  ExpectBondedPass(
      turning, turning.Run([&] { turned = std::max(turned, std::abs(CalcX_o(turning.step())[5] - start)); }));
  EXPECT_GT(turned, 0.1);
}

/// Angle of the object's axis against the vertical, rad.
double CalcLean(const Pose& X_Bo) { return std::acos(X_Bo.linear()(2, 2)); }

// Eight contacts: the ring is raised by 0.12 m, tilted by 30 degrees about a horizontal axis, and turns.
TEST(ShippedScenarios, TwoHandsRaiseTiltAndTurn) {
  ShippedRun run("two-hands");
  const RunResult& result = run.Run();
  ExpectPass(run, result);
  const GraspTerms& grasp = run.step().model->grasp();
  EXPECT_EQ(grasp.G().cols(), 24);
  EXPECT_EQ(grasp.J_B().rows(), 24);
  EXPECT_EQ(grasp.J_B().cols(), 50);
  // All eight push.
  for (Eigen::Index i = 2; i < 24; i += 3) EXPECT_GT(run.step().findings.f_c[i], 0.5) << i;

  const Pose& start = run.setup().start().X_Bo;
  const Pose& end = run.step().reading.state.X_Bo;
  EXPECT_NEAR(end.translation().z() - start.translation().z(), 0.12, 1e-6);
  EXPECT_NEAR(CalcLean(end) - CalcLean(start), DegToRad(30.0), 1e-6);
  // Turn and tilt, both about axes that the tilt's does not leave the horizontal plane with.
  const double turn = run.step().command.desired.X_d[3] - run.setup().start().X_o[3];
  EXPECT_LT(turn, -0.7);
  EXPECT_LT(run.step().reading.state.q[2], -0.6);  // so does the platform
  const Matrix3d R = end.linear() * start.linear().transpose();
  const Vector3d tilt = LogSo3(R * Eigen::AngleAxisd(-turn, Vector3d::UnitZ()).toRotationMatrix());
  EXPECT_NEAR(tilt.z(), 0.0, 1e-6);
  EXPECT_NEAR(tilt.norm(), DegToRad(30.0), 1e-6);
  EXPECT_LE(result.tracking.position.max, 1e-6);
  EXPECT_LE(result.tracking.orientation.max, 1e-5);
}

TEST(ShippedScenarios, OtherGraspsPassToo) {
  for (const char* scenario : {"curve", "two-hands"}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      SCOPED_TRACE(std::string(scenario) + ", seed " + std::to_string(seed));
      ShippedRun run(scenario, {"duration=1"}, seed);
      EXPECT_TRUE(Passes(run.Run()));
      EXPECT_NE(run.setup().start().q, ShippedRun(scenario).setup().start().q);
    }
  }
}

}  // namespace
}  // namespace dexcheck::testing::scenarios_test
