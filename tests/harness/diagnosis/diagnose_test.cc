// The diagnosis: one fault is named first, two are both named, and what they repair agrees.

#include "harness/diagnosis/diagnose.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "controller/common/errors.h"
#include "harness/diagnosis/mutation.h"
#include "tests/harness/diagnosis/diagnosed_robot.h"

namespace dexcheck::testing::diagnose_test {
namespace {

constexpr double kScale = 1e-3;

// What is asked of the diagnosis.
constexpr double kSinglesNamedFirst = 0.95;
constexpr double kPairsBothNamed = 0.80;

using Robot = DiagnosedRobot;

/// All kinds of base, of joint and of branching.
Robot MakeRandom(int index, std::mt19937* random) {
  RandomRobotOptions options;
  constexpr BaseType kBases[] = {BaseType::kFixed, BaseType::kPlanar, BaseType::kDifferentialDrive};
  options.base = kBases[index % 3];
  options.velocity = index % 2 == 0 ? DriveVelocity::kTwist : DriveVelocity::kWheelRates;
  options.joints = 2 + index % 16;
  options.branching = 0.1 * (index % 10);
  options.prismatic = 0.1 * (index % 5);
  return MakeDiagnosedRobot(options, random);
}

/// The diagnosis after several changes at once; nothing when they cannot be made together.
std::optional<Diagnosis> ExplainMutants(const Robot& robot, const std::vector<const Mutant*>& mutants) {
  RobotSpec wrong = robot.spec;
  for (const Mutant* mutant : mutants) mutant->change(&wrong);
  try {
    return Explain(robot, wrong);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// Whether one of the first causes, as many as there are faults, names the change or lists it as equal.
bool IsNamed(const Diagnosis& diagnosis, const Mutant& mutant, size_t faults) {
  const size_t looked_at = std::min(faults, diagnosis.causes.size());
  return std::any_of(diagnosis.causes.begin(),
                     diagnosis.causes.begin() + static_cast<std::ptrdiff_t>(looked_at),
                     [&](const Repair& cause) {
                       return IsNamedBy(mutant, cause) ||
                              std::any_of(cause.equivalents.begin(), cause.equivalents.end(),
                                          [&](const Repair& equal) { return IsNamedBy(mutant, equal); });
                     });
}

/// Counts what was named; prints what was not.
class Score {
 public:
  void Add(bool named, const std::string& what) {
    ++tried_;
    named_ += named ? 1 : 0;
    if (!named) missed_ += "\n  " + what;
  }
  [[nodiscard]] int tried() const { return tried_; }
  void ExpectFraction(double fraction) const {
    EXPECT_GE(named_, fraction * tried_) << named_ << " of " << tried_ << " named; missed:" << missed_;
    fmt::print("{} of {} named{}\n", named_, tried_, missed_);
  }

 private:
  int tried_ = 0;
  int named_ = 0;
  std::string missed_;
};

/// Whether two changes are of one vector, tensor or row, and so one fault.
bool AreOneFault(const Mutant& a, const Mutant& b) {
  const auto touches = [](const Mutant& mutant, const Mutant& other) {
    if (mutant.expected.kind != RepairKind::kParameters) {
      if (other.expected.kind != RepairKind::kParameters) return true;
      const int joint = other.expected.parameters.front().index;
      return joint == mutant.expected.joint || joint == mutant.expected.other;
    }
    return false;
  };
  if (touches(a, b) || touches(b, a)) return true;
  return std::any_of(a.expected.parameters.begin(), a.expected.parameters.end(), [&](const Parameter& x) {
    return std::any_of(b.expected.parameters.begin(), b.expected.parameters.end(),
                       [&](const Parameter& y) { return x.kind == y.kind && x.index == y.index; });
  });
}

void TryPairs(const Robot& robot, int count, std::mt19937* random, Score* score) {
  const std::vector<Mutant> mutants = ListMutants(robot.spec, kScale);
  for (int tries = 0; tries < count;) {
    const Mutant& a = mutants[(*random)() % mutants.size()];
    const Mutant& b = mutants[(*random)() % mutants.size()];
    if (AreOneFault(a, b)) continue;
    ++tries;
    const std::optional<Diagnosis> diagnosis = ExplainMutants(robot, {&a, &b});
    if (!diagnosis) continue;
    score->Add(IsNamed(*diagnosis, a, 2) && IsNamed(*diagnosis, b, 2), a.name + " and " + b.name);
  }
}

TEST(Diagnose, HasNothingToExplainWhereModelsAgree) {
  for (const Robot& robot : {LoadPanda(), LoadPaperRobot()}) {
    const Diagnosis diagnosis = Explain(robot, robot.spec);
    EXPECT_TRUE(diagnosis.agrees);
    EXPECT_TRUE(diagnosis.causes.empty());
  }
}

TEST(Diagnose, NamesAMassWithTheValueThatRepairsIt) {
  const Robot robot = LoadPaperRobot();
  RobotSpec wrong = robot.spec;
  const int forearm = RobotModel(robot.spec).FindLink("r_forearm");
  wrong.joints[static_cast<size_t>(forearm)].body.mass = 1.5;
  const Diagnosis diagnosis = Explain(robot, wrong);
  ASSERT_EQ(diagnosis.causes.size(), 1U);
  EXPECT_EQ(Describe(diagnosis.causes[0], wrong, "FILE"),
            "link r_forearm: mass 1.5 kg in FILE, 1.4 kg repairs it");
  EXPECT_NEAR(diagnosis.causes[0].explained, 1.0, 1e-9);
  EXPECT_NEAR(diagnosis.causes[0].explained_of_forces, 1.0, 1e-9);
  EXPECT_TRUE(IsRepairedWholly(diagnosis));
}

/// Numbers as they are published: each is off by up to `error` of itself.
RobotSpec Publish(const RobotSpec& spec, double error) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> draw(-error, error);
  RobotSpec published = spec;
  for (const Parameter& parameter : ListParameters(spec))
    SetValue(&published, parameter, GetValue(spec, parameter) * (1.0 + draw(random)));
  return published;
}

// Rounded numbers are no faults when so many digits are asked for; what differs by more is named alone,
// within those digits, and printed with hardly more.
TEST(Diagnose, NamesWhatDiffersBeyondTheDigitsOfPublishedNumbers) {
  constexpr double kPublished = 3e-7;
  DiagnosisOptions options;
  options.tolerance = 1e-5;  // seven joints' errors add up
  const Robot robot = LoadPanda();
  const RobotSpec published = Publish(robot.spec, kPublished);
  EXPECT_FALSE(Explain(robot, published).agrees);
  const Diagnosis nothing = Explain(robot, published, options);
  EXPECT_TRUE(nothing.agrees);
  EXPECT_TRUE(nothing.causes.empty());

  struct Fault {
    Parameter parameter;
    double factor;
  };
  for (const Fault& fault : {Fault{{ParameterKind::kMass, 2, 0}, 1.01},
                             {{ParameterKind::kInertia, 4, 0}, 0.9},
                             {{ParameterKind::kCom, 5, 1}, 1.3},
                             {{ParameterKind::kD, 2, 0}, 1.02},
                             {{ParameterKind::kA, 3, 0}, 0.9},
                             {{ParameterKind::kAlpha, 3, 0}, 1.01}}) {
    RobotSpec wrong = published;
    const double right = GetValue(robot.spec, fault.parameter);
    ASSERT_NE(right, 0.0);
    SetValue(&wrong, fault.parameter, fault.factor * right);
    const Diagnosis diagnosis = Explain(robot, wrong, options);
    const std::string name =
        DescribePart(robot.spec, fault.parameter) + ": " + DescribeQuantity(fault.parameter);
    ASSERT_EQ(diagnosis.causes.size(), 1U) << name;
    const Repair& cause = diagnosis.causes.front();
    ASSERT_EQ(cause.parameters.size(), 1U) << name;
    EXPECT_EQ(cause.parameters.front(), fault.parameter) << Describe(cause, wrong, "FILE");
    EXPECT_NEAR(cause.values.front(), right, options.tolerance * std::abs(right)) << name;
    // What is solved for is rounded; what is read is as the engine has it.
    if (IsGeometric(fault.parameter.kind))
      EXPECT_LE(CountDigits(wrong, fault.parameter, cause.values.front()), 7) << name;
    EXPECT_TRUE(IsRepairedWholly(diagnosis)) << name;
  }
}

/// Diagnoses the fault alone. @return the diagnosis, or nothing where it makes no robot.
std::optional<Diagnosis> TryFault(const Robot& robot, const Mutant& fault, Score* score) {
  std::optional<Diagnosis> diagnosis = ExplainMutants(robot, {&fault});
  if (diagnosis && !diagnosis->agrees)
    score->Add(!diagnosis->causes.empty() && IsNamedBy(fault, diagnosis->causes.front()), fault.name);
  return diagnosis;
}

// Every mutant of the Panda; what is repaired agrees.
TEST(Diagnose, NamesEverySingleFaultOfThePanda) {
  const Robot robot = LoadPanda();
  Score score;
  int wholly_repaired = 0;
  for (const Mutant& mutant : ListMutants(robot.spec, kScale)) {
    const std::optional<Diagnosis> diagnosis = TryFault(robot, mutant, &score);
    if (!diagnosis) continue;
    EXPECT_FALSE(diagnosis->agrees) << mutant.name;
    wholly_repaired += IsRepairedWholly(*diagnosis) ? 1 : 0;
  }
  EXPECT_GT(score.tried(), 200);
  score.ExpectFraction(kSinglesNamedFirst);
  EXPECT_GE(wholly_repaired, kSinglesNamedFirst * score.tried());
}

TEST(Diagnose, NamesSingleFaultsOfThePaperRobot) {
  const Robot robot = LoadPaperRobot();
  const std::vector<Mutant> mutants = ListMutants(robot.spec, kScale);
  ASSERT_GT(mutants.size(), 1500U);
  constexpr size_t kEvery = 37;
  Score score;
  for (size_t i = 0; i < mutants.size(); i += kEvery) TryFault(robot, mutants[i], &score);
  EXPECT_GT(score.tried(), 35);
  score.ExpectFraction(kSinglesNamedFirst);
}

TEST(Diagnose, NamesSingleFaultsOfRandomRobots) {
  std::mt19937 random(700);
  Score score;
  for (int index = 0; index < 80; ++index) {
    const Robot robot = MakeRandom(index, &random);
    const std::vector<Mutant> mutants = ListMutants(robot.spec, kScale);
    TryFault(robot, mutants[random() % mutants.size()], &score);
  }
  EXPECT_GT(score.tried(), 70);
  score.ExpectFraction(kSinglesNamedFirst);
}

TEST(Diagnose, NamesBothOfTwoFaults) {
  std::mt19937 random(701);
  Score panda;
  TryPairs(LoadPanda(), 60, &random, &panda);
  panda.ExpectFraction(kPairsBothNamed);
  Score random_robots;
  for (int index = 0; index < 45; ++index) TryPairs(MakeRandom(index, &random), 1, &random, &random_robots);
  random_robots.ExpectFraction(kPairsBothNamed);
  Score paper_robot;
  TryPairs(LoadPaperRobot(), 16, &random, &paper_robot);
  paper_robot.ExpectFraction(kPairsBothNamed);
}

// The score must be able to be bad: named by another mutant's expectation, nothing counts.
TEST(Diagnose, DoesNotNameWhatIsRight) {
  const Robot robot = LoadPanda();
  const std::vector<Mutant> mutants = ListMutants(robot.spec, kScale);
  int named = 0;
  for (size_t i = 0; i < 40; ++i) {
    const std::optional<Diagnosis> diagnosis = ExplainMutants(robot, {&mutants[3 * i]});
    const Mutant& other = mutants[3 * i + 30];
    if (diagnosis) named += IsNamed(*diagnosis, other, 1) ? 1 : 0;
  }
  EXPECT_EQ(named, 0);
}

TEST(Diagnose, SaysWhatOnlyTheMjcfHas) {
  Robot robot = LoadPanda();
  const int joint = mj_name2id(robot.engine.get(), mjOBJ_JOINT, "panda_joint3");
  robot.engine->jnt_stiffness[joint] = 2.0;
  robot.engine->dof_armature[robot.engine->jnt_dofadr[joint]] = 0.1;
  const Diagnosis diagnosis = Explain(robot, robot.spec);
  ASSERT_EQ(diagnosis.causes.size(), 2U);
  EXPECT_EQ(DescribeShort(diagnosis.causes[0], robot.spec), "joint panda_joint3: armature");
  EXPECT_EQ(diagnosis.causes[0].values, std::vector<double>{0.1});
  EXPECT_EQ(diagnosis.causes[1].kind, RepairKind::kEngineOnly);
  EXPECT_NE(diagnosis.causes[1].note.find("panda_joint3"), std::string::npos);
  EXPECT_NE(diagnosis.causes[1].note.find("spring of 2 only in the MJCF"), std::string::npos);
}

TEST(Diagnose, NamesASolidOfAnotherMassAsOneCause) {
  const Robot robot = LoadPaperRobot();
  RobotSpec wrong = robot.spec;
  wrong.joints[4].body.mass *= 0.5;
  wrong.joints[4].body.inertia *= 0.5;
  const Diagnosis diagnosis = Explain(robot, wrong);
  ASSERT_EQ(diagnosis.causes.size(), 1U);
  EXPECT_NE(Describe(diagnosis.causes[0], wrong, "FILE").find("with the inertia in proportion"),
            std::string::npos);
}

// Wheels that differ from each other are no single number of the model.
TEST(Diagnose, SaysWhatRemains) {
  Robot robot = LoadPaperRobot();
  const int wheel = mj_name2id(robot.engine.get(), mjOBJ_JOINT, "wheel_left");
  robot.engine->dof_damping[robot.engine->jnt_dofadr[wheel]] *= 2.0;
  const Diagnosis diagnosis = Explain(robot, robot.spec);
  EXPECT_FALSE(diagnosis.agrees);
  EXPECT_FALSE(diagnosis.remaining_constants.empty());
}

TEST(Diagnose, StopsWhenToldTo) {
  const Robot robot = LoadPanda();
  RobotSpec wrong = robot.spec;
  wrong.joints[2].mdh.alpha = 0.0;
  const Diagnosis diagnosis =
      Diagnose(RobotModel(wrong), *robot.engine, "mjcf", {}, [](const char*) { return false; });
  EXPECT_FALSE(diagnosis.agrees);
  EXPECT_TRUE(diagnosis.causes.empty());
  EXPECT_FALSE(diagnosis.remaining_terms.empty());
}

}  // namespace
}  // namespace dexcheck::testing::diagnose_test
