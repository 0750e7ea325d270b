// The Panda arm against the Orocos Kinematics and Dynamics Library: a chain of that library, its joints from
// the published MDH table, its links' masses from the same file as the model's.

#include <gtest/gtest.h>

#include <array>
#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacdotsolver.hpp>
#include <kdl/chainjnttojacsolver.hpp>

#include "controller/dynamics/model_terms.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::kdl_test {
namespace {

// Seven joints; M up to 3 kg m^2, forces up to 60 N m. Measured 2e-14.
constexpr double kRounding = 2e-13;
// A mutated model must miss by far more.
constexpr double kVisible = 1e-4;

constexpr unsigned kJoints = 7;

// The manufacturer's table: a_{i-1}, alpha_{i-1}, d_i in m and rad; then the flange.
struct CraigRow {
  double a, alpha, d;
};
constexpr std::array<CraigRow, kJoints> kTable = {{{0.0, 0.0, 0.333},
                                                   {0.0, -kPi / 2, 0.0},
                                                   {0.0, kPi / 2, 0.316},
                                                   {0.0825, kPi / 2, 0.0},
                                                   {-0.0825, -kPi / 2, 0.384},
                                                   {0.0, kPi / 2, 0.0},
                                                   {0.088, kPi / 2, 0.0}}};
constexpr double kFlange = 0.107;

KDL::RigidBodyInertia MakeInertia(const MassProperties& body) {
  const Matrix3d& I = body.inertia;
  return KDL::RigidBodyInertia(body.mass, KDL::Vector(body.com.x(), body.com.y(), body.com.z()),
                               KDL::RotationalInertia(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
}

/// Segment i turns about z of its own tip frame, which is the MDH frame of link i.
KDL::Chain MakeChain(const RobotModel& panda) {
  KDL::Chain chain;
  for (unsigned i = 0; i < kJoints; ++i) {
    const Joint& joint = panda.joints()[i];
    const KDL::Frame tip = KDL::Frame::DH_Craig1989(kTable[i].a, kTable[i].alpha, kTable[i].d, 0.0);
    chain.addSegment(KDL::Segment(joint.link,
                                  KDL::Joint(joint.name, tip.p, tip.M.UnitZ(), KDL::Joint::RotAxis), tip,
                                  MakeInertia(joint.body)));
  }
  chain.addSegment(
      KDL::Segment("flange", KDL::Joint(KDL::Joint::Fixed), KDL::Frame(KDL::Vector(0.0, 0.0, kFlange))));
  return chain;
}

Pose MakePose(const KDL::Frame& frame) {
  Pose X = Pose::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) X.linear()(i, j) = frame.M(i, j);
    X.translation()[i] = frame.p(i);
  }
  return X;
}

KDL::JntArray MakeArray(const VectorXd& values) {
  KDL::JntArray array(kJoints);
  array.data = values;
  return array;
}

/// Everything that the library computes of the chain at one state. J and J_dot are those of the flange's body
/// velocity.
struct KdlTerms {
  KdlTerms(const KDL::Chain& chain, const VectorXd& q, const VectorXd& q_dot) {
    const KDL::JntArray positions = MakeArray(q);
    const KDL::JntArray rates = MakeArray(q_dot);
    KDL::Frame frame;
    KDL::ChainFkSolverPos_recursive(chain).JntToCart(positions, frame);
    flange = MakePose(frame);

    KDL::Jacobian jacobian(kJoints);
    KDL::ChainJntToJacSolver(chain).JntToJac(positions, jacobian);
    jacobian.changeBase(frame.M.Inverse());
    J = jacobian.data;
    KDL::ChainJntToJacDotSolver jac_dot_solver(chain);
    jac_dot_solver.setBodyFixedRepresentation();
    jac_dot_solver.JntToJacDot(KDL::JntArrayVel(positions, rates), jacobian);
    J_dot = jacobian.data;

    KDL::ChainDynParam dynamics(chain, KDL::Vector(0.0, 0.0, -9.81));
    KDL::JntSpaceInertiaMatrix mass_matrix(kJoints);
    dynamics.JntToMass(positions, mass_matrix);
    M = mass_matrix.data;
    KDL::JntArray array(kJoints);
    dynamics.JntToCoriolis(positions, rates, array);
    coriolis = array.data;
    dynamics.JntToGravity(positions, array);
    gravity = array.data;
  }
  Pose flange;
  Matrix6Xd J;
  Matrix6Xd J_dot;
  MatrixXd M;
  VectorXd coriolis;
  VectorXd gravity;
};

class PandaAgainstKdl : public ::testing::Test {
 protected:
  const RobotModel panda_ = ReadPanda();
  std::mt19937 random_{1989};
};

TEST_F(PandaAgainstKdl, AllTermsAgree) {
  const KDL::Chain chain = MakeChain(panda_);
  ASSERT_EQ(chain.getNrOfJoints(), kJoints);
  ASSERT_EQ(panda_.num_velocities(), static_cast<int>(kJoints));
  ModelTerms terms(panda_);
  Matrix6Xd J(6, kJoints);
  Matrix6Xd J_dot(6, kJoints);
  for (int state = 0; state < 50; ++state) {
    const VectorXd q = DrawPositions(panda_, &random_);
    const VectorXd q_dot = DrawVelocities(kJoints, &random_);
    const KdlTerms expected(chain, q, q_dot);
    terms.SetState(q, q_dot);
    terms.CalcDynamics();
    const int flange = panda_.FindFrame("panda_flange");
    terms.CalcFrameJacobian(flange, J, J_dot);
    ASSERT_GT(expected.coriolis.norm(), 0.1);
    ASSERT_GT(expected.gravity.norm(), 1.0);
    ASSERT_GT(expected.J_dot.norm(), 0.1);
    EXPECT_TRUE(MatrixNear(terms.CalcFramePose(flange).matrix(), expected.flange.matrix(), kRounding))
        << "pose";
    EXPECT_TRUE(MatrixNear(J, expected.J, kRounding)) << "J";
    EXPECT_TRUE(MatrixNear(J_dot, expected.J_dot, kRounding)) << "J_dot";
    EXPECT_TRUE(MatrixNear(terms.M(), expected.M, kRounding)) << "M";
    EXPECT_TRUE(MatrixNear(terms.C() * q_dot, expected.coriolis, kRounding)) << "C q_dot";
    EXPECT_TRUE(MatrixNear(terms.gravity(), expected.gravity, kRounding)) << "gravity";
  }
}

TEST_F(PandaAgainstKdl, MutationsAreSeen) {
  const VectorXd q = DrawPositions(panda_, &random_);
  const VectorXd q_dot = DrawVelocities(kJoints, &random_);
  const KdlTerms expected(MakeChain(panda_), q, q_dot);
  const int flange = panda_.FindFrame("panda_flange");
  Matrix6Xd J(6, kJoints);
  Matrix6Xd J_dot(6, kJoints);

  RobotSpec heavier = panda_.spec();
  heavier.joints[5].body.mass += 0.01;
  const RobotModel heavier_model(heavier);
  ModelTerms terms(heavier_model);
  terms.SetState(q, q_dot);
  terms.CalcDynamics();
  EXPECT_GT((terms.M() - expected.M).cwiseAbs().maxCoeff(), kVisible);
  EXPECT_GT((terms.C() * q_dot - expected.coriolis).cwiseAbs().maxCoeff(), kVisible);
  EXPECT_GT((terms.gravity() - expected.gravity).cwiseAbs().maxCoeff(), kVisible);

  RobotSpec longer = panda_.spec();
  longer.joints[3].mdh.a += 1e-3;
  const RobotModel longer_model(longer);
  ModelTerms moved(longer_model);
  moved.SetState(q, q_dot);
  moved.CalcFrameJacobian(flange, J, J_dot);
  EXPECT_GT((moved.CalcFramePose(flange).matrix() - expected.flange.matrix()).norm(), kVisible);
  EXPECT_GT((J - expected.J).norm(), kVisible);
  EXPECT_GT((J_dot - expected.J_dot).norm(), kVisible);
}

}  // namespace
}  // namespace dexcheck::testing::kdl_test
