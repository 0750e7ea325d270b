// Faults made in a run on purpose are found, and their causes are named and measured.

#include "harness/run/run_mutation.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iostream>

#include "tests/common/matchers.h"
#include "tests/harness/run/fault_campaign.h"

namespace dexcheck::testing::run_mutation_test {
namespace {

/// A campaign of nothing but what is switched on.
RunMutationOptions MakeOptions(double from, double duration) {
  RunMutationOptions options;
  options.from = from;
  options.duration = duration;
  options.parameters = 0;
  options.laws = options.equations = options.plants = false;
  return options;
}

/// How many of the campaign's faults came to what.
struct Count {
  int made = 0, killed = 0, cause = 0, part = 0, with_part = 0;
};

/// Makes those faults that are chosen.
Count Make(RunCampaign* campaign, const std::function<bool(const RunMutant&)>& choose) {
  Count count;
  for (const RunMutant* mutant : RunChosen(campaign, choose)) {
    ++count.made;
    count.killed += mutant->killed ? 1 : 0;
    count.cause += mutant->has_right_cause() ? 1 : 0;
    if (!mutant->killed || !mutant->has_right_cause() || !mutant->is_named()) {
      std::cout << mutant->all.name << ": " << (mutant->killed ? NameOf(mutant->cause) : "survived") << ": "
                << mutant->evidence << " " << mutant->failure << "\n";
    }
    if (mutant->all.part.empty() && mutant->all.truth.empty()) continue;
    ++count.with_part;
    count.part += mutant->is_named() ? 1 : 0;
  }
  return count;
}

TEST(RunCampaign, FindsEveryWrongLawAndNamesThePart) {
  RunMutationOptions options = MakeOptions(1.0, 0.02);
  options.laws = true;
  for (const char* scenario : {"curve", "exercise"}) {
    SCOPED_TRACE(scenario);
    RunCampaign campaign = MakeCampaign(options, scenario);
    const Count laws = Make(&campaign, [](const RunMutant&) { return true; });
    EXPECT_GE(laws.killed, 55);
    // An entry of M_bar' that is zero couples nothing.
    const auto none = std::ranges::count_if(campaign.mutants(), &RunMutant::no_effect);
    EXPECT_EQ(laws.killed + none, laws.made);
    EXPECT_EQ(laws.cause, laws.killed);
    EXPECT_EQ(laws.with_part, 45);
    EXPECT_GE(laws.part, 43);
  }
}

/// One half of the equations, every other one: together they are all.
class EquationHalf : public ::testing::TestWithParam<size_t> {};

TEST_P(EquationHalf, FindsEveryWrongEquationAndNamesTheTerm) {
  RunMutationOptions options = MakeOptions(1.0, 0.01);
  options.equations = true;
  RunCampaign campaign = MakeCampaign(options, "exercise");
  EXPECT_GE(campaign.mutants().size(), 28U);
  const RunMutant* const first = campaign.mutants().data();
  const Count equations = Make(&campaign, [&](const RunMutant& mutant) {
    return static_cast<size_t>(&mutant - first) % 2 == GetParam();
  });
  EXPECT_GE(equations.made, 14);
  EXPECT_EQ(equations.killed, equations.made);
  EXPECT_EQ(equations.cause, equations.made);
  EXPECT_EQ(equations.part, equations.made);
}
INSTANTIATE_TEST_SUITE_P(Both, EquationHalf, ::testing::Values(0, 1));

TEST(RunCampaign, FindsFaultsOfPlantsAndTheirCauses) {
  RunMutationOptions options = MakeOptions(0.6, 0.05);
  options.parameters = 3;
  options.plants = true;
  RunCampaign campaign = MakeCampaign(options);
  // Those that are there from the beginning take longest.
  const Count faults = Make(&campaign, [](const RunMutant& mutant) { return mutant.all.kind != "wheels"; });
  EXPECT_GE(faults.made, 60);
  // Small frictions of joints that rest survive.
  EXPECT_GE(10 * faults.killed, 9 * faults.made);
  EXPECT_EQ(faults.cause, faults.killed);
  // Some of one draw are classes: a torque that is held, or of one sign, has many names.
  EXPECT_GE(20 * faults.part, 16 * faults.with_part);
}

// A hand on the Panda that holds a ball, and the Panda with nothing: what can be wrong is looked for in the
// robot, and no name is known beforehand.
class OtherRobot : public ::testing::TestWithParam<const char*> {};

TEST_P(OtherRobot, HasFaultsOfItsOwn) {
  RunMutationOptions options;
  options.from = 0.2;
  options.duration = 0.05;
  options.parameters = 6;
  RunCampaign campaign = MakeCampaign(options, GetParam());
  const auto is_of_plant = [](const RunMutant& mutant) {
    return mutant.all.kind != "equation" && mutant.all.kind != "law, one part" &&
           mutant.all.kind != "law, otherwise";
  };
  const Count faults = Make(&campaign, is_of_plant);
  EXPECT_GE(faults.made, 40);
  EXPECT_GE(20 * faults.cause, 18 * faults.made);
  bool has_laws = false;
  for (const RunMutant& mutant : campaign.mutants()) {
    if (!is_of_plant(mutant)) has_laws = true;
    EXPECT_FALSE(mutant.refused) << mutant.all.name << ": " << mutant.failure;
    if (is_of_plant(mutant)) EXPECT_TRUE(mutant.killed || mutant.no_effect) << mutant.all.name;
    EXPECT_EQ(mutant.all.name.find("wheel"), std::string::npos) << mutant.all.name;
  }
  EXPECT_EQ(has_laws, ReadShippedScenario(GetParam()).joint_task() == nullptr);
}
INSTANTIATE_TEST_SUITE_P(Robots, OtherRobot, ::testing::Values("hand-curve", "panda-reach"),
                         [](const auto& info) { return std::string(info.index == 0 ? "Hand" : "Arm"); });

// A motion of joints begins at rest, where their friction is nothing; the seventh never moves.
TEST(RunCampaign, LooksOnWhereAFaultIsNotFound) {
  RunMutationOptions options = MakeOptions(0.0, 0.001);
  options.draws = 40;
  options.kinds = {"joint"};
  RunCampaign brief = MakeCampaign(options, "panda-reach", {"duration=1"});
  options.looks_on = true;
  RunCampaign whole = MakeCampaign(options, "panda-reach", {"duration=1"});
  int moving = 0, still = 0;
  for (size_t i = 0; i < brief.mutants().size(); ++i) {
    const std::string& name = brief.mutants()[i].all.name;
    const bool is_still = name.starts_with("joint panda_joint7: viscous friction");
    if (!is_still && !name.starts_with("joint panda_joint3: viscous friction")) continue;
    ASSERT_EQ(whole.mutants()[i].all.name, name);
    ASSERT_TRUE(brief.Run(i, kGoOn) && whole.Run(i, kGoOn));
    EXPECT_FALSE(brief.mutants()[i].killed) << name;
    EXPECT_EQ(whole.mutants()[i].killed, !is_still) << name;
    EXPECT_EQ(whole.mutants()[i].no_effect, is_still) << name;
    ++(is_still ? still : moving);
  }
  EXPECT_GE(moving, 1);
  EXPECT_GE(still, 1);
}

TEST(RunCampaign, AnUprightAxisHoldsWhatPushesAlongIt) {
  RunMutationOptions options;
  options.laws = options.equations = false;
  options.plants = false;
  options.parameters = 1000;
  RunCampaign campaign = MakeCampaign(options, "panda-reach");
  const auto shows_never = [](const RunMutant& mutant) {
    return mutant.all.name == "link panda_link1: Ixx" || mutant.all.name == "link panda_link1: Ixy";
  };
  const auto is_chosen = [&shows_never](const RunMutant& mutant) {
    return shows_never(mutant) || mutant.all.name == "link panda_link2: mass";
  };
  int without = 0;
  for (const RunMutant* mutant : RunChosen(&campaign, is_chosen)) {
    EXPECT_EQ(mutant->no_effect, shows_never(*mutant)) << mutant->all.name;
    EXPECT_EQ(mutant->killed, !shows_never(*mutant)) << mutant->all.name;
    without += mutant->no_effect ? 1 : 0;
  }
  EXPECT_EQ(without, 2);
}

// The run without a fault goes through what makes faults: fingertips that are joined stay where they are.
TEST(RunCampaign, NothingInjectedChangesNothing) {
  RunMutationOptions options;
  options.from = 0.02;
  options.duration = 0.02;
  options.parameters = 0;
  options.laws = options.equations = false;
  RunCampaign campaign = MakeCampaign(options, "bonded");
  const Count objects = Make(&campaign, [](const RunMutant& mutant) { return mutant.all.kind == "body"; });
  EXPECT_GE(objects.made, 7);
  EXPECT_GE(objects.cause, objects.made - 1);  // one pushes later than the run lasts
  for (const RunMutant& mutant : campaign.mutants())
    if (mutant.killed) EXPECT_EQ(mutant.causes.find("fingertip"), std::string::npos) << mutant.causes;
}

TEST(RunCampaign, ARunThatDoesNotPassIsNoPlaceForFaults) {
  RunMutationOptions options;
  options.from = 0.01;
  EXPECT_THROW(MakeCampaign(options, "curve", {"settle=0.1", "model.object.mass=0.21"}), InputError);
  EXPECT_THROW(MakeCampaign(options, "lift"), InputError);
}

TEST(RunCampaign, WhatIsStoppedIsNotDone) {
  RunMutationOptions options;
  options.from = 0.01;
  options.parameters = 1;
  RunCampaign campaign = MakeCampaign(options);
  EXPECT_FALSE(campaign.Run(0, [] { return true; }));
}

}  // namespace
}  // namespace dexcheck::testing::run_mutation_test
