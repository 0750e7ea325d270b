// What explains the balances, step by step of the estimator, on a right run to whose residuals forces are
// added.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "harness/diagnosis/run_causes.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::force_causes_test {
namespace {

/// Force (n) that the model does not have, at the k-th step that is looked at.
using Force = std::function<VectorXd(int k)>;

/// Torques of joint i of the arm's seven, N m.
VectorXd Torque(int i, double size) { return size * VectorXd::Unit(7, i); }

/// Looks at `count` steps from the one at `first` on, each so many after the last.
Causes Explain(int first, int every, int count, const Force& force) {
  ShippedRun run("panda-reach", {"duration=0.4"});
  StepStore store(run.setup(), nullptr, 1.0);
  int step = 0;
  run.Run([&] {
    const int k = (step++ - first) / every;
    if (step <= first || (step - 1 - first) % every != 0 || k >= count) return;
    StepAnalysis analysis = run.loop().checks().analysis();
    analysis.robot_residual += force(k);
    store.Add(run.step(), analysis, /*differs=*/true);
  });
  EXPECT_EQ(store.size(), count);
  return ExplainForces(store);
}

const Fault* Find(const Explanation& one, std::string_view fault) {
  for (const Fault& other : one.faults)
    if (other.fault == fault) return &other;
  return nullptr;
}

const Explanation* FindPlace(const Causes& causes, std::string_view place) {
  for (const Explanation& one : causes)
    if (one.faults.front().place == place) return &one;
  return nullptr;
}

void ExpectTorque(const Causes& causes, const std::string& place, double size) {
  SCOPED_TRACE(place);
  const Explanation* const one = FindPlace(causes, place);
  ASSERT_NE(one, nullptr) << TellCauses(causes, CauseChannel::kBalance);
  EXPECT_EQ(one->faults.front().fault, "torque");
  EXPECT_EQ(one->outcome, CauseOutcome::kNamed) << one->Tell();
  EXPECT_NEAR(one->faults.front().value, size, 1e-3 * size);
}

TEST(ForceCauses, NothingIsNamedWhereNothingDiffers) {
  EXPECT_TRUE(Explain(200, 4, 24, [](int) { return Torque(0, 0.0); }).empty());
}

// What is hidden by what the columns of a large fault are off shows once only rounding is noise.
TEST(ForceCauses, SmallFaultsBesideLargeOnesAreNamedWhereNothingElseIsLeft) {
  const Causes causes = Explain(200, 4, 24, [](int) -> VectorXd { return Torque(1, 1.0) + Torque(4, 5e-5); });
  EXPECT_EQ(causes.size(), 2U);
  ExpectTorque(causes, "joint panda_joint2", 1.0);
  ExpectTorque(causes, "joint panda_joint5", 5e-5);
}

TEST(ForceCauses, FaultsOneAfterAnotherAreNamedInParts) {
  constexpr int kCount = 24, kChange = 11;
  const Causes causes =
      Explain(200, 4, kCount, [](int k) { return k < kChange ? Torque(1, 0.7) : Torque(3, 0.4); });
  EXPECT_EQ(causes.size(), 2U);
  ExpectTorque(causes, "joint panda_joint2", 0.7);
  ExpectTorque(causes, "joint panda_joint4", 0.4);
  const Explanation* const first = FindPlace(causes, "joint panda_joint2");
  const Explanation* const second = FindPlace(causes, "joint panda_joint4");
  ASSERT_TRUE(first != nullptr && second != nullptr);
  EXPECT_TRUE(first->ends);
  EXPECT_LT(first->to, second->from);
}

TEST(ForceCauses, StepOfOneTorqueIsNotTheSumOfTwo) {
  const Causes causes = Explain(200, 4, 24, [](int k) { return Torque(2, k < 9 ? 0.3 : 0.9); });
  ASSERT_EQ(causes.size(), 2U);
  EXPECT_NEAR(causes[0].faults.front().value, 0.3, 1e-6);
  EXPECT_NEAR(causes[1].faults.front().value, 0.9, 1e-6);
}

// Most steps between two that are kept are not known, and it may begin there.
TEST(ForceCauses, WhatGrowsSinceALaterTimeIsNamedBesideWhatIsThereAllTheTime) {
  constexpr int kEvery = 4;
  constexpr double kTimeStep = 1e-3, kRate = 2.5, kSince = 13.4;  // s, N m/s, in looked at steps
  const auto grow = [](int k) { return kRate * kEvery * kTimeStep * std::max(0.0, k - kSince); };
  const Causes causes =
      Explain(200, kEvery, 24, [&](int k) -> VectorXd { return Torque(1, 0.7) + Torque(3, grow(k)); });
  EXPECT_EQ(causes.size(), 2U);
  ExpectTorque(causes, "joint panda_joint2", 0.7);
  const Explanation* const grows = FindPlace(causes, "joint panda_joint4");
  const Explanation* const always = FindPlace(causes, "joint panda_joint2");
  ASSERT_TRUE(grows != nullptr && always != nullptr) << TellCauses(causes, CauseChannel::kBalance);
  EXPECT_EQ(grows->outcome, CauseOutcome::kNamed) << grows->Tell();
  EXPECT_EQ(grows->faults.front().fault, "torque that grows by");
  EXPECT_NEAR(grows->faults.front().value, kRate, 1e-3 * kRate);
  EXPECT_GT(grows->from, always->from);
}

// What grows changes more from step to step than what begins beside it.
TEST(ForceCauses, WhatBeginsAndEndsBesideWhatGrowsIsNamed) {
  const Causes causes = Explain(200, 1, 24, [](int k) -> VectorXd {
    return Torque(1, 0.05 * k + 0.02) + Torque(3, 9 <= k && k < 17 ? 0.1 : 0.0);
  });
  EXPECT_EQ(causes.size(), 2U) << TellCauses(causes, CauseChannel::kBalance);
  ExpectTorque(causes, "joint panda_joint4", 0.1);
  const Explanation* const grows = FindPlace(causes, "joint panda_joint2");
  ASSERT_NE(grows, nullptr) << TellCauses(causes, CauseChannel::kBalance);
  EXPECT_EQ(grows->outcome, CauseOutcome::kNamed) << grows->Tell();
  EXPECT_EQ(grows->faults.front().fault, "torque that grows by");
}

// Of two jumps that follow each other neither is taken for how the other one's neighbours change.
TEST(ForceCauses, WhatBeginsAStepBeforeAnotherEndsIsNamed) {
  const Causes causes = Explain(200, 1, 24, [](int k) -> VectorXd {
    return Torque(1, k < 15 ? 0.7 : 0.0) + Torque(3, k < 14 ? 0.0 : 0.4);
  });
  EXPECT_EQ(causes.size(), 2U) << TellCauses(causes, CauseChannel::kBalance);
  ExpectTorque(causes, "joint panda_joint2", 0.7);
  ExpectTorque(causes, "joint panda_joint4", 0.4);
}

// Of a single step several faults explain anything: made-up torques are none of them.
TEST(ForceCauses, OfOneStepNoSeveralFaultsAreNamed) {
  for (int draw = 0; draw < 20; ++draw) {
    const Causes causes = Explain(200 + draw, 4, 1, [&](int) -> VectorXd {
      VectorXd torques(7);
      for (int i = 0; i < 7; ++i) torques[i] = 0.1 * ((7 * i * i + 3 * draw * i + 5 * draw) % 11 - 5);
      return torques;
    });
    SCOPED_TRACE(TellCauses(causes, CauseChannel::kBalance));
    EXPECT_LE(causes.size(), 1U);
  }
}

// A joint that rests shows a spring's torque, and nothing of its stiffness.
TEST(ForceCauses, TorqueOfAJointThatRestsMayBeASprings) {
  for (const int joint : {1, 6}) {
    SCOPED_TRACE(joint);
    const bool rests = joint == 6;
    const Causes causes = Explain(200, 8, 24, [=](int) { return Torque(joint, 0.5); });
    ASSERT_EQ(causes.size(), 1U);
    ASSERT_NE(Find(causes[0], "torque"), nullptr) << causes[0].Tell();
    const Fault* const spring = Find(causes[0], "spring");
    ASSERT_EQ(spring != nullptr, rests) << causes[0].Tell();
    if (rests) EXPECT_EQ(spring->detail, "of any stiffness");
  }
}

// No fault with a size, and no single name: anything may act there.
TEST(ForceCauses, TorqueThatIsFreeAtEachStepIsAClass) {
  const Causes causes =
      Explain(200, 1, 24, [](int k) { return Torque(5, 0.1 + 0.01 * ((7 * k * k + 3 * k) % 11)); });
  ASSERT_EQ(causes.size(), 1U);
  EXPECT_EQ(causes[0].outcome, CauseOutcome::kNamedClass);
  EXPECT_EQ(causes[0].faults.front().fault, "torque that changes, up to");
  EXPECT_EQ(causes[0].faults.front().place, "joint panda_joint6");
  EXPECT_NEAR(causes[0].faults.front().value, 0.2, 1e-3);
}

}  // namespace
}  // namespace dexcheck::testing::force_causes_test
