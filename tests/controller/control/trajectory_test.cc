// X_d(t): derivatives, boundary conditions, continuity, known values, the reader.

#include "controller/control/trajectory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "controller/common/errors.h"
#include "controller/object/so3.h"
#include "tests/common/finite_difference.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::trajectory_test {
namespace {

constexpr double kRounding = 1e-14;  // values of up to a few m and rad

Vector6d MakeStart() {
  Vector6d X;
  X << 0.6, -0.2, 0.9, 0.3, 1.4, -0.5;
  return X;
}

Vector6d MakeDirection() {
  Vector6d X;
  X << 0.3, -0.1, 0.05, 0.4, 0.2, -0.3;
  return X;
}

std::vector<WayPoint> MakeWayPoints() {
  std::vector<WayPoint> points;
  for (const double time : {0.7, 1.5, 1.9, 3.0}) {
    Vector6d displacement;
    for (int i = 0; i < 6; ++i) displacement[i] = std::sin(2.0 * time + i);
    points.push_back({time, displacement});
  }
  return points;
}

std::unique_ptr<Trajectory> MakeSum() {
  std::vector<std::unique_ptr<Trajectory>> parts;
  parts.push_back(MakeCircleTrajectory(Vector6d::Zero(), {-0.4, 0.9, 1.2}, 0.8));
  parts.push_back(MakePointToPointTrajectory(Vector6d::Zero(), MakeDirection(), 1.7));
  return MakeSumTrajectory(MakeStart(), std::move(parts));
}

std::map<std::string, std::unique_ptr<Trajectory>> MakeAll() {
  std::map<std::string, std::unique_ptr<Trajectory>> all;
  const Vector6d X = MakeStart();
  const Vector6d d = MakeDirection();
  all["line"] = MakeLineTrajectory(X, d, 0.0);
  all["ramp"] = MakeLineTrajectory(X, d, 1.3);
  all["point_to_point"] = MakePointToPointTrajectory(X, d, 1.7);
  all["oscillation"] = MakeOscillationTrajectory(X, d, 0.8, 1.1);
  all["fading"] = MakeOscillationTrajectory(X, d, 0.8, 1.3, 2.75);
  all["weave"] = MakeWeaveTrajectory(X, {0.7, 1.0, 1.2}, 0.15, 1.6);
  all["circle"] = MakeCircleTrajectory(X, {-0.4, 0.9, 1.2}, 0.8);
  all["right_circle"] = MakeCircleTrajectory(X, {-0.4, 0.9, 0.0}, -0.8);
  all["way_points"] = MakeWayPointTrajectory(X, MakeWayPoints());
  all["sum"] = MakeSum();
  return all;
}

TEST(Trajectory, DerivativesAreThoseOfThePosition) {
  // h^4 times fifth derivatives of up to 1e4, eps / h.
  constexpr double kStep = 1e-3;
  constexpr double kTolerance = 1e-8;
  for (const auto& [name, trajectory] : MakeAll()) {
    const Trajectory& curve = *trajectory;
    for (double t = 0.0573; t < 3.2; t += 0.0973) {  // no knot within two steps
      const DesiredMotion motion = trajectory->Evaluate(t);
      const auto X = [&](double h) { return curve.Evaluate(t + h).X_d; };
      const auto X_dot = [&](double h) { return curve.Evaluate(t + h).X_d_dot; };
      EXPECT_TRUE(MatrixNear(Differentiate(X, kStep), motion.X_d_dot, kTolerance)) << name << " at " << t;
      EXPECT_TRUE(MatrixNear(Differentiate(X_dot, kStep), motion.X_d_ddot, kTolerance))
          << name << " at " << t;
    }
  }
}

TEST(Trajectory, StartsWhereTheObjectIs) {
  for (const auto& [name, trajectory] : MakeAll()) {
    const DesiredMotion motion = trajectory->Evaluate(0.0);
    EXPECT_TRUE(MatrixNear(motion.X_d, MakeStart(), kRounding)) << name;
    if (name == "line" || name == "right_circle") {
      EXPECT_GT(motion.X_d_dot.norm(), 0.1) << name;
    } else {
      EXPECT_TRUE(MatrixNear(motion.X_d_dot, Vector6d::Zero(), kRounding)) << name;
      EXPECT_TRUE(MatrixNear(motion.X_d_ddot, Vector6d::Zero(), kRounding)) << name;
    }
  }
}

// Across every time at which a formula changes, X_d_ddot moves by no more than its slope allows.
TEST(Trajectory, AccelerationIsContinuous) {
  constexpr double kStep = 1e-7;
  for (const auto& [name, trajectory] : MakeAll()) {
    if (name == "line" || name == "right_circle") continue;
    double largest = 0.0;
    for (const double t : {0.0, 0.7, 1.1, 1.2, 1.3, 1.5, 1.7, 1.9, 3.0}) {
      const DesiredMotion before = trajectory->Evaluate(t - kStep);
      const DesiredMotion after = trajectory->Evaluate(t + kStep);
      largest = std::max(largest, after.X_d_ddot.norm());
      // Jerks of up to 500 per s^3.
      EXPECT_TRUE(MatrixNear(before.X_d, after.X_d, 1e3 * kStep)) << name << " at " << t;
      EXPECT_TRUE(MatrixNear(before.X_d_dot, after.X_d_dot, 1e3 * kStep)) << name << " at " << t;
      EXPECT_TRUE(MatrixNear(before.X_d_ddot, after.X_d_ddot, 1e3 * kStep)) << name << " at " << t;
    }
    EXPECT_GT(largest, 1e-4) << name;
  }
}

/// A motion at one time, worked out by hand.
struct ByHand {
  const char* name;
  std::unique_ptr<Trajectory> trajectory;
  double t;
  Vector6d X, X_dot, X_ddot;
};

Vector6d MakeVector(double x, double y, double turn) {
  return (Vector6d() << x, y, 0, turn, 0, 0).finished();
}

TEST(Trajectory, ByHand) {
  const Vector6d start = MakeStart(), d = MakeDirection(), none = Vector6d::Zero(),
                 ahead = MakeVector(1, 0, 0);
  std::vector<ByHand> cases;
  cases.push_back({"line", MakeLineTrajectory(start, ahead, 0.0), 2.5, start + 2.5 * ahead, ahead, none});
  // With a ramp half of the ramp's time is lost; in its middle the speed is half.
  cases.push_back({"ramp", MakeLineTrajectory(start, ahead, 2.0), 2.5, start + 1.5 * ahead, ahead, none});
  cases.push_back({"middle of a ramp", MakeLineTrajectory(start, ahead, 2.0), 1.0, start + 5.0 / 32.0 * ahead,
                   0.5 * ahead, 0.9375 * ahead});
  // u = 1/2: s = 1/2, s_dot = 15/8 / T, s_ddot = 0; ends at rest.
  for (const auto& [t, s, s_dot] : {std::tuple(1.0, 0.5, 15.0 / 16.0), {2.0, 1.0, 0.0}, {3.0, 1.0, 0.0}})
    cases.push_back(
        {"least jerk", MakePointToPointTrajectory(start, d, 2.0), t, start + s * d, s_dot * d, none});
  cases.push_back({"peak of a swing", MakeOscillationTrajectory(start, d, 0.25, 0.0), 1.0, start + d, none,
                   -kPi * kPi / 4.0 * d});
  cases.push_back(
      {"faded swing", MakeOscillationTrajectory(start, d, 0.25, 0.5, 2.0), 2.0, start, none, none});
  // A quarter to the left from heading +x: at (r, r), turned by 90 degrees, accelerating to the centre.
  constexpr double r = 0.8, v = 0.4;
  cases.push_back({"circle", MakeCircleTrajectory(none, {0.0, v, 0.0}, r), kPi / 2.0 * r / v,
                   MakeVector(r, r, kPi / 2.0), MakeVector(0, v, v / r), MakeVector(-v * v / r, 0, 0)});
  // Half a wave on: on the far side, heading as at the start.
  cases.push_back({"weave", MakeWeaveTrajectory(none, {kPi / 2.0, 1.0, 0.0}, 0.2, 2.0), 1.0,
                   MakeVector(-0.4, 1, 0), MakeVector(0, 1, -0.2 * kPi * kPi),
                   MakeVector(0.2 * kPi * kPi, 0, 0)});
  for (const ByHand& one : cases) {
    SCOPED_TRACE(one.name);
    const DesiredMotion motion = one.trajectory->Evaluate(one.t);
    EXPECT_TRUE(MatrixNear(motion.X_d, one.X, kRounding));
    EXPECT_TRUE(MatrixNear(motion.X_d_dot, one.X_dot, kRounding));
    EXPECT_TRUE(MatrixNear(motion.X_d_ddot, one.X_ddot, 10.0 * kRounding));
  }
  // Before it fades a swing is as without an end.
  EXPECT_TRUE(MatrixNear(MakeOscillationTrajectory(start, d, 0.25, 0.5, 2.0)->Evaluate(1.4).X_d,
                         MakeOscillationTrajectory(start, d, 0.25, 0.5)->Evaluate(1.4).X_d, 0.0));
}

// The object turns about the world's vertical like the path's tangent.
TEST(Trajectory, PlanarPathsKeepTheObjectsHeading) {
  const auto all = MakeAll();
  for (const std::string name : {"weave", "circle", "right_circle"}) {
    const double heading = name == "weave" ? 0.7 : -0.4;
    const Matrix3d R_start = CalcRotationZyz(MakeStart().tail<3>());
    double turned = 0.0;
    for (double t = 0.2; t < 4.0; t += 0.13) {
      const DesiredMotion motion = all.at(name)->Evaluate(t);
      const double tangent = std::atan2(motion.X_d_dot[1], motion.X_d_dot[0]);
      const double turn = std::remainder(motion.X_d[3] - MakeStart()[3] + heading - tangent, 2.0 * kPi);
      EXPECT_NEAR(turn, 0.0, 1e-13) << name;
      const double about_z = motion.X_d[3] - MakeStart()[3];
      turned = std::max(turned, std::abs(about_z));
      EXPECT_TRUE(MatrixNear(CalcRotationZyz(motion.X_d.tail<3>()),
                             Eigen::AngleAxisd(about_z, Vector3d::UnitZ()) * R_start, kRounding));
    }
    EXPECT_GT(turned, 0.3);
  }
}

TEST(Trajectory, GoesThroughItsWayPoints) {
  const auto path = MakeWayPointTrajectory(MakeStart(), MakeWayPoints());
  for (const WayPoint& point : MakeWayPoints()) {
    EXPECT_TRUE(MatrixNear(path->Evaluate(point.time).X_d, MakeStart() + point.displacement, kRounding));
  }
  for (const double t : {-1.0, 0.0, 3.0, 4.0}) {
    EXPECT_TRUE(MatrixNear(path->Evaluate(t).X_d_dot, Vector6d::Zero(), kRounding));
    EXPECT_TRUE(MatrixNear(path->Evaluate(t).X_d_ddot, Vector6d::Zero(), kRounding));
  }
}

// One way-point is a least-jerk move. Of three knots at t = 0, 1, 2 the spline's velocity in the middle is
// 3/4 (X_2 - X_0) and its acceleration 3 X_2 - 6 X_1 + 3 X_0.
TEST(Trajectory, WayPointsByHand) {
  const Vector6d d = MakeDirection();
  const auto move = MakeWayPointTrajectory(MakeStart(), {{2.0, d}});
  const auto expected = MakePointToPointTrajectory(MakeStart(), d, 2.0);
  for (double t = 0.1; t < 2.0; t += 0.3) {
    EXPECT_TRUE(MatrixNear(move->Evaluate(t).X_d, expected->Evaluate(t).X_d, kRounding));
    EXPECT_TRUE(MatrixNear(move->Evaluate(t).X_d_ddot, expected->Evaluate(t).X_d_ddot, 10.0 * kRounding));
  }
  const auto two = MakeWayPointTrajectory(MakeStart(), {{1.0, 5.0 * d}, {2.0, 2.0 * d}});
  EXPECT_TRUE(MatrixNear(two->Evaluate(1.0).X_d_dot, 0.75 * 2.0 * d, kRounding));
  EXPECT_TRUE(MatrixNear(two->Evaluate(1.0).X_d_ddot, (3.0 * 2.0 - 6.0 * 5.0) * d, 10.0 * kRounding));
}

TEST(Trajectory, SumAddsItsParts) {
  const auto all = MakeAll();
  const double t = 1.3;
  const DesiredMotion sum = all.at("sum")->Evaluate(t);
  const DesiredMotion circle = all.at("circle")->Evaluate(t);
  const DesiredMotion move = all.at("point_to_point")->Evaluate(t);
  EXPECT_GT((circle.X_d - MakeStart()).norm(), 0.1);
  EXPECT_GT((move.X_d - MakeStart()).norm(), 0.1);
  EXPECT_TRUE(MatrixNear(sum.X_d, circle.X_d + move.X_d - MakeStart(), kRounding));
  EXPECT_TRUE(MatrixNear(sum.X_d_dot, circle.X_d_dot + move.X_d_dot, kRounding));
  EXPECT_TRUE(MatrixNear(sum.X_d_ddot, circle.X_d_ddot + move.X_d_ddot, kRounding));
}

std::unique_ptr<Trajectory> Parse(const std::string& text) {
  const TomlDocument document(text, "scenario.toml");
  return document.Read([](TomlTable table) { return ReadTrajectory(table); })(MakeStart());
}

TEST(TrajectoryReader, ReadsEveryType) {
  const auto all = MakeAll();
  const auto expect_same = [&](const std::string& name, const std::string& text) {
    const std::unique_ptr<Trajectory> read = Parse(text);
    for (const double t : {0.3, 1.0, 2.7}) {
      EXPECT_TRUE(MatrixNear(read->Evaluate(t).X_d, all.at(name)->Evaluate(t).X_d, kRounding)) << name;
      EXPECT_TRUE(MatrixNear(read->Evaluate(t).X_d_dot, all.at(name)->Evaluate(t).X_d_dot, kRounding))
          << name;
    }
  };
  const std::string direction = "velocity = [0.3, -0.1, 0.05]\nturning = [0.4, 0.2, -0.3]\n";
  const std::string displacement = "xyz = [0.3, -0.1, 0.05]\nzyz = [0.4, 0.2, -0.3]\n";
  expect_same("line", "type = 'line'\n" + direction);
  expect_same("ramp", "type = 'line'\nramp_time = 1.3\n" + direction);
  expect_same("point_to_point", "type = 'point_to_point'\nduration = 1.7\n" + displacement);
  expect_same("oscillation", "type = 'oscillation'\nfrequency = 0.8\nramp_time = 1.1\n" + displacement);
  expect_same(
      "weave",
      "type = 'weave'\nheading = 0.7\nspeed = 1.0\nramp_time = 1.2\namplitude = 0.15\nwavelength = 1.6\n");
  expect_same("circle", "type = 'circle'\nheading = -0.4\nspeed = 0.9\nramp_time = 1.2\nradius = 0.8\n");
  expect_same(
      "sum",
      "type = 'sum'\nparts = [{ type = 'circle', heading = -0.4, speed = 0.9, ramp_time = 1.2, radius = 0.8 "
      "}, { type = 'point_to_point', duration = 1.7, xyz = [0.3, -0.1, 0.05], zyz = [0.4, 0.2, -0.3] }]\n");
  const std::unique_ptr<Trajectory> points = Parse(
      "type = 'way_points'\npoints = [{ time = 1.0, xyz = [0.1, 0, 0] }, { time = 2, zyz_deg = [90, 0, 0] "
      "}]\n");
  EXPECT_NEAR(points->Evaluate(1.0).X_d[0], MakeStart()[0] + 0.1, kRounding);
  EXPECT_NEAR(points->Evaluate(2.0).X_d[0], MakeStart()[0], kRounding);
  EXPECT_NEAR(points->Evaluate(2.0).X_d[3], MakeStart()[3] + kPi / 2.0, kRounding);
}

TEST(TrajectoryReader, RejectsWhatIsWrong) {
  const auto rejects = [](const std::string& text, const std::string& message) {
    return Throws<InputError>([&] { return Parse(text); }, message);
  };
  EXPECT_TRUE(rejects("type = 'spiral'", "type"));
  EXPECT_TRUE(rejects("type = 'line'\nspeed = 3", "speed"));
  EXPECT_TRUE(rejects("type = 'point_to_point'", "duration"));
  EXPECT_TRUE(rejects("type = 'point_to_point'\nduration = -1", "scenario.toml:2: duration"));
  EXPECT_TRUE(rejects("type = 'circle'\nspeed = 1\nradius = 0", "radius: must not be zero"));
  EXPECT_TRUE(
      rejects("type = 'oscillation'\nfrequency = 1e308", "frequency: must not be so large, got 1e+308"));
  EXPECT_TRUE(rejects("type = 'weave'\nspeed = 1\namplitude = 1e308\nwavelength = 0.1",
                      "amplitude: must not be so large, got 1e+308"));
  EXPECT_TRUE(rejects("type = 'weave'\nspeed = 1\namplitude = 1\nwavelength = 1e-320",
                      "wavelength: must not be so small, got 1e-320"));
  EXPECT_TRUE(rejects("type = 'way_points'\npoints = []", "needs at least one point"));
  EXPECT_TRUE(rejects("type = 'way_points'\npoints = [{ time = 2 }, { time = 1 }]",
                      "must be greater than the time before"));
  EXPECT_TRUE(rejects("type = 'way_points'\npoints = [{ time = 2, abc = 1 }]", "abc"));
  EXPECT_TRUE(rejects("type = 'sum'\nparts = []", "parts: needs at least one part"));
  EXPECT_TRUE(rejects("type = 'sum'\nparts = [{ type = 'line', radius = 1 }]", "radius: unknown key"));
  EXPECT_TRUE(rejects("type = 'sum'\nparts = [3]", "parts"));
}

}  // namespace
}  // namespace dexcheck::testing::trajectory_test
