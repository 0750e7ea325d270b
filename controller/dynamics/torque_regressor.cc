#include "controller/dynamics/torque_regressor.h"

#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

/// I w of the six entries of a tensor, as a matrix times them.
Eigen::Matrix<double, 3, 6> InertiaTimes(const Vector3d& w) {
  Eigen::Matrix<double, 3, 6> L;
  // clang-format off
  L << w.x(), 0.0,   0.0,   w.y(), w.z(), 0.0,
       0.0,   w.y(), 0.0,   w.x(), 0.0,   w.z(),
       0.0,   0.0,   w.z(), 0.0,   w.x(), w.y();
  // clang-format on
  return L;
}

/// Force and moment at the origin of a link's frame by its BodyVector.
/// @param a acceleration of the origin less gravity; all in the frame's axes.
Eigen::Matrix<double, 6, TorqueRegressor::kBody> WrenchColumns(const Vector3d& w, const Vector3d& w_dot,
                                                               const Vector3d& a) {
  Eigen::Matrix<double, 6, TorqueRegressor::kBody> A =
      Eigen::Matrix<double, 6, TorqueRegressor::kBody>::Zero();
  A.block<3, 1>(0, 0) = a;
  A.block<3, 3>(0, 1) = Skew(w_dot) + Skew(w) * Skew(w);
  A.block<3, 3>(3, 1) = -Skew(a);
  A.block<3, 6>(3, 4) = InertiaTimes(w_dot) + Skew(w) * InertiaTimes(w);
  return A;
}

}  // namespace

TorqueRegressor::TorqueRegressor(const RobotModel& model) : model_(&model), qdd_(model.num_joints()) {
  RequireNoBalls(model, "where torques are explained");
  for (int joint = 0; joint < model.num_joints(); ++joint) {
    bodies_.push_back(Pack(model.joint(joint).body));
    chains_.push_back(model.ListChain(joint));
  }
  links_.resize(bodies_.size());
}

TorqueRegressor::BodyVector TorqueRegressor::Pack(const MassProperties& body) {
  BodyVector vector;
  vector << body.mass, body.mass * body.com, ToEntries(body.inertia + CalcPointInertia(body.mass, body.com));
  return vector;
}

MassProperties TorqueRegressor::Unpack(const BodyVector& vector) {
  MassProperties body;
  body.mass = vector[0];
  if (body.mass != 0.0) body.com = vector.segment<3>(1) / body.mass;
  body.inertia = ToTensor(vector.tail<6>()) - CalcPointInertia(body.mass, body.com);
  return body;
}

void TorqueRegressor::SetMotion(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& qd,
                                const Eigen::Ref<const VectorXd>& qdd, const BaseMotion& base) {
  qdd_ = qdd;
  const Link ground = {base.R * model_->base().X_B0.linear(), Vector3d::Zero(), base.w, base.w_dot,
                       base.a - model_->gravity()};
  for (int i = 0; i < size(); ++i) {
    const Joint& joint = model_->joint(i);
    const Link& parent = joint.parent < 0 ? ground : links_[static_cast<size_t>(joint.parent)];
    const bool turns = joint.type == JointType::kRevolute;
    const Pose X =
        joint.X_PB * CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q + (turns ? q[i] : 0.0),
                                      joint.mdh.d + (turns ? 0.0 : q[i]));
    Link& link = links_[static_cast<size_t>(i)];
    link.R = parent.R * X.linear();
    const Vector3d r = parent.R * X.translation();
    const Vector3d z = link.R.col(2);
    link.p = parent.p + r;
    link.w = parent.w;
    link.w_dot = parent.w_dot;
    link.a = parent.a + parent.w_dot.cross(r) + parent.w.cross(parent.w.cross(r));
    if (turns) {
      link.w += z * qd[i];
      link.w_dot += z * qdd[i] + parent.w.cross(z) * qd[i];
    } else {
      link.a += z * qdd[i] + 2.0 * parent.w.cross(z) * qd[i];
    }
  }
}

void TorqueRegressor::CalcTorques(Eigen::Ref<VectorXd> torques) const {
  for (int i = 0; i < size(); ++i) torques[i] = model_->joint(i).armature * qdd_[i];
  for (int i = 0; i < size(); ++i) {
    const Link& link = links_[static_cast<size_t>(i)];
    const Vector6d wrench = WrenchColumns(link.R.transpose() * link.w, link.R.transpose() * link.w_dot,
                                          link.R.transpose() * link.a) *
                            bodies_[static_cast<size_t>(i)];
    const Vector3d force = link.R * wrench.head<3>();
    const Vector3d moment = link.R * wrench.tail<3>();
    for (const int j : chains_[static_cast<size_t>(i)]) {
      const Vector3d r = link.p - links_[static_cast<size_t>(j)].p;
      torques[j] += axis(j).dot(is_revolute(j) ? Vector3d(moment + r.cross(force)) : force);
    }
  }
}

void TorqueRegressor::CalcBodyColumns(Eigen::Ref<MatrixXd> columns) const {
  for (int i = 0; i < size(); ++i) CalcBodyColumns(i, columns.middleCols<kBody>(kBody * i));
}

void TorqueRegressor::CalcBodyColumns(int i, Eigen::Ref<MatrixXd> columns) const {
  columns.setZero();
  const Link& link = links_[static_cast<size_t>(i)];
  const auto A = WrenchColumns(link.R.transpose() * link.w, link.R.transpose() * link.w_dot,
                               link.R.transpose() * link.a);
  for (const int j : chains_[static_cast<size_t>(i)]) {
    const Vector3d z = link.R.transpose() * axis(j);
    const Vector3d r = link.R.transpose() * (link.p - links_[static_cast<size_t>(j)].p);
    if (is_revolute(j)) {
      columns.row(j) = z.cross(r).transpose() * A.topRows<3>() + z.transpose() * A.bottomRows<3>();
    } else {
      columns.row(j) = z.transpose() * A.topRows<3>();
    }
  }
}

void TorqueRegressor::CalcGravityColumns(Eigen::Ref<MatrixXd> columns) const {
  columns.setZero();
  for (int i = 0; i < size(); ++i) {
    const Link& link = links_[static_cast<size_t>(i)];
    const double mass = bodies_[static_cast<size_t>(i)][0];
    const Vector3d mc = link.R * bodies_[static_cast<size_t>(i)].segment<3>(1);
    for (const int j : chains_[static_cast<size_t>(i)]) {
      const Vector3d arm = mass * (link.p - links_[static_cast<size_t>(j)].p) + mc;
      const Vector3d z = axis(j);
      columns.row(j) -= (is_revolute(j) ? Vector3d(z.cross(arm)) : Vector3d(mass * z)).transpose();
    }
  }
}

void TorqueRegressor::CalcForceColumns(int link, Eigen::Ref<MatrixXd> columns) const {
  columns.setZero();
  const Link& carrier = links_[static_cast<size_t>(link)];
  const Vector3d place = carrier.p + carrier.R * model_->joint(link).body.com;
  for (const int j : chains_[static_cast<size_t>(link)]) {
    const Vector3d z = axis(j);
    if (is_revolute(j)) {
      columns.row(j) << -z.cross(place - links_[static_cast<size_t>(j)].p).transpose(), -z.transpose();
    } else {
      columns.row(j).head<3>() = -z.transpose();
    }
  }
}

Eigen::Matrix4d CalcPseudoInertia(const TorqueRegressor::BodyVector& body) {
  const Matrix3d I = ToTensor(body.tail<6>());
  Eigen::Matrix4d pseudo;
  // The second moments are half the trace of I less I.
  pseudo << 0.5 * I.trace() * Matrix3d::Identity() - I, body.segment<3>(1), body.segment<3>(1).transpose(),
      body[0];
  return pseudo;
}

bool IsBody(const TorqueRegressor::BodyVector& body) {
  constexpr double kRounding = 1e-9;
  const Eigen::Matrix4d pseudo = CalcPseudoInertia(body);
  return body[0] > 0.0 && CalcSymmetricEigenvalues(pseudo)[0] >= -kRounding * pseudo.trace();
}

TorqueRegressor::BodyVector FindNearestBody(const TorqueRegressor::BodyVector& body) {
  const SymmetricEigen eigen = DecomposeSymmetric(CalcPseudoInertia(body));
  // No thinner than readers of descriptions take for a body.
  constexpr double kThinnest = 1e-6;
  const VectorXd possible = eigen.values.cwiseMax(kThinnest * eigen.values.cwiseAbs().maxCoeff());
  const Eigen::Matrix4d pseudo = eigen.vectors * possible.asDiagonal() * eigen.vectors.transpose();
  const Matrix3d moments = pseudo.topLeftCorner<3, 3>();
  TorqueRegressor::BodyVector nearest;
  nearest << pseudo(3, 3), pseudo.topRightCorner<3, 1>(),
      ToEntries(moments.trace() * Matrix3d::Identity() - moments);
  return nearest;
}

}  // namespace dexcheck
