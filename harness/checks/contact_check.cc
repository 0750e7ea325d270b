#include "harness/checks/contact_check.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "controller/common/errors.h"
#include "harness/base/worst.h"

namespace dexcheck {

namespace {

/// Rounding errors of a contact's place.
void CalcPlaceScales(const RoundingScales& robot, const ContactGeometry& contact, ContactScales* scales) {
  // A fingertip displaced by e over the object moves the contact by (K_f + Kt_o)^-1 K_f e on the object and
  // turns the normal by K_o times that.
  const Matrix2d sum = contact.fingertip.K + contact.R_psi * contact.object.K * contact.R_psi;
  // The smallest eigenvalue. R_psi K_o R_psi is symmetric but for rounding, and hypot knows no negative
  // squares.
  const double half = 0.5 * (sum(0, 0) - sum(1, 1));
  const double least = 0.5 * sum.trace() - std::hypot(half, 0.5 * (sum(0, 1) + sum(1, 0)));
  const double moved = contact.fingertip.K.norm() / least;
  const double length = robot.world_length();
  // On a flat object hardly anything turns the normal except the error of the search for the contact.
  const double left = kContactConvergence / CalcRoundingBound(robot.depth(), 1.0);
  scales->normal = Worst(1.0 + contact.object.K.norm() * moved * length, left);
  scales->position = (1.0 + moved) * length;
  scales->moment = scales->position + contact.g_o_cf.translation().norm() * scales->normal;
  scales->J_B = scales->normal + scales->position / robot.length();
}

/// Sigma_cf by the engine, in the plant's world and where the projected robot has it.
struct ContactPlace {
  Matrix3d R;
  Vector3d p;
  Matrix3d R_projected;
  Vector3d p_projected;
};

/// Rates of the two bodies' velocities at the contact, as Sigma_cf has them.
void EvaluateRates(const EngineTerms& terms, int frame, const RoundingScales& robot, const Contact& contact,
                   const ContactPlace& place, ContactValues* engine, ContactValues* model,
                   ContactScales* scales) {
  // Everything in Sigma_cf, which moves over the fingertip at u_f and turns at omega.
  const EngineMotion tip = terms.FrameMotion(frame).MoveTo(place.p_projected);
  const EngineMotion object = terms.ObjectMotion().MoveTo(place.p);
  const Vector3d v_f = place.R_projected.transpose() * tip.v;
  const Vector3d omega_f = place.R_projected.transpose() * tip.omega;
  const Vector3d v_o = place.R.transpose() * object.v;
  const Vector3d omega_o = place.R.transpose() * object.omega;
  const Vector6d over_tip = CalcFrameTwistOnFingertip(contact.geometry, contact.kappa_dot);
  const Vector3d u_f = over_tip.head<3>();
  Vector3d u_o = v_f + u_f - v_o;
  u_o.z() = 0.0;  // kappa moves within the surfaces, also while the bodies approach
  const Vector3d omega = omega_f + over_tip.tail<3>();
  // d/dt (R_cf^T v_f(p_c)), and the same of the object's velocity at p_c
  engine->J_B_dot_xi = place.R_projected.transpose() * tip.a + omega_f.cross(u_f) - omega.cross(v_f);
  engine->G_dot_T_V = place.R.transpose() * object.a + omega_o.cross(u_o) - omega.cross(v_o);
  // Both ways to Sigma_cf: V_f_cf + Ad^-1 V_f = V_o_cf + Ad^-1 V_o.
  engine->relative_twist << v_f - v_o, omega_f - omega_o;
  model->relative_twist = CalcFrameTwistOnObject(contact.geometry, contact.kappa_dot) - over_tip;

  const double turning = omega.norm();
  const double linear = robot.linear_rate() + u_f.norm();
  const double angular = robot.angular_rate() + turning;
  scales->J_B_dot_xi = Positive(linear * angular * scales->normal + scales->position * angular * angular);
  // An error of v_f - v_o is one of u_o, and turns Sigma_cf's rate by the fingertip's curvature.
  const double object_linear = v_o.norm() + u_o.norm();
  const double object_angular = omega_o.norm() + turning;
  const double curvature = contact.geometry.fingertip.K.norm() * scales->position / robot.world_length();
  scales->G_dot_T_V = Positive(object_linear * object_angular * scales->normal +
                               scales->position * object_angular * object_angular +
                               robot.linear_rate() * (omega_o.norm() + curvature * v_o.norm()));
  // Rolling rates are the relative rates over the surfaces' relative curvature.
  scales->relative_twist = Positive(v_f.norm() + v_o.norm() + over_tip.norm() +
                                    robot.world_length() * (omega_f.norm() + omega_o.norm()));
}

}  // namespace

void EvaluateContact(const Contact& contact, const Pose& shift, size_t index, EngineProvider* provider,
                     ContactValues* model, ScaleContext* context) {
  EngineTerms& terms = provider->terms();
  const int frame = context->contact_frames[index];
  ContactScales* const scales = &context->contacts[index];
  const Pose& g_o_cf = contact.geometry.g_o_cf;
  const Pose X_oW = terms.ObjectPose().inverse(Eigen::Isometry);
  const Pose X_cf = shift * terms.FramePose(frame) * contact.geometry.g_f_cf;
  const EngineTouch touch = terms.CalcTouch(frame, shift);
  CalcPlaceScales(context->robot, contact.geometry, scales);

  model->frame.head<3>() = g_o_cf.translation();
  model->frame.segment<3>(3) = g_o_cf.linear().col(2);
  model->frame.tail<12>() = g_o_cf.matrix().topRows<3>().reshaped();
  ContactValues& engine = (*provider->mutable_contacts())[index];
  engine.frame.head<3>() = X_oW * touch.position;
  engine.frame.segment<3>(3) = X_oW.linear() * touch.normal;
  engine.frame[ContactValues::kOverlap] = -touch.distance;
  engine.frame.tail<12>() = (X_oW * X_cf).matrix().topRows<3>().reshaped();

  // Sigma_cf has the engine's normal; the direction of its x axis about the normal is a convention.
  Matrix3d R_cf;
  R_cf.col(2) = touch.normal;
  R_cf.col(1) = touch.normal.cross(X_cf.linear().col(0)).normalized();
  R_cf.col(0) = R_cf.col(1).cross(R_cf.col(2));
  const ContactPlace place{R_cf, touch.position, shift.linear().transpose() * R_cf,
                           shift.inverse(Eigen::Isometry) * touch.position};
  engine.G = (R_cf.transpose() * terms.CalcObjectJacobian(touch.position)).transpose();
  // v + omega x arm at the contact
  const Matrix3d& tilt = terms.tilt().linear();
  const Vector3d arm = tilt * (place.p_projected - terms.FramePose(frame).translation());
  const Matrix3d R_T = (tilt * place.R_projected).transpose();
  const Matrix6Xd& columns = provider->columns(index);
  Eigen::Index k = 0;
  for (const int col : terms.chain(frame)) {
    engine.J_B.col(col) = R_T * (columns.col(k).head<3>() + columns.col(k).tail<3>().cross(arm));
    ++k;
  }
  EvaluateRates(terms, frame, context->robot, contact, place, &engine, model, scales);
}

namespace {

/// R_co_cf as section 4.3 says it, written here once more: c_u of the object turned by psi about the outward
/// normal of the fingertip is c_u of the fingertip, and the normals are opposite.
Matrix3d CalcContactTurn(double psi) {
  Matrix3d R;
  R << std::cos(psi), -std::sin(psi), 0.0, -std::sin(psi), -std::cos(psi), 0.0, 0.0, 0.0, -1.0;
  return R;
}

}  // namespace

ContactCheck::ContactCheck(const Adapter& adapter, int fingertip, ContactFormulas formulas)
    : fingertip_(fingertip),
      formulas_(std::move(formulas)),
      engine_(adapter, {&fingertip_, 1}, /*has_coordinates=*/false),
      model_(engine_.terms().size()),
      comparison_(adapter.model(), kAskedByContacts, {&model_, &engine_}, {fingertip}, 1),
      robot_(adapter.model()),
      tip_(adapter.model().frame(fingertip).sphere_radius.value()) {
  const RobotModel& model = adapter.model();
  try {
    object_ = MakeSurface(model.object()->shape);
  } catch (const std::invalid_argument& error) {
    throw InputError(model.spec().source + ": object: " + error.what());
  }
  const int n = engine_.terms().size();
  J_f_.setZero(6, n);
  J_f_dot_.setZero(6, n);
  G_.setZero(6, 3);
}

Pose ContactCheck::CalcObjectPose(const ContactCoordinates& kappa, const Pose& X_cf) const {
  const SurfaceGeometry on_object = object_->Evaluate(kappa.alpha_o);
  Pose X_o_cf = on_object.CalcPose();
  X_o_cf.linear() = on_object.R * CalcContactTurn(kappa.psi);
  return X_cf * X_o_cf.inverse();
}

void ContactCheck::Compare(const VectorXd& q, const VectorXd& xi, StateSource* source, long sample) {
  // The contact is away from the sphere's poles and where a torus is convex, so that bodies touch at one
  // point.
  ContactCoordinates kappa;
  kappa.alpha_f = {source->Draw(-kPi, kPi), source->Draw(-1.0, 1.0), 0};
  kappa.alpha_o = {source->Draw(-kPi, kPi), source->Draw(-1.0, 1.0), 0};
  kappa.psi = source->Draw(-kPi, kPi);
  // The object rolls, spins and slides on the fingertip at rates of order 1.
  Vector6d V_relative;
  for (double& entry : V_relative) entry = source->Draw(-1.0, 1.0);
  V_relative[2] = 0.0;

  // The engine's fingertip, then the object against it.
  EngineTerms& engine = engine_.terms();
  engine.SetState(q, xi);
  const Pose X_cf = engine.FramePose(fingertip_) * tip_.Evaluate(kappa.alpha_f).CalcPose();
  const Pose X_Bo = CalcObjectPose(kappa, X_cf);
  const EngineMotion tip = engine.FrameMotion(fingertip_).MoveTo(X_cf.translation());
  const Vector3d omega_o = tip.omega - X_cf.linear() * V_relative.tail<3>();
  const Vector3d at_contact = tip.v - X_cf.linear() * V_relative.head<3>();
  const Vector3d v_o = at_contact - omega_o.cross(X_cf.translation() - X_Bo.translation());
  Vector6d V_o;
  V_o << X_Bo.linear().transpose() * v_o, X_Bo.linear().transpose() * omega_o;
  engine_.SetState(q, xi, X_Bo, V_o, nullptr);

  // The model's side.
  robot_.SetState(q, xi);
  comparison_.SetScales(robot_, q, xi);
  robot_.CalcFrameJacobian(fingertip_, J_f_, J_f_dot_);
  Contact contact;
  contact.geometry = formulas_.geometry(tip_, *object_, kappa);
  const Vector6d V_f = J_f_ * xi;
  contact.kappa_dot = formulas_.kappa_dot(contact.geometry, CalcRelativeTwist(contact.geometry, V_f, V_o));
  ContactValues& values = model_.mutable_contacts()->front();
  MatrixXd J_B(3, xi.size());
  formulas_.jacobian(contact, J_f_, J_B);
  values.J_B = J_B;
  formulas_.grasp_map(contact, G_);
  values.G = G_;
  values.frame[ContactValues::kOverlap] = 0.0;
  EvaluateContact(contact, Pose::Identity(), 0, &engine_, &values, &comparison_.scales());
  comparison_.Compare(static_cast<double>(sample));
}

}  // namespace dexcheck
