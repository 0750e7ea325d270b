// The adapter between q', xi and qpos, qvel: order, signs, quaternion and frame conventions, for every kind
// of base.

#include "harness/engine/adapter.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>

#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/platform.h"
#include "harness/engine/engine.h"
#include "harness/engine/velocity_map.h"
#include "tests/common/files.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::adapter_test {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Both descriptions of one robot and what connects them.
struct Subject {
  Subject(RobotSpec spec, const std::string& mjcf)
      : model(std::move(spec)),
        engine(LoadMjcfText(mjcf, "text")),
        data(MakeData(*engine)),
        adapter(model, *engine, "text") {}

  RobotModel model;
  MjModelPtr engine;
  MjDataPtr data;
  Adapter adapter;
};

struct Case {
  const char* name;
  BaseType base;
  DriveVelocity velocity = DriveVelocity::kTwist;
  bool free_joint = true;
  Pose X_0b = Pose::Identity();
  std::function<std::string(std::string)> edit = [](std::string text) { return text; };
};
void PrintTo(const Case& one, std::ostream* stream) { *stream << one.name; }

Pose MakePose(const Vector3d& translation, double angle, const Vector3d& axis) {
  Pose X = Pose::Identity();
  X.translation() = translation;
  X.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  return X;
}

std::vector<Case> MakeCases() {
  const Pose displaced = MakePose({0.2, -0.1, 0.3}, 0.8, {1.0, -2.0, 0.5});
  const Pose turned = MakePose({0.2, -0.1, 0.3}, 0.8, Vector3d::UnitZ());
  const auto reverse_hinge = [](const std::string& text) {
    return ReplaceOnce(text, R"(<joint axis="0 0 1"/>)", R"(<joint axis="0 0 -1" ref="0.2"/>)");
  };
  const auto reverse_slide = [](const std::string& text) {
    return ReplaceOnce(text, R"(type="slide" axis="0 1 0")", R"(type="slide" axis="0 -1 0" ref="0.4")");
  };
  const auto reverse_wheel = [](const std::string& text) {
    return ReplaceOnce(text, R"(<joint name="wheel_left" axis="0 1 0")",
                       R"(<joint name="wheel_left" axis="0 -1 0")");
  };
  constexpr DriveVelocity kTwist = DriveVelocity::kTwist;
  constexpr DriveVelocity kWheelRates = DriveVelocity::kWheelRates;
  constexpr BaseType kDrive = BaseType::kDifferentialDrive;
  return {
      {"Fixed", BaseType::kFixed},
      {"FixedDisplaced", BaseType::kFixed, kTwist, true, displaced},
      {"PlanarFree", BaseType::kPlanar},
      {"PlanarFreeDisplaced", BaseType::kPlanar, kTwist, true, displaced},
      {"PlanarSlides", BaseType::kPlanar, kTwist, false},
      {"PlanarSlidesTurned", BaseType::kPlanar, kTwist, false, turned},
      {"PlanarHingeReversed", BaseType::kPlanar, kTwist, false, turned, reverse_hinge},
      {"PlanarSlideReversed", BaseType::kPlanar, kTwist, false, turned, reverse_slide},
      {"DriveFree", kDrive},
      {"DriveFreeDisplaced", kDrive, kTwist, true, displaced},
      {"DriveSlidesTurned", kDrive, kTwist, false, turned},
      {"DriveWheelRates", kDrive, kWheelRates, true, displaced},
      {"DriveWheelReversed", kDrive, kWheelRates, false, turned, reverse_wheel},
  };
}

class AdapterTest : public ::testing::TestWithParam<Case> {
 protected:
  AdapterTest() {
    RandomRobotOptions options;
    options.base = GetParam().base;
    options.velocity = GetParam().velocity;
    options.joints = 8;
    const RobotSpec spec = MakeRandomRobot(options, &random_);
    subject_ = std::make_unique<Subject>(
        spec, GetParam().edit(WriteMjcf(spec, GetParam().free_joint, GetParam().X_0b)));
  }

  [[nodiscard]] const RobotModel& model() const { return subject_->model; }
  [[nodiscard]] const Adapter& adapter() const { return subject_->adapter; }
  [[nodiscard]] const mjModel* m() const { return subject_->engine.get(); }
  [[nodiscard]] mjData* d() const { return subject_->data.get(); }

  VectorXd DrawPositions() { return testing::DrawPositions(model(), &random_); }
  VectorXd DrawVelocities(int size) { return testing::DrawVelocities(size, &random_); }

  [[nodiscard]] std::vector<Coordinates> AllCoordinates() const {
    if (GetParam().base != BaseType::kDifferentialDrive)
      return {Coordinates::kReduced, Coordinates::kUnreduced};
    // q_dot' of a drive may violate the constraint; its wheels then have no rates of their own.
    return {Coordinates::kReduced};
  }

  /// q_dot' of a velocity at q'.
  [[nodiscard]] VectorXd CalcPositionRate(const VectorXd& q, const VectorXd& velocity) const {
    if (GetParam().base != BaseType::kDifferentialDrive) return velocity;
    VectorXd q_dot(model().num_positions());
    const Vector2d v = velocity.head<2>();
    q_dot << CalcPlatformConstraint(model().base(), q.head<3>(), v).S_v * v,
        velocity.tail(model().num_joints());
    return q_dot;
  }

  [[nodiscard]] VectorXd CalcQpos(const VectorXd& q) const {
    VectorXd qpos = Eigen::Map<const VectorXd>(m()->qpos0, m()->nq);
    adapter().SetPositions(q, qpos.data());
    return qpos;
  }

  /// T column by column.
  [[nodiscard]] MatrixXd CalcDenseMap(const VelocityMap& map) const {
    MatrixXd T = MatrixXd::Zero(m()->nv, map.size());
    for (int i = 0; i < map.size(); ++i) map.Expand(VectorXd::Unit(map.size(), i), T.col(i).data());
    return T;
  }

  /// Largest difference between the engine's pose of a link's body and the model's pose of the link.
  double ComparePoses(const VectorXd& q, const VectorXd& qpos) {
    ModelTerms terms(model());
    terms.SetState(q, VectorXd::Zero(model().num_velocities()));
    Eigen::Map<VectorXd>(d()->qpos, m()->nq) = qpos;
    mj_kinematics(m(), d());
    double worst = 0.0;
    for (int link = -1; link < model().num_joints(); ++link) {
      const int body = adapter().link_bodies()[static_cast<size_t>(link + 1)];
      const Pose X = link < 0 ? terms.CalcLinkPose(link) * GetParam().X_0b : terms.CalcLinkPose(link);
      const Matrix3d R = Eigen::Map<const RowMatrix3d>(d()->xmat + 9 * body);
      const Vector3d p = Eigen::Map<const Vector3d>(d()->xpos + 3 * body);
      worst = std::max(
          {worst, (R - X.linear()).cwiseAbs().maxCoeff(), (p - X.translation()).cwiseAbs().maxCoeff()});
    }
    return worst;
  }

  /// Velocity of the wheels' lowest points in the world.
  double CalcWheelSlip(const VectorXd& q, const VectorXd& qvel) {
    Eigen::Map<VectorXd>(d()->qpos, m()->nq) = CalcQpos(q);
    mj_kinematics(m(), d());
    mj_comPos(m(), d());
    double worst = 0.0;
    for (const EngineWheel& wheel : adapter().wheels()) {
      const int body = m()->jnt_bodyid[wheel.joint];
      const Vector3d lowest =
          Eigen::Map<const Vector3d>(d()->xpos + 3 * body) - model().base().wheel_radius * Vector3d::UnitZ();
      EXPECT_NEAR(lowest.z(), 0.0, kRounding);  // on the floor
      RowMatrixXd J(3, m()->nv);
      mj_jac(m(), d(), J.data(), nullptr, lowest.data(), body);
      worst = std::max(worst, (J * qvel).norm());
    }
    return worst;
  }

  // Rotations and sums of at most ten joints in metres: measured at most 1.7e-15.
  static constexpr double kRounding = 1e-14;

  std::mt19937 random_{977};
  std::unique_ptr<Subject> subject_;
};

constexpr int kTrials = 20;

TEST_P(AdapterTest, PositionsRoundTrip) {
  for (int trial = 0; trial < kTrials; ++trial) {
    const VectorXd q = DrawPositions();
    VectorXd back = VectorXd::Constant(q.size(), 99.0);
    adapter().GetPositions(CalcQpos(q).data(), back);
    EXPECT_TRUE(MatrixNear(back, q, kRounding));
  }
}

TEST_P(AdapterTest, PlacesEveryLinkWhereTheModelHasIt) {
  for (int trial = 0; trial < kTrials; ++trial) {
    const VectorXd q = DrawPositions();
    const VectorXd qpos = CalcQpos(q);
    EXPECT_LT(ComparePoses(q, qpos), kRounding * TolScale());

    // Positions of two joints swapped; and for a free joint the transposed rotation.
    VectorXd swapped = q;
    std::swap(swapped[q.size() - 1], swapped[q.size() - 2]);
    EXPECT_GT(ComparePoses(q, CalcQpos(swapped)), 1e-3);
    if (adapter().base_joints().size() != 1) continue;
    VectorXd transposed = qpos;
    transposed.segment<3>(m()->jnt_qposadr[adapter().base_joints()[0]] + 4) *= -1.0;
    EXPECT_GT(ComparePoses(q, transposed), 1e-3);
  }
}

class FreeAdapterTest : public AdapterTest {};

TEST_P(FreeAdapterTest, TiltIsDroppedFromPositions) {
  const VectorXd q = DrawPositions();
  VectorXd qpos = CalcQpos(q);
  // A turn about a horizontal axis through Sigma_0's origin leaves x_c, y_c; phi is the heading of its x
  // axis.
  const Vector3d heading(std::cos(q[2]), std::sin(q[2]), 0.0);
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.1, heading.cross(Vector3d::UnitZ())));
  const int address = m()->jnt_qposadr[adapter().base_joints()[0]];
  const Eigen::Quaterniond R(qpos[address + 3], qpos[address + 4], qpos[address + 5], qpos[address + 6]);
  const Vector3d origin = model().base().X_B0.translation() + Vector3d(q[0], q[1], 0.0);
  const Vector3d p = origin + tilt * (qpos.segment<3>(address) - origin);
  const Eigen::Quaterniond tilted = tilt * R;
  qpos.segment<7>(address) << p, tilted.w(), tilted.x(), tilted.y(), tilted.z();
  VectorXd back(q.size());
  adapter().GetPositions(qpos.data(), back);
  EXPECT_TRUE(MatrixNear(back, q, kRounding));
}

TEST_P(AdapterTest, VelocitiesAreDerivativesOfPositions) {
  constexpr double kStep = 1e-5;
  // Central differences: kStep^2 times third derivatives (10) and 1e-16 * 3 / kStep; measured at
  // most 4.5e-11.
  constexpr double kDifferences = 4e-10;
  for (const Coordinates coordinates : AllCoordinates()) {
    VelocityMap map(adapter(), coordinates);
    for (int trial = 0; trial < kTrials; ++trial) {
      const VectorXd q = DrawPositions();
      const VectorXd velocity = DrawVelocities(map.size());
      map.SetState(q, velocity);
      VectorXd qvel = VectorXd::Zero(m()->nv);
      map.Expand(velocity, qvel.data());
      const VectorXd q_dot = CalcPositionRate(q, velocity);
      VectorXd expected(m()->nv);
      mj_differentiatePos(m(), expected.data(), 2.0 * kStep, CalcQpos(q - kStep * q_dot).data(),
                          CalcQpos(q + kStep * q_dot).data());
      // Rolling leaves no mark on the wheels' angles; WheelsRollWithoutSlip looks at their rates.
      for (const EngineWheel& wheel : adapter().wheels()) expected[wheel.dof] = qvel[wheel.dof];
      ASSERT_GT(expected.norm(), 1.0);
      EXPECT_TRUE(MatrixNear(qvel, expected, kDifferences));

      if (coordinates == Coordinates::kUnreduced || adapter().base_joints().size() != 1 ||
          GetParam().X_0b.linear().isIdentity()) {
        continue;
      }
      // The angular velocity of a turned body in the wrong frame.
      const int dof = m()->jnt_dofadr[adapter().base_joints()[0]] + 3;
      const Matrix3d R = GetParam().X_0b.linear();
      VectorXd wrong = qvel;
      wrong.segment<3>(dof) = R * R * qvel.segment<3>(dof);
      EXPECT_FALSE(MatrixNear(wrong, expected, 1e-3));
    }
  }
}

TEST_P(AdapterTest, BiasIsTheDerivativeOfTheMap) {
  constexpr double kStep = 1e-5;
  // The tolerance follows as above; measured at most 2.4e-10.
  constexpr double kDifferences = 2e-9;
  for (const Coordinates coordinates : AllCoordinates()) {
    VelocityMap map(adapter(), coordinates);
    double largest = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const VectorXd q = DrawPositions();
      const VectorXd velocity = DrawVelocities(map.size());
      const VectorXd q_dot = CalcPositionRate(q, velocity);
      const auto expand_at = [&](const VectorXd& where) {
        VectorXd qvel = VectorXd::Zero(m()->nv);
        map.SetState(where, velocity);
        map.Expand(velocity, qvel.data());
        return qvel;
      };
      const VectorXd expected = (expand_at(q + kStep * q_dot) - expand_at(q - kStep * q_dot)) / (2.0 * kStep);
      VectorXd bias = VectorXd::Zero(m()->nv);
      map.SetState(q, velocity);
      map.ExpandBias(bias.data());
      EXPECT_TRUE(MatrixNear(bias, expected, kDifferences));
      largest = std::max(largest, bias.norm());
    }
    const bool base_turns = GetParam().base == BaseType::kDifferentialDrive ||
                            (GetParam().base == BaseType::kPlanar && !GetParam().X_0b.matrix().isIdentity() &&
                             GetParam().X_0b.translation().head<2>().norm() > 0.0);
    EXPECT_EQ(largest > 0.1, base_turns) << largest;
  }
}

TEST_P(AdapterTest, TheProjectionIsTheProductWithTheDenseMap) {
  for (const Coordinates coordinates : AllCoordinates()) {
    VelocityMap map(adapter(), coordinates);
    map.SetState(DrawPositions(), DrawVelocities(map.size()));
    const MatrixXd T = CalcDenseMap(map);
    ASSERT_EQ(CalcRank(T), map.size());

    const VectorXd force = DrawVelocities(static_cast<int>(m()->nv));
    VectorXd projected_force(map.size());
    map.ProjectForce(force.data(), projected_force);
    EXPECT_TRUE(MatrixNear(projected_force, T.transpose() * force, kRounding));
  }
}

class WheeledAdapterTest : public AdapterTest {};

TEST_P(WheeledAdapterTest, WheelsRollWithoutSlip) {
  VelocityMap map(adapter(), Coordinates::kReduced);
  for (int trial = 0; trial < kTrials; ++trial) {
    const VectorXd q = DrawPositions();
    const VectorXd xi = DrawVelocities(map.size());
    map.SetState(q, xi);
    VectorXd qvel = VectorXd::Zero(m()->nv);
    map.Expand(xi, qvel.data());
    EXPECT_LT(CalcWheelSlip(q, qvel), kRounding * TolScale());

    VectorXd wrong = qvel;
    for (const EngineWheel& wheel : adapter().wheels()) wrong[wheel.dof] *= -1.0;
    EXPECT_GT(CalcWheelSlip(q, wrong), 1e-3);
  }
}

// v = [thetadot_r, thetadot_l] are the rates of the wheels' hinges themselves.
class WheelRatesAdapterTest : public AdapterTest {};

TEST_P(WheelRatesAdapterTest, AreTheHinges) {
  VelocityMap map(adapter(), Coordinates::kReduced);
  const VectorXd xi = DrawVelocities(map.size());
  map.SetState(DrawPositions(), xi);
  VectorXd qvel = VectorXd::Zero(m()->nv);
  map.Expand(xi, qvel.data());
  for (size_t k = 0; k < 2; ++k) {
    const EngineWheel& wheel = adapter().wheels()[k];
    EXPECT_NEAR(qvel[wheel.dof], wheel.axis.y() * xi[static_cast<int>(k)], kRounding);
  }
}

std::vector<Case> Select(const std::function<bool(const Case&)>& wanted) {
  std::vector<Case> cases;
  for (const Case& one : MakeCases()) {
    if (wanted(one)) cases.push_back(one);
  }
  return cases;
}

std::string PrintName(const ::testing::TestParamInfo<Case>& info) { return info.param.name; }
bool IsFree(const Case& one) { return one.base != BaseType::kFixed && one.free_joint; }
bool HasWheels(const Case& one) { return one.base == BaseType::kDifferentialDrive; }
bool HasWheelRates(const Case& one) { return one.velocity == DriveVelocity::kWheelRates; }

INSTANTIATE_TEST_SUITE_P(Bases, AdapterTest, ::testing::ValuesIn(MakeCases()), PrintName);
INSTANTIATE_TEST_SUITE_P(Bases, FreeAdapterTest, ::testing::ValuesIn(Select(IsFree)), PrintName);
INSTANTIATE_TEST_SUITE_P(Bases, WheeledAdapterTest, ::testing::ValuesIn(Select(HasWheels)), PrintName);
INSTANTIATE_TEST_SUITE_P(Bases, WheelRatesAdapterTest, ::testing::ValuesIn(Select(HasWheelRates)), PrintName);

TEST(ShippedAdapter, LeavesTheObjectAlone) {
  const RobotModel model = ReadRobotModel(SourcePath("/controller/parameters/assistant_robot.toml"));
  const MjModelPtr engine = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const Adapter adapter(model, *engine, "scene.xml");
  ASSERT_EQ(engine->nv, 6 + 2 + 48 + 6);
  constexpr double kMark = 77.0;
  VectorXd qpos = VectorXd::Constant(engine->nq, kMark);
  VectorXd qvel = VectorXd::Constant(engine->nv, kMark);
  VectorXd qacc = VectorXd::Constant(engine->nv, kMark);
  VelocityMap map(adapter, Coordinates::kReduced);
  const VectorXd q = VectorXd::LinSpaced(51, 0.1, 0.3);
  const VectorXd xi = VectorXd::LinSpaced(50, 0.1, 0.3);
  adapter.SetPositions(q, qpos.data());
  map.SetState(q, xi);
  map.Expand(xi, qvel.data());
  map.ExpandBias(qacc.data());
  const int joint = engine->body_jntadr[adapter.object_body()];
  const int position = engine->jnt_qposadr[joint];
  const int dof = engine->jnt_dofadr[joint];
  for (int i = 0; i < engine->nq; ++i) {
    EXPECT_EQ(qpos[i] == kMark, position <= i && i < position + 7) << "qpos " << i;
  }
  for (int i = 0; i < engine->nv; ++i) {
    EXPECT_EQ(qvel[i] == kMark, dof <= i && i < dof + 6) << "qvel " << i;
    EXPECT_EQ(qacc[i] == kMark, dof <= i && i < dof + 6) << "qacc " << i;
  }
}

}  // namespace
}  // namespace dexcheck::testing::adapter_test
