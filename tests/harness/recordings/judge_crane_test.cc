// Recordings of an arm with turned and oblique frames: sizes can be, and the verdict says which joints are
// not judged. Faults of the arm and of the recording's columns are in tests/cases.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "harness/base/files.h"
#include "harness/recordings/judgement_verdict.h"
#include "tests/harness/recordings/judge_panda.h"

namespace dexcheck::testing::judge_crane_test {
namespace {

using ::testing::HasSubstr;

RobotDescription Crane() { return ReadDescription(SourcePath("/tests/cases/robots/arm.urdf")); }

constexpr const char* kJoints[] = {"swivel", "lift", "fold", "roll"};

constexpr double kStep = 0.004;  // s

/// Torques of Newton-Euler along sines, with noise of 1e-5 rad, 1e-3 rad/s and 0.01 N m.
/// @param lag of the velocities, s. @param torque_noise N m.
RecordedTable Record(const RobotDescription& robot, bool stands = false, double lag = 0.0,
                     double torque_noise = 0.01) {
  const RobotModel model(robot.spec);
  TorqueRegressor regressor(model);
  std::mt19937 random(7);
  RecordedTable table;
  table.names = {"time"};
  for (const char* kind : {"q.", "qd.", "tau."})
    for (const char* joint : kJoints) table.names.push_back(std::string(kind) + joint);
  table.columns.resize(13);
  const auto noise = [&](double size) { return std::normal_distribution<>(0.0, size)(random); };
  for (int row = 0; row < 4000; ++row) {
    const double t = kStep * row;
    VectorXd q(4), qd(4), qdd(4), tau(4), recorded = VectorXd::Zero(4);
    q << 0.1, -0.5, 0.7, 0.2;
    qd.setZero();
    qdd.setZero();
    for (int joint = 0; joint < 4 && !stands; ++joint)
      for (int k = 1; k <= 3; ++k) {
        const double w = 2.0 * kPi * (0.13 + 0.03 * joint) * k, phase = joint + 2.0 * k, size = 0.5 / k;
        q[joint] += size * std::sin(w * t + phase);
        qd[joint] += size * w * std::cos(w * t + phase);
        recorded[joint] += size * w * std::cos(w * (t - lag) + phase);
        qdd[joint] -= size * w * w * std::sin(w * t + phase);
      }
    regressor.SetMotion(q, qd, qdd);
    regressor.CalcTorques(tau);
    table.columns[0].push_back(t);
    for (Eigen::Index i = 0; i < 4; ++i) {
      table.columns[static_cast<size_t>(1 + i)].push_back(q[i] + noise(1e-5));
      table.columns[static_cast<size_t>(5 + i)].push_back(recorded[i] + noise(1e-3));
      table.columns[static_cast<size_t>(9 + i)].push_back(tau[i] + noise(torque_noise));
    }
  }
  return table;
}

RecordingJudgement JudgeCrane(const RecordedTable& table) {
  const RobotDescription robot = Crane();
  const RobotModel model(robot.spec);
  const TemporaryFolder folder;
  WriteCsv(table, folder.path() / "recording.csv");
  JudgeOptions options;
  options.frames = ListLinkFrames(robot);
  std::vector<Recording> recordings;
  recordings.push_back(OpenRecordingOf(model, folder.path() / "recording.csv", ""));
  return JudgeRecordings(model, &recordings, options);
}

void Change(RecordedTable* table, const std::string& column, const std::function<double(double)>& change) {
  for (double& value : table->Get(column)) value = change(value);
}

TEST(JudgeCrane, ARightRecordingIsExplained) {
  const RecordingJudgement judgement = JudgeCrane(Record(Crane()));
  EXPECT_TRUE(judgement.Agrees()) << Tell(judgement);
  EXPECT_TRUE(judgement.unjudged.empty());
}

// Simulators with a leapfrog log velocities so.
TEST(JudgeCrane, VelocitiesHalfAStepBeforePositionsAreNoCause) {
  for (const double lag : {0.5 * kStep, -0.5 * kStep}) {
    const RecordingJudgement judgement = JudgeCrane(Record(Crane(), /*stands=*/false, lag));
    EXPECT_TRUE(judgement.Agrees()) << Tell(judgement);
    EXPECT_THAT(judgement.notes, ::testing::Contains(HasSubstr("0.5 rows")));
  }
}

TEST(JudgeCrane, TheVerdictSaysHowLargeAnErrorNoiseHides) {
  const RobotModel model(Crane().spec);
  const auto judge = [&](double noise) { return JudgeCrane(Record(Crane(), /*stands=*/false, 0.0, noise)); };
  const auto tell = [&](const RecordingJudgement& judgement) {
    return MakeAnswer(judgement, model, "recording.csv");
  };
  const RecordingJudgement quiet = judge(0.01), loud = judge(1000.0);
  for (const JointJudgement& one : quiet.balances) {
    EXPECT_GT(one.hidden, 0.0);
    EXPECT_LT(one.hidden, 0.1 * one.modelled);
  }
  EXPECT_THAT(tell(quiet).sentence, AllOf(HasSubstr("hides errors below"), HasSubstr("% of its torque)")));
  // Beside a noise of 1 kN m nothing can be seen at any joint.
  EXPECT_TRUE(loud.IsWhole() && loud.IsHidden() && !loud.Agrees()) << Tell(loud);
  EXPECT_EQ(tell(loud).word, "PARTLY EXPLAINED");
}

TEST(JudgeCrane, DryFrictionThatTurnsSlowlyIsOneCause) {
  RecordedTable table = Record(Crane());
  const std::vector<double>& rate = table.Get("qd.lift");
  std::vector<double>& torque = table.Get("tau.lift");
  for (size_t i = 0; i < rate.size(); ++i) torque[i] += std::tanh(rate[i] / 0.03);
  EXPECT_TRUE(NamesOnly(JudgeCrane(table), "dry friction", "joint lift", 1.0));
}

TEST(JudgeCrane, AJointThatMovesAndIsNotJudgedIsInTheVerdict) {
  RecordedTable table = Record(Crane());
  *std::find(table.names.begin(), table.names.end(), "tau.fold") = "temperature";
  const RecordingJudgement judgement = JudgeCrane(table);
  EXPECT_TRUE(judgement.causes.empty()) << Tell(judgement);
  EXPECT_FALSE(judgement.Agrees());
  const Answer verdict = MakeAnswer(judgement, RobotModel(Crane().spec), "recording.csv");
  EXPECT_EQ(verdict.word, "PARTLY EXPLAINED");
  EXPECT_THAT(verdict.sentence, HasSubstr("not judged: fold (no torque of it is recorded"));
  // One that rests all the time is no reason for doubt.
  RecordedTable standing = Record(Crane(), /*stands=*/true);
  *std::find(standing.names.begin(), standing.names.end(), "tau.fold") = "temperature";
  const RecordingJudgement rested = JudgeCrane(standing);
  EXPECT_TRUE(rested.rests && rested.IsWhole()) << Tell(rested);
  EXPECT_THAT(MakeAnswer(rested, RobotModel(Crane().spec), "recording.csv").sentence,
              HasSubstr("no joint of recording.csv moves"));
}

TEST(JudgeCrane, EachJointsWholeGainIsTold) {
  RecordedTable table = Record(Crane());
  const double gains[] = {0.105, 0.0893, 0.115, 0.244};
  for (size_t i = 0; i < 4; ++i)
    Change(&table, std::string("tau.") + kJoints[i], [&](double x) { return gains[i] * x; });
  const RecordingJudgement judgement = JudgeCrane(table);
  EXPECT_TRUE(judgement.IsWhole()) << Tell(judgement);
  size_t told = 0;
  for (const Explanation& one : judgement.causes) {
    const Fault& fault = one.faults.front();
    EXPECT_NE(fault.place, "all joints") << Tell(judgement);
    for (size_t i = 0; i < 4; ++i) {
      if (fault.fault != "torque gain" || fault.place != std::string("joint ") + kJoints[i]) continue;
      EXPECT_NEAR(fault.value, gains[i], 0.03 * gains[i]) << fault.place;
      ++told;
    }
  }
  EXPECT_GE(told, 3U) << Tell(judgement);
}

// Faults in which torques are not linear: each is one cause, and the only one.
TEST(JudgeCrane, WrongPositionsClocksAndGeometryAreNamed) {
  struct Case {
    std::string fault, place;
    double value;
    std::function<void(RecordedTable*)> record;
    std::function<void(Joint*)> robot = nullptr;  // of the fold joint
    double near = 0.02;
  };
  const auto scale = [](const std::string& column, double factor) {
    return [=](RecordedTable* table) { Change(table, column, [=](double x) { return factor * x; }); };
  };
  const Eigen::AngleAxisd turned(0.1, Vector3d::UnitX());
  const auto turn = [&](Joint* joint) { joint->X_PB = joint->X_PB * Pose(turned); };
  // Beside a zero of what is missing as well.
  const auto stuck = [](RecordedTable* table) {
    std::vector<double>& torque = table->Get("tau.fold");
    std::fill(torque.begin() + 1500, torque.begin() + 2600, torque[1500]);
  };
  const auto eccentric = [](RecordedTable* table) {
    const std::vector<double> q = table->Get("q.fold");
    for (size_t row = 0; row < q.size(); ++row) {
      table->Get("q.fold")[row] += 0.02 * std::sin(2.0 * q[row] + 0.5);
      table->Get("qd.fold")[row] *= 1.0 + 0.04 * std::cos(2.0 * q[row] + 0.5);
    }
  };
  const auto late = [](RecordedTable* table) {
    for (const char* const name : {"q.fold", "qd.fold"}) {
      std::vector<double>& column = table->Get(name);
      std::copy_backward(column.begin(), column.end() - 6, column.end());
    }
    for (std::vector<double>& column : table->columns) column.erase(column.begin(), column.begin() + 6);
  };
  const auto warms = [](RecordedTable* table) {
    for (size_t row = 0; row < table->rows(); ++row)
      table->Get("tau.lift")[row] -=
          0.03 * table->columns[0][row] * (table->Get("qd.lift")[row] > 0.0 ? 1.0 : -1.0);
  };
  const auto clipped = [](RecordedTable* table) {
    Change(table, "tau.fold", [](double x) { return std::clamp(x, -1.0, 1.0); });
  };
  const auto in_kilo = [](RecordedTable* table) {
    for (const char* const joint : kJoints)
      Change(table, std::string("tau.") + joint, [](double x) { return 1e-3 * x; });
  };
  constexpr double kAny = std::numeric_limits<double>::quiet_NaN();
  const Case cases[] = {
      {"position gain", "joint lift", 1.02, scale("q.lift", 1.02), nullptr, 0.002},
      {"unit of the position", "joint fold", 180.0 / kPi, scale("q.fold", 180.0 / kPi)},
      {"clock", "all joints", 1.01, scale("time", 1.01), nullptr, 0.002},
      {"placement", "joint fold", 0.03, {}, [](Joint* joint) { joint->X_PB.translation().x() += 0.03; }},
      {"orientation", "joint fold", 0.1, {}, turn},
      {"placement", "joint fold", 0.005, {}, [](Joint* joint) { joint->X_PB.translation().x() += 0.005; }},
      {"stuck torque", "joint fold", kAny, stuck},
      {"eccentric encoder", "joint fold", 0.02, eccentric, nullptr, 0.1},
      {"delay of the position", "joint fold", 6.0 * kStep, late},
      {"dry friction that changes with time", "joint lift", -0.03, warms},
      {"saturation", "joint fold", 1.0, clipped},
      {"torque gain", "all joints", 1e-3, in_kilo},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.fault);
    RobotDescription robot = Crane();
    if (one.robot) one.robot(&robot.spec.joints[2]);
    RecordedTable table = Record(robot);
    if (one.record) one.record(&table);
    const RecordingJudgement judgement = JudgeCrane(table);
    ASSERT_EQ(judgement.causes.size(), 1U) << Tell(judgement);
    const Fault& fault = judgement.causes[0].faults[0];
    EXPECT_EQ(fault.place + ": " + fault.fault, one.place + ": " + one.fault);
    EXPECT_EQ(judgement.causes[0].outcome, CauseOutcome::kNamed);
    if (!std::isnan(one.value)) EXPECT_NEAR(fault.value, one.value, one.near * std::abs(one.value));
  }
}

TEST(JudgeCrane, APushOfARobotThatStandsHasItsTimes) {
  RecordedTable table = Record(Crane(), /*stands=*/true);
  std::vector<double>& torque = table.Get("tau.lift");
  for (size_t row = 2000; row < 2040; ++row) torque[row] += 3.0;
  const RecordingJudgement judgement = JudgeCrane(table);
  ASSERT_FALSE(judgement.causes.empty());
  EXPECT_NEAR(judgement.causes[0].from, 8.0, 0.03) << Tell(judgement);
  EXPECT_NEAR(judgement.causes[0].to, 8.16, 0.03) << Tell(judgement);
}

// Sizes that were told of real recordings.
TEST(JudgeCrane, ImpossibleSizesAreNoCauses) {
  const RobotModel model(Crane().spec);
  const VectorXd torque = VectorXd::Constant(4, 30.0), ones = VectorXd::Ones(4);
  const MotionExtents extents{torque, ones, 5.0 * ones, ones, 0.004};
  const auto can_be = [&](TorqueFault::Kind kind, const VectorXd& amplitude) {
    const std::vector<TorqueFault> all = ListTorqueFaults(model, {0, 1, 2, 3}, 1, {}, extents);
    const auto one = std::ranges::find_if(all, [&](const TorqueFault& fault) {
      return fault.kind == kind && static_cast<Eigen::Index>(fault.sums.size()) == amplitude.size();
    });
    return one != all.end() && one->is_possible(amplitude);
  };
  const auto number = [](double x) { return VectorXd::Constant(1, x); };
  using enum TorqueFault::Kind;
  for (const auto& [kind, possible, impossible] :
       std::initializer_list<std::tuple<TorqueFault::Kind, double, double>>{{kDryFriction, 5.0, 31.0},
                                                                            {kViscousFriction, 5.0, 80'297.0},
                                                                            {kOffset, -5.0, 7550.0},
                                                                            {kBacklash, 0.05, 643.0},
                                                                            {kArmature, 0.5, 7.0},
                                                                            {kLoadFriction, 0.2, 1.5},
                                                                            {kTorqueGain, -2.0, 2000.0},
                                                                            {kZero, 0.8, 3.5},
                                                                            {kDelay, 0.02, 0.6}}) {
    EXPECT_TRUE(can_be(kind, number(possible))) << kind << " " << possible;
    EXPECT_FALSE(can_be(kind, number(impossible))) << kind << " " << impossible;
  }
  // An offset that changes a little with the angle would be a spring at rest where the joint never is.
  const Joint& first = model.joint(0);
  const auto rests_at = [&](double rest) { return can_be(kSpring, Vector2d(2.0, -2.0 * rest)); };
  EXPECT_TRUE(rests_at(first.upper + 0.5));
  EXPECT_FALSE(rests_at(first.upper + 1.1 * (first.upper - first.lower)));
  EXPECT_FALSE(rests_at(first.lower - 1.1 * (first.upper - first.lower)));
  EXPECT_TRUE(can_be(kGravity, Vector3d(0.0, 9.81, 9.81))) << "on a wall";
  EXPECT_FALSE(can_be(kGravity, Vector3d(0.0, 0.0, -16.4))) << "26.2 m/s^2";
  EXPECT_FALSE(can_be(kAllOffsets, Eigen::Vector4d(1.0, 1.0, 40.0, 1.0)));
}

}  // namespace
}  // namespace dexcheck::testing::judge_crane_test
