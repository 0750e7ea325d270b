#include "harness/checks/contact_check.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "controller/common/errors.h"
#include "harness/checks/contact_terms.h"

namespace dexcheck {
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
  // Away from the sphere's poles and where a torus is convex, so that the bodies touch at one point only.
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
