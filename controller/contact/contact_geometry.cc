#include "controller/contact/contact_geometry.h"

#include <cmath>

#include "controller/common/errors.h"
#include "controller/contact/adjoint.h"

namespace dexcheck {

namespace {

// R_co_cf = [R_psi 0; 0 -1]
Matrix3d CalcContactRotation3(const Matrix2d& R_psi) {
  Matrix3d R_co_cf = Matrix3d::Zero();
  R_co_cf.topLeftCorner<2, 2>() = R_psi;
  R_co_cf(2, 2) = -1.0;
  return R_co_cf;
}

}  // namespace

Vector5d ContactCoordinates::CalcVector() const {
  Vector5d kappa;
  kappa << alpha_f.u, alpha_f.v, alpha_o.u, alpha_o.v, psi;
  return kappa;
}

Matrix2d CalcContactRotation(double psi) {
  const double c = std::cos(psi);
  const double s = std::sin(psi);
  Matrix2d R_psi;
  R_psi << c, -s, -s, -c;
  return R_psi;
}

ContactGeometry CalcContactGeometry(const Surface& fingertip, const Surface& object,
                                    const ContactCoordinates& kappa, double overlap) {
  Require(std::isfinite(kappa.psi), "psi", "must be finite", kappa.psi);
  ContactGeometry contact;
  contact.fingertip = fingertip.Evaluate(kappa.alpha_f);
  contact.object = object.Evaluate(kappa.alpha_o);
  if (overlap != 0.0) {
    contact.fingertip = CalcParallelSurface(contact.fingertip, -0.5 * overlap);
    contact.object = CalcParallelSurface(contact.object, -0.5 * overlap);
  }
  contact.R_psi = CalcContactRotation(kappa.psi);
  contact.g_f_cf = contact.fingertip.CalcPose();
  // g_o_cf = g_o_co g_co_cf, the inverse of (31)
  contact.g_o_cf = contact.object.CalcPose();
  contact.g_o_cf.linear() = contact.object.R * CalcContactRotation3(contact.R_psi);
  return contact;
}

Vector6d CalcRelativeTwist(const ContactGeometry& contact, const Vector6d& V_f, const Vector6d& V_o) {
  // V_co_cf^cf = Ad_{g_cf_f} V_f - Ad_{g_cf_o} V_o
  return CalcAdjointInverse(contact.g_f_cf) * V_f - CalcAdjointInverse(contact.g_o_cf) * V_o;
}

Vector6d CalcGaussFrameTwist(const SurfaceGeometry& surface, const Vector2d& alpha_dot) {
  // s = M alphadot;  v = [s; 0];  zdot = [x y] K s = omega x z;  y . xdot = T s = omega_z
  const Vector2d s = surface.M * alpha_dot;
  const Vector2d n_dot = surface.K * s;
  Vector6d V;
  V << s, 0.0, -n_dot.y(), n_dot.x(), surface.T.dot(s);
  return V;
}

Vector6d CalcFrameTwistOnFingertip(const ContactGeometry& contact, const Vector5d& kappa_dot) {
  return CalcGaussFrameTwist(contact.fingertip, kappa_dot.head<2>());
}

Vector6d CalcFrameTwistOnObject(const ContactGeometry& contact, const Vector5d& kappa_dot) {
  // V_o_cf^cf = Ad_{g_cf_co} V_o_co^co + psidot e_6, with R_cf_co = R_co_cf^T = R_co_cf
  const Vector6d V_o_co = CalcGaussFrameTwist(contact.object, kappa_dot.segment<2>(2));
  const Matrix3d R_cf_co = CalcContactRotation3(contact.R_psi);
  Vector6d V;
  V << R_cf_co * V_o_co.head<3>(), R_cf_co * V_o_co.tail<3>();
  V(5) += kappa_dot(4);
  return V;
}

double CalcRimDistance(double radius, const Vector3d& pole, const Vector3d& p) {
  // pi/2 - angle, of the height above the rim's plane and the distance from the axis
  return radius * std::atan2(pole.dot(p), pole.cross(p).norm());
}

}  // namespace dexcheck
