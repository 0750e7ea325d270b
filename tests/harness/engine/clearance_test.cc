// Distances of solids, which pairs are watched, and how they are followed.

#include "harness/engine/clearance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "harness/engine/engine.h"
#include "harness/engine/exact_collision.h"
#include "tests/common/allocation_counter.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::clearance_test {
namespace {

using Shape = Solid::Shape;

constexpr double kAccuracy = 2e-7;  // m: twice that of CalcDistance

Solid Make(Shape shape, const Vector3d& size) { return Solid{.shape = shape, .size = size}; }

Pose At(double x, double y, double z, const Matrix3d& R = Matrix3d::Identity()) {
  Pose X = Pose::Identity();
  X.linear() = R;
  X.translation() = Vector3d(x, y, z);
  return X;
}

Matrix3d Turn(double angle, const Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

const Solid kBall = Make(Shape::kSphere, {0.02, 0.0, 0.0});
const Solid kCapsule = Make(Shape::kCapsule, {0.01, 0.05, 0.0});
const Solid kCylinder = Make(Shape::kCylinder, {0.03, 0.05, 0.0});
const Solid kBox = Make(Shape::kBox, {0.04, 0.05, 0.06});
const Solid kEllipsoid = Make(Shape::kEllipsoid, {0.03, 0.04, 0.05});
const Solid kTorus = Make(Shape::kTorus, {0.035, 0.011, 0.0});
const Solid kPlane = Make(Shape::kPlane, Vector3d::Zero());
/// A bench's top: wide and thin.
const Solid kTop = Make(Shape::kBox, {1.4, 0.3, 0.02});

TEST(SolidDistance, IsThatOfTheWorkedCases) {
  const double kRight = kPi / 2.0;
  const auto distance = [](const Solid& a, const Pose& X_A, const Solid& b, const Pose& X_B) {
    EXPECT_NEAR(CalcDistance(a, X_A, b, X_B), CalcDistance(b, X_B, a, X_A), kAccuracy);
    return CalcDistance(a, X_A, b, X_B);
  };
  EXPECT_NEAR(distance(kBall, At(0, 0, 0), kBall, At(0.06, 0.08, 0)), 0.06, kAccuracy);
  EXPECT_NEAR(distance(kBall, At(0, 0, 0), kBall, At(0.03, 0, 0)), -0.01, kAccuracy);
  EXPECT_NEAR(distance(kCapsule, At(0, 0, 0), kBall, At(0, 0.03, 0.09)), 0.02, kAccuracy);
  EXPECT_NEAR(distance(kCapsule, At(0, 0, 0), kCapsule, At(0.1, 0, 0, Turn(kRight, Vector3d::UnitX()))), 0.08,
              kAccuracy);
  // Side to side, side to end, and the rim to a face.
  EXPECT_NEAR(distance(kCylinder, At(0, 0, 0), kCylinder, At(0.1, 0, 0.02)), 0.04, kAccuracy);
  EXPECT_NEAR(distance(kCylinder, At(0, 0, 0), kCylinder, At(0.1, 0, 0, Turn(kRight, Vector3d::UnitY()))),
              0.02, kAccuracy);
  EXPECT_NEAR(distance(kCylinder, At(0, 0, 0.2, Turn(0.5, Vector3d::UnitX())), kBox, At(0, 0, 0)),
              0.2 - 0.05 * std::cos(0.5) - 0.03 * std::sin(0.5) - 0.06, kAccuracy);
  EXPECT_NEAR(distance(kBox, At(0, 0, 0), kBox, At(0.2, 0.2, 0.2)),
              std::sqrt(0.12 * 0.12 + 0.1 * 0.1 + 0.08 * 0.08), kAccuracy);
  EXPECT_NEAR(distance(kEllipsoid, At(0, 0, 0), kBox, At(0, 0.2, 0)), 0.11, kAccuracy);
  EXPECT_NEAR(distance(kPlane, At(0, 0, 0), kCylinder, At(1, 2, 0.1, Turn(0.5, Vector3d::UnitY()))),
              0.1 - 0.05 * std::cos(0.5) - 0.03 * std::sin(0.5), 1e-15);
  // A torus has a hole, in which a finger does not touch it.
  EXPECT_NEAR(distance(kTorus, At(0, 0, 0), kCapsule, At(0, 0, 0)), 0.035 - 0.011 - 0.01, kAccuracy);
  EXPECT_NEAR(distance(kTorus, At(0, 0, 0), kCapsule, At(0.02, 0, 0)), 0.015 - 0.011 - 0.01, kAccuracy);
  EXPECT_NEAR(distance(kTorus, At(0, 0, 0, Turn(kRight, Vector3d::UnitX())), kPlane, At(0, 0, -0.1)), 0.054,
              kAccuracy);
}

TEST(SolidDistance, ReportsHowDeepBodiesOverlap) {
  // Far from the middle of a wide thin top, where its nearest face is above.
  for (const double x : {0.0, 0.7, 1.2, 1.35}) {
    for (const double z : {0.025, 0.015, 0.002}) {
      EXPECT_NEAR(CalcDistance(kTop, At(0, 0, 0), Make(Shape::kCylinder, {0.008, 0.01, 0}), At(x, 0.1, z)),
                  z - 0.03, 1e-6)
          << x << " " << z;
      EXPECT_NEAR(CalcDistance(kTop, At(0, 0, 0), Make(Shape::kBox, {0.02, 0.03, 0.01}),
                               At(x, 0.1, z, Turn(0.3, Vector3d::UnitZ()))),
                  z - 0.03, 1e-6);
      EXPECT_NEAR(CalcDistance(kTop, At(0, 0, 0), Make(Shape::kCapsule, {0.008, 0.01, 0}), At(x, 0.1, z)),
                  z - 0.038, 1e-6);
    }
  }
}

// Solids that are apart stay apart when both grow by less than the distance, and touch when one grows by
// more.
TEST(SolidDistance, IsBetweenABoundOfEitherSide) {
  std::mt19937 random(3);
  std::normal_distribution<double> draw;
  const auto random_pose = [&] {
    const Eigen::Quaterniond q(draw(random), draw(random), draw(random), draw(random));
    return At(0.06 * draw(random), 0.06 * draw(random), 0.06 * draw(random),
              q.normalized().toRotationMatrix());
  };
  int apart = 0;
  for (const Solid& shape : {kCapsule, kCylinder, kBox, kEllipsoid}) {
    for (int i = 0; i < 300; ++i) {
      const Pose X_A = random_pose();
      const Pose X_B = random_pose();
      const double distance = CalcDistance(shape, X_A, kCylinder, X_B);
      // A ball that reaches from a point of the cylinder's axis to the shape is no smaller than the distance
      // between them, and the least of such is at most the radius more.
      double least = 1.0;
      for (int k = 0; k <= 200; ++k) {
        const Vector3d on_axis = X_B * Vector3d(0, 0, -0.05 + 0.0005 * k);
        Solid point = kBall;
        point.size.setZero();
        least = std::min(least, CalcDistance(shape, X_A, point, At(on_axis.x(), on_axis.y(), on_axis.z())));
      }
      EXPECT_LE(distance, least + kAccuracy);
      EXPECT_GE(distance, std::min(least, 0.0) - 0.03 - 0.06 - kAccuracy);
      if (least > 0.03) EXPECT_GE(distance, least - 0.03 - 3e-4);
      apart += distance > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(apart, 200);
  EXPECT_LT(apart, 1100);
}

class ClearanceTest : public ::testing::Test {
 protected:
  ClearanceTest()
      : model_(ReadRobotModel(SourcePath("/controller/parameters/assistant_robot.toml"))),
        engine_(LoadMjcf(SourcePath("/mjcf/bench_scene.xml"))),
        adapter_(model_, *engine_, "bench_scene.xml"),
        solids_(ListSolids(*engine_)) {}

  [[nodiscard]] std::vector<WatchedPair> List(const std::vector<AllowedPair>& allowed = {}) const {
    return ListWatchedPairs(*engine_, adapter_, solids_, allowed, "test");
  }
  [[nodiscard]] bool Watches(const std::vector<WatchedPair>& pairs, const std::string& a,
                             const std::string& b) const {
    return std::ranges::any_of(pairs, [&](const WatchedPair& pair) {
      const std::string& first = solids_.list[static_cast<size_t>(pair.a)].name;
      const std::string& second = solids_.list[static_cast<size_t>(pair.b)].name;
      return (first == a && second == b) || (first == b && second == a);
    });
  }

  RobotModel model_;
  MjModelPtr engine_;
  Adapter adapter_;
  Solids solids_;
};

TEST_F(ClearanceTest, WatchesWhatIsNotMeantToTouch) {
  const std::vector<WatchedPair> pairs = List();
  for (const auto& [a, b] : std::vector<AllowedPair>{{"r_palm", "bench"},
                                                     {"r_palm", "torus"},
                                                     {"rf1_phalanx_3", "bench"},
                                                     {"rf1_phalanx_4", "torus"},
                                                     {"r_forearm", "platform"},
                                                     {"rf1_phalanx_2", "rf2_phalanx_2"},
                                                     {"platform", "floor"},
                                                     {"r_palm", "l_palm"},
                                                     {"wheel_right", "bench"}}) {
    EXPECT_TRUE(Watches(pairs, a, b)) << a << " " << b;
  }
  // Neighbours, also over a joint whose axes meet the next one's, wheels on the floor, what does not move.
  for (const auto& [a, b] : std::vector<AllowedPair>{{"r_forearm", "r_wrist"},
                                                     {"r_wrist", "r_palm"},
                                                     {"torso", "r_upper_arm"},
                                                     {"wheel_right", "floor"},
                                                     {"bench", "floor"}}) {
    EXPECT_FALSE(Watches(pairs, a, b)) << a << " " << b;
  }
  // A declared contact is of its geoms alone: another part of the fingertip's body is watched.
  for (const WatchedPair& pair : pairs) {
    EXPECT_EQ(std::ranges::count(solids_.declared, std::pair(pair.a, pair.b)), 0);
  }
  EXPECT_FALSE(Watches(List({{"bench", "r_palm"}}), "r_palm", "bench"));
  EXPECT_THROW((void)List({{"bench", "r_plam"}}), InputError);
}

// At some of many small random steps all distances are computed besides.
TEST_F(ClearanceTest, MissesNoOverlapAndMeasuresFew) {
  constexpr int kSteps = 400;
  const std::vector<WatchedPair> pairs = List();
  Clearance clearance(*engine_, adapter_, solids_, pairs);
  const MjDataPtr data = MakeData(*engine_);
  std::mt19937 random(11);
  std::normal_distribution<double> draw;
  VectorXd rate = VectorXd::Zero(engine_->nv);
  std::array<double, kPairClassCount> smallest;
  smallest.fill(1e9);
  int overlapped = 0;
  long before = 0;
  for (int step = 0; step < kSteps; ++step) {
    for (int i = 0; i < engine_->nv; ++i) rate[i] = 0.99 * rate[i] + 1e-4 * draw(random);
    rate.head<6>() *= 0.5;
    mj_integratePos(engine_.get(), data->qpos, rate.data(), 1.0);
    mj_kinematics(engine_.get(), data.get());
    const AllocationCounter counter;
    clearance.Update({data->xpos, data->xmat}, step);
    EXPECT_EQ(counter.count(), 0);
    if (step == 0) before = clearance.measured();
    if (step % 20 != 0) continue;
    double deepest = 0.0;
    for (const WatchedPair& pair : pairs) {
      const auto pose = [&](int index) {
        const Solid& solid = solids_.list[static_cast<size_t>(index)];
        Pose X = Pose::Identity();
        X.linear() =
            Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data->xmat + 9 * solid.body);
        X.translation() = Eigen::Map<const Vector3d>(data->xpos + 3 * solid.body);
        return Pose(X * solid.X_BG);
      };
      const double distance =
          CalcDistance(clearance.solid(pair.a), pose(pair.a), clearance.solid(pair.b), pose(pair.b));
      double& least = smallest[static_cast<size_t>(pair.pairs)];
      least = std::min(least, distance);
      deepest = std::max(deepest, -distance);
    }
    overlapped += deepest > 0.0 ? 1 : 0;
    const double reported = clearance.FindDeepest().first;
    EXPECT_NEAR(reported, deepest, Clearance::kResolution + kAccuracy) << step;
    if (deepest > kAccuracy) EXPECT_GT(reported, 0.0) << step;
    for (int i = 0; i < kPairClassCount; ++i) {
      const double found = clearance.nearest(static_cast<PairClass>(i)).distance;
      EXPECT_LE(found, smallest[static_cast<size_t>(i)] + Clearance::kResolution) << step;
    }
  }
  EXPECT_GT(overlapped, 2);
  EXPECT_GT(pairs.size(), 1000U);
  // At most a hundredth of all pairs is measured in a step.
  EXPECT_LT(clearance.measured() - before, static_cast<long>(pairs.size()) * kSteps / 100);
}

TEST_F(ClearanceTest, TimeBeginsAnew) {
  Clearance clearance(*engine_, adapter_, solids_, List());
  const MjDataPtr data = MakeData(*engine_);
  mj_kinematics(engine_.get(), data.get());
  clearance.Update({data->xpos, data->xmat}, 1.0);
  const Clearance::Nearest first = clearance.nearest(PairClass::kRobotItself);
  clearance.Restart();
  EXPECT_EQ(clearance.nearest(PairClass::kRobotItself).pair, -1);
  clearance.Update({data->xpos, data->xmat}, 2.0);
  EXPECT_EQ(clearance.nearest(PairClass::kRobotItself).time, 2.0);
  EXPECT_NEAR(clearance.nearest(PairClass::kRobotItself).distance, first.distance, Clearance::kResolution);
}

}  // namespace
}  // namespace dexcheck::testing::clearance_test
