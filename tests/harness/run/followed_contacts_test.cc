// control.kappa = "integrated": contacts that the law follows by (40) from their start, as in the paper.

#include <gtest/gtest.h>

#include <utility>

#include "tests/common/refused_text.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::followed_contacts_test {
namespace {

/// Fingers roll the torus: rolling contact is the whole motion.
std::vector<std::string> Roll(const std::vector<std::string>& more) {
  std::vector<std::string> overrides = {"duration=0.4", "settle=0.3", "expect={}",
                                        "control.kappa=integrated"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  return overrides;
}

/// Contacts that roll without slip drift only by the integrator's error, of second order.
TEST(FollowedContacts, DriftWithTheSquareOfTheStepWhereNothingSlips) {
  const auto drift = [](const char* step) {
    ShippedRun run("reorient", Roll({"plant.type=rigid", std::string("plant.time_step=") + step}));
    const RunResult& result = run.Run();
    EXPECT_TRUE(Passes(result));
    return run.loop().largest_drift();
  };
  const ContactDrift whole = drift("4e-3"), half = drift("2e-3");
  EXPECT_GT(half.object, 1e-12);
  EXPECT_NEAR(whole.object / half.object, 4.0, 0.4);
  EXPECT_NEAR(whole.fingertip / half.fingertip, 4.0, 0.4);
  EXPECT_NEAR(whole.psi / half.psi, 4.0, 0.4);
}

/// Soft contacts slip and sink, which the law is told as motion: they drift, no check alarms, and the drift
/// is told of each coordinate.
TEST(FollowedContacts, DriftIsToldAndCriesNoWolf) {
  ShippedRun run("reorient", Roll({}));
  ContactDrift largest;
  const RunResult& result = run.Run([&] {
    ASSERT_EQ(run.step().drift.size(), 4U);
    for (const ContactDrift& drift : run.step().drift) largest.Raise(drift);
  });
  EXPECT_TRUE(Passes(result));
  const auto summary = MakeSummary(run.setup(), run.loop(), result);
  const auto& told = summary.at("contact_drift");
  EXPECT_EQ(told.at("object_max_m"), largest.object);
  EXPECT_EQ(told.at("fingertip_max_m"), largest.fingertip);
  EXPECT_EQ(told.at("psi_max_rad"), largest.psi);
  EXPECT_GT(largest.object, 1e-9);
  EXPECT_GT(largest.fingertip, 1e-9);
  EXPECT_GT(largest.psi, 1e-9);
  EXPECT_LT(largest.object, 1e-4);
}

TEST(FollowedContacts, AreRefusedWhereNothingRolls) {
  for (const auto& [scenario, why] :
       {std::pair("lift", "contacts of a task come and go"), {"bonded", "bonds do not roll"}}) {
    EXPECT_TRUE(
        IsRefused([name = scenario] { return ReadShippedScenario(name, {"control.kappa=integrated"}); },
                  {"control.kappa", why}));
  }
}

}  // namespace
}  // namespace dexcheck::testing::followed_contacts_test
