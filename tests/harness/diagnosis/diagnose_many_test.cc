// Many numbers wrong at once: what the diagnosis prints repairs what it names, however many there are.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "harness/engine/engine_terms.h"
#include "tests/harness/diagnosis/diagnosed_robot.h"

namespace dexcheck::testing::diagnose_many_test {
namespace {

using Kind = ParameterKind;

// Thirteen digits are printed and compared at 1e-11 of the robot's size; a body is up to a hundred times
// smaller.
constexpr double kSame = 1e-9;

using Robot = DiagnosedRobot;

bool IsOfBodies(Kind kind) {
  return kind == Kind::kMass || kind == Kind::kCom || kind == Kind::kInertia || kind == Kind::kDamping ||
         kind == Kind::kArmature || kind == Kind::kGravity;
}

double Draw(std::mt19937* random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(*random);
}

bool IsRobot(const RobotSpec& spec) {
  try {
    static_cast<void>(RobotModel(spec));
    return true;
  } catch (const InputError&) {
    return false;
  }
}

/// Changes as many of the numbers, up to a tenth; those that cannot be changed by that much stay.
RobotSpec Spoil(const RobotSpec& spec, std::vector<Parameter> numbers, size_t count, std::mt19937* random) {
  std::shuffle(numbers.begin(), numbers.end(), *random);
  numbers.resize(std::min(count, numbers.size()));
  const double size = std::pow(10.0, -Draw(random, 1.0, 4.0));
  RobotSpec wrong = spec;
  for (const Parameter& number : numbers) {
    const double value = GetValue(wrong, number);
    SetValue(&wrong, number, value + size * Draw(random, -1.0, 1.0) * GetScale(wrong, number));
    if (!IsRobot(wrong)) SetValue(&wrong, number, value);
  }
  return wrong;
}

/// Whether what a parameter describes is the same of the repaired model and the engine: the number itself, or
/// for what depends on where frames stand, the place of axis, frame or body in the world. (Other numbers than
/// the true ones may place them alike.)
class Comparison {
 public:
  Comparison(const Robot& robot, const RobotSpec& repaired, std::mt19937* random)
      : truth_(robot.spec),
        model_(repaired),
        adapter_(model_, *robot.engine, "mjcf"),
        engine_(adapter_, Coordinates::kReduced),
        terms_(model_) {
    for (int sample = 0; sample < 3; ++sample) states_.push_back(DrawPositions(model_, random));
  }

  [[nodiscard]] bool IsSame(const Parameter& p) {
    switch (p.kind) {
      case Kind::kAlpha:
      case Kind::kA:
      case Kind::kHomeAngle:
      case Kind::kD:
      case Kind::kPosition:
      case Kind::kRotation:
        return IsAxisSame(p.index);
      case Kind::kFramePosition:
      case Kind::kFrameRotation:
        return IsFrameSame(p.index);
      case Kind::kBasePosition:
      case Kind::kBaseRotation:
        return IsBaseSame();
      case Kind::kCom:
      case Kind::kInertia:
        return IsBodySame(p.index, p.kind == Kind::kInertia);
      default: {
        const double a = GetValue(truth_, p);
        const double b = GetValue(model_.spec(), p);
        return std::abs(a - b) <=
               kSame * std::max({std::abs(a), std::abs(b), p.kind == Kind::kGravity ? 1.0 : 0.0});
      }
    }
  }
  [[nodiscard]] bool IsAxisSame(int joint) {
    const bool slide = model_.joints()[static_cast<size_t>(joint)].type == JointType::kPrismatic;
    return Holds([&] {
      const Pose X = terms_.CalcLinkPose(joint);
      const Vector3d axis = engine_.JointAxis(joint);
      const Vector3d apart = X.translation() - engine_.JointAnchor(joint);
      const double off_line = slide ? 0.0 : (apart - axis.dot(apart) * axis).norm();
      return (axis - X.linear().col(2)).norm() <= kSame && off_line <= kSame;
    });
  }

 private:
  template <typename Same>
  [[nodiscard]] bool Holds(const Same& same) {
    return std::all_of(states_.begin(), states_.end(), [&](const VectorXd& q) {
      const VectorXd xi = VectorXd::Zero(terms_.size());
      terms_.SetState(q, xi);
      engine_.SetState(q, xi);
      return same();
    });
  }
  [[nodiscard]] bool IsFrameSame(int frame) {
    return Holds([&] {
      return (terms_.CalcFramePose(frame).matrix() - engine_.FramePose(frame).matrix()).norm() <= kSame;
    });
  }
  [[nodiscard]] bool IsBaseSame() {
    for (int i = 0; i < model_.num_joints(); ++i) {
      if (model_.joints()[static_cast<size_t>(i)].parent < 0 && !IsAxisSame(i)) return false;
    }
    return true;
  }
  [[nodiscard]] bool IsBodySame(int link, bool inertia) {
    if (link < 0) return IsBaseBodySame(inertia);
    const MassProperties& body = model_.joints()[static_cast<size_t>(link)].body;
    return Holds([&] {
      const Pose X = terms_.CalcLinkPose(link);
      const LinkInWorld there = engine_.links()[static_cast<size_t>(link + 1)];
      if (!inertia) return (X * body.com - there.com).norm() <= kSame;
      const Matrix3d I = X.linear() * body.inertia * X.linear().transpose();
      return (I - there.inertia).norm() <= kSame * I.trace();
    });
  }
  /// Without its wheels, whose own numbers may still be wrong; the engine has the wheels in the same body.
  [[nodiscard]] bool IsBaseBodySame(bool inertia) const {
    const auto turn = [](const Base& base) -> Matrix3d {
      return base.X_B0.linear() * base.body.inertia * base.X_B0.linear().transpose();
    };
    const Base& here = model_.spec().base;
    if (!inertia)
      return (here.X_B0 * here.body.com - truth_.base.X_B0 * truth_.base.body.com).norm() <= kSame;
    const Matrix3d there = turn(truth_.base);
    return (turn(here) - there).norm() <= kSame * there.trace();
  }

  const RobotSpec& truth_;
  RobotModel model_;
  Adapter adapter_;
  EngineTerms engine_;
  ModelTerms terms_;
  std::vector<VectorXd> states_;
};

/// Counts over many sets.
struct Tally {
  int sets = 0;
  int causes = 0;
  int wholly = 0;
};

/// Diagnoses a wrong model and looks at each repair as it is printed.
void Look(const Robot& robot, const RobotSpec& wrong, bool bodies_only, const std::string& what,
          std::mt19937* random, Tally* tally) {
  const Diagnosis diagnosis = Explain(robot, wrong);
  ++tally->sets;
  tally->causes += static_cast<int>(diagnosis.causes.size());
  RobotSpec repaired = wrong;
  for (const Repair& cause : diagnosis.causes) {
    Repair printed = cause;
    for (size_t i = 0; i < cause.parameters.size(); ++i)
      printed.values[i] = ReadBackPrinted(wrong, cause.parameters[i], cause.values[i]);
    Apply(printed, &repaired);
  }
  ASSERT_TRUE(IsRobot(repaired)) << what;
  Comparison comparison(robot, repaired, random);
  for (const Repair& cause : diagnosis.causes) {
    EXPECT_NE(cause.kind, RepairKind::kEngineOnly) << what;
    for (const Parameter& parameter : cause.parameters)
      EXPECT_TRUE(comparison.IsSame(parameter)) << what << ": " << Describe(cause, wrong, "FILE");
    for (const int joint : {cause.joint, cause.other}) {
      if (joint >= 0)
        EXPECT_TRUE(comparison.IsAxisSame(joint)) << what << ": " << DescribeShort(cause, wrong);
    }
  }
  const bool wholly = IsRepairedWholly(diagnosis);
  tally->wholly += wholly ? 1 : 0;
  if (!bodies_only) return;
  // Numbers that both sides state are all found.
  EXPECT_TRUE(wholly) << what;
  for (const Parameter& parameter : ListParameters(robot.spec)) {
    if (!IsOfBodies(parameter.kind)) continue;
    const double truth = GetValue(robot.spec, parameter);
    double size = std::abs(truth);
    if (parameter.kind == Kind::kCom) size = 1.0;  // m
    if (parameter.kind == Kind::kInertia) {
      const bool base = parameter.index < 0;
      size = (base ? robot.spec.base.body : robot.spec.joints[static_cast<size_t>(parameter.index)].body)
                 .inertia.trace();
    }
    EXPECT_NEAR(GetValue(repaired, parameter), truth, kSame * std::max(size, 1e-6))
        << what << ": " << DescribePart(robot.spec, parameter) << ": " << DescribeQuantity(parameter);
  }
}

/// From two numbers to all; as many small sets as large ones.
void TrySets(const Robot& robot, bool bodies_only, int sets, const std::string& name, std::mt19937* random,
             Tally* tally) {
  std::vector<Parameter> numbers = ListParameters(robot.spec);
  if (bodies_only) std::erase_if(numbers, [](const Parameter& p) { return !IsOfBodies(p.kind); });
  for (int i = 0; i < sets; ++i) {
    const double fraction = sets == 1 ? 1.0 : static_cast<double>(i) / (sets - 1);
    const auto count =
        static_cast<size_t>(2.0 * std::pow(static_cast<double>(numbers.size()) / 2.0, fraction) + 0.5);
    const RobotSpec wrong = Spoil(robot.spec, numbers, count, random);
    Look(robot, wrong, bodies_only,
         fmt::format("{}, set {}: {} of {} numbers", name, i, count, numbers.size()), random, tally);
    if (::testing::Test::HasFatalFailure()) return;
  }
}

Robot MakeRandom(int index, std::mt19937* random) {
  RandomRobotOptions options;
  constexpr BaseType kBases[] = {BaseType::kFixed, BaseType::kPlanar, BaseType::kDifferentialDrive,
                                 BaseType::kFloating};
  options.base = kBases[index % 4];
  options.joints = 2 + index % 6;
  options.branching = 0.1 * (index % 10);
  Robot robot = MakeDiagnosedRobot(options, random);
  // Where a floating base starts in the MJCF says nothing of the robot.
  if (options.base == BaseType::kFloating) robot.engine->qpos0[2] += 0.7;
  return robot;
}

/// For long runs by hand: how many times as many sets.
int Factor() {
  const char* const text = std::getenv("DEXCHECK_DIAGNOSE_FACTOR");
  return text == nullptr ? 1 : std::atoi(text);
}

void Print(const char* name, const Tally& tally) {
  fmt::print("{}: {} sets, {} causes, {} sets wholly repaired\n", name, tally.sets, tally.causes,
             tally.wholly);
}

TEST(DiagnoseMany, BodiesAreAllReadWhateverTheirNumber) {
  std::mt19937 random(710);
  Tally tally;
  TrySets(LoadPanda(), true, 20 * Factor(), "panda", &random, &tally);
  for (int i = 0; i < 30 * Factor(); ++i)
    TrySets(MakeRandom(i, &random), true, 2, fmt::format("random robot {}", i), &random, &tally);
  TrySets(LoadPaperRobot(), true, 2 * Factor(), "assistant", &random, &tally);
  Print("bodies", tally);
  EXPECT_GE(tally.sets, 80);
  EXPECT_EQ(tally.wholly, tally.sets);
}

TEST(DiagnoseMany, NothingWrongIsPrinted) {
  std::mt19937 random(711);
  Tally tally;
  TrySets(LoadPanda(), false, 6 * Factor(), "panda", &random, &tally);
  for (int i = 0; i < 24 * Factor(); ++i)
    TrySets(MakeRandom(i, &random), false, 3, fmt::format("random robot {}", i), &random, &tally);
  TrySets(LoadPaperRobot(), false, 2 * Factor(), "assistant", &random, &tally);
  Print("all", tally);
  EXPECT_GE(tally.sets, 80);
  EXPECT_GT(tally.causes, 2 * tally.sets);  // it still says much
}

}  // namespace
}  // namespace dexcheck::testing::diagnose_many_test
