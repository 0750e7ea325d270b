#include "harness/engine/engine_terms.h"

#include <algorithm>

namespace dexcheck {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Vector3d MapVector(const mjtNum* v) { return {v[0], v[1], v[2]}; }

}  // namespace

EngineTerms::EngineTerms(const Adapter& adapter, Coordinates coordinates)
    : adapter_(&adapter),
      engine_(mj_copyModel(nullptr, &adapter.engine())),
      data_(MakeData(*engine_)),
      map_(adapter, coordinates) {
  const int nv = engine_->nv;
  const int n = map_.size();
  q_.setZero(adapter.model().num_positions());
  bias_nv_.setZero(nv);
  force_nv_.setZero(nv);
  M_nv_.setZero(nv, nv);
  M_.setZero(n, n);
  coriolis_.setZero(n);
  gravity_.setZero(n);
  friction_.setZero(n);
  velocity_.setZero(n);
  force_.setZero(n);
  J_nv_.setZero(6, nv);
  J_.setZero(6, n);
  links_.resize(adapter.link_bodies().size());
}

void EngineTerms::SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity) {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  const Vector3d gravity = MapVector(adapter_->engine().opt.gravity);
  q_ = q;
  adapter_->SetPositions(q, d->qpos);
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_crb(m, d);
  mj_fullM(m, M_nv_.data(), d->qM);  // symmetric, so the storage order does not matter
  map_.SetState(q, velocity);
  map_.ProjectMatrix(M_nv_, M_);

  // Gravity alone: the bias force at rest.
  for (int i = 0; i < 3; ++i) engine_->opt.gravity[i] = gravity[i];
  mju_zero(d->qvel, m->nv);
  mj_comVel(m, d);
  mj_rne(m, d, 0, force_nv_.data());
  map_.ProjectForce(force_nv_.data(), gravity_);
  mju_zero(engine_->opt.gravity, 3);

  CalcCoriolis(velocity, coriolis_);
  mj_passive(m, d);
  map_.ProjectForce(d->qfrc_passive, friction_);
  friction_ = -friction_;
  mju_copy(d->qacc, bias_nv_.data(), m->nv);
  mj_rnePostConstraint(m, d);  // body accelerations at constant coordinates' rates
  CalcEnergyAndMomentum();
}

void EngineTerms::CalcCoriolis(const Eigen::Ref<const VectorXd>& velocity, Eigen::Ref<VectorXd> result) {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  map_.SetState(q_, velocity);
  map_.Expand(velocity, d->qvel);
  map_.ExpandBias(bias_nv_.data());
  mj_comVel(m, d);
  mj_rne(m, d, 0, force_nv_.data());
  force_nv_.noalias() += M_nv_ * bias_nv_;
  map_.ProjectForce(force_nv_.data(), result);
}

void EngineTerms::CalcCoriolisProduct(const Eigen::Ref<const VectorXd>& velocity,
                                      const Eigen::Ref<const VectorXd>& w, Eigen::Ref<VectorXd> result) {
  velocity_ = velocity + w;
  CalcCoriolis(velocity_, result);
  velocity_ = velocity - w;
  CalcCoriolis(velocity_, force_);
  result -= force_;
  map_.ExpandBracket(q_, velocity, w, bias_nv_.data());
  force_nv_.noalias() = M_nv_ * bias_nv_;
  map_.ProjectForce(force_nv_.data(), force_);
  result = 0.25 * result + 0.5 * force_;
}

void EngineTerms::CalcEnergyAndMomentum() {
  const mjModel* m = engine_.get();
  mjData* d = data_.get();
  const Vector3d gravity = MapVector(adapter_->engine().opt.gravity);
  energy_ = EnergyAndMomentum{};
  double total_mass = 0.0;
  Vector3d mass_moment = Vector3d::Zero();
  Vector3d angular_about_origin = Vector3d::Zero();
  for (size_t link = 0; link < links_.size(); ++link) {
    LinkInWorld& sum = links_[link];
    sum = LinkInWorld{};
    for (const int body : adapter_->welded_bodies()[link]) {
      sum.mass += m->body_mass[body];
      sum.com += m->body_mass[body] * MapVector(d->xipos + 3 * body);
    }
    if (sum.mass > 0.0) sum.com /= sum.mass;
    for (const int body : adapter_->welded_bodies()[link]) {
      const Eigen::Map<const RowMatrix3d> R(d->ximat + 9 * body);
      const Matrix3d inertia = R * MapVector(m->body_inertia + 3 * body).asDiagonal() * R.transpose();
      const Vector3d com = MapVector(d->xipos + 3 * body);
      const Vector3d arm = com - sum.com;
      const double mass = m->body_mass[body];
      sum.inertia += inertia + mass * (arm.squaredNorm() * Matrix3d::Identity() - arm * arm.transpose());

      mjtNum velocity[6];  // angular, linear; of the body's centre of mass
      mj_objectVelocity(m, d, mjOBJ_BODY, body, velocity, 0);
      const Vector3d p = mass * MapVector(velocity + 3);
      energy_.linear_momentum += p;
      angular_about_origin += com.cross(p) + inertia * MapVector(velocity);
    }
    total_mass += sum.mass;
    mass_moment += sum.mass * sum.com;
  }
  if (total_mass > 0.0) energy_.com = mass_moment / total_mass;
  energy_.potential = -gravity.dot(mass_moment);
  energy_.angular_momentum = angular_about_origin - energy_.com.cross(energy_.linear_momentum);
  force_nv_.noalias() = M_nv_ * Eigen::Map<const VectorXd>(d->qvel, m->nv);
  energy_.kinetic = 0.5 * force_nv_.dot(Eigen::Map<const VectorXd>(d->qvel, m->nv));
}

Vector3d EngineTerms::JointAxis(int joint) const {
  return MapVector(data_->xaxis + 3 * adapter_->joint_ids()[static_cast<size_t>(joint)]);
}

Vector3d EngineTerms::JointAnchor(int joint) const {
  return MapVector(data_->xanchor + 3 * adapter_->joint_ids()[static_cast<size_t>(joint)]);
}

Pose EngineTerms::FramePose(int frame) const {
  const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
  Pose X = Pose::Identity();
  X.linear() = Eigen::Map<const RowMatrix3d>(data_->site_xmat + 9 * site);
  X.translation() = MapVector(data_->site_xpos + 3 * site);
  return X;
}

void EngineTerms::CalcFrameJacobian(int frame, Eigen::Ref<Matrix6Xd> J) {
  const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
  mj_jacSite(engine_.get(), data_.get(), J_nv_.data(), J_nv_.data() + 3 * engine_->nv, site);
  map_.ProjectJacobian(J_nv_, J_);
  J = J_;
}

Vector6d EngineTerms::CalcFrameBiasAcceleration(int frame) const {
  const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
  mjtNum acceleration[6];  // angular, linear
  mj_objectAcceleration(engine_.get(), data_.get(), mjOBJ_SITE, site, acceleration, 0);
  Vector6d result;
  result << MapVector(acceleration + 3), MapVector(acceleration);
  return result;
}

}  // namespace dexcheck
