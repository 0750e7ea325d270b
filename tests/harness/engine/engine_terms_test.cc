// The engine's terms, formed sparsely, against the analytic model on random robots (every kind of base, joint
// and branching) and against dense projections of the engine's own matrices and forces.

#include "harness/engine/engine_terms.h"

#include <gtest/gtest.h>

#include <memory>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "harness/engine/mujoco_release.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::engine_terms_test {
namespace {

struct Case {
  const char* name;
  RandomRobotOptions options;
};

std::vector<Case> MakeCases() {
  std::vector<Case> cases;
  const auto add = [&](const char* name, BaseType base, DriveVelocity velocity, bool free_joint,
                       double branching) {
    RandomRobotOptions options;
    options.base = base;
    options.velocity = velocity;
    options.planar_by_free_joint = free_joint;
    options.branching = branching;
    cases.push_back({name, options});
  };
  add("FixedChain", BaseType::kFixed, DriveVelocity::kTwist, true, 0.0);
  add("FixedTree", BaseType::kFixed, DriveVelocity::kTwist, true, 0.4);
  add("PlanarFreeJoint", BaseType::kPlanar, DriveVelocity::kTwist, true, 0.3);
  add("PlanarSlides", BaseType::kPlanar, DriveVelocity::kTwist, false, 0.3);
  add("DriveTwist", BaseType::kDifferentialDrive, DriveVelocity::kTwist, true, 0.3);
  add("DriveTwistSlides", BaseType::kDifferentialDrive, DriveVelocity::kTwist, false, 0.3);
  add("DriveWheelRates", BaseType::kDifferentialDrive, DriveVelocity::kWheelRates, true, 0.3);
  return cases;
}

class RandomRobot : public ::testing::TestWithParam<Case> {};

// Measured below 2e-13 relative to the largest entry on these robots (20 joints, reach about 2 m).
constexpr double kRounding = 2e-12;

TEST_P(RandomRobot, AgreesWithEngine) {
  std::mt19937 random(20161);
  for (int trial = 0; trial < 20; ++trial) {
    const RobotSpec spec = MakeRandomRobot(GetParam().options, &random);
    const RobotModel model(spec);
    const MjModelPtr engine = LoadMjcfText(WriteMjcf(spec, GetParam().options.planar_by_free_joint), "text");
    const Adapter adapter(model, *engine, "text");
    for (const Coordinates coordinates : {Coordinates::kReduced, Coordinates::kUnreduced}) {
      // In q_dot' of a differential drive the wheels' spin is no holonomic function: only the reduced terms
      // compare.
      if (spec.base.type == BaseType::kDifferentialDrive && coordinates == Coordinates::kUnreduced) continue;
      ModelTerms terms(model, coordinates);
      EngineTerms reference(adapter, coordinates);
      ASSERT_EQ(terms.size(), reference.size());
      const VectorXd q = DrawPositions(model, &random);
      const VectorXd velocity = DrawVelocities(terms.size(), &random);
      terms.SetState(q, velocity);
      terms.CalcDynamics();
      reference.SetState(q, velocity);

      const MatrixXd M = reference.M();
      EXPECT_TRUE(MatrixNear(terms.M(), M, kRounding * M.cwiseAbs().maxCoeff())) << "M";
      const VectorXd coriolis = terms.C() * velocity;
      ASSERT_GT(reference.coriolis().norm(), 1e-3);
      EXPECT_TRUE(MatrixNear(coriolis, reference.coriolis(), kRounding * reference.coriolis().norm()))
          << "C velocity";
      EXPECT_TRUE(MatrixNear(terms.gravity(), reference.gravity(), kRounding * reference.gravity().norm()))
          << "gravity";
      EXPECT_TRUE(MatrixNear(terms.friction(), reference.friction(), kRounding * reference.friction().norm()))
          << "friction";

      Matrix6Xd J(6, terms.size());
      Matrix6Xd J_dot(6, terms.size());
      for (int frame = 0; frame < static_cast<int>(model.frames().size()); ++frame) {
        const Pose X = terms.CalcFramePose(frame);
        EXPECT_TRUE(MatrixNear(X.matrix(), reference.FramePose(frame).matrix(), kRounding)) << "pose";
        terms.CalcFrameJacobian(frame, J, J_dot);
        const Matrix6Xd J_engine = reference.CalcFrameJacobian(frame);
        Matrix6Xd J_world(6, terms.size());
        J_world << X.linear() * J.topRows<3>(), X.linear() * J.bottomRows<3>();
        EXPECT_TRUE(MatrixNear(J_world, J_engine, kRounding)) << "J";
        const Vector6d rate = J_world * velocity;
        const Vector6d in_frame = J_dot * velocity;
        Vector6d bias;
        bias << X.linear() * in_frame.head<3>() + rate.tail<3>().cross(rate.head<3>()),
            X.linear() * in_frame.tail<3>();
        const EngineMotion motion = reference.FrameMotion(frame);
        Vector6d bias_engine;
        bias_engine << motion.a, motion.alpha;
        EXPECT_TRUE(MatrixNear(bias, bias_engine, kRounding * (1.0 + bias_engine.norm())))
            << "J_dot velocity";
      }

      if (spec.base.type == BaseType::kFixed) continue;
      const EnergyAndMomentum energy = terms.CalcEnergyAndMomentum();
      const EnergyAndMomentum& expected = reference.energy_and_momentum();
      EXPECT_NEAR(energy.kinetic, expected.kinetic, kRounding * expected.kinetic);
      EXPECT_NEAR(energy.potential, expected.potential, kRounding * (std::abs(expected.potential) + 100.0));
      EXPECT_TRUE(MatrixNear(energy.linear_momentum, expected.linear_momentum, 100.0 * kRounding));
      EXPECT_TRUE(MatrixNear(energy.angular_momentum, expected.angular_momentum, 100.0 * kRounding));
      EXPECT_TRUE(MatrixNear(energy.com, expected.com, kRounding));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Bases, RandomRobot, ::testing::ValuesIn(MakeCases()),
                         [](const auto& info) { return info.param.name; });

/// The engine's matrices and forces, all of them, through a dense T: qvel = T xi.
class DenseEngine {
 public:
  DenseEngine(const Adapter& adapter, const VectorXd& q, const VectorXd& xi)
      : adapter_(adapter), model_(mj_copyModel(nullptr, &adapter.engine())), data_(MakeData(*model_)) {
    const mjModel* m = model_.get();
    mjData* d = data_.get();
    VelocityMap map(adapter, Coordinates::kReduced);
    map.SetState(q, xi);
    T = MatrixXd::Zero(m->nv, map.size());
    for (int i = 0; i < map.size(); ++i) map.Expand(VectorXd::Unit(map.size(), i), T.col(i).data());
    VectorXd bias = VectorXd::Zero(m->nv);
    map.ExpandBias(bias.data());

    adapter.SetPositions(q, d->qpos);
    mj_kinematics(m, d);
    mj_comPos(m, d);
    MakeMass(*m, d);
    MatrixXd M_nv(m->nv, m->nv);
    ExpandMass(*m, *d, M_nv.data());
    M = T.transpose() * M_nv * T;
    VectorXd force(m->nv);
    mj_comVel(m, d);
    mj_rne(m, d, 0, force.data());
    gravity = T.transpose() * force;
    Eigen::Map<VectorXd> qvel(d->qvel, m->nv);
    qvel = T * xi;
    mj_comVel(m, d);
    mj_rne(m, d, 0, force.data());
    coriolis = T.transpose() * (force + M_nv * bias) - gravity;
    mj_passive(m, d);
    friction = -T.transpose() * Eigen::Map<VectorXd>(d->qfrc_passive, m->nv);
    kinetic = 0.5 * qvel.dot(M_nv * qvel);
    for (const std::vector<int>& welded : adapter.welded_bodies()) {
      for (const int body : welded) {
        mjtNum velocity[6];  // angular, linear; of the centre of mass
        mj_objectVelocity(m, d, mjOBJ_BODY, body, velocity, 0);
        linear_momentum += m->body_mass[body] * Vector3d(velocity[3], velocity[4], velocity[5]);
      }
    }
    mju_copy(d->qacc, bias.data(), static_cast<int>(m->nv));
    mju_zero(model_->opt.gravity, 3);
    mj_rnePostConstraint(m, d);
  }

  [[nodiscard]] Matrix6Xd CalcJacobian(int frame) const {
    RowMatrixXd J(6, model_->nv);
    mj_jacSite(model_.get(), data_.get(), J.data(), J.data() + 3 * model_->nv, site(frame));
    return J * T;
  }
  [[nodiscard]] Vector6d CalcBias(int frame) const {
    mjtNum a[6];  // angular, linear
    mj_objectAcceleration(model_.get(), data_.get(), mjOBJ_SITE, site(frame), a, 0);
    return (Vector6d() << a[3], a[4], a[5], a[0], a[1], a[2]).finished();
  }

  MatrixXd T, M;
  VectorXd coriolis, gravity, friction;
  double kinetic = 0.0;
  Vector3d linear_momentum = Vector3d::Zero();

 private:
  [[nodiscard]] int site(int frame) const { return adapter_.frame_sites()[static_cast<size_t>(frame)]; }

  const Adapter& adapter_;
  MjModelPtr model_;
  MjDataPtr data_;
};

class SparseTerms : public ::testing::TestWithParam<DriveVelocity> {};

// Masses of 90 kg, lengths of 2 m, rates of 3 rad/s, in sums of some hundred products: measured 1.2e-13.
constexpr double kSmall = 1e-12;

TEST_P(SparseTerms, AreThoseOfDenseProjections) {
  const RobotModel model = ReadPaperRobot(GetParam());
  const MjModelPtr engine = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const Adapter adapter(model, *engine, "scene.xml");
  EngineTerms all(adapter, Coordinates::kReduced);
  EngineTerms grasp(adapter, model.fingertips());
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const VectorXd q = DrawPositions(model, &random);
    const VectorXd xi = DrawVelocities(model.num_velocities(), &random);
    const DenseEngine dense(adapter, q, xi);
    for (EngineTerms* sparse : {&all, &grasp}) {
      sparse->SetState(q, xi);
      EXPECT_TRUE(MatrixNear(sparse->M(), dense.M, kSmall));
      ASSERT_GT(dense.coriolis.norm(), 0.1);
      EXPECT_TRUE(MatrixNear(sparse->coriolis(), dense.coriolis, kSmall));
      EXPECT_TRUE(MatrixNear(sparse->gravity(), dense.gravity, kSmall));
      EXPECT_TRUE(MatrixNear(sparse->friction(), dense.friction, kSmall));
      EXPECT_NEAR(sparse->energy_and_momentum().kinetic, dense.kinetic, kSmall);
      EXPECT_TRUE(MatrixNear(sparse->energy_and_momentum().linear_momentum, dense.linear_momentum, kSmall));
      for (const int frame : model.fingertips()) {
        const Matrix6Xd J = dense.CalcJacobian(frame);
        EXPECT_TRUE(MatrixNear(sparse->CalcFrameJacobian(frame), J, kSmall));
        const EngineMotion motion = sparse->FrameMotion(frame);
        Vector6d bias;
        bias << motion.a, motion.alpha;
        EXPECT_TRUE(MatrixNear(bias, dense.CalcBias(frame), kSmall));
        Vector6d velocity;
        velocity << motion.v, motion.omega;
        EXPECT_TRUE(MatrixNear(velocity, J * xi, kSmall));
      }
    }
    // C(xi) w, of a C that (C(xi) + C(w)) belongs to: (c(xi + w) - c(xi) - c(w)) = C(xi) w + C(w) xi.
    const VectorXd w = DrawVelocities(model.num_velocities(), &random);
    VectorXd product(all.size()), swapped(all.size());
    all.SetState(q, xi);
    all.CalcCoriolisProduct(xi, w, product);
    all.CalcCoriolisProduct(w, xi, swapped);
    const VectorXd both =
        DenseEngine(adapter, q, xi + w).coriolis - dense.coriolis - DenseEngine(adapter, q, w).coriolis;
    EXPECT_TRUE(MatrixNear(product + swapped, both, 10.0 * kSmall));
  }
}

INSTANTIATE_TEST_SUITE_P(Drive, SparseTerms,
                         ::testing::Values(DriveVelocity::kTwist, DriveVelocity::kWheelRates));

TEST(EngineTerms, NeedsAnObjectAndSpheresThatTouch) {
  const RobotModel model = ReadPaperRobot();
  RobotSpec spec = model.spec();
  spec.object.reset();
  const RobotModel alone(spec);
  const MjModelPtr robot = LoadMjcf(SourcePath("/mjcf/robot.xml"));
  const Adapter without_object(alone, *robot, "robot.xml");
  EXPECT_THROW(EngineTerms(without_object, std::span<const int>(model.fingertips())), InputError);

  const MjModelPtr scene = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  const Adapter adapter(model, *scene, "scene.xml");
  const std::vector<int> palm = {model.FindFrame("r_palm_frame")};
  EXPECT_THROW(EngineTerms(adapter, std::span<const int>(palm)), InputError);
  for (int pair = 0; pair < scene->npair; ++pair) {  // of the floor with itself
    scene->pair_geom1[pair] = 0;
    scene->pair_geom2[pair] = 0;
  }
  EXPECT_THROW(EngineTerms(adapter, std::span<const int>(model.fingertips())), InputError);
}

/// A tree on a fixed base, with something besides in its MJCF, and the engine's whole pipeline beside the
/// terms.
class TreeWithTendons {
 public:
  TreeWithTendons(int joints, const std::string& besides, std::mt19937* random)
      : model_(MakeRandomRobot({.base = BaseType::kFixed, .joints = joints}, random)) {
    std::string text = WriteMjcf(model_.spec());
    text.insert(text.rfind("</mujoco>"), besides);
    engine_ = LoadMjcfText(text, "text");
    adapter_ = std::make_unique<Adapter>(model_, *engine_, "text");
    terms_ = std::make_unique<EngineTerms>(*adapter_, Coordinates::kReduced);
    data_ = MakeData(*engine_);
  }
  /// qfrc_passive of the joints by mj_forward, which the terms' friction must be the opposite of.
  VectorXd CalcPassiveForces(const VectorXd& q, const VectorXd& xi) {
    terms_->SetState(q, xi);
    adapter_->SetPositions(q, data_->qpos);
    const std::vector<int>& dofs = adapter_->joint_dofs();
    for (size_t i = 0; i < dofs.size(); ++i) data_->qvel[dofs[i]] = xi[static_cast<Eigen::Index>(i)];
    mj_forward(engine_.get(), data_.get());
    VectorXd passive(xi.size());
    for (size_t i = 0; i < dofs.size(); ++i)
      passive[static_cast<Eigen::Index>(i)] = data_->qfrc_passive[dofs[i]];
    constexpr double kScale = 1000.0;  // N m, of springs of 300 N m/rad, or some metres of 100 N/m on metres
    EXPECT_TRUE(MatrixNear(terms_->friction(), -passive, kRounding * kScale));
    return passive;
  }
  [[nodiscard]] const RobotModel& model() const { return model_; }
  [[nodiscard]] const mjModel& engine() const { return *engine_; }
  [[nodiscard]] const mjData& data() const { return *data_; }

 private:
  RobotModel model_;
  MjModelPtr engine_;
  std::unique_ptr<Adapter> adapter_;
  std::unique_ptr<EngineTerms> terms_;
  MjDataPtr data_;
};

// Springs and dampers of tendons are among the engine's passive forces, however its Jacobians are stored.
TEST(EngineTerms, FrictionHasTheForcesOfTendons) {
  for (const std::string jacobian : {"dense", "sparse"}) {
    std::mt19937 random(20162);
    TreeWithTendons tree(6, R"(<option jacobian=")" + jacobian + R"("/><tendon>
        <fixed stiffness="300" springlength="0.1"><joint joint="joint_1" coef="1"/>
          <joint joint="joint_3" coef="-2"/></fixed>
        <fixed damping="7"><joint joint="joint_2" coef="1.5"/><joint joint="joint_5" coef="1"/></fixed>
      </tendon>)",
                         &random);
    ASSERT_EQ(tree.engine().ntendon, 2);
    for (int trial = 0; trial < 5; ++trial) {
      const VectorXd q = DrawPositions(tree.model(), &random);
      const VectorXd xi = DrawVelocities(tree.model().num_velocities(), &random);
      VectorXd own = tree.CalcPassiveForces(q, xi);  // less the joints'
      for (int i = 0; i < tree.model().num_joints(); ++i) own[i] += tree.model().joint(i).damping * xi[i];
      EXPECT_GT(own.cwiseAbs().maxCoeff(), 1.0);
    }
  }
}

// A string around a post pulls the robot as the engine's own pipeline has it, which places the post.
TEST(EngineTerms, FrictionHasTheForcesOfTendonsAroundGeoms) {
  std::mt19937 random(20163);
  TreeWithTendons tree(4, R"(<worldbody><site name="hook" pos="3 0 0"/>
        <geom name="post" type="sphere" size="0.6" pos="1.5 0 0" contype="0" conaffinity="0"/></worldbody>
      <tendon><spatial stiffness="100" springlength="0.1"><site site="hook"/><geom geom="post"/>
        <site site="tip_3"/></spatial></tendon>)",
                       &random);
  int wrapped = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const VectorXd q = DrawPositions(tree.model(), &random);
    const VectorXd at_rest = VectorXd::Zero(tree.model().num_velocities());
    EXPECT_GT(tree.CalcPassiveForces(q, at_rest).norm(), 1.0);
    wrapped += tree.data().ten_wrapnum[0] == 4 ? 1 : 0;  // hook, two points on the post, tip
  }
  EXPECT_GT(wrapped, 3);
}

}  // namespace
}  // namespace dexcheck::testing::engine_terms_test
