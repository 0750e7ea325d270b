// Bounds follow from the plant's step and stiffness and from the gains, by the formulas that the document
// has.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "controller/control/actuation.h"
#include "controller/dynamics/tree_factor.h"
#include "harness/checks/check_table.h"
#include "harness/checks/contact_compliance.h"
#include "tests/common/matchers.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::bounds_test {
namespace {

TEST(Bounds, EachHasItsFormulaAndReasonInTheDocument) {
  const std::string document = ReadTextFile(SourcePath("/harness/README.md"));
  std::string table;
  for (const CheckInfo& info : ListChecks()) {
    ASSERT_NE(*info.bound.reason, '\0') << info.name;
    table +=
        "| `" + std::string(info.name) + "` | " + info.bound.Print() + " | " + info.bound.reason + " |\n";
  }
  EXPECT_THAT(document, HasSubstr("\n|---|---|---|\n" + table + "\n"));
}

TEST(Bounds, AreTheTablesForTheShippedPlant) {
  const Scenario scenario = ReadShippedScenario("hold");
  for (const CheckInfo& info : ListChecks())
    EXPECT_DOUBLE_EQ(CalcBound(info, scenario), info.bound.shipped) << info.name;
}

/// The bound in `hold` so changed over the shipped one.
double CalcRatio(const char* check, const std::vector<std::string>& overrides) {
  const CheckInfo& info = *FindCheck(check);
  return CalcBound(info, ReadShippedScenario("hold", overrides)) / info.bound.shipped;
}

TEST(Bounds, FollowStepStiffnessAndGains) {
  const auto expect = [](const char* check, const std::vector<std::string>& overrides, double ratio) {
    EXPECT_NEAR(CalcRatio(check, overrides), ratio, 1e-9 * ratio) << overrides[0];
  };
  const std::string step = "plant.time_step=0.002";
  const std::string soft = "plant.contact_impedance=0.9";
  const std::string slow = "plant.contact_time_constant=0.02";
  expect("penetration", {step}, 4.0);
  expect("penetration", {soft}, 10.0);
  // Softer than the step needs is no reason to forgive.
  expect("penetration", {slow}, 1.0);
  expect("base_tilt", {soft, step}, 40.0);
  expect("rolling", {soft, step}, 20.0);
  expect("fingertip_slip_rate", {soft, step}, 20.0);
  expect("fingertip_slip", {soft, step}, 20.0);
  expect("fingertip_slip_rate", {"plant.impratio=10"}, 1.0);
  expect("wheel_slip_rate", {soft, step}, 2.0);
  expect("rolling", {slow}, 10.0);
  expect("error_dynamics", {"control.natural_frequency=10"}, 4.0);
  expect("orientation_dynamics", {"control.natural_frequency=40"}, 0.25);
  expect("idle_joints", {"control.posture_frequency=20"}, 0.25);
  for (const char* check :
       {"law_torque", "inverse_dynamics_robot", "inverse_dynamics_object", "cone_use", "solver"})
    expect(check, {soft, step, slow}, 1.0);
  EXPECT_DOUBLE_EQ(CalcRatio("error_dynamics", {"control.natural_frequency=0"}), 1.0);
}

TEST(Bounds, OfAScenarioFollowWhatIsSet) {
  const auto find = [](const char* check, const std::vector<std::string>& overrides) {
    const std::string file = SourcePath("/harness/shipped/scenarios/curve-real.toml");
    const Scenario scenario = ParseScenario(ReadTextFile(file) + "contact_force = 1e-5\n", file,
                                            std::filesystem::path(file).parent_path(), overrides);
    for (const BoundOverride& stated : scenario.bounds) {
      if (stated.first == check) return CalcStatedBound(*FindCheck(check), stated, scenario);
    }
    ADD_FAILURE() << check;
    return 0.0;
  };
  const std::string soft = "plant.contact_impedance=0.9", step = "plant.time_step=0.002";
  const double slip = find("fingertip_slip_rate", {}), force = find("contact_force", {});
  EXPECT_NEAR(find("fingertip_slip_rate", {soft}), 10.0 * slip, 1e-9 * slip);
  EXPECT_NEAR(find("fingertip_slip_rate", {soft, step}), 20.0 * slip, 1e-9 * slip);
  // Whoever sets the bound means it.
  EXPECT_EQ(find("fingertip_slip_rate", {soft, "bounds.fingertip_slip_rate=3e-3"}), 3e-3);
  // One that is a fraction scales with nothing.
  EXPECT_EQ(find("contact_force", {soft, step}), force);
}

TEST(ContactCompliance, ConstantForcesAreHeldWhole) {
  PlantOptions plant;
  ContactCompliance give(plant, ContactCompliance::Fraction::Of(0.2), ContactCompliance::Fraction::Of(0.1));
  const Vector3d force(1.0, -2.0, 0.5);
  for (int i = 0; i < 10; ++i) {
    give.Add(force);
    EXPECT_LE(give.size(), 1e-15);
  }
  // At first a fraction of a step is missing, and some time constants later nothing.
  const Vector3d step(0.0, 1.0, 0.0);
  give.Add(force + step);
  EXPECT_NEAR(give.along_normal().norm(), 0.2, 1e-12);
  EXPECT_NEAR(give.along_tangent().norm(), 0.1, 1e-12);
  for (int i = 0; i < 60; ++i) give.Add(force + step);
  EXPECT_LE(give.size(), 1e-6);
}

TEST(ContactCompliance, AccelerationsAreHeldBackWhole) {
  PlantOptions plant;
  ContactCompliance give(plant, ContactCompliance::Fraction::Of(0.0), ContactCompliance::Fraction::Whole());
  give.Add(VectorXd::Zero(1));
  give.Add(VectorXd::Ones(1));
  EXPECT_EQ(give.along_normal().norm(), 0.0);
  EXPECT_NEAR(give.along_tangent().norm(), 1.0, 1e-12);
}

// Modes of any fractions up to the softest one's, under forces that jump at every step or wander: together
// they hold back at most what is said, where the softest alone would be less than that.
TEST(ModesCompliance, BoundsAllModes) {
  constexpr int kCount = 6;
  PlantOptions plant;
  plant.contact_impedance = 0.9;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto length = [](const VectorXd& f) { return f.norm(); };
  double largest = 0.0, over_softest = 0.0;
  for (const double fraction : {0.1, 0.5, 0.7}) {
    for (const double kept : {0.0, 1.0}) {
      ModesCompliance all(plant, fraction, 0.0);
      std::vector<ContactCompliance> modes;
      for (int i = 0; i < kCount; ++i) {
        const double own = fraction * (i + 1.0) / kCount;
        modes.emplace_back(plant, ContactCompliance::Fraction::Of(own), ContactCompliance::Fraction::Of(0.0));
      }
      VectorXd force = VectorXd::Zero(kCount), held(kCount);
      for (int step = 0; step < 2000; ++step) {
        for (double& f : force) f = kept * f + normal(random);
        all.Add(force);
        for (int i = 0; i < kCount; ++i) {
          modes[static_cast<size_t>(i)].Add(force.segment<1>(i));
          held[i] = modes[static_cast<size_t>(i)].along_normal()[0];
        }
        const double size = all.CalcSize(length);
        if (step == 0) continue;  // at rest
        largest = std::max(largest, held.norm() / size);
        over_softest = std::max(over_softest, held.norm() / all.softest().size());
      }
    }
  }
  EXPECT_LE(largest, 1.0);
  EXPECT_GE(largest, 0.5) << "the bound is wider than it need be";
  EXPECT_GT(over_softest, 1.2) << "the softest mode alone would do";
}

// Rates from counts make the torques rough, and the tyres of soft contacts let the platform tilt at rates of
// 1e-3 rad/s: nothing of that is a force that neither side has, nor more than the contacts give.
TEST(Balance, KnowsThePlatformThatTiltsUnderRoughTorques) {
  for (const char* impedance : {"0.9", "0.99", "0.999"}) {
    ShippedRun run("curve-real", {std::string("plant.contact_impedance=") + impedance, "duration=1.5"});
    const RunResult& result = run.Run();
    EXPECT_EQ(result.verdict, Verdict::kPass) << impedance << " " << result.attribution.evidence;
  }
}

// What the prediction misses when the torques jump at the start of `offset` is the derived fraction of the
// jump.
TEST(ContactSoftness, IsWhatThePredictionMisses) {
  for (const char* step : {"0.002"}) {
    for (const char* impedance : {"0.9", "0.99", "0.999"}) {
      const std::vector<std::string> overrides = {std::string("plant.time_step=") + step,
                                                  std::string("plant.contact_impedance=") + impedance,
                                                  std::string("duration=") + step, "settle=0.2"};
      SCOPED_TRACE(overrides[0] + " " + overrides[1]);
      std::vector<std::string> at_rest = overrides;
      at_rest.push_back("start_error.xyz=[0,0,0]");
      ShippedRun offset("offset", overrides), rest("offset", at_rest);
      offset.Run();
      rest.Run();
      TreeFactor factor(offset.setup().model());
      factor.Compute(offset.step().model->robot().M());
      VectorXd force(offset.step().command.tau.size());
      ActuationMap(offset.setup().model())
          .CalcForce(offset.step().command.tau - rest.step().command.tau, force);
      RowMatrixXd jump = force;
      factor.SolveTransposed(jump);
      VectorXd missed = offset.step().findings.xi_dot_model - offset.step().response.xi_dot;
      factor.Multiply(missed);
      const ContactSoftness softness = FindContactSoftness(offset.setup().adapter(), offset.setup().start().q,
                                                           offset.setup().start().X_Bo);
      ASSERT_GT(missed.norm(), 1e-4);
      const double fraction = missed.norm() / jump.norm();
      EXPECT_LE(fraction, softness.fraction);
      // Measured 0.38 to 0.9 of the largest fraction: the jump is not along its direction.
      EXPECT_GE(fraction, 0.25 * softness.fraction);
      EXPECT_FALSE(offset.loop().checks().Find("reduced_acceleration").failed);
    }
  }
}

TEST(ContactSoftness, GrowsWithSoftness) {
  const auto find = [](const char* impedance) {
    const ShippedRun run("hold", {std::string("plant.contact_impedance=") + impedance});
    return FindContactSoftness(run.setup().adapter(), run.setup().start().q, run.setup().start().X_Bo);
  };
  const ContactSoftness soft = find("0.99"), stiff = find("0.999");
  for (const auto fraction :
       {&ContactSoftness::fraction, &ContactSoftness::tangential_fraction, &ContactSoftness::object_fraction,
        &ContactSoftness::object_tangential_fraction}) {
    EXPECT_GT(soft.*fraction, 0.0);
    // (1 - d) / d over A: ten times, but for what the fraction takes of A + R itself.
    EXPECT_NEAR(soft.*fraction / (stiff.*fraction), 10.0, 1.5);
    EXPECT_LE(soft.*fraction, soft.fraction);
  }
}

// A wheel that spins has its own friction, which (48) has at the rate of one that rolls: without it 3.9e-3 is
// left.
TEST(Balance, KnowsTheFrictionOfWheelsThatSpin) {
  ShippedRun run("paper-rest", {"duration=0.4", "settle=0.3"});
  const RunResult& result = run.Run();
  EXPECT_GT(run.Worst("wheel_slip_rate"), 0.05);
  // Nor is the Coriolis force of a platform that hops, which alone is 3.1e-4.
  EXPECT_LE(run.Worst("inverse_dynamics_robot"), 1e-6);  // measured 0
  EXPECT_EQ(result.attribution.cause, Cause::kWheelSlip);
}

}  // namespace
}  // namespace dexcheck::testing::bounds_test
