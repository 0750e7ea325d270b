// Queries of the engine at the state set: poses, Jacobians, motions, object, contacts.

#include "harness/engine/engine_terms.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

/// Gap up to which CalcTouch looks for the nearest points, m: much more than contacts are compared at, and
/// within the range of the engine's general method for convex bodies.
constexpr double kTouchMargin = 0.1;

}  // namespace

EngineMotion EngineMotion::MoveTo(const Vector3d& point) const {
  const Vector3d arm = point - p;
  EngineMotion moved = *this;
  moved.p = point;
  moved.v += omega.cross(arm);
  moved.a += alpha.cross(arm) + omega.cross(omega.cross(arm));
  return moved;
}

Pose EngineTerms::FramePose(int frame) const {
  const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
  return tilt_.inverse(Eigen::Isometry) *
         (site < 0 ? BodyPose(*data_, body_of(frame))
                   : MapPose(data_->site_xmat + 9 * site, data_->site_xpos + 3 * site));
}

const mjtNum* EngineTerms::PlaceOf(int frame) const {
  const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
  return site < 0 ? data_->xpos + 3 * body_of(frame) : data_->site_xpos + 3 * site;
}

Vector3d EngineTerms::JointAxis(int joint, int column) const {
  const int id = adapter_->joint_ids()[static_cast<size_t>(joint)];
  if (engine_->jnt_type[id] != mjJNT_BALL) return MapVector(data_->xaxis + 3 * id);
  const mjtNum* const R = data_->xmat + 9 * engine_->jnt_bodyid[id];
  return {R[column], R[3 + column], R[6 + column]};
}

Vector3d EngineTerms::JointAnchor(int joint) const {
  return MapVector(data_->xanchor + 3 * adapter_->joint_ids()[static_cast<size_t>(joint)]);
}

std::vector<MassProperties> EngineTerms::links() const {
  const mjModel* m = engine_.get();
  const mjData* d = data_.get();
  std::vector<MassProperties> links;
  for (const std::vector<int>& welded : adapter_->welded_bodies()) {
    MassProperties& link = links.emplace_back();
    for (const int body : welded) {
      link.mass += m->body_mass[body];
      link.com += m->body_mass[body] * MapVector(d->xipos + 3 * body);
    }
    if (link.mass > 0.0) link.com /= link.mass;
    for (const int body : welded) {
      const RotationMap R(d->ximat + 9 * body);
      const Vector3d arm = MapVector(d->xipos + 3 * body) - link.com;
      // The parallel-axis theorem adds m (|r|^2 1 - r r^T).
      link.inertia += R * MapVector(m->body_inertia + 3 * body).asDiagonal() * R.transpose() +
                      m->body_mass[body] * (arm.squaredNorm() * Matrix3d::Identity() - arm * arm.transpose());
    }
  }
  return links;
}

Vector6d EngineTerms::CalcPointColumn(int dof, const Vector3d& point) const {
  // The engine's motion axes [omega; v] are about the centre of mass of the dof's tree; as in mj_jac.
  const mjtNum* const axis = data_->cdof + 6 * dof;
  const int root = engine_->body_rootid[engine_->dof_bodyid[dof]];
  const Vector3d arm = point - MapVector(data_->subtree_com + 3 * root);
  Vector6d column;
  column << MapVector(axis + 3) + MapVector(axis).cross(arm), MapVector(axis);
  return column;
}

void EngineTerms::CalcFrameColumns(int frame, Eigen::Ref<Matrix6Xd> J) const {
  const Vector3d point = MapVector(PlaceOf(frame));
  J.leftCols(base_size_).setZero();
  for (int k = 0; k < carrying_dofs_; ++k) {
    const Vector6d column = CalcPointColumn(map_.base_dofs()[static_cast<size_t>(k)], point);
    for (int col = 0; col < base_size_; ++col) J.col(col) += map_.base_columns()(k, col) * column;
  }
  Eigen::Index col = base_size_;
  for (const int dof : chain_of(frame).dofs) J.col(col++) = CalcPointColumn(dof, point);
}

Matrix6Xd EngineTerms::CalcFrameJacobian(int frame) const {
  const std::vector<int>& coordinates = chain(frame);
  Matrix6Xd columns(6, static_cast<Eigen::Index>(coordinates.size()));
  CalcFrameColumns(frame, columns);
  Matrix6Xd J = Matrix6Xd::Zero(6, size());
  for (size_t i = 0; i < coordinates.size(); ++i)
    J.col(coordinates[i]) = columns.col(static_cast<Eigen::Index>(i));
  return J;
}

EngineMotion EngineTerms::ReadMotion(mjtObj type, int id, const mjtNum* place) const {
  mjtNum velocity[6];  // angular, linear
  mjtNum acceleration[6];
  mj_objectVelocity(engine_.get(), data_.get(), type, id, velocity, 0);
  mj_objectAcceleration(engine_.get(), data_.get(), type, id, acceleration, 0);
  return {MapVector(place), MapVector(velocity + 3), MapVector(velocity), MapVector(acceleration + 3),
          MapVector(acceleration)};
}

EngineMotion EngineTerms::FrameMotion(int frame) const {
  const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
  const EngineMotion motion = site < 0 ? ReadMotion(mjOBJ_XBODY, body_of(frame), PlaceOf(frame))
                                       : ReadMotion(mjOBJ_SITE, site, PlaceOf(frame));
  return {Move(motion.p), Turn(motion.v), Turn(motion.omega), Turn(motion.a), Turn(motion.alpha)};
}

Matrix3d EngineTerms::ObjectRotation() const { return RotationMap(data_->xmat + 9 * object_body_); }

Pose EngineTerms::ObjectPose() const { return BodyPose(*data_, object_body_); }

Vector6d EngineTerms::ObjectVelocity() const {
  const EngineMotion motion = ObjectMotion();
  const Matrix3d R = ObjectRotation();
  Vector6d V;
  V << R.transpose() * motion.v, R.transpose() * motion.omega;
  return V;
}

EngineMotion EngineTerms::ObjectMotion() const {
  return ReadMotion(mjOBJ_XBODY, object_body_, data_->xpos + 3 * object_body_);
}

Matrix6d EngineTerms::ObjectInertia() const {
  Matrix6d B = Matrix6d::Identity();
  B.topLeftCorner<3, 3>() = ObjectRotation();
  return B.transpose() * mass_nv_.block<6, 6>(adapter_->object_dof(), adapter_->object_dof()) * B;
}

Vector6d EngineTerms::ObjectForce() const {
  Vector6d wrench = force_nv_.segment<6>(adapter_->object_dof());
  wrench.head<3>() = ObjectRotation().transpose() * wrench.head<3>().eval();
  return wrench;
}

Eigen::Matrix<double, 3, 6> EngineTerms::CalcObjectJacobian(const Vector3d& point) const {
  Eigen::Matrix<double, 3, 6> J;
  for (int i = 0; i < 6; ++i) J.col(i) = CalcPointColumn(adapter_->object_dof() + i, point).head<3>();
  J.leftCols<3>() *= ObjectRotation();
  return J;
}

EngineTouch EngineTerms::CalcTouch(int frame, const Pose& shift) {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  const auto place = [&](int geom) {
    mj_local2Global(d, d->geom_xpos + 3 * geom, d->geom_xmat + 9 * geom, m->geom_pos + 3 * geom,
                    m->geom_quat + 4 * geom, m->geom_bodyid[geom], m->geom_sameframe[geom]);
  };
  const int tip = chain_of(frame).tip_geom;
  place(tip);
  Eigen::Map<Vector3d> center(d->geom_xpos + 3 * tip);  // a sphere has no axes
  center = shift * Move(center);
  EngineTouch touch;
  for (const int geom : object_geoms_) {
    place(geom);
    const bool tip_first = m->geom_type[tip] <= m->geom_type[geom];
    const int first = tip_first ? tip : geom;
    const int second = tip_first ? geom : tip;
    const mjfCollision collide = mjCOLLISIONFUNC[m->geom_type[first]][m->geom_type[second]];
    if (collide == nullptr) continue;
    CollisionContact contacts[mjMAXCONPAIR];
    const int count = collide(m, d, contacts, first, second, kTouchMargin);
    for (int i = 0; i < count; ++i) {
      if (touch.found && contacts[i].dist >= touch.distance) continue;
      touch.found = true;
      touch.distance = contacts[i].dist;
      touch.position = MapVector(contacts[i].pos);
      touch.normal = (tip_first ? 1.0 : -1.0) * MapVector(NormalOf(contacts + i));
    }
  }
  return touch;
}

}  // namespace dexcheck
