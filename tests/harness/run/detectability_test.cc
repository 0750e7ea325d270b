// The smallest fault that a run would name.

#include "harness/run/detectability.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/common/matchers.h"
#include "tests/harness/run/fault_campaign.h"

namespace dexcheck::testing::detectability_test {
namespace {

/// Whether the mass of the object is named in a run whose model is off by so much.
bool NamesObjectMass(std::vector<std::string> overrides, double change) {
  overrides.push_back(fmt::format("model.object.mass={:.17g}", 0.2 + change));
  ShippedRun wrong("exercise", overrides);
  const Causes& causes = wrong.Run().causes;
  return std::any_of(causes.begin(), causes.end(), [](const Explanation& one) {
    return one.outcome == CauseOutcome::kNamed && one.faults.front().fault == "mass" &&
           one.faults.front().place.starts_with("object");
  });
}

// A mass of some times the smallest that is said to be named is named in a run, one of a tenth is not.
TEST(Detectability, TellsTheSmallestFaultThatIsNamed) {
  const std::vector<std::string> shorter = {"duration=0.3", "settle=0.3"};
  const ShippedRun right("exercise", shorter);
  const std::vector<Detectability> all = FindDetectability(right.setup(), 3, kGoOn);
  const auto mass = std::find_if(all.begin(), all.end(), [](const Detectability& one) {
    return one.fault == "mass" && one.place.starts_with("object");
  });
  ASSERT_NE(mass, all.end());
  EXPECT_LE(mass->found, mass->named);
  ASSERT_LT(mass->named, 0.02);
  EXPECT_TRUE(NamesObjectMass(shorter, 4.0 * mass->named));
  EXPECT_FALSE(NamesObjectMass(shorter, 0.1 * mass->found));
}

TEST(Detectability, StopsEarly) {
  const ShippedRun run("exercise", {"duration=0.02", "settle=0.3"});
  EXPECT_TRUE(FindDetectability(run.setup(), 1, [] { return true; }).empty());
}

}  // namespace
}  // namespace dexcheck::testing::detectability_test
