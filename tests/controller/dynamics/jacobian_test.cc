// Jacobians and their derivatives (6), (7) against differences of poses on SE(3), for a frame on every link.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "tests/common/finite_difference.h"
#include "tests/common/matrix_near.h"
#include "tests/common/reduction_map.h"
#include "tests/controller/dynamics/robot_cases.h"

namespace dexcheck::testing::jacobian_test {
namespace {

// Five-point differences at unit rates: truncation h^4 / 30 = 3e-14 per metre, rounding eps |p| / h = 1e-12.
// Measured 9e-13.
constexpr double kPoseStep = 1e-3, kPoseDifference = 5e-12;
// Along q_dot, whose rates add up to 20 rad/s and more: truncation h^4 20^5 / 30 = 1e-11, rounding eps |J| /
// h = 1e-11; measured 1e-11.
constexpr double kStateStep = 1e-4, kStateDifference = 1e-10;
// Two formulas for one quantity of up to 30 (in SI units); measured 1e-15 of it.
constexpr double kRounding = 1e-14;
// A wrong formula must miss by far more.
constexpr double kVisible = 1e-3;

/// The model with a frame at a generic place on every link, the base's included.
RobotModel AddFrames(const RobotModel& model) {
  RobotSpec spec = model.spec();
  for (int link = -1; link < model.num_joints(); ++link) {
    Frame frame;
    frame.name = "on_link_" + std::to_string(link);
    frame.link = link;
    frame.X_LF = Eigen::Translation3d(0.03, -0.05, 0.02) * Eigen::AngleAxisd(0.8, Vector3d(0.6, 0.0, 0.8));
    spec.frames.push_back(frame);
  }
  return RobotModel(spec);
}

std::vector<RobotCase> MakeCases() {
  std::vector<RobotCase> cases;
  for (const RobotCase& robot : MakeRobotCases(607)) {
    cases.push_back({robot.name + "Reduced", AddFrames(robot.model), Coordinates::kReduced});
    cases.push_back({robot.name + "Unreduced", AddFrames(robot.model), Coordinates::kUnreduced});
  }
  return cases;
}

/// A pose's rate as a body velocity: X^-1 X_dot = [[w]x, v; 0, 0], returned as [v; w].
Vector6d CalcBodyVelocity(const Pose& X, const Eigen::Matrix4d& X_dot) {
  const Matrix3d W = X.linear().transpose() * X_dot.topLeftCorner<3, 3>();
  Vector6d V;
  V << X.linear().transpose() * X_dot.topRightCorner<3, 1>(), 0.5 * (W(2, 1) - W(1, 2)),
      0.5 * (W(0, 2) - W(2, 0)), 0.5 * (W(1, 0) - W(0, 1));
  return V;
}

class Jacobian : public ::testing::TestWithParam<RobotCase> {
 protected:
  /// Positions' rates from velocity coordinates: S', or 1.
  [[nodiscard]] MatrixXd CalcRateMap(const VectorXd& q, const VectorXd& velocity) const {
    if (GetParam().coordinates == Coordinates::kUnreduced) return MatrixXd::Identity(q.size(), q.size());
    return CalcReductionMap(model_, q, velocity).S;
  }
  Pose CalcPose(int frame, const VectorXd& q) {
    moving_.SetState(q, velocity_);
    return moving_.CalcFramePose(frame);
  }
  Matrix6Xd CalcJacobian(int frame, const VectorXd& q) {
    moving_.SetState(q, velocity_);
    Matrix6Xd J(6, moving_.size());
    Matrix6Xd J_dot(6, moving_.size());
    moving_.CalcFrameJacobian(frame, J, J_dot);
    return J;
  }

  const RobotModel& model_ = GetParam().model;
  const int frames_ = static_cast<int>(model_.frames().size());
  std::mt19937 random_{67};
  ModelTerms terms_{model_, GetParam().coordinates};
  ModelTerms moving_{model_, GetParam().coordinates};
  const VectorXd q_ = DrawPositions(model_, &random_);
  const VectorXd velocity_ = DrawVelocities(terms_.size(), &random_);
  const MatrixXd rate_map_ = CalcRateMap(q_, velocity_);
  const VectorXd q_dot_ = rate_map_ * velocity_;
};

INSTANTIATE_TEST_SUITE_P(Robots, Jacobian, ::testing::ValuesIn(MakeCases()), NameOf);

TEST_P(Jacobian, IsTheDerivativeOfThePose) {
  terms_.SetState(q_, velocity_);
  // Whatever stood in the caller's matrices is overwritten.
  Matrix6Xd J = Matrix6Xd::Constant(6, terms_.size(), 7.0);
  Matrix6Xd J_dot = J;
  Matrix6Xd by_difference(6, terms_.size());
  for (int frame = 0; frame < frames_; ++frame) {
    const Pose X = terms_.CalcFramePose(frame);
    terms_.CalcFrameJacobian(frame, J, J_dot);
    for (int i = 0; i < terms_.size(); ++i) {
      const VectorXd direction = rate_map_.col(i);
      const Eigen::Matrix4d X_dot = Differentiate(
          [&](double t) -> Eigen::Matrix4d { return CalcPose(frame, q_ + t * direction).matrix(); },
          kPoseStep);
      by_difference.col(i) = CalcBodyVelocity(X, X_dot);
    }
    const bool moves = model_.base().type != BaseType::kFixed || model_.frame(frame).link >= 0;
    if (moves) ASSERT_GT(J.norm(), 0.01);
    EXPECT_TRUE(MatrixNear(J, by_difference, kPoseDifference)) << model_.frame(frame).name;
  }
}

TEST_P(Jacobian, RateIsTheDerivativeAlongTheMotion) {
  terms_.SetState(q_, velocity_);
  Matrix6Xd J(6, terms_.size());
  Matrix6Xd J_dot(6, terms_.size());
  double largest = 0.0;
  for (int frame = 0; frame < frames_; ++frame) {
    terms_.CalcFrameJacobian(frame, J, J_dot);
    const Matrix6Xd by_difference = Differentiate(
        [&](double t) -> Matrix6Xd { return CalcJacobian(frame, q_ + t * q_dot_); }, kStateStep);
    EXPECT_TRUE(MatrixNear(J_dot, by_difference, kStateDifference)) << model_.frame(frame).name;
    largest = std::max(largest, J_dot.norm());
  }
  ASSERT_GT(largest, 1.0);
}

TEST_P(Jacobian, LinkVelocityIsTheDerivativeOfTheLinksPose) {
  terms_.SetState(q_, velocity_);
  double largest = 0.0;
  for (int frame = 0; frame < frames_; ++frame) {
    const int link = model_.frame(frame).link;
    const Vector6d V = terms_.CalcLinkVelocity(link);
    const Pose X = terms_.CalcLinkPose(link);
    const Eigen::Matrix4d X_dot = Differentiate(
        [&](double t) -> Eigen::Matrix4d {
          moving_.SetState(q_ + t * q_dot_, velocity_);
          return moving_.CalcLinkPose(link).matrix();
        },
        kStateStep);
    const Vector6d in_link = CalcBodyVelocity(X, X_dot);
    Vector6d by_difference;
    by_difference << X.linear() * in_link.head<3>(), X.linear() * in_link.tail<3>();
    EXPECT_TRUE(MatrixNear(V, by_difference, kStateDifference)) << "link " << link;
    largest = std::max(largest, V.norm());
  }
  EXPECT_GT(largest, kVisible);
}

// A mobile base is placed by q_v; a rotation that its poses would not show must not be accepted silently.
TEST(BasePose, OfAMobileBaseIsNotTurned) {
  std::mt19937 random(3);
  for (const BaseType type : {BaseType::kPlanar, BaseType::kDifferentialDrive}) {
    RandomRobotOptions options;
    options.base = type;
    RobotSpec spec = MakeRandomRobot(options, &random);
    spec.base.X_B0.translation() = Vector3d(0.5, -0.4, 0.3);
    const RobotModel model(spec);
    ModelTerms terms(model);
    terms.SetState(VectorXd::Zero(model.num_positions()), VectorXd::Zero(terms.size()));
    EXPECT_TRUE(MatrixNear(terms.CalcLinkPose(-1).matrix(), spec.base.X_B0.matrix(), kRounding));
    spec.base.X_B0.rotate(Eigen::AngleAxisd(0.5, Vector3d::UnitZ()));
    EXPECT_THROW(RobotModel{spec}, InputError);
  }
}

}  // namespace
}  // namespace dexcheck::testing::jacobian_test
