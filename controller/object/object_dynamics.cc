#include "controller/object/object_dynamics.h"

#include "controller/common/errors.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

void RequireObject(const MassProperties& object) {
  Require(object.mass > 0.0, "object mass", "must be positive", object.mass);
  Require(object.com.isZero(0.0), "object com", "must be zero (Sigma_o stands at the centre of mass)",
          object.com.norm());
}

}  // namespace

ObjectBodyTerms CalcObjectBodyTerms(const MassProperties& object, const Vector3d& gravity,
                                    const Matrix3d& R_Bo, const Vector6d& V_Bo) {
  RequireObject(object);
  const Vector3d omega = V_Bo.tail<3>();
  const Vector3d h = object.inertia * omega;
  ObjectBodyTerms terms;
  // M_hat = diag(m I_3, I_o)
  terms.M_hat.setZero();
  terms.M_hat.diagonal().head<3>().setConstant(object.mass);
  terms.M_hat.bottomRightCorner<3, 3>() = object.inertia;
  // C_hat V = [m omega x v; omega x I_o omega]
  terms.C_hat.setZero();
  terms.C_hat.topLeftCorner<3, 3>() = object.mass * Skew(omega);
  terms.C_hat.bottomRightCorner<3, 3>() = -Skew(h);
  // N_o = -[m R^T g; 0]
  terms.N_o << -object.mass * (R_Bo.transpose() * gravity), Vector3d::Zero();
  return terms;
}

ObjectTerms CalcObjectTerms(const MassProperties& object, const Vector3d& gravity, const Vector6d& X_o,
                            const Vector6d& X_o_dot) {
  ObjectTerms terms;
  terms.P_inv = CalcPInverse(X_o);
  terms.P_inv_dot = CalcPInverseDot(X_o, X_o_dot);
  terms.V_Bo = terms.P_inv * X_o_dot;
  const Matrix3d R_Bo = terms.P_inv.topLeftCorner<3, 3>().transpose();
  terms.body = CalcObjectBodyTerms(object, gravity, R_Bo, terms.V_Bo);
  // V_dot = P^-1 X_o_ddot + d/dt P^-1 X_o_dot, put into M_hat V_dot + C_hat V + N_o = F_o
  terms.M_o = terms.body.M_hat * terms.P_inv;
  terms.C_o = terms.body.M_hat * terms.P_inv_dot + terms.body.C_hat * terms.P_inv;
  terms.N_o = terms.body.N_o;
  return terms;
}

double CalcObjectKineticEnergy(const MassProperties& object, const Vector6d& V_Bo) {
  RequireObject(object);
  const Vector3d v = V_Bo.head<3>();
  const Vector3d omega = V_Bo.tail<3>();
  return 0.5 * (object.mass * v.squaredNorm() + omega.dot(object.inertia * omega));
}

double CalcObjectPotentialEnergy(const MassProperties& object, const Vector3d& gravity,
                                 const Vector3d& p_Bo) {
  RequireObject(object);
  return -object.mass * gravity.dot(p_Bo);
}

}  // namespace dexcheck
