// Wrong equations and wrong numbers: all that have an effect are found, the others are shown to have none.

#include "harness/diagnosis/mutation.h"

#include <gmock/gmock.h>

#include <cmath>
#include <set>
#include <sstream>

#include "harness/checks/contact_check.h"
#include "harness/diagnosis/formula_mutants.h"
#include "harness/engine/engine.h"
#include "tests/common/paper_robot.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::mutation_test {
namespace {

constexpr int kSamples = 3;

struct Files {
  const char* name;
  RobotModel (*read)();
  const char* mjcf;
  size_t formulas, terms;
  bool spoils_all;  // terms of the engine
};

class WrongEquations : public ::testing::TestWithParam<Files> {};

// A term on both sides of its own comparison, or one that nothing can spoil, would say "ok" for ever.
TEST_P(WrongEquations, AreFoundByTheirCheckAndFailEveryTerm) {
  const RobotModel model = GetParam().read();
  const MjModelPtr engine = LoadMjcf(SourcePath(GetParam().mjcf));
  const Adapter adapter(model, *engine, "mjcf");
  ConsistencyOptions options;
  options.samples = kSamples;
  std::set<std::string> names;
  for (const CheckRecord& record : CheckConsistency(adapter, options, [](long) { return true; }).terms)
    names.insert(record.name);
  EXPECT_GE(names.size(), GetParam().terms);
  std::vector<FormulaMutant> mutants = ListFormulaMutants(model);
  EXPECT_GE(mutants.size(), GetParam().formulas);
  for (FormulaMutant& mutant : mutants) {
    RunFormulaMutant(adapter, kSamples, &mutant);
    EXPECT_EQ(mutant.outcome, MutantOutcome::kKilled) << mutant.name;
    EXPECT_TRUE(mutant.named_first) << mutant.name << ": " << mutant.failed_checks;
    std::istringstream failed(mutant.failed_checks);
    for (std::string name; failed >> name;) names.erase(name);
  }
  if (GetParam().spoils_all) EXPECT_THAT(names, ::testing::IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Robots, WrongEquations,
    ::testing::Values(Files{"Assistant", [] { return ReadPaperRobot(); }, "/mjcf/scene.xml", 85, 20, true},
                      Files{"AssistantWheelRates", [] { return ReadPaperRobot(DriveVelocity::kWheelRates); },
                            "/mjcf/scene.xml", 85, 20, false},
                      Files{"Panda", [] { return ReadPanda(); }, "/mjcf/panda.xml", 24, 10, false}),
    [](const auto& info) { return info.param.name; });

TEST(ContactCheck, AgreesAtRandomContacts) {
  const RobotModel model = ReadPaperRobot();
  const MjModelPtr engine = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const Adapter adapter(model, *engine, "mjcf");
  StateSource source(model, {}, 3);
  VectorXd q = VectorXd::Zero(model.num_positions());
  VectorXd xi = VectorXd::Zero(model.num_velocities());
  for (const int tip : model.fingertips()) {
    ContactCheck check(adapter, tip);
    constexpr int kContacts = 50;
    for (int sample = 0; sample < kContacts; ++sample) {
      source.DrawPositions(&q);
      source.DrawVelocity(&xi);
      check.Compare(q, xi, &source, sample);
    }
    ASSERT_EQ(check.records().size(), 4U);
    for (const CheckRecord& record : check.records()) {
      EXPECT_FALSE(record.failed) << record.name << " " << record.worst;
      EXPECT_GE(record.comparisons, kContacts * 6) << record.name;
      EXPECT_GT(record.worst, 1e-4 * record.bound) << record.name << ": a bound that no error comes near";
      EXPECT_LT(record.bound, 1e-12);
    }
  }
}

TEST(Mutants, CoverEveryNumberOfTheModel) {
  const RobotSpec spec = ReadPaperRobot().spec();
  const std::vector<Parameter> parameters = ListParameters(spec);
  // 48 joints with 14 numbers of kinematics and motion and 10 of the link; 8 fingertips and 3 frames; the
  // base's place and body, wheels, gravity and the torus.
  EXPECT_EQ(parameters.size(), 48U * 24 + 11 * 6 + 8 + 3 + 10 + 7 + 3 + 10);
  std::set<std::string> names;
  for (const Parameter& parameter : parameters) {
    const std::string name = DescribePart(spec, parameter) + ": " + DescribeQuantity(parameter);
    names.insert(name);
    constexpr double kChange = 1e-3;
    constexpr double kRounding = 1e-12;
    const auto difference = [](double x, double y) { return std::abs(std::remainder(x - y, 2.0 * kPi)); };
    RobotSpec changed = spec;
    const double value = GetValue(spec, parameter);
    SetValue(&changed, parameter, value + kChange);
    EXPECT_LT(difference(GetValue(changed, parameter), value + kChange), kRounding) << name;
    int differing = 0;
    for (const Parameter& other : parameters)
      differing += difference(GetValue(changed, other), GetValue(spec, other)) > kRounding ? 1 : 0;
    EXPECT_EQ(differing, 1) << name;
  }
  EXPECT_EQ(names.size(), parameters.size());
}

MutatedPair ReadPandaPair() {
  return MutatedPair(DescriptionFile(SourcePath("/controller/parameters/panda.toml")),
                     DescriptionFile(SourcePath("/mjcf/panda.xml")));
}

// A change of the Panda's table is named with its place and its quantity.
TEST(Mutants, OfThePandaAreNamed) {
  const MutatedPair pair = ReadPandaPair();
  int found = 0, named = 0;
  std::string missed;
  std::vector<Mutant> mutants = ListMutants(pair.model.spec(), 1e-3);
  for (size_t i = 0; i < mutants.size(); i += 3) {
    Mutant& mutant = mutants[i];
    TryMutant(pair, {}, &mutant);
    EXPECT_NE(mutant.outcome, MutantOutcome::kSurvived) << mutant.name;
    if (mutant.outcome != MutantOutcome::kKilled) continue;
    ++found;
    if (mutant.named_first) {
      ++named;
    } else {
      missed += "\n" + mutant.name + " (" + mutant.kind + "): " + mutant.named;
    }
  }
  EXPECT_GT(found, 40);
  EXPECT_GE(named, 0.95 * found) << missed;
}

// A range that the MJCF does not limit only says where to look.
TEST(Mutants, WithoutEffectAreShownToHaveNone) {
  const MutatedPair pair = ReadPandaPair();
  const int joint = mj_name2id(pair.engine.get(), mjOBJ_JOINT, "panda_joint2");
  int limits = 0;
  for (Mutant& mutant : ListMutants(pair.model.spec(), 1e-3)) {
    if (mutant.name != "joint panda_joint2: upper limit") continue;
    ++limits;
    TryMutant(pair, {}, &mutant);
    EXPECT_EQ(mutant.outcome, MutantOutcome::kKilled);
    EXPECT_EQ(mutant.failed_checks, "joint_range");
    EXPECT_TRUE(mutant.named_first);
    Mutant unlimited = mutant;
    pair.engine->jnt_limited[joint] = 0;
    TryMutant(pair, {}, &unlimited);
    EXPECT_EQ(unlimited.outcome, MutantOutcome::kNoEffect);
    // A change that has an effect but is too small to be found is a survivor.
    Mutant tiny = mutant;
    tiny.change = [](RobotSpec* spec) { spec->joints[0].mdh.d *= 1.0 + 1e-13; };
    TryMutant(pair, {}, &tiny);
    EXPECT_NE(tiny.outcome, MutantOutcome::kKilled);
  }
  EXPECT_EQ(limits, 1);
}

TEST(Mutants, ThatAreNoRobotAreRefused) {
  const MutatedPair pair = ReadPandaPair();
  Mutant mutant = ListMutants(pair.model.spec(), 1e-3).front();
  mutant.change = [](RobotSpec* spec) { spec->joints[1].body.mass = -1.0; };
  TryMutant(pair, {}, &mutant);
  EXPECT_EQ(mutant.outcome, MutantOutcome::kRefused);
}

}  // namespace
}  // namespace dexcheck::testing::mutation_test
