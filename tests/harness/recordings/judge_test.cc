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
#include "harness/recordings/torque_errors.h"
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

/// A recording with faults, all else by default.
RecordedTable Record(const std::vector<RecordedFault>& faults, bool has_velocities = false,
                     unsigned seed = 3) {
  std::mt19937 random(seed);
  RecordingOptions options;
  options.has_velocities = has_velocities;
  return RecordRobot(kMjcf, faults, options, &random);
}

void ScaleColumns(const std::string& begin, double factor, RecordedTable* table) {
  for (const std::string& name : table->names)
    if (name.starts_with(begin))
      for (double& value : table->Get(name)) value *= factor;
}

/// The only cause is this one, and is named.
::testing::AssertionResult NamesOnly(const RecordingJudgement& judgement, const std::string& fault,
                                     const std::string& place, double value) {
  const bool is_named = judgement.causes.size() == 1 && judgement.causes[0].outcome == CauseOutcome::kNamed &&
                        judgement.causes[0].faults[0].fault == fault &&
                        judgement.causes[0].faults[0].place == place &&
                        std::abs(judgement.causes[0].faults[0].value - value) < 0.05 * std::abs(value);
  return is_named ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << Tell(judgement);
}

RecordedFault DryFriction(int joint, double value) {
  return {"dry friction", "joint panda_joint" + std::to_string(joint + 1), value,
          [=](mjModel* robot) { robot->dof_frictionloss[joint] = value; }};
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

TEST(Judge, AWrongRatioOfAnEncoderIsNamed) {
  RecordedTable table = Record({});
  ScaleColumns("q.panda_joint4", 1.17, &table);
  EXPECT_TRUE(NamesOnly(Judge(table), "position gain", "joint panda_joint4", 1.17));
}

TEST(Judge, ARecordedTorqueThatWasCutOffIsNamed) {
  double most = 0.0;
  // Noise comes after the cut, so that the largest number is not the limit.
  const RecordedFault cut = {.record = [&](RecordedTable* table) {
    std::vector<double>& torque = table->Get("tau.panda_joint2");
    most = 0.5 * *std::max_element(torque.begin(), torque.end());
    for (double& value : torque) value = std::clamp(value, -most, most);
  }};
  const RecordedTable table = Record({cut});
  EXPECT_TRUE(NamesOnly(Judge(table), "saturation", "joint panda_joint2", most));
}

TEST(Judge, AMotorThatGivesLessThanRecordedIsNamed) {
  // About a vertical axis: gravity would make the arm fall.
  const std::vector<double> torque = Record({}).Get("tau.panda_joint1");
  const auto [low, high] = std::minmax_element(torque.begin(), torque.end());
  const double most = 0.85 * std::max(-*low, *high);
  const RecordedFault weak = {.act = [=](double, const mjModel&, mjData* data) {
    data->qfrc_applied[0] = std::clamp(data->qfrc_applied[0], -most, most);
  }};
  EXPECT_TRUE(NamesOnly(Judge(Record({weak})), "saturation", "joint panda_joint1", most));
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

/// What a base that is accelerated does to all bodies.
RecordedFault Accelerate(const std::function<Vector3d(double t)>& acceleration) {
  return {.act = [=](double t, const mjModel& model, mjData* data) {
    const Vector3d a = acceleration(t);
    for (int body = 1; body < model.nbody; ++body)
      for (int k = 0; k < 3; ++k) data->xfrc_applied[6 * body + k] = -model.body_mass[body] * a[k];
  }};
}

TEST(Judge, ABaseThatShakesIsNamed) {
  constexpr double kAmplitude = 0.03, kFrequency = 2.0 * kPi * 0.9;
  const RecordedFault shaking = Accelerate([](double t) {
    return Vector3d(-kAmplitude * kFrequency * kFrequency * std::sin(kFrequency * t + 0.4) *
                    Vector3d::UnitY());
  });
  const RecordingJudgement judgement = Judge(Record({shaking}));
  EXPECT_TRUE(NamesOnly(judgement, "shaking", "base", kAmplitude));
  const std::string& detail = judgement.causes[0].faults[0].detail;  // "at 0.9 Hz, ..."
  ASSERT_TRUE(detail.starts_with("at ")) << Tell(judgement);
  EXPECT_NEAR(std::stod(detail.substr(3)), 0.9, 0.01) << Tell(judgement);
}

TEST(Judge, ABaseThatIsAcceleratedForAWhileIsNamed) {
  const auto judge = [](double from, double to) {
    const Vector3d a(0.6, -0.8, 0.0);
    return Judge(
        Record({Accelerate([=](double t) { return t > from && t < to ? a : Vector3d(Vector3d::Zero()); })}));
  };
  EXPECT_TRUE(NamesOnly(judge(8.0, 10.0), "acceleration", "base", 1.0));
  EXPECT_TRUE(NamesOnly(judge(7.0, 1e9), "acceleration", "base", 1.0)) << "to the end, as a tilt";
}

TEST(Judge, APushBesideACentreOfMassIsNamed) {
  const RecordedFault push = {.act = [](double t, const mjModel& model, mjData* data) {
    const int body = mj_name2id(&model, mjOBJ_BODY, "panda_link5");
    const double size = t > 8.0 && t < 11.0 ? 1.0 : 0.0;
    data->xfrc_applied[6 * body] = 30.0 * size;
    data->xfrc_applied[6 * body + 4] = 6.0 * size;
  }};
  const RecordingJudgement judgement = Judge(Record({push}));
  EXPECT_TRUE(NamesOnly(judgement, "force", "link panda_link5", 30.0));
  constexpr double kFewRows = 0.1;  // s; the quarter second before either is held out
  EXPECT_NEAR(judgement.causes[0].from, 8.0, kFewRows);
  EXPECT_NEAR(judgement.causes[0].to, 11.0, kFewRows);
}

TEST(Judge, AMeasuredWrenchIsNoCause) {
  constexpr int kLink = 6;
  const auto calc_force = [](double t, int k) { return 10.0 * std::sin((k + 1.0) * t + k); };
  const RecordedFault push = {.act = [&](double t, const mjModel& m, mjData* data) {
    for (int k = 0; k < 3; ++k) data->xfrc_applied[6 * m.jnt_bodyid[kLink] + k] = calc_force(t, k);
  }};
  RecordedTable table = Record({push});
  EXPECT_FALSE(Judge(table).Agrees());
  const std::vector<double> times = table.columns[0];
  for (int k = 0; k < 6; ++k) {
    table.names.push_back("wrench" + std::to_string(k));
    std::vector<double>& column = table.columns.emplace_back();
    for (const double t : times) column.push_back(k < 3 ? calc_force(t, k) : 0.0);
  }
  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(Panda(), table));
  recordings[0].wrenches = {{kLink, Panda().joint(kLink).body.com, /*is_world=*/true}};
  for (int k = 0; k < 6; ++k)
    recordings[0].channels.push_back(
        {RecordedQuantity::kWrench, k, table.names.size() - 6 + static_cast<size_t>(k)});
  const RecordingJudgement judgement = JudgeRecordings(Panda(), &recordings, {});
  EXPECT_TRUE(judgement.Agrees()) << Tell(judgement);
}

TEST(Judge, ForcesOnTwoLinksWithoutMomentsAreNoCause) {
  const auto calc_force = [](int link, double t, int k) { return 10.0 * std::sin((k + 1.0) * t + k + link); };
  const std::vector<int> links = {3, 6};
  const RecordedFault push = {.act = [&](double t, const mjModel& m, mjData* data) {
    for (const int link : links)
      for (int k = 0; k < 3; ++k) data->xfrc_applied[6 * m.jnt_bodyid[link] + k] = calc_force(link, t, k);
  }};
  RecordedTable table = Record({push});
  std::vector<Channel> channels;
  const auto judge = [&](size_t count) {
    std::vector<Recording> recordings;
    recordings.push_back(ToRecording(Panda(), table));
    for (size_t i = 0; i < count; ++i)
      recordings[0].wrenches.push_back({links[i], Panda().joint(links[i]).body.com, /*is_world=*/true});
    recordings[0].channels.insert(recordings[0].channels.end(), channels.begin(),
                                  channels.begin() + static_cast<std::ptrdiff_t>(3 * count));
    return JudgeRecordings(Panda(), &recordings, {.tries_positions = false});
  };
  const std::vector<double> times = table.columns[0];
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 3; ++k) {
      channels.push_back({RecordedQuantity::kWrench, 6 * i + k, table.names.size()});
      table.names.push_back("force" + std::to_string(3 * i + k));
      std::vector<double>& column = table.columns.emplace_back();
      for (const double t : times) column.push_back(calc_force(links[static_cast<size_t>(i)], t, k));
    }
  }
  EXPECT_FALSE(judge(0).Agrees());
  EXPECT_FALSE(judge(1).Agrees()) << "one of them alone";
  const RecordingJudgement judgement = judge(2);
  EXPECT_TRUE(judgement.Agrees()) << Tell(judgement);
}

TEST(Judge, ARecordedMotionOfTheBaseIsNoCause) {
  // The base is turned, and moves to and fro: in its axes that is another gravity, and a force on each body.
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.4, Vector3d(1.0, 2.0, 0.5).normalized()));
  constexpr double kReach = 0.05, kRate = 4.0;
  const RecordedFault moved = {
      .change =
          [&](mjModel* robot) {
            const Vector3d g = turned.conjugate() * Eigen::Map<Vector3d>(robot->opt.gravity);
            Eigen::Map<Vector3d>(robot->opt.gravity) = g;
          },
      .act =
          [&](double t, const mjModel& m, mjData* data) {
            const Vector3d a =
                turned.conjugate() * Vector3d(-kReach * kRate * kRate * std::sin(kRate * t), 0, 0);
            for (int body = 1; body < m.nbody; ++body)
              for (int k = 0; k < 3; ++k) data->xfrc_applied[6 * body + k] = -m.body_mass[body] * a[k];
          }};
  RecordedTable table = Record({moved});
  EXPECT_FALSE(Judge(table).Agrees());
  const std::vector<double> times = table.columns[0];
  const double rest[] = {0.0, 0.3, 0.5, turned.w(), turned.x(), turned.y(), turned.z()};
  for (int k = 0; k < 7; ++k) {
    table.names.push_back("pose" + std::to_string(k));
    std::vector<double>& column = table.columns.emplace_back();
    for (const double t : times) column.push_back(k == 0 ? kReach * std::sin(kRate * t) : rest[k]);
  }
  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(Panda(), table));
  for (int k = 0; k < 7; ++k)
    recordings[0].channels.push_back(
        {RecordedQuantity::kBase, k, table.names.size() - 7 + static_cast<size_t>(k)});
  const RecordingJudgement judgement = JudgeRecordings(Panda(), &recordings, {});
  EXPECT_TRUE(judgement.Agrees()) << Tell(judgement);
}

TEST(ClusteredVariances, OfAMeanAreThoseOfTheClustersMeans) {
  // Residuals of a mean in clusters of two: sum (mean of a cluster)^2 / (C (C - 1)).
  const std::vector<double> sums = {3.0, -1.0, -4.0, 2.0};
  std::vector<RowCluster> clusters;
  double expected = 0.0;
  for (const double sum : sums) {
    clusters.push_back({MatrixXd::Constant(1, 1, 2.0), VectorXd::Constant(1, sum)});
    expected += 0.25 * sum * sum / 12.0;
  }
  EXPECT_NEAR(CalcClusteredVariances(clusters)[0], expected, 1e-14);
  // What one cluster alone tells is not told by what clusters disagree.
  EXPECT_EQ(CalcClusteredVariances({clusters[0], {MatrixXd::Zero(1, 1), VectorXd::Zero(1)}})[0], 0.0);
}

TEST(Judge, FewNumbersPredictWhatIsHeldOut) {
  const RecordingJudgement judgement = Judge(Record({DryFriction(1, 1.5), DryFriction(3, 1.0)}));
  EXPECT_EQ(judgement.by_causes.numbers, 2);
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
  for (size_t i = table.rows() / 3; i < table.rows(); ++i) table.columns[0][i] += 5.0;
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

/// What --write makes of a model's file explains the recording.
void ExpectCorrected(const std::string& file, const std::string& comment, const RecordedTable& table) {
  const RobotDescription robot = ReadDescription(SourcePath("/" + file));
  const RobotModel model(robot.spec);
  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(model, table));
  const RecordingJudgement judgement = JudgeRecordings(model, &recordings, {});
  EXPECT_FALSE(judgement.Agrees());
  const std::string text = ReadBytes(SourcePath("/" + file));
  const CorrectedFile corrected = WriteCorrections(robot, text, judgement);
  EXPECT_TRUE(corrected.left.empty());
  const TemporaryFolder folder;
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
  const std::string file = SourcePath("/controller/parameters/panda.toml");
  const RobotDescription robot = ReadDescription(file);
  constexpr int kLink = 3;
  RecordingJudgement judgement;
  for (const TorqueFault& fault : ListTorqueFaults(Panda(), {kLink}, 1)) {
    if (fault.index != kLink || fault.place != "link " + Panda().link_name(kLink)) continue;
    VectorXd amplitude = VectorXd::Zero(static_cast<Eigen::Index>(fault.columns.size()));
    if (fault.kind == TorqueFault::kMass) amplitude[0] = -0.9 * fault.nominal;
    if (fault.kind == TorqueFault::kInertia) amplitude[0] = -0.5 * Panda().joint(kLink).body.inertia(0, 0);
    if (amplitude.isZero()) continue;
    judgement.found.push_back({fault, amplitude, amplitude});
  }
  ASSERT_EQ(judgement.found.size(), 2U);
  const CorrectedFile corrected = WriteCorrections(robot, ReadBytes(file), judgement);
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
