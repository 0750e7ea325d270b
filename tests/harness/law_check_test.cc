// The question about the law: right torques pass to rounding, wrong ones are found and the wrong part is
// named.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "harness/checks/law_terms.h"
#include "harness/diagnosis/spoiled_law.h"
#include "tests/harness/simulation/shipped_run.h"

namespace dexcheck::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// What a run with a spoiled law came to.
struct Outcome {
  RunResult result;
  double law_torque = 0.0;
  double law_demand = 0.0;
};

Outcome RunSpoiled(const Setup& setup, unsigned parts, double factor) {
  LoopParts loop = MakeLoopParts(setup);
  loop.controller = std::make_unique<SpoiledLaw>(setup, std::move(loop.controller), parts, factor);
  Runner runner(setup, /*check=*/true, std::move(loop));
  Outcome outcome;
  outcome.result = runner.Run([](const StepRecord&) {}, [] { return false; });
  outcome.law_torque = runner.loop().checks().Find("law_torque").worst;
  outcome.law_demand = runner.loop().checks().Find("law_demand").worst;
  return outcome;
}

const LawPartName& FindPart(std::string_view name) {
  for (const LawPartName& part : ListLawParts()) {
    if (part.name == name) return part;
  }
  throw std::invalid_argument("no such part");
}

// curve has turned far enough by then that every summand shows: measured, the least is 2e-6 of the forces
// balanced (the object's C_o), a million times the check's rounding.
const std::vector<std::string> kShort = {"duration=2.2", "settle=0.3"};

TEST(LawCheck, TheRightLawPassesToRounding) {
  ShippedRun run("curve", kShort);
  EXPECT_EQ(run.Run().verdict, Verdict::kPass) << run.Run().attribution.evidence;
  EXPECT_GT(run.loop().checks().Find("law_torque").count, 2000);
  for (const char* name : {"law_torque", "law_demand", "grasp_force", "torque_applied", "error_dynamics"}) {
    const CheckRecord& check = run.loop().checks().Find(name);
    EXPECT_LE(check.worst, 0.5 * check.bound) << name;
    EXPECT_GT(check.count, 0) << name;
  }
}

TEST(LawCheck, AnUnchangedLawIsNotSpoiled) {
  const ShippedRun shipped("curve", {"duration=0.05", "settle=0.1"});
  const Outcome outcome = RunSpoiled(shipped.setup(), FindPart("all torques").parts, 1.0);
  EXPECT_EQ(outcome.result.verdict, Verdict::kPass);
}

/// Every part, a thousandth too large and dropped.
class SpoiledLawTest : public ::testing::TestWithParam<size_t> {};

TEST_P(SpoiledLawTest, IsFoundAndTheWrongPartIsNamed) {
  static const ShippedRun shipped("curve", kShort);
  const LawPartName& part = ListLawParts()[GetParam()];
  for (const double factor : {1.001, 0.0}) {
    SCOPED_TRACE(::testing::Message() << part.name << " times " << factor);
    const Outcome outcome = RunSpoiled(shipped.setup(), part.parts, factor);
    EXPECT_NE(outcome.result.verdict, Verdict::kPass);
    EXPECT_EQ(outcome.result.attribution.cause, Cause::kControlLaw) << outcome.result.attribution.evidence;
    EXPECT_THAT(outcome.result.attribution.evidence,
                AllOf(HasSubstr(part.name), HasSubstr(factor == 0.0 ? "has 0 times" : "has 1.001 times")));
  }
}

std::string NamePart(const ::testing::TestParamInfo<size_t>& part) {
  std::string name;
  for (const char* c = ListLawParts()[part.param].name; *c != '\0'; ++c) {
    if (std::isalnum(static_cast<unsigned char>(*c)) != 0) name += *c;
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Parts, SpoiledLawTest, ::testing::Range<size_t>(0, ListLawParts().size()), NamePart);

TEST(LawCheck, GainsThatCannotSettleFailBeforeAnythingMoves) {
  for (const auto& [scenario, gain] :
       {std::pair{"curve", "control.natural_frequency=0"}, std::pair{"offset", "control.K_p=0"},
        std::pair{"offset", "control.K_p=-9"}}) {
    SCOPED_TRACE(gain);
    ShippedRun run(scenario, {gain, "duration=0.05", "settle=0.1"});
    EXPECT_NE(run.Run().verdict, Verdict::kPass);
    EXPECT_EQ(run.Run().attribution.cause, Cause::kControlLaw);
    EXPECT_TRUE(run.loop().checks().Find("gain_stability").failed);
    EXPECT_EQ(run.loop().checks().Find("gain_stability").failed_at, 0.0);
  }
}

TEST(LawCheck, SampledRadiusIsThatOfTheRecursion) {
  ObjectGains gains;
  gains.K_v.setConstant(30.0);
  gains.K_p.setConstant(700.0);
  for (const long hold : {1L, 4L}) {
    const double dt = 1e-3;
    double e = 1.0, v = 0.3, u = 0.0;
    double last = 0.0;
    constexpr long kSteps = 4000;
    for (long i = 0; i < kSteps; ++i) {
      if (i % hold == 0) u = -30.0 * v - 700.0 * e;
      if (i == kSteps / 2) last = std::hypot(e, v);
      v += dt * u;
      e += dt * v;
    }
    // The envelope of a damped oscillation: its phase leaves some hundredths over 2000 steps.
    const double measured = std::pow(std::hypot(e, v) / last, 2.0 / static_cast<double>(kSteps));
    EXPECT_NEAR(CalcSampledRadius(gains, dt, hold), measured, 3e-3) << hold;
  }
  gains.K_p.setZero();
  EXPECT_EQ(CalcSampledRadius(gains, 1e-3, 1), 1.0);
  gains.K_v.setConstant(2100.0);
  EXPECT_GT(CalcSampledRadius(gains, 1e-3, 1), 1.0);
}

}  // namespace
}  // namespace dexcheck::testing
