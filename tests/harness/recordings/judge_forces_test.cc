// Recordings of a robot that is pushed or whose base moves: what is measured of it is no cause, what is not
// is named.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "harness/recordings/torque_errors.h"
#include "tests/harness/recordings/judge_panda.h"

namespace dexcheck::testing::judge_forces_test {
namespace {

/// Returns the effect of an accelerated base on all bodies.
RecordedFault Accelerate(const std::function<Vector3d(double t)>& acceleration) {
  return {.act = [=](double t, const mjModel& model, mjData* data) {
    const Vector3d a = acceleration(t);
    for (int body = 1; body < model.nbody; ++body)
      for (int k = 0; k < 3; ++k) data->xfrc_applied[6 * body + k] = -model.body_mass[body] * a[k];
  }};
}

TEST(JudgeForces, ABaseThatShakesIsNamed) {
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

TEST(JudgeForces, ABaseThatIsAcceleratedForAWhileIsNamed) {
  const auto judge = [](double from, double to) {
    const Vector3d a(0.6, -0.8, 0.0);
    return Judge(
        Record({Accelerate([=](double t) { return t > from && t < to ? a : Vector3d(Vector3d::Zero()); })}));
  };
  EXPECT_TRUE(NamesOnly(judge(8.0, 10.0), "acceleration", "base", 1.0));
  EXPECT_TRUE(NamesOnly(judge(7.0, 1e9), "acceleration", "base", 1.0)) << "to the end, as a tilt";
}

TEST(JudgeForces, APushBesideACentreOfMassIsNamed) {
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

/// Adds columns of a quantity's values f(t, k). @returns their channels.
std::vector<Channel> AddColumns(RecordedQuantity quantity, int first, int count,
                                const std::function<double(double t, int k)>& f, RecordedTable* table) {
  const std::vector<double> times = table->columns[0];
  std::vector<Channel> channels;
  for (int k = 0; k < count; ++k) {
    channels.push_back({quantity, first + k, table->names.size()});
    table->names.push_back("added" + std::to_string(table->names.size()));
    std::vector<double>& column = table->columns.emplace_back();
    for (const double t : times) column.push_back(f(t, k));
  }
  return channels;
}

/// @param links on which measured forces act, at their centres of mass, in the world's axes.
RecordingJudgement JudgeWith(const RecordedTable& table, const std::vector<Channel>& channels,
                             const std::vector<int>& links, const JudgeOptions& options) {
  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(Panda(), table));
  for (const int link : links)
    recordings[0].wrenches.push_back({link, Panda().joint(link).body.com, /*is_world=*/true});
  recordings[0].channels.insert(recordings[0].channels.end(), channels.begin(), channels.end());
  return JudgeRecordings(Panda(), &recordings, options);
}

TEST(JudgeForces, MeasuredForcesAreNoCause) {
  // The forces are those of one link with its moment, or of two without.
  for (const std::vector<int>& links : {std::vector<int>{6}, {3, 6}}) {
    const int width = links.size() == 1 ? 6 : 3;
    const auto calc_force = [](int link, double t, int k) {
      return k < 3 ? 10.0 * std::sin((k + 1.0) * t + k + link) : 0.0;
    };
    const RecordedFault push = {.act = [&](double t, const mjModel& m, mjData* data) {
      for (const int link : links)
        for (int k = 0; k < 3; ++k) data->xfrc_applied[6 * m.jnt_bodyid[link] + k] = calc_force(link, t, k);
    }};
    RecordedTable table = Record({push});
    std::vector<Channel> channels;
    for (size_t i = 0; i < links.size(); ++i) {
      const auto calc = [&](double t, int k) { return calc_force(links[i], t, k); };
      const auto added = AddColumns(RecordedQuantity::kWrench, 6 * static_cast<int>(i), width, calc, &table);
      channels.insert(channels.end(), added.begin(), added.end());
    }
    for (size_t count = 0; count <= links.size(); ++count) {
      const auto known = static_cast<std::ptrdiff_t>(count);
      const RecordingJudgement judgement =
          JudgeWith(table, {channels.begin(), channels.begin() + width * known},
                    {links.begin(), links.begin() + known}, {.tries_positions = false});
      EXPECT_EQ(judgement.Agrees(), count == links.size()) << count << Tell(judgement);
    }
  }
}

TEST(JudgeForces, ARecordedMotionOfTheBaseIsNoCause) {
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
  const double rest[] = {0.0, 0.3, 0.5, turned.w(), turned.x(), turned.y(), turned.z()};
  const auto calc_pose = [&](double t, int k) { return k == 0 ? kReach * std::sin(kRate * t) : rest[k]; };
  const auto channels = AddColumns(RecordedQuantity::kBase, 0, 7, calc_pose, &table);
  const RecordingJudgement judgement = JudgeWith(table, channels, {}, {});
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
  // A value from one cluster alone does not follow from the disagreement of clusters.
  EXPECT_EQ(CalcClusteredVariances({clusters[0], {MatrixXd::Zero(1, 1), VectorXd::Zero(1)}})[0], 0.0);
}

// Since then its weight acts at the hand's centre of mass, and its inertia.
TEST(JudgeForces, APayloadThatIsPickedUpMidwayIsNamed) {
  constexpr double kMass = 0.8, kFrom = 8.0;
  Vector3d last_velocity = Vector3d::Zero();
  const RecordedFault payload = {.act = [&](double t, const mjModel& robot, mjData* data) {
    const int hand = robot.nbody - 1;
    Vector6d twist;  // turning, then moving
    mj_objectVelocity(&robot, data, mjOBJ_BODY, hand, twist.data(), /*flg_local=*/0);
    const Vector3d velocity = twist.tail<3>();
    const Vector3d acceleration = (velocity - std::exchange(last_velocity, velocity)) / robot.opt.timestep;
    const Vector3d force = kMass * (Vector3d(robot.opt.gravity) - acceleration), none = Vector3d::Zero();
    if (t >= kFrom)
      mj_applyFT(&robot, data, force.data(), none.data(), data->xipos + 3 * hand, hand, data->qfrc_applied);
  }};
  const RecordingJudgement judgement = Judge(Record({payload}));
  ASSERT_EQ(judgement.causes.size(), 1U) << Tell(judgement);
  const Explanation& cause = judgement.causes[0];
  EXPECT_EQ(cause.outcome, CauseOutcome::kNamed) << Tell(judgement);
  EXPECT_EQ(cause.faults[0].fault + ", " + cause.faults[0].place, "payload, link panda_link7");
  EXPECT_NEAR(cause.faults[0].value, kMass, 0.05 * kMass);
  EXPECT_NEAR(cause.from, kFrom, 0.3);
}

}  // namespace
}  // namespace dexcheck::testing::judge_forces_test
