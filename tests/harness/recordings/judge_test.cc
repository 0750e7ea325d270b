// Recordings of a robot that MuJoCo moves, judged by the analytic model: right ones agree, faults are named.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "controller/common/errors.h"
#include "harness/base/files.h"
#include "harness/descriptions/read_description.h"
#include "harness/recordings/compare_recordings.h"
#include "harness/recordings/write_corrections.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"
#include "tests/harness/recordings/judge_panda.h"

namespace dexcheck::testing::judge_test {
namespace {

TEST(Judge, RightRecordingsAreExplained) {
  std::mt19937 random(1);
  for (int i = 0; i < 6; ++i) {
    RecordingOptions options;
    options.has_velocities = i % 2 == 1;
    options.encoder_bits = i < 4 ? 12 : 0;
    options.torque_noise = i < 4 ? 0.02 : 0.0;
    options.velocity_noise = i < 4 ? 0.005 : 0.0;
    const RecordingJudgement judgement = Judge(RecordRobot(kMjcf, {}, options, &random));
    EXPECT_TRUE(judgement.Agrees()) << i << Tell(judgement);
  }
}

void ScaleColumns(const std::string& begin, double factor, RecordedTable* table) {
  for (const std::string& name : table->names)
    if (name.starts_with(begin))
      for (double& value : table->Get(name)) value *= factor;
}

RecordedFault DryFriction(int joint, double value) {
  return {"dry friction", "joint panda_joint" + std::to_string(joint + 1), value,
          [=](mjModel* robot) { robot->dof_frictionloss[joint] = value; }};
}

// Velocities of half a step before and damping of the step's end are no faults, with whatever step.
TEST(Judge, IntegratorsOfRightSimulationsAreNoCause) {
  std::mt19937 random(3);
  for (const double step : {0.0005, 0.001, 0.002, 0.004})
    for (const bool has_velocities : {false, true}) {
      RobotSpec spec = ReadDescription(SourcePath("/controller/parameters/panda.toml")).spec;
      RecordedFault damped;
      std::vector<double> damping;
      for (Joint& joint : spec.joints)
        damping.push_back(joint.damping = std::uniform_real_distribution<>(0.0, 1.0)(random));
      damped.change = [&](mjModel* robot) { mju_copy(robot->dof_damping, damping.data(), robot->nv); };
      const RecordingOptions options{.duration = 5.0,
                                     .step = step,
                                     .engine_step = step,
                                     .encoder_bits = 0,
                                     .torque_noise = 0.0,
                                     .has_velocities = has_velocities,
                                     .velocity_noise = 0.0};
      const RobotModel model(spec);
      const RecordedTable table = RecordRobot(kMjcf, {damped}, options, &random);
      std::vector<Recording> recordings;
      recordings.push_back(ToRecording(model, table));
      const RecordingJudgement judgement = JudgeRecordings(model, &recordings, {});
      EXPECT_TRUE(judgement.Agrees()) << step << ' ' << has_velocities << Tell(judgement);
    }
}

// One at a time, each set of frictions is nearly a gain of the torque, and bodies the rest.
TEST(Judge, SeveralFrictionsOfAModelThatAreWrongAtOnceAreNamed) {
  RobotSpec spec = ReadDescription(SourcePath("/controller/parameters/panda.toml")).spec;
  for (const size_t joint : {4U, 5U, 6U}) {
    spec.joints[joint].damping = 0.5;
    spec.joints[joint].dry_friction = 0.5;
  }
  const RobotModel wrong(spec);
  const RecordedTable table = Record({DryFriction(4, 0.2)});
  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(wrong, table));
  const RecordingJudgement judgement = JudgeRecordings(wrong, &recordings, {});
  ASSERT_EQ(judgement.causes.size(), 6U) << Tell(judgement);
  for (const Explanation& cause : judgement.causes) {
    const Fault& found = cause.faults.front();
    const double right = found.place == "joint panda_joint5" && found.fault == "dry friction" ? 0.2 : 0.0;
    EXPECT_NEAR(found.value, right, std::max(0.02, 3.0 * found.error)) << Tell(judgement);
    EXPECT_THAT(found.fault, ::testing::AnyOf("dry friction", "viscous friction"));
  }
}

TEST(Judge, JumpsAreNamedAndUndone) {
  const RecordedTable right = Record({});
  const size_t middle = right.rows() / 2;
  const auto move_up = [&](const std::string& column, double by, RecordedTable* table) {
    std::vector<double>& values = table->Get(column);
    for (size_t i = middle; i < values.size(); ++i) values[i] += by;
  };
  RecordedTable slips = right, waits = right, loses = right, lies = right;
  move_up("q.panda_joint4", 0.05, &slips);
  EXPECT_TRUE(NamesOnly(Judge(slips), "jump of the position", "joint panda_joint4", 0.05));
  move_up("time", 0.5, &waits);
  EXPECT_TRUE(NamesOnly(Judge(waits), "jump of the time", "all joints", 0.5));
  constexpr size_t kLost = 250;  // rows of 2 ms
  for (std::vector<double>& column : loses.columns) {
    const auto first = column.begin() + static_cast<std::ptrdiff_t>(middle);
    column.erase(first, first + kLost);
  }
  std::vector<double>& time = loses.Get("time");
  for (size_t i = middle; i < time.size(); ++i) time[i] -= 0.5;
  const RecordingJudgement judgement = Judge(loses);
  ASSERT_EQ(judgement.causes.size(), 1U) << Tell(judgement);
  EXPECT_EQ(judgement.causes[0].faults[0].fault, "lost rows");
  std::vector<double>& position = lies.Get("q.panda_joint2");
  for (size_t i = 50; i < position.size(); i += 100) position[i] += 0.2;
  EXPECT_TRUE(NamesOnly(Judge(lies), "lost or wrong samples of the position", "joint panda_joint2", 1.0));
}

TEST(Judge, FewWrongTorquesOfARightModelAreANote) {
  RecordedTable table = Record({});
  std::vector<double>& torque = table.Get("tau.panda_joint2");
  for (size_t i = 50; i < torque.size(); i += 200) torque[i] += 20.0;
  const RecordingJudgement judgement = Judge(table);
  EXPECT_TRUE(judgement.Agrees()) << Tell(judgement);
  EXPECT_THAT(judgement.notes, ::testing::Contains(::testing::HasSubstr(
                                   "50 wrong samples of the torque of panda_joint2 are left out")));
}

TEST(Judge, VelocitiesOfAnotherSignAreSaidAndNotUsed) {
  RecordedTable table = Record({}, /*has_velocities=*/true);
  ScaleColumns("qd.panda_joint3", -1.0, &table);
  EXPECT_TRUE(NamesOnly(Judge(table), "velocity gain", "joint panda_joint3", -1.0));
}

TEST(Judge, PositionsInDegreesAreSaid) {
  RecordedTable table = Record({}, /*has_velocities=*/true);
  ScaleColumns("q.", 180.0 / kPi, &table);
  ScaleColumns("qd.", 180.0 / kPi, &table);
  EXPECT_TRUE(NamesOnly(Judge(table), "unit of the positions", "all joints", 180.0 / kPi));
}

// A drive's filter leaves noise that is similar in rows that follow each other: it is no residual of the
// model.
TEST(Judge, FilteredNoiseOfARightModelIsExplained) {
  std::mt19937 random(3);
  const RecordedFault filter = {.record = [&](RecordedTable* table) {
    const double keeps = std::exp(-1.0 / 9.0);  // a first-order filter of nine rows
    for (const std::string& name : table->names) {
      if (!name.starts_with("tau.")) continue;
      std::vector<double>& torques = table->Get(name);
      const Eigen::Map<const VectorXd> all(torques.data(), static_cast<Eigen::Index>(torques.size()));
      std::normal_distribution<double> normal(0.0, 0.1 * all.norm() / std::sqrt(all.size()));
      double error = 0.0;
      for (double& torque : torques) {
        error = keeps * error + (1.0 - keeps) * normal(random);
        torque += error;
      }
    }
  }};
  const RecordingJudgement judgement =
      Judge(RecordRobot(kMjcf, {filter}, {.encoder_bits = 16, .torque_noise = 0.0}, &random));
  EXPECT_TRUE(judgement.Agrees()) << Tell(judgement);
}

// Velocities of coarse encoders are off by more than torques that are exact.
TEST(Judge, DampingOfARightModelTimesAnErrorOfTheVelocityIsNoCause) {
  constexpr double kDamping = 10.0;
  RobotSpec spec = ReadDescription(SourcePath("/controller/parameters/panda.toml")).spec;
  for (Joint& joint : spec.joints) joint.damping = kDamping;
  const RobotModel model(spec);
  const RecordedFault damped = {
      .change = [=](mjModel* robot) { std::fill_n(robot->dof_damping, robot->nv, kDamping); }};
  std::mt19937 random(3);
  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(model, RecordRobot(kMjcf, {damped}, {.torque_noise = 0.0}, &random)));
  const RecordingJudgement judgement = JudgeRecordings(model, &recordings, {});
  EXPECT_TRUE(judgement.Agrees()) << Tell(judgement);
}

// A quarter of the time is held out from the search: the torque, its beginning or its end may fall into it.
TEST(Judge, ShortTorquesAreNamedWhereverTheyFall) {
  for (const double begin : {15.5, 17.0})
    for (const double size : {0.004, 0.012}) {
      const RecordedFault knock = {.record = [=](RecordedTable* table) {
        for (size_t i = 0; i < table->rows(); ++i)
          if (const double t = table->columns[0][i]; t >= begin && t < begin + 0.3)
            table->Get("tau.panda_joint7")[i] += size;
      }};
      std::mt19937 random(3);
      const RecordingJudgement judgement = Judge(RecordRobot(kMjcf, {knock}, {.encoder_bits = 0}, &random));
      ASSERT_EQ(judgement.causes.size(), 1U) << begin << Tell(judgement);
      const Explanation& cause = judgement.causes[0];
      EXPECT_EQ(cause.outcome, CauseOutcome::kNamed) << begin << Tell(judgement);
      EXPECT_EQ(cause.faults[0].place + ": " + cause.faults[0].fault, "joint panda_joint7: torque");
      EXPECT_NEAR(cause.faults[0].value, size, 0.15 * size) << begin;
      EXPECT_NEAR(cause.from, begin, 0.15);
      EXPECT_NEAR(cause.to, begin + 0.3, 0.15);
    }
}

TEST(Judge, TorquesThatWereCutOffAreNamed) {
  // Noise comes after the cut of what is recorded, so that the largest number is not the limit. A motor that
  // gives less is one about a vertical axis: gravity would make the arm fall.
  const RecordedTable right = Record({});
  const auto find_most = [&](const std::string& joint, double fraction) {
    const auto [low, high] = std::ranges::minmax(RecordedTable(right).Get("tau." + joint));
    return fraction * std::max(-low, high);
  };
  const double recorded = find_most("panda_joint2", 0.5), given = find_most("panda_joint1", 0.85);
  const RecordedFault cut = {.record = [=](RecordedTable* table) {
    for (double& value : table->Get("tau.panda_joint2")) value = std::clamp(value, -recorded, recorded);
  }};
  const RecordedFault weak = {.act = [=](double, const mjModel&, mjData* data) {
    data->qfrc_applied[0] = std::clamp(data->qfrc_applied[0], -given, given);
  }};
  EXPECT_TRUE(NamesOnly(Judge(Record({cut})), "saturation", "joint panda_joint2", recorded));
  EXPECT_TRUE(NamesOnly(Judge(Record({weak})), "saturation", "joint panda_joint1", given));
}

TEST(Judge, BacklashIsNamed) {
  constexpr double kPlay = 0.06;
  RecordedTable table = Record({}, /*has_velocities=*/true);
  std::vector<double>& q = table.Get("q.panda_joint2");
  const std::vector<double>& torque = table.Get("tau.panda_joint2");
  // A motor's encoder: the link is behind it by half of the play, where the torque pushes it.
  for (size_t i = 0; i < q.size(); ++i) q[i] += 0.5 * kPlay * std::tanh(torque[i] / 0.5);
  const RecordingJudgement judgement = Judge(table);
  ASSERT_FALSE(judgement.causes.empty());
  const Fault& first = judgement.causes[0].faults[0];
  EXPECT_EQ(first.place + ": " + first.fault, "joint panda_joint2: backlash") << Tell(judgement);
  EXPECT_NEAR(first.value, kPlay, 0.1 * kPlay) << Tell(judgement);
}

TEST(Judge, BesideADriveThatIsNotKnownNoBodyIsBlamed) {
  // A torque that depends on the position as nothing that is known does, beside friction.
  const RecordedFault cogging = {.act = [](double, const mjModel&, mjData* data) {
    for (int joint : {1, 3}) data->qfrc_applied[joint] += 1.5 * std::sin(9.0 * data->qpos[joint]);
  }};
  const RecordingJudgement judgement = Judge(Record({DryFriction(1, 3.0), cogging}));
  EXPECT_FALSE(judgement.IsWhole());
  EXPECT_GE(judgement.CountExplaining(), 1U) << Tell(judgement);
  for (const FoundFault& one : judgement.found)
    EXPECT_FALSE(one.is_named && one.fault.IsOfLoad()) << Tell(judgement);
  EXPECT_LT(judgement.by_causes.numbers, judgement.by_all.numbers);
}

TEST(Judge, StribeckFrictionIsNamed) {
  constexpr double kFriction = 3.0, kVelocity = 0.15;
  const RecordedFault stribeck = {.act = [](double, const mjModel&, mjData* data) {
    const double v = data->qvel[1];
    data->qfrc_applied[1] -= kFriction * std::exp(-v * v / (kVelocity * kVelocity)) * std::tanh(v / 0.02);
  }};
  std::mt19937 random(3);
  RecordingOptions options;
  options.has_velocities = true;
  options.encoder_bits = 16;
  options.torque_noise = options.velocity_noise = 1e-3;
  const RecordingJudgement judgement = Judge(RecordRobot(kMjcf, {stribeck}, options, &random));
  ASSERT_FALSE(judgement.causes.empty());
  const Fault& first = judgement.causes[0].faults[0];
  EXPECT_EQ(first.place + ": " + first.fault, "joint panda_joint2: Stribeck friction") << Tell(judgement);
  // The tanh, by which it begins, takes a part of it: measured 0.79.
  EXPECT_NEAR(first.value, kFriction, 0.25 * kFriction) << Tell(judgement);
  EXPECT_LT(judgement.balances[1].left, 0.5 * judgement.balances[1].residual);
}

TEST(Judge, ASpringIsNamed) {
  const RecordedFault spring = {.act = [](double, const mjModel&, mjData* data) {
    data->qfrc_applied[1] -= 5.0 * (data->qpos[1] - 0.3);
  }};
  EXPECT_TRUE(NamesOnly(Judge(Record({spring})), "spring", "joint panda_joint2", 5.0));
}

TEST(Judge, DrivesOfWhichOneNumberIsOffAreNamed) {
  const RecordedFault drag = {.act = [](double, const mjModel&, mjData* data) {
    data->qfrc_applied[1] -= 4.0 * data->qvel[1] * std::abs(data->qvel[1]);
  }};
  const RecordedFault drift = {.record = [](RecordedTable* table) {
    for (size_t i = 0; i < table->rows(); ++i)
      table->Get("tau.panda_joint4")[i] += 0.1 * table->Get("time")[i];
  }};
  EXPECT_TRUE(NamesOnly(Judge(Record({drag})), "friction that grows with the square of the velocity",
                        "joint panda_joint2", 4.0));
  EXPECT_TRUE(NamesOnly(Judge(Record({drift})), "torque drift", "joint panda_joint4", 0.1));
  RecordedTable table = Record({}, /*has_velocities=*/true);
  ScaleColumns("qd.panda_joint3", 1.04, &table);
  EXPECT_TRUE(NamesOnly(Judge(table), "velocity gain", "joint panda_joint3", 1.04));
  // A stretch that the logger repeats makes no gain.
  std::vector<double>& q = table.Get("q.panda_joint3");
  std::fill(q.begin() + 3000, q.begin() + 4000, q[3000]);
  const Fault first = Judge(table).causes.front().faults.front();
  EXPECT_EQ(first.place + ": " + first.fault, "joint panda_joint3: velocity");
}

TEST(Judge, FewNumbersPredictWhatIsHeldOut) {
  const RecordingJudgement judgement = Judge(Record({DryFriction(1, 1.5), DryFriction(3, 1.0)}));
  // The simulator's dry friction turns over a velocity, which is a number of its own.
  EXPECT_GE(judgement.by_causes.numbers, 2);
  EXPECT_LE(judgement.by_causes.numbers, 4);
  EXPECT_GT(judgement.by_all.numbers, 50) << "base parameters, friction, offsets and armatures";
  for (const HeldPrediction& one : {judgement.by_causes, judgement.by_all}) {
    EXPECT_GT(one.held_left, 0.0);
    EXPECT_LT(one.held_left, 1.0) << "no more than noise";
  }
}

TEST(Judge, RepeatedAndDoubledRowsAreLeftOut) {
  const RecordedTable once = Record({DryFriction(1, 1.5)});
  RecordedTable table = once;
  for (std::vector<double>& column : table.columns) {
    std::vector<double> held;
    for (const double value : column) held.insert(held.end(), {value, value});
    column = held;
  }
  // Half of the rows with the time of the row before, half a little later.
  std::vector<double>& time = table.columns[0];
  for (size_t i = 1; i < time.size(); i += 4) time[i] += 1e-3;
  const RecordingJudgement judgement = Judge(table);
  EXPECT_TRUE(NamesOnly(judgement, "dry friction", "joint panda_joint2", 1.5));
  EXPECT_EQ(judgement.rows, 2 * static_cast<long>(once.rows()));
  EXPECT_GE(judgement.notes.size(), 3U);
}

TEST(Judge, JointsWithoutPositionsAreSaid) {
  RecordedTable table = Record({});
  table.Get("q.panda_joint7") = table.columns[0];
  *std::find(table.names.begin(), table.names.end(), "q.panda_joint7") = "temperature";
  EXPECT_THAT(Judge(table).notes,
              ::testing::Contains("drawn: has no positions of panda_joint7: taken to rest at 0"));
}

TEST(Judge, GapsAreNotSmoothedOver) {
  RecordedTable table = Record({DryFriction(1, 1.5)});
  for (std::vector<double>& column : table.columns)
    column.erase(column.begin() + 3000, column.begin() + 5000);
  EXPECT_TRUE(NamesOnly(Judge(table), "dry friction", "joint panda_joint2", 1.5));
}

TEST(Judge, CurrentsGiveDriveGainsAndThePayload) {
  std::mt19937 random(5);
  RecordedFault payload;
  do payload = DrawRecordedFault(kMjcf, PayloadKind(), &random);
  while (payload.value < 1.0);
  std::vector<Recording> recordings;
  std::vector<RecordedTable> tables = {Record({DryFriction(1, 3.0)}, false, 1),
                                       Record({DryFriction(1, 3.0), payload}, false, 2)};
  for (RecordedTable& table : tables) {
    for (std::string& name : table.names)
      if (name.starts_with("tau.")) name.replace(0, 3, "current");
    ScaleColumns("current.", 1.0 / 8.0, &table);
    recordings.push_back(ToRecording(Panda(), table));
  }
  const RecordingJudgement judgement = JudgeRecordings(Panda(), &recordings, {});
  for (const JointJudgement& one : judgement.balances) EXPECT_NEAR(one.drive_gain, 8.0, 0.4) << one.joint;
  bool has_payload = false;
  for (const Explanation& one : judgement.causes)
    has_payload |= one.faults[0].fault == "payload" &&
                   std::abs(one.faults[0].value - payload.value) < 0.1 * payload.value;
  EXPECT_TRUE(has_payload) << payload.value << Tell(judgement);
}

/// Checks that the model that --write makes explains the recording.
void ExpectCorrected(const std::string& file, const std::string& comment, const RecordedTable& table) {
  const DescriptionFile source(SourcePath("/" + file));
  const RobotModel model(source.Describe().spec);
  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(model, table));
  const RecordingJudgement judgement = JudgeRecordings(model, &recordings, {});
  EXPECT_FALSE(judgement.Agrees());
  const TemporaryFolder folder;
  const CorrectedFile corrected = WriteCorrections(source, judgement, folder.path());
  EXPECT_TRUE(corrected.left.empty());
  const std::filesystem::path path =
      folder.path() / ("copy" + std::filesystem::path(file).extension().string());
  std::ofstream(path) << corrected.text;
  const RobotModel right(ReadDescription(path).spec);
  std::vector<Recording> again;
  again.push_back(ToRecording(right, table));
  const RecordingJudgement second = JudgeRecordings(right, &again, {});
  EXPECT_TRUE(second.Agrees()) << Tell(second);
  EXPECT_NE(corrected.text.find(comment), std::string::npos) << "comments stay";
}

TEST(Judge, WritesWhatItFoundIntoACopyOfTheModel) {
  std::mt19937 random(11);
  const RecordedFault payload = DrawRecordedFault(kMjcf, PayloadKind(), &random);
  const RecordedTable table = Record({DryFriction(2, 1.0), payload});
  ExpectCorrected("controller/parameters/panda.toml", "# Inertial parameters: C. Gaz", table);
  ExpectCorrected("mjcf/panda.xml", "Franka Emika Panda, fixed base.", table);
}

TEST(Judge, WritesABodyThatCanBe) {
  const DescriptionFile file(SourcePath("/controller/parameters/panda.toml"));
  constexpr int kLink = 3;
  RecordingJudgement judgement;
  for (const TorqueFault& fault : ListTorqueFaults(Panda(), {kLink}, 1)) {
    if (fault.index != kLink || fault.place != "link " + Panda().link_name(kLink)) continue;
    VectorXd amplitude = VectorXd::Zero(static_cast<Eigen::Index>(fault.sums.size()));
    if (fault.kind == TorqueFault::kMass) amplitude[0] = -0.9 * fault.nominal;
    if (fault.kind == TorqueFault::kInertia) amplitude[0] = -0.5 * Panda().joint(kLink).body.inertia(0, 0);
    const bool is_second = !judgement.found.empty() && judgement.found.back().fault.kind == fault.kind;
    if (amplitude.isZero() || is_second || fault.IsEntry()) continue;
    judgement.found.push_back({fault, amplitude, amplitude});
  }
  ASSERT_EQ(judgement.found.size(), 2U);
  const CorrectedFile corrected = WriteCorrections(file, judgement, {});
  ASSERT_EQ(corrected.left.size(), 1U);
  EXPECT_THAT(corrected.left[0], ::testing::HasSubstr("the nearest one is written"));
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "copy.toml") << corrected.text;
  const RobotModel copy(ReadDescription(folder.path() / "copy.toml").spec);
  EXPECT_TRUE(IsBody(TorqueRegressor::Pack(copy.joint(kLink).body)));
  EXPECT_NEAR(copy.joint(kLink).body.mass, 0.1 * Panda().joint(kLink).body.mass,
              0.05 * Panda().joint(kLink).body.mass);
}

TEST(Judge, TwoRecordingsDifferByWhatOneRobotHas) {
  const RecordedTable first = Record({DryFriction(1, 2.0)});
  RecordedTable second = Record({DryFriction(1, 2.0), DryFriction(3, 1.0)});
  for (double& time : second.columns[0]) time += 3.7;
  std::vector<Recording> recordings;
  for (const RecordedTable* table : {&first, static_cast<const RecordedTable*>(&second)})
    recordings.push_back(ToRecording(Panda(), *table));
  const RecordingComparison comparison = CompareRecordings(Panda(), &recordings, {});
  EXPECT_TRUE(comparison.is_same_motion);
  EXPECT_NEAR(comparison.delay, 3.7, 0.01);
  ASSERT_EQ(comparison.causes.size(), 1U);
  EXPECT_FALSE(comparison.causes[0].first.has_value());
  EXPECT_EQ(comparison.causes[0].second->place, "joint panda_joint4");
}

TEST(Judge, WhatCannotBeUnderstoodIsNotJudged) {
  const auto problem = [](RecordedTable table) {
    return MessageOf<InputError>([&] { return Judge(table); });
  };
  const RecordedTable table = Record({});
  RecordedTable bad = table;
  bad.columns[3][20] = std::nan("");
  EXPECT_THAT(problem(bad),
              ::testing::HasSubstr("drawn: row 21: column q.panda_joint3: must be a finite number"));
  bad = table;
  bad.columns[0][30] = -1.0;
  EXPECT_THAT(problem(bad), ::testing::HasSubstr("drawn: row 31: time goes back from 0.058 to -1 s"));
  bad = table;
  for (std::vector<double>& column : bad.columns) column.resize(9);
  EXPECT_THAT(problem(bad), ::testing::HasSubstr("drawn: has 9 rows that differ, fewer than 16"));
}

}  // namespace
}  // namespace dexcheck::testing::judge_test
