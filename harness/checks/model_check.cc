#include "harness/checks/model_check.h"

#include <numeric>
#include <utility>

namespace dexcheck {
namespace {

/// Pose and body velocity of the object at X_o, X_o_dot by the engine's quaternions.
struct EngineObjectState {
  Pose X_Bo = Pose::Identity();
  Vector6d V_Bo = Vector6d::Zero();
};

EngineObjectState CalcEngineObjectState(const Vector6d& X_o, const Vector6d& X_o_dot) {
  // Quaternion z(alpha) y(beta) z(gamma); each angle's rate turns about its axis as the later rotations leave
  // it.
  const mjtNum axes[3][3] = {{0, 0, 1}, {0, 1, 0}, {0, 0, 1}};
  mjtNum rotation[4] = {1, 0, 0, 0};
  Vector3d omega = Vector3d::Zero();  // in the frame reached so far
  for (int k = 0; k < 3; ++k) {
    mjtNum step[4];
    mjtNum inverse[4];
    mjtNum turned[3];
    mju_axisAngle2Quat(step, axes[k], X_o[3 + k]);
    mju_mulQuat(rotation, rotation, step);
    mju_negQuat(inverse, step);
    mju_rotVecQuat(turned, omega.data(), inverse);
    omega = Vector3d(turned[0], turned[1], turned[2]) +
            X_o_dot[3 + k] * Vector3d(axes[k][0], axes[k][1], axes[k][2]);
  }
  mju_normalize4(rotation);
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R;
  mju_quat2Mat(R.data(), rotation);
  EngineObjectState state;
  state.X_Bo.linear() = R;
  state.X_Bo.translation() = X_o.head<3>();
  state.V_Bo << R.transpose() * X_o_dot.head<3>(), omega;
  return state;
}

}  // namespace

ModelCheck::ModelCheck(const Adapter& adapter, const ModelViewFactory& make_view, ObjectFormulas object)
    : TermComparison(adapter),
      object_(std::move(object)),
      engine_(adapter, Coordinates::kReduced),
      engine_unreduced_(adapter, Coordinates::kUnreduced),
      robot_(make_view(adapter.model(), Coordinates::kReduced)),
      unreduced_(make_view(adapter.model(), Coordinates::kUnreduced)),
      terms_at_w_(adapter.model()),
      scales_at_w_(adapter.model()) {
  const bool has_object = adapter.model().object().has_value();
  if (has_object) engine_.RequireObject();
  const int n = engine_.size();
  const size_t frames = adapter.model().frames().size();
  unreduced_velocity_.setZero(unreduced_->size());
  J_.assign(frames, Matrix6Xd::Zero(6, n));
  J_dot_ = J_;
  context_.engine = &engine_;
  context_.engine_unreduced = &engine_unreduced_;
  context_.robot = robot_.get();
  context_.unreduced = unreduced_.get();
  context_.scales_at_w = &scales_at_w_;
  context_.links = engine_.links();
  std::vector<int> all(frames);
  std::iota(all.begin(), all.end(), 0);
  SetFrames(all, /*contacts=*/false);
  for (size_t i = 0; i < frames; ++i) context_.jacobians[i] = {&J_[i], &J_dot_[i]};
  constexpr TermGroup kObject[] = {TermGroup::kObject, TermGroup::kObjectCoordinates};
  Ask(kAskedByConsistency, has_object ? std::span<const TermGroup>() : kObject);
}

void ModelCheck::Compare(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                         const Eigen::Ref<const VectorXd>& w, const Vector6d& X_o, const Vector6d& X_o_dot,
                         long sample) {
  robot_->SetState(q, xi);
  unreduced_->SetState(q, unreduced_velocity_);
  const EngineObjectState object = CalcEngineObjectState(X_o, X_o_dot);
  engine_.SetState(q, xi, object.X_Bo, object.V_Bo);
  engine_unreduced_.SetState(q, unreduced_velocity_);
  scales_.SetState(robot_->terms(), q, xi);
  terms_at_w_.SetState(q, w);
  scales_at_w_.SetState(terms_at_w_, q, w);
  context_.xi = xi;
  context_.w = w;
  context_.energy = robot_->CalcEnergyAndMomentum();
  context_.links = engine_.links();
  EvaluateFrames();
  for (size_t i = 0; i < J_.size(); ++i) robot_->CalcFrameJacobian(static_cast<int>(i), J_[i], J_dot_[i]);
  if (model().object()) ReadObject(X_o, X_o_dot);
  TermComparison::Compare(static_cast<double>(sample), /*contacts=*/false);
}

void ModelCheck::ReadObject(const Vector6d& X_o, const Vector6d& X_o_dot) {
  const MassProperties& body = model().object()->body;
  const ObjectTerms terms = object_.terms(body, model().gravity(), X_o, X_o_dot);
  ObjectValues& values = context_.object_model;
  values.pose = object_.pose(X_o).matrix().topRows<3>();
  values.V_Bo = terms.V_Bo;
  values.N_o = terms.N_o;
  values.kinetic = CalcObjectKineticEnergy(body, terms.V_Bo);
  values.M_o = terms.M_o;
  values.C_o_X_o_dot = terms.C_o * X_o_dot;
  const ObjectCoordinates coordinates{X_o, X_o_dot};
  EvaluateObject(body, model().gravity(), &coordinates, &context_);
}

}  // namespace dexcheck
