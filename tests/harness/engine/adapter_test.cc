// The adapter between q', xi and qpos, qvel: order, signs, quaternion and frame conventions, for every kind
// of base; and the engine's terms through it against the analytic model's.

#include "harness/engine/adapter.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>

#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "harness/engine/engine.h"
#include "harness/engine/engine_terms.h"
#include "harness/engine/velocity_map.h"
#include "tests/common/files.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"
#include "tests/common/refused_text.h"

namespace dexcheck::testing::adapter_test {
namespace {

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

std::string Keep(std::string text) { return text; }

struct Case {
  const char* name;
  BaseType base;
  DriveVelocity velocity = DriveVelocity::kTwist;
  bool free_joint = true;
  Pose X_0b = Pose::Identity();
  std::function<std::string(std::string)> edit = Keep;
  double branching = 0.3;
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
      {"FixedChain", BaseType::kFixed, kTwist, true, Pose::Identity(), Keep, 0.0},
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

bool HasWheels(const Case& one) { return one.base == BaseType::kDifferentialDrive; }

class AdapterTest : public ::testing::TestWithParam<Case> {
 protected:
  AdapterTest() { DrawRobot(8); }

  void DrawRobot(int joints) {
    const Case& one = GetParam();
    const RobotSpec spec = MakeRandomRobot(
        {.base = one.base, .velocity = one.velocity, .joints = joints, .branching = one.branching}, &random_);
    subject_ = std::make_unique<Subject>(spec, one.edit(WriteMjcf(spec, one.free_joint, one.X_0b)));
  }

  [[nodiscard]] const RobotModel& model() const { return subject_->model; }
  [[nodiscard]] const Adapter& adapter() const { return subject_->adapter; }
  [[nodiscard]] const mjModel* m() const { return subject_->engine.get(); }
  [[nodiscard]] mjData* d() const { return subject_->data.get(); }

  VectorXd DrawPositions() { return testing::DrawPositions(model(), &random_); }
  VectorXd DrawVelocities(int size) { return testing::DrawVelocities(size, &random_); }

  [[nodiscard]] VectorXd CalcQpos(const VectorXd& q) const {
    VectorXd qpos = Eigen::Map<const VectorXd>(m()->qpos0, m()->nq);
    adapter().SetPositions(q, qpos.data());
    return qpos;
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

// Measured below 2e-13 relative to the largest entry on these robots (20 joints, reach about 2 m).
constexpr double kTermRounding = 2e-12;

TEST_P(AdapterTest, TermsAreTheModels) {
  for (int trial = 0; trial < kTrials; ++trial) {
    DrawRobot(20);
    for (const Coordinates coordinates : {Coordinates::kReduced, Coordinates::kUnreduced}) {
      // In q_dot' of a differential drive the wheels' spin is no holonomic function: only the reduced terms
      // compare.
      if (HasWheels(GetParam()) && coordinates == Coordinates::kUnreduced) continue;
      ModelTerms terms(model(), coordinates);
      EngineTerms reference(adapter(), coordinates);
      ASSERT_EQ(terms.size(), reference.size());
      const VectorXd q = DrawPositions();
      const VectorXd velocity = DrawVelocities(terms.size());
      terms.SetState(q, velocity);
      terms.CalcDynamics();
      reference.SetState(q, velocity);

      const MatrixXd M = reference.M();
      EXPECT_TRUE(MatrixNear(terms.M(), M, kTermRounding * M.cwiseAbs().maxCoeff())) << "M";
      const VectorXd coriolis = terms.C() * velocity;
      ASSERT_GT(reference.coriolis().norm(), 1e-3);
      EXPECT_TRUE(MatrixNear(coriolis, reference.coriolis(), kTermRounding * reference.coriolis().norm()))
          << "C velocity";
      EXPECT_TRUE(
          MatrixNear(terms.gravity(), reference.gravity(), kTermRounding * reference.gravity().norm()))
          << "gravity";
      EXPECT_TRUE(
          MatrixNear(terms.friction(), reference.friction(), kTermRounding * reference.friction().norm()))
          << "friction";

      Matrix6Xd J(6, terms.size());
      Matrix6Xd J_dot(6, terms.size());
      for (int frame = 0; frame < static_cast<int>(model().frames().size()); ++frame) {
        const Pose X = terms.CalcFramePose(frame);
        EXPECT_TRUE(MatrixNear(X.matrix(), reference.FramePose(frame).matrix(), kTermRounding)) << "pose";
        terms.CalcFrameJacobian(frame, J, J_dot);
        const Matrix6Xd J_engine = reference.CalcFrameJacobian(frame);
        Matrix6Xd J_world(6, terms.size());
        J_world << X.linear() * J.topRows<3>(), X.linear() * J.bottomRows<3>();
        EXPECT_TRUE(MatrixNear(J_world, J_engine, kTermRounding)) << "J";
        const Vector6d rate = J_world * velocity;
        const Vector6d in_frame = J_dot * velocity;
        Vector6d bias;
        bias << X.linear() * in_frame.head<3>() + rate.tail<3>().cross(rate.head<3>()),
            X.linear() * in_frame.tail<3>();
        const EngineMotion motion = reference.FrameMotion(frame);
        Vector6d bias_engine;
        bias_engine << motion.a, motion.alpha;
        EXPECT_TRUE(MatrixNear(bias, bias_engine, kTermRounding * (1.0 + bias_engine.norm())))
            << "J_dot velocity";
      }

      if (GetParam().base == BaseType::kFixed) continue;
      const EnergyAndMomentum energy = terms.CalcEnergyAndMomentum();
      const EnergyAndMomentum& expected = reference.energy_and_momentum();
      EXPECT_NEAR(energy.kinetic, expected.kinetic, kTermRounding * expected.kinetic);
      EXPECT_NEAR(energy.potential, expected.potential,
                  kTermRounding * (std::abs(expected.potential) + 100.0));
      EXPECT_TRUE(MatrixNear(energy.linear_momentum, expected.linear_momentum, 100.0 * kTermRounding));
      EXPECT_TRUE(MatrixNear(energy.angular_momentum, expected.angular_momentum, 100.0 * kTermRounding));
      EXPECT_TRUE(MatrixNear(energy.com, expected.com, kTermRounding));
    }
  }
}

TEST_P(AdapterTest, TiltIsDroppedFromPositions) {
  if (GetParam().base == BaseType::kFixed || !GetParam().free_joint) return;
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

TEST_P(AdapterTest, WheelsRollWithoutSlip) {
  if (!HasWheels(GetParam())) return;
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
TEST_P(AdapterTest, WheelRatesAreTheHinges) {
  if (GetParam().velocity != DriveVelocity::kWheelRates) return;
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

INSTANTIATE_TEST_SUITE_P(Bases, AdapterTest, ::testing::ValuesIn(MakeCases()), CaseName());

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
