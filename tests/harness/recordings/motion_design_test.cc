// Motions that are made to be recorded: within limits, and better for the judge than others.

#include "harness/recordings/motion_design.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "harness/engine/clearance.h"
#include "tests/common/files.h"
#include "tests/common/throws.h"
#include "tests/harness/recordings/judge_panda.h"

namespace dexcheck::testing::motion_design_test {
namespace {

const RobotDescription& PandaFile() {
  static const RobotDescription robot = ReadDescription(SourcePath("/controller/parameters/panda.toml"));
  return robot;
}
SelfContact MakeContact(const MotionLimits& limits) {
  std::vector<std::string> names;
  for (const Joint& joint : PandaFile().spec.joints) names.push_back(joint.name);
  return SelfContact(LoadMjcf(std::filesystem::path(SourcePath(std::string("/") + kMjcf))), kMjcf, names,
                     0.5 * (limits.lower + limits.upper));
}
MotionDesignOptions Quick(int evaluations = 150) {
  MotionDesignOptions options;
  options.evaluations = evaluations;
  return options;
}
double ErrorOf(const MotionDesign& design, const std::string& fault) {
  for (const ExpectedError& one : design.errors)
    if (one.fault == fault) return one.after;
  ADD_FAILURE() << fault;
  return 0.0;
}
VectorXd Follow(const SeriesMotion& motion, double time, int derivative) {
  VectorXd all[3];
  motion.Calc(time, &all[0], &all[1], &all[2]);
  return all[derivative];
}

TEST(MotionDesign, StaysWithinLimitsAndRestsAtItsEnds) {
  MotionLimits limits = ReadMotionLimits(PandaFile(), {});
  limits.velocity[3] = 0.3;
  limits.acceleration[5] = 0.4;
  limits.torque = VectorXd::Constant(7, 87.0);
  limits.torque[1] = 40.0;
  SelfContact contact = MakeContact(limits);
  MotionDesignOptions options = Quick();
  options.calc_overlap = [&](const VectorXd& q) { return contact.CalcDepth(q); };
  const MotionDesign design = DesignMotion(Panda(), limits, options);
  TorqueRegressor regressor(Panda());
  VectorXd torque(7), largest_rate = VectorXd::Zero(7);
  for (double time = 0.0; time < design.motion.duration(); time += 0.01) {
    const VectorXd q = Follow(design.motion, time, 0), qd = Follow(design.motion, time, 1);
    const VectorXd qdd = Follow(design.motion, time, 2);
    EXPECT_TRUE((q.array() >= limits.lower.array()).all() && (q.array() <= limits.upper.array()).all());
    EXPECT_TRUE((qd.cwiseAbs().array() <= limits.velocity.array()).all()) << time;
    EXPECT_TRUE((qdd.cwiseAbs().array() <= limits.acceleration.array()).all()) << time;
    regressor.SetMotion(q, qd, qdd);
    regressor.CalcTorques(torque);
    constexpr double kBetween = 1.01;  // the search looks at every fifth of a second
    EXPECT_TRUE((torque.cwiseAbs().array() <= kBetween * limits.torque.array()).all()) << torque.transpose();
    EXPECT_LT(contact.CalcDepth(q), 1e-3) << time;
    constexpr double kStep = 1e-4;
    if (time > kStep) {
      const VectorXd rate =
          (Follow(design.motion, time + kStep, 0) - Follow(design.motion, time - kStep, 0)) / (2.0 * kStep);
      EXPECT_LT((rate - qd).norm(), 1e-6);
      const VectorXd change =
          (Follow(design.motion, time + kStep, 1) - Follow(design.motion, time - kStep, 1)) / (2.0 * kStep);
      EXPECT_LT((change - qdd).norm(), 2e-4);  // the third derivative jumps where the rise ends
    }
    largest_rate = largest_rate.cwiseMax(qd.cwiseAbs());
  }
  for (const double end : {0.0, design.motion.duration()}) {
    EXPECT_LT(Follow(design.motion, end, 1).norm(), 1e-12);
    EXPECT_LT(Follow(design.motion, end, 2).norm(), 1e-12);
  }
  // Every joint moves, or nothing of it is told.
  EXPECT_GT((largest_rate.cwiseQuotient(limits.velocity)).minCoeff(), 0.1) << largest_rate.transpose();
}

TEST(MotionDesign, SearchingTellsMoreThanDrawing) {
  const MotionLimits limits = ReadMotionLimits(PandaFile(), {});
  const MotionDesign drawn = DesignMotion(Panda(), limits, Quick(1));
  const MotionDesign found = DesignMotion(Panda(), limits, Quick(400));
  EXPECT_GT(found.known_after, drawn.known_after);
  EXPECT_LT(ErrorOf(found, "mass"), ErrorOf(drawn, "mass"));
  EXPECT_LT(ErrorOf(found, "torque gain"), ErrorOf(drawn, "torque gain"));
}

/// Standard error of a cause's size as the judge says it; infinite where it is not named.
double JudgeError(std::vector<RecordedTable> tables, const std::string& fault, const std::string& place) {
  std::vector<Recording> recordings;
  for (const RecordedTable& table : tables) recordings.push_back(ToRecording(Panda(), table));
  const RecordingJudgement judgement = JudgeRecordings(Panda(), &recordings, {});
  for (const Explanation& one : judgement.causes)
    if (one.outcome == CauseOutcome::kNamed && one.faults[0].fault == fault && one.faults[0].place == place)
      return one.faults[0].error;
  return std::numeric_limits<double>::infinity();
}

TEST(MotionDesign, AddsWhatARecordingDoesNotTell) {
  // The wrist rests in the first recording, so that nothing of its rotors shows.
  const auto half_still = [](double t, VectorXd* q, VectorXd* qd, VectorXd* qdd) {
    *q = VectorXd::Zero(7);
    *qd = *qdd = *q;
    (*q)[3] = -1.5;
    (*q)[5] = 1.5;
    for (int i = 0; i < 3; ++i) {
      const double w = 1.0 + 0.7 * i;
      (*q)[i] += 0.5 * std::sin(w * t);
      (*qd)[i] = 0.5 * w * std::cos(w * t);
      (*qdd)[i] = -0.5 * w * w * std::sin(w * t);
    }
  };
  const RecordedFault armature{"armature", "joint panda_joint6", 0.15,
                               [](mjModel* robot) { robot->dof_armature[5] = 0.15; }};
  std::mt19937 random(5);
  RecordingOptions recording;
  recording.motion = half_still;
  const RecordedTable first = RecordRobot(kMjcf, {armature}, recording, &random);
  EXPECT_TRUE(std::isinf(JudgeError({first}, armature.fault, armature.place)));

  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(Panda(), first));
  const RecordingSet recorded(Panda(), &recordings, {}, {});
  MotionDesignOptions options = Quick(300);
  options.recorded = &recorded;
  const MotionLimits limits = ReadMotionLimits(PandaFile(), {});
  const MotionDesign design = DesignMotion(Panda(), limits, options);
  EXPECT_GT(design.known_after, design.known_before);

  recording.motion = [&](double t, VectorXd* q, VectorXd* qd, VectorXd* qdd) {
    design.motion.Calc(std::min(t, design.motion.duration()), q, qd, qdd);
  };
  const RecordedTable second = RecordRobot(kMjcf, {armature}, recording, &random);
  EXPECT_LT(JudgeError({first, second}, armature.fault, armature.place), 0.1 * armature.value);
}

TEST(MotionDesign, CannotBeWithinImpossibleLimits) {
  MotionLimits limits = ReadMotionLimits(PandaFile(), {});
  limits.torque = VectorXd::Constant(7, 1e-6);
  EXPECT_TRUE(Throws<InputError>([&] { return DesignMotion(Panda(), limits, Quick(50)); },
                                 "no motion within the limits was found"));
}

TEST(MotionLimits, AreReadByJointOrForAll) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "limits.toml";
  WriteText(file, "[all]\nvelocity = 0.5\n[joints.panda_joint4]\nvelocity = 0.7\nlower = -2\nupper = -1\n");
  const MotionLimits limits = ReadMotionLimits(PandaFile(), file);
  EXPECT_EQ(limits.velocity[0], 0.5);
  EXPECT_EQ(limits.velocity[3], 0.7);
  EXPECT_EQ(limits.upper[3], -1.0);
  EXPECT_LT(limits.upper[0], PandaFile().spec.joints[0].upper);
  for (const auto& [text, problem] : std::initializer_list<std::pair<const char*, const char*>>{
           {"[joints.elbow]\nvelocity = 1\n", "joints.elbow: is no joint of"},
           {"[all]\nvelocity = 0\n", "all.velocity: must be"},
           {"[all]\nlower = 1\nupper = 1\n", "lower must be less than upper"},
           {"[all]\nspeed = 1\n", "all.speed: unknown key"}}) {
    WriteText(file, text);
    EXPECT_TRUE(Throws<InputError>([&] { return ReadMotionLimits(PandaFile(), file); }, problem)) << text;
  }
}

}  // namespace
}  // namespace dexcheck::testing::motion_design_test
