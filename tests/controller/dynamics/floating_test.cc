// A floating base against the same robot on three slides and three hinges, whose rates are mapped by hand.

#include <gtest/gtest.h>

#include "controller/dynamics/model_terms.h"
#include "controller/model/rigid_body.h"
#include "tests/common/matrix_near.h"
#include "tests/common/random_robot.h"

namespace dexcheck::testing::floating_test {
namespace {

// Masses of some 50 kg over lengths of a few metres, chains of 20 joints, and E^-1 at pitch below 1.2 rad.
constexpr double kRounding = 1e-11;

RobotSpec MakeFloating(std::mt19937* random) {
  RandomRobotOptions options;
  options.base = BaseType::kFloating;
  options.joints = 12;
  return MakeRandomRobot(options, random);
}

/// The robot with its base carried by x, y, z, yaw, pitch, roll.
RobotSpec PutOnChain(const RobotSpec& floating) {
  RobotSpec spec = floating;
  spec.base = Base{};
  spec.base.link = "ground";
  spec.joints.clear();
  const Vector3d axes[] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ(),
                           Vector3d::UnitZ(), Vector3d::UnitY(), Vector3d::UnitX()};
  Matrix3d R_last = Matrix3d::Identity();
  for (int i = 0; i < 6; ++i) {
    Joint joint;
    joint.name = "base_" + std::to_string(i);
    joint.link = i == 5 ? floating.base.link : "carrier_" + std::to_string(i);
    joint.parent = i - 1;
    joint.type = i < 3 ? JointType::kPrismatic : JointType::kRevolute;
    const Matrix3d R = MakeRotationFromZ(axes[i]);
    joint.X_PB.linear() = R_last.transpose() * R;
    joint.lower = -10.0;
    joint.upper = 10.0;
    R_last = R;
    spec.joints.push_back(joint);
  }
  Pose X_i0 = Pose::Identity();
  X_i0.linear() = R_last.transpose();
  spec.joints.back().body = ExpressIn(floating.base.body, X_i0);
  for (Joint joint : floating.joints) {
    if (joint.parent < 0) joint.X_PB = X_i0 * joint.X_PB;
    joint.parent = joint.parent < 0 ? 5 : joint.parent + 6;
    spec.joints.push_back(joint);
  }
  for (Frame& frame : spec.frames) {
    if (frame.link < 0) frame.X_LF = X_i0 * frame.X_LF;
    frame.link = frame.link < 0 ? 5 : frame.link + 6;
  }
  return spec;
}

/// A state of both robots and the map between their velocities.
struct State {
  VectorXd q, xi;           // floating
  VectorXd q_chain, q_dot;  // on the chain
  MatrixXd T, T_dot;        // q_dot = T xi
};

State MakeState(const RobotModel& floating, std::mt19937* random) {
  State state;
  state.q = DrawPositions(floating, random);
  state.xi = DrawVelocities(floating.num_velocities(), random);
  const double yaw = 0.7, p = -0.9, r = 0.4;
  const Eigen::Quaterniond quaternion(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(p, Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(r, Vector3d::UnitX()));
  state.q.segment<4>(3) << quaternion.w(), quaternion.x(), quaternion.y(), quaternion.z();
  const int n = floating.num_velocities();
  state.q_chain = VectorXd(n);
  state.q_chain << state.q.head<3>(), yaw, p, r, state.q.tail(n - 6);

  // w (body axes) = E [yaw_dot; pitch_dot; roll_dot]
  const double sp = std::sin(p), cp = std::cos(p), sr = std::sin(r), cr = std::cos(r);
  Matrix3d E;
  E << -sp, 0.0, 1.0, cp * sr, cr, 0.0, cp * cr, -sr, 0.0;
  const Matrix3d E_inverse = E.inverse();
  const Vector3d rates = E_inverse * state.xi.segment<3>(3);
  const double dp = rates[1], dr = rates[2];
  Matrix3d E_dot;
  E_dot << -cp * dp, 0.0, 0.0, -sp * sr * dp + cp * cr * dr, -sr * dr, 0.0, -sp * cr * dp - cp * sr * dr,
      -cr * dr, 0.0;
  state.T = MatrixXd::Identity(n, n);
  state.T.block<3, 3>(3, 3) = E_inverse;
  state.T_dot = MatrixXd::Zero(n, n);
  state.T_dot.block<3, 3>(3, 3) = -E_inverse * E_dot * E_inverse;
  state.q_dot = state.T * state.xi;
  return state;
}

class FloatingBase : public ::testing::Test {
 protected:
  FloatingBase() : random_(400), spec_(MakeFloating(&random_)), floating_(spec_), chain_(PutOnChain(spec_)) {}

  std::mt19937 random_;
  RobotSpec spec_;
  RobotModel floating_;
  RobotModel chain_;
};

TEST_F(FloatingBase, HasTheTermsOfTheRobotOnAChain) {
  EXPECT_EQ(floating_.num_positions(), 19);
  EXPECT_EQ(floating_.num_velocities(), 18);
  for (int sample = 0; sample < 5; ++sample) {
    const State state = MakeState(floating_, &random_);
    ModelTerms terms(floating_);
    ModelTerms on_chain(chain_);
    terms.SetState(state.q, state.xi);
    terms.CalcDynamics();
    on_chain.SetState(state.q_chain, state.q_dot);
    on_chain.CalcDynamics();
    const MatrixXd& T = state.T;
    EXPECT_TRUE(MatrixNear(terms.M(), T.transpose() * on_chain.M() * T, kRounding));
    EXPECT_TRUE(MatrixNear(terms.gravity(), T.transpose() * on_chain.gravity(), kRounding));
    EXPECT_TRUE(MatrixNear(terms.friction(), T.transpose() * on_chain.friction(), kRounding));
    EXPECT_TRUE(
        MatrixNear(terms.C() * state.xi,
                   T.transpose() * (on_chain.C() * state.q_dot + on_chain.M() * state.T_dot * state.xi),
                   10.0 * kRounding));
    EXPECT_GT(terms.gravity().head<6>().norm(), 1.0);
    Matrix6Xd J(6, terms.size()), J_dot(6, terms.size()), J_chain(6, terms.size()),
        J_dot_chain(6, terms.size());
    for (int frame = 0; frame < static_cast<int>(floating_.frames().size()); ++frame) {
      EXPECT_TRUE(
          MatrixNear(terms.CalcFramePose(frame).matrix(), on_chain.CalcFramePose(frame).matrix(), kRounding));
      terms.CalcFrameJacobian(frame, J, J_dot);
      on_chain.CalcFrameJacobian(frame, J_chain, J_dot_chain);
      EXPECT_TRUE(MatrixNear(J, J_chain * T, kRounding));
      EXPECT_TRUE(MatrixNear(J_dot, J_dot_chain * T + J_chain * state.T_dot, 10.0 * kRounding));
    }
    const EnergyAndMomentum a = terms.CalcEnergyAndMomentum();
    const EnergyAndMomentum b = on_chain.CalcEnergyAndMomentum();
    EXPECT_NEAR(a.kinetic, b.kinetic, 1e2 * kRounding);
    EXPECT_NEAR(a.potential, b.potential, 1e2 * kRounding);
    EXPECT_TRUE(MatrixNear(a.linear_momentum, b.linear_momentum, kRounding));
    EXPECT_TRUE(MatrixNear(a.angular_momentum, b.angular_momentum, 10.0 * kRounding));
  }
}

// With c(x) = C(x) x:  C(x) w = (c(x + w) - c(x - w)) / 4 + M s / 2,  s = [0; w_x x w_w; 0], since the
// angular velocity in the body's axes is no rate of coordinates.
TEST_F(FloatingBase, HasTheCoriolisMatrixOfItsForces) {
  const State state = MakeState(floating_, &random_);
  const VectorXd x = state.xi;
  const VectorXd w = DrawVelocities(floating_.num_velocities(), &random_);
  ModelTerms terms(floating_);
  const auto coriolis = [&](const VectorXd& velocity) {
    terms.SetState(state.q, velocity);
    terms.CalcDynamics();
    return VectorXd(terms.C() * velocity);
  };
  const VectorXd quarter = 0.25 * (coriolis(x + w) - coriolis(x - w));
  VectorXd s = VectorXd::Zero(x.size());
  s.segment<3>(3) = Vector3d(x.segment<3>(3)).cross(Vector3d(w.segment<3>(3)));
  coriolis(x);
  EXPECT_TRUE(MatrixNear(terms.C() * w, quarter + 0.5 * terms.M() * s, 1e2 * kRounding));
  EXPECT_GT((terms.M() * s).norm(), 1.0);
}

}  // namespace
}  // namespace dexcheck::testing::floating_test
