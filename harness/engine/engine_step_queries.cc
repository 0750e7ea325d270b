// What the engine has at the state set: poses, Jacobians, motions, object, contacts.

#include "harness/engine/engine_step.h"

namespace dexcheck {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Gap up to which CalcTouch looks for the nearest points, m: much more than contacts are compared at, and
/// not more than the engine's general method for convex bodies bears.
constexpr double kTouchMargin = 0.1;

Vector3d MapVector(const mjtNum* v) { return {v[0], v[1], v[2]}; }

Pose MakePose(const mjtNum* rotation, const mjtNum* position) {
  Pose X = Pose::Identity();
  X.linear() = Eigen::Map<const RowMatrix3d>(rotation);
  X.translation() = MapVector(position);
  return X;
}

}  // namespace

EngineMotion EngineMotion::MoveTo(const Vector3d& point) const {
  const Vector3d arm = point - p;
  EngineMotion moved = *this;
  moved.p = point;
  moved.v += omega.cross(arm);
  moved.a += alpha.cross(arm) + omega.cross(omega.cross(arm));
  return moved;
}

Pose EngineStep::FramePose(int frame) const {
  const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
  return MakePose(data_->site_xmat + 9 * site, data_->site_xpos + 3 * site);
}

void EngineStep::CalcTipJacobian(int finger, const Vector3d& point, Eigen::Ref<Matrix6Xd> J) {
  const auto i = static_cast<size_t>(finger);
  mj_jac(engine_.get(), data_.get(), J_nv_.data(), J_nv_.data() + 3 * engine_->nv, point.data(),
         tip_bodies_[i]);
  for (int col = 0; col < base_size_; ++col) {
    J.col(col).setZero();
    for (int k = 0; k < carrying_dofs_; ++k) {
      J.col(col) += map_.base_columns()(k, col) * J_nv_.col(map_.base_dofs()[static_cast<size_t>(k)]);
    }
  }
  Eigen::Index col = base_size_;
  for (const int dof : chain_dofs_[i]) J.col(col++) = J_nv_.col(dof);
}

EngineMotion EngineStep::ReadMotion(mjtObj type, int id, const mjtNum* place) const {
  mjtNum velocity[6];  // angular, linear
  mjtNum acceleration[6];
  mj_objectVelocity(engine_.get(), data_.get(), type, id, velocity, 0);
  mj_objectAcceleration(engine_.get(), data_.get(), type, id, acceleration, 0);
  return {MapVector(place), MapVector(velocity + 3), MapVector(velocity), MapVector(acceleration + 3),
          MapVector(acceleration)};
}

EngineMotion EngineStep::TipMotion(int finger) const {
  const int site = tip_sites_[static_cast<size_t>(finger)];
  return ReadMotion(mjOBJ_SITE, site, data_->site_xpos + 3 * site);
}

Matrix3d EngineStep::ObjectRotation() const {
  return Eigen::Map<const RowMatrix3d>(data_->xmat + 9 * object_body_);
}

Pose EngineStep::ObjectPose() const {
  return MakePose(data_->xmat + 9 * object_body_, data_->xpos + 3 * object_body_);
}

Vector6d EngineStep::ObjectVelocity() const {
  const EngineMotion motion = ObjectMotion();
  const Matrix3d R = ObjectRotation();
  Vector6d V;
  V << R.transpose() * motion.v, R.transpose() * motion.omega;
  return V;
}

EngineMotion EngineStep::ObjectMotion() const {
  return ReadMotion(mjOBJ_XBODY, object_body_, data_->xpos + 3 * object_body_);
}

Matrix6d EngineStep::ObjectInertia() const {
  const mjModel& m = *engine_;
  Matrix6d M;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) M(i, j) = M(j, i) = data_->qM[m.dof_Madr[object_dof_ + i] + i - j];
  }
  Matrix6d B = Matrix6d::Identity();
  B.topLeftCorner<3, 3>() = ObjectRotation();
  return B.transpose() * M * B;
}

Vector6d EngineStep::ObjectCoriolis() const {
  Vector6d wrench = object_force_.head<6>();
  wrench.head<3>() = ObjectRotation().transpose() * wrench.head<3>().eval();
  return wrench;
}

Vector6d EngineStep::ObjectGravity() const {
  Vector6d wrench = object_force_.tail<6>();
  wrench.head<3>() = ObjectRotation().transpose() * wrench.head<3>().eval();
  return wrench;
}

Eigen::Matrix<double, 3, 6> EngineStep::CalcObjectJacobian(const Vector3d& point) {
  mj_jac(engine_.get(), data_.get(), J_nv_.data(), nullptr, point.data(), object_body_);
  Eigen::Matrix<double, 3, 6> J = J_nv_.block<3, 6>(0, object_dof_);
  J.leftCols<3>() *= ObjectRotation();
  return J;
}

EngineTouch EngineStep::CalcTouch(int finger, const Pose& shift) {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  const auto place = [&](int geom) {
    mj_local2Global(d, d->geom_xpos + 3 * geom, d->geom_xmat + 9 * geom, m->geom_pos + 3 * geom,
                    m->geom_quat + 4 * geom, m->geom_bodyid[geom], m->geom_sameframe[geom]);
  };
  const int tip = tip_geoms_[static_cast<size_t>(finger)];
  place(tip);
  Eigen::Map<Vector3d> center(d->geom_xpos + 3 * tip);  // a sphere has no axes
  center = shift * Vector3d(center);
  EngineTouch touch;
  for (const int geom : object_geoms_) {
    place(geom);
    const bool tip_first = m->geom_type[tip] <= m->geom_type[geom];
    const int first = tip_first ? tip : geom;
    const int second = tip_first ? geom : tip;
    const mjfCollision collide = mjCOLLISIONFUNC[m->geom_type[first]][m->geom_type[second]];
    if (collide == nullptr) continue;
    mjContact contacts[mjMAXCONPAIR];
    const int count = collide(m, d, contacts, first, second, kTouchMargin);
    for (int i = 0; i < count; ++i) {
      if (touch.found && contacts[i].dist >= touch.distance) continue;
      touch.found = true;
      touch.distance = contacts[i].dist;
      touch.position = MapVector(contacts[i].pos);
      touch.normal = (tip_first ? 1.0 : -1.0) * MapVector(contacts[i].frame);
    }
  }
  return touch;
}

}  // namespace dexcheck
