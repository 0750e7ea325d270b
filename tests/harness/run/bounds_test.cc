// Bounds follow from the plant's step and stiffness and from the gains, by the formulas that the document
// has.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "controller/dynamics/tree_factor.h"
#include "controller/model/platform.h"
#include "harness/checks/check_table.h"
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
  expect("reduced_acceleration", {soft, step, slow}, 10.0);
  expect("reduced_acceleration", {"plant.contact_impedance=0.999"}, 1.0);
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
    const Scenario scenario = ParseScenario(ReadTextFile(file) + "solver = 1e-5\n", file,
                                            std::filesystem::path(file).parent_path(), overrides);
    for (const BoundOverride& stated : scenario.bounds) {
      if (stated.first == check) return CalcStatedBound(*FindCheck(check), stated, scenario);
    }
    ADD_FAILURE() << check;
    return 0.0;
  };
  const std::string soft = "plant.contact_impedance=0.9", step = "plant.time_step=0.002";
  const double slip = find("fingertip_slip_rate", {}), solver = find("solver", {});
  EXPECT_NEAR(find("fingertip_slip_rate", {soft}), 10.0 * slip, 1e-9 * slip);
  EXPECT_NEAR(find("fingertip_slip_rate", {soft, step}), 20.0 * slip, 1e-9 * slip);
  // Whoever sets the bound means it.
  EXPECT_EQ(find("fingertip_slip_rate", {soft, "bounds.fingertip_slip_rate=3e-3"}), 3e-3);
  // One that is a fraction scales with nothing.
  EXPECT_EQ(find("solver", {soft, step}), solver);
}

}  // namespace
}  // namespace dexcheck::testing::bounds_test
