// Causes of the balances, step by step of the estimator, on a right run with forces added to the residuals.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <type_traits>

#include "harness/diagnosis/run_causes.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::force_causes_test {
namespace {

/// Force (n) that the model does not have, at the k-th step that is looked at.
using Force = std::function<VectorXd(int k)>;

/// Torques of joint i of the arm's seven, N m.
VectorXd Torque(int i, double size) { return size * VectorXd::Unit(7, i); }

/// Looks at `count` steps from the one at `first` on, each so many after the last.
/// @param force of k, and of the velocities (n) where it depends on them.
template <typename ForceOf>
Causes Explain(int first, int every, int count, const ForceOf& force) {
  ShippedRun run("panda-reach", {"duration=0.4"});
  StepStore store(run.setup(), nullptr, 1.0);
  int step = 0;
  run.Run([&] {
    const int k = (step++ - first) / every;
    if (step <= first || (step - 1 - first) % every != 0 || k >= count) return;
    StepAnalysis analysis = run.loop().checks().analysis();
    if constexpr (std::is_invocable_v<ForceOf, int>) {
      analysis.motion.residual += force(k);
    } else {
      analysis.motion.residual += force(k, run.step().reading.state.xi);
    }
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

TEST(ForceCauses, NothingIsNamedWhereNothingDiffers) {
  EXPECT_TRUE(Explain(200, 4, 24, [](int) { return Torque(0, 0.0); }).empty());
}

/// Forces at 24 steps, and the causes in the order in which they begin.
struct Pushes {
  const char* name;
  int every;  // steps from one that is looked at to the next
  std::function<VectorXd(int k)> force;
  std::vector<Fault> faults;
  CauseOutcome outcome = CauseOutcome::kNamed;  // of the first
};
Fault TorqueAt(int joint, double value) {
  return {"torque", "joint panda_joint" + std::to_string(joint), value, 0.0, "N m", ""};
}
Fault GrowingAt(int joint, double value) {
  return {"torque that grows by", "joint panda_joint" + std::to_string(joint), value, 0.0, "N m/s", ""};
}

constexpr double kTimeStep = 1e-3;  // s
const Pushes kPushes[] = {
    // A small force that the columns of a large fault hide appears once only rounding is noise.
    {"SmallBesideLarge",
     4,
     [](int) -> VectorXd { return Torque(1, 1.0) + Torque(4, 5e-5); },
     {TorqueAt(2, 1.0), TorqueAt(5, 5e-5)}},
    {"OneAfterAnother",
     4,
     [](int k) { return k < 11 ? Torque(1, 0.7) : Torque(3, 0.4); },
     {TorqueAt(2, 0.7), TorqueAt(4, 0.4)}},
    // A torque of a joint that turns one way is its dry friction as well; a second one adds to the first.
    {"StepOfOne",
     4,
     [](int k) { return Torque(2, k < 9 ? 0.3 : 0.9); },
     {TorqueAt(3, 0.3), TorqueAt(3, 0.6)},
     CauseOutcome::kNamedClass},
    // Most steps between two that are kept are not known, and the growth may begin there.
    {"GrowingLater",
     4,
     [](int k) -> VectorXd {
       return Torque(1, 0.7) + Torque(3, 2.5 * 4 * kTimeStep * std::max(0.0, k - 13.4));
     },
     {TorqueAt(2, 0.7), GrowingAt(4, 2.5)}},
    // A growing force changes more from step to step than one that begins beside it.
    {"ForAWhileBesideGrowing",
     1,
     [](int k) -> VectorXd { return Torque(1, 0.05 * k + 0.02) + Torque(3, 9 <= k && k < 17 ? 0.1 : 0.0); },
     {GrowingAt(2, 0.05 / kTimeStep), TorqueAt(4, 0.1)}},
    // Neither of two successive jumps is taken for the change of the other one's neighbours.
    {"BeginsBeforeAnotherEnds",
     1,
     [](int k) -> VectorXd { return Torque(1, k < 15 ? 0.7 : 0.0) + Torque(3, k < 14 ? 0.0 : 0.4); },
     {TorqueAt(2, 0.7), TorqueAt(4, 0.4)}}};

TEST(ForceCauses, SeveralAreNamed) {
  for (const Pushes& pushes : kPushes) {
    SCOPED_TRACE(pushes.name);
    const Causes causes = Explain(200, pushes.every, 24, pushes.force);
    SCOPED_TRACE(DescribeCauses(causes, CauseChannel::kBalance));
    ASSERT_EQ(causes.size(), pushes.faults.size());
    double last = 0.0;
    for (const Fault& fault : pushes.faults) {
      const auto one = std::ranges::find_if(causes, [&](const Explanation& each) {
        const Fault* const found = Find(each, fault.fault);
        return found != nullptr && found->place == fault.place &&
               std::abs(found->value - fault.value) <= 1e-3 * fault.value;
      });
      ASSERT_NE(one, causes.end()) << fault.Describe();
      EXPECT_EQ(one->outcome, last == 0.0 ? pushes.outcome : CauseOutcome::kNamed);
      EXPECT_GE(one->from, last);
      last = one->from;
    }
  }
}

// A joint's own numbers stay while a push comes and goes there.
TEST(ForceCauses, APushBesideFrictionOfItsJointIsNamed) {
  const auto torque = [](int k, const VectorXd& xi) -> VectorXd {
    return Torque(1, -0.4 * xi[1]) + Torque(1, 8 <= k && k < 16 ? 2.0 : 0.0);
  };
  const Causes causes = Explain(200, 4, 24, torque);
  SCOPED_TRACE(DescribeCauses(causes, CauseChannel::kBalance));
  ASSERT_EQ(causes.size(), 2u);
  const size_t later = causes[0].ends ? 0 : 1;
  EXPECT_EQ(causes[1 - later].faults.front().fault, "viscous friction");
  EXPECT_FALSE(causes[1 - later].ends);
  const Fault* push = Find(causes[later], "torque");
  ASSERT_NE(push, nullptr);
  EXPECT_NEAR(std::abs(push->value), 2.0, 1e-6);
  EXPECT_TRUE(causes[later].ends);
}

// Several faults explain anything in a single step: made-up torques are none of them.
TEST(ForceCauses, OfOneStepNoSeveralFaultsAreNamed) {
  for (int draw = 0; draw < 20; ++draw) {
    const Causes causes = Explain(200 + draw, 4, 1, [&](int) -> VectorXd {
      VectorXd torques(7);
      for (int i = 0; i < 7; ++i) torques[i] = 0.1 * ((7 * i * i + 3 * draw * i + 5 * draw) % 11 - 5);
      return torques;
    });
    SCOPED_TRACE(DescribeCauses(causes, CauseChannel::kBalance));
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
    ASSERT_NE(Find(causes[0], "torque"), nullptr) << causes[0].Describe();
    const Fault* const spring = Find(causes[0], "spring");
    ASSERT_EQ(spring != nullptr, rests) << causes[0].Describe();
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
