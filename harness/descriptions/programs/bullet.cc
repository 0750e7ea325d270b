// Bullet: the articulated-body algorithm of its btMultiBody, in double precision. It has no mass matrix and
// no inverse dynamics: M is the inverse of the accelerations that unit forces cause, and forces are M times
// accelerations, so that as many digits are lost as M's condition number has.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <LinearMath/btScalar.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "harness/descriptions/programs/engine_program.h"

namespace dexcheck::engines {
namespace {

static_assert(sizeof(btScalar) == sizeof(double), "Bullet must be compiled with BT_USE_DOUBLE_PRECISION");

btVector3 ToBullet(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

btQuaternion ToQuaternion(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return {q.x(), q.y(), q.z(), q.w()};
}

/// Bullet's frame of a link stands at its centre of mass, along its principal axes.
struct PrincipalFrame {
  Eigen::Isometry3d X_LB = Eigen::Isometry3d::Identity();
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();
};

PrincipalFrame FindPrincipalFrame(const UrdfBody& body) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(body.inertia);
  PrincipalFrame frame;
  frame.moments = solver.eigenvalues();
  Eigen::Matrix3d R = solver.eigenvectors();
  if (R.determinant() < 0.0) R.col(0) = -R.col(0);
  frame.X_LB.linear() = R;
  frame.X_LB.translation() = body.com;
  return frame;
}

class BulletRobot : public EngineRobot {
 public:
  BulletRobot(const std::vector<UrdfBody>& bodies, const RobotFacts& facts)
      : floats_(facts.floats), gravity_(ToBullet(facts.gravity)) {
    for (const UrdfBody& body : bodies) frames_.push_back(FindPrincipalFrame(body));
    robot_ = std::make_unique<btMultiBody>(static_cast<int>(bodies.size()) - 1, bodies[0].mass,
                                           ToBullet(frames_[0].moments), !floats_, /*canSleep=*/false);
    for (size_t i = 1; i < bodies.size(); ++i) AddLink(bodies[i], i);
    robot_->finalizeMultiDof();
    // Bullet's own defaults take 4 % of all velocities a second, and stop at 100 rad/s.
    robot_->setLinearDamping(0.0);
    robot_->setAngularDamping(0.0);
    robot_->setUseGyroTerm(true);
    robot_->setMaxCoordinateVelocity(BT_LARGE_FLOAT);
  }

  EngineTerms Evaluate(const Eigen::VectorXd& q, const Eigen::VectorXd& v) override {
    const Eigen::Index n = v.size();
    EngineTerms terms;
    SetState(q, v);
    const Eigen::VectorXd moving = CalcAccelerations(v, /*with_gravity=*/false);
    SetState(q, Eigen::VectorXd::Zero(n));
    const Eigen::VectorXd falling = CalcAccelerations(v, /*with_gravity=*/true);
    // M^-1: Bullet's accelerations under unit forces; a fixed base has six entries of its own that stay zero.
    const Eigen::Index first = floats_ ? 0 : kBase;
    Eigen::MatrixXd inverse(n, n);
    for (Eigen::Index col = 0; col < n; ++col) {
      Eigen::VectorXd force = Eigen::VectorXd::Unit(kBase + robot_->getNumDofs(), first + col);
      Eigen::VectorXd response = Eigen::VectorXd::Zero(force.size());
      robot_->calcAccelerationDeltasMultiDof(force.data(), response.data(), scratch_r_, scratch_v_);
      inverse.col(col) = response.tail(n);
    }
    terms.M = inverse.partialPivLu().inverse();
    terms.c = -terms.M * moving;
    terms.g = -terms.M * falling;
    if (floats_) ExpressAtOrigin(q, v, &terms);
    return terms;
  }

 private:
  static constexpr Eigen::Index kBase = 6;

  void AddLink(const UrdfBody& body, size_t index) {
    const PrincipalFrame& own = frames_[index];
    const PrincipalFrame& parent = frames_[static_cast<size_t>(body.parent)];
    const int link = static_cast<int>(index) - 1;
    const Eigen::Isometry3d X_BpL = parent.X_LB.inverse() * body.X_PL;
    const btQuaternion from_parent = ToQuaternion((X_BpL * own.X_LB).linear().transpose());
    const btVector3 moments = ToBullet(own.moments);
    const btVector3 pivot = ToBullet(X_BpL.translation());
    const btVector3 com = ToBullet(own.X_LB.linear().transpose() * own.X_LB.translation());
    const btVector3 axis = ToBullet(own.X_LB.linear().transpose() * body.axis);
    if (body.motion == Motion::kTurns) {
      robot_->setupRevolute(link, body.mass, moments, body.parent - 1, from_parent, axis, pivot, com, true);
    } else {
      robot_->setupPrismatic(link, body.mass, moments, body.parent - 1, from_parent, axis, pivot, com, true);
    }
  }

  /// The frame of the root link in the world.
  [[nodiscard]] static Eigen::Isometry3d MakeBasePose(const Eigen::VectorXd& q) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    X.translation() = q.segment<3>(4);
    return X;
  }

  void SetState(const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
    Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
    if (floats_) X_WL = MakeBasePose(q);
    const Eigen::Isometry3d X_WB = X_WL * frames_[0].X_LB;
    robot_->setBasePos(ToBullet(X_WB.translation()));
    robot_->setWorldToBaseRot(ToQuaternion(X_WB.linear().transpose()));
    if (floats_) {
      const Eigen::Vector3d omega = v.head<3>();
      const Eigen::Vector3d r = X_WB.translation() - X_WL.translation();
      robot_->setBaseOmega(ToBullet(omega));
      robot_->setBaseVel(ToBullet(v.segment<3>(3) + omega.cross(r)));
    }
    const int count = robot_->getNumLinks();
    for (int i = 0; i < count; ++i) {
      robot_->setJointPos(i, q[q.size() - count + i]);
      robot_->setJointVel(i, v[v.size() - count + i]);
    }
  }

  /// Accelerations of the base (angular, then that of its centre of mass, world axes) and the joints, under
  /// gravity or no force. Bullet adds them to the velocities, here for a step of 1 s.
  Eigen::VectorXd CalcAccelerations(const Eigen::VectorXd& v, bool with_gravity) {
    robot_->clearForcesAndTorques();
    if (with_gravity) {
      robot_->addBaseForce(gravity_ * robot_->getBaseMass());
      for (int i = 0; i < robot_->getNumLinks(); ++i) {
        robot_->addLinkForce(i, gravity_ * robot_->getLinkMass(i));
      }
    }
    const Eigen::VectorXd before = ReadVelocities(v.size());
    robot_->computeAccelerationsArticulatedBodyAlgorithmMultiDof(1.0, scratch_r_, scratch_v_, scratch_m_,
                                                                 /*isConstraintPass=*/false, false, false);
    return ReadVelocities(v.size()) - before;
  }

  [[nodiscard]] Eigen::VectorXd ReadVelocities(Eigen::Index n) const {
    return Eigen::Map<const Eigen::VectorXd>(robot_->getVelocityVector(), kBase + robot_->getNumDofs())
        .tail(n);
  }

  /// From the velocity of the base's centre of mass to that of the root link's origin: with u_B = B u,
  ///   v_B = v + omega x r,  M = B^T M_B B,  c = B^T (c_B + M_B B_dot u),  g = B^T g_B.
  void ExpressAtOrigin(const Eigen::VectorXd& q, const Eigen::VectorXd& v, EngineTerms* terms) const {
    const Eigen::Vector3d r = MakeBasePose(q).linear() * frames_[0].X_LB.translation();
    const Eigen::Vector3d omega = v.head<3>();
    Eigen::MatrixXd B = Eigen::MatrixXd::Identity(v.size(), v.size());
    for (int i = 0; i < 3; ++i) B.block<3, 1>(3, i) = Eigen::Vector3d::Unit(i).cross(r);
    Eigen::VectorXd rate = Eigen::VectorXd::Zero(v.size());
    rate.segment<3>(3) = omega.cross(omega.cross(r));
    terms->c = (B.transpose() * (terms->c + terms->M * rate)).eval();
    terms->g = (B.transpose() * terms->g).eval();
    terms->M = (B.transpose() * terms->M * B).eval();
  }

  bool floats_;
  btVector3 gravity_;
  std::vector<PrincipalFrame> frames_;  // by body
  std::unique_ptr<btMultiBody> robot_;
  btAlignedObjectArray<btScalar> scratch_r_;
  btAlignedObjectArray<btVector3> scratch_v_;
  btAlignedObjectArray<btMatrix3x3> scratch_m_;
};

}  // namespace
}  // namespace dexcheck::engines

int main(int argc, char** argv) {
  using namespace dexcheck::engines;
  const int version = btGetVersion();
  const std::string name = "Bullet " + std::to_string(version / 100) + "." + std::to_string(version % 100);
  return RunEngine(argc, argv, name, [](const auto& bodies, const RobotFacts& facts) {
    return std::make_unique<BulletRobot>(bodies, facts);
  });
}
