#include "harness/diagnosis/spoiled_terms.h"

#include <algorithm>
#include <utility>

#include "controller/contact/adjoint.h"
#include "controller/contact/rolling.h"
#include "controller/model/platform.h"

namespace dexcheck {
namespace {

using Terms = SpoiledTerms;

/// C_bar' = S^T C S + S^T M S_dot of (14), without the second term.
void DropConstraintRate(const Terms& t) {
  const Eigen::Index n = t.M().rows();
  ModelTerms unreduced(t.model(), Coordinates::kUnreduced);
  const VectorXd& q = t.state().q;
  const VectorXd& xi = t.state().xi;
  const PlatformConstraint platform = CalcPlatformConstraint(t.model().base(), q.head<3>(), xi.head<2>());
  MatrixXd S = MatrixXd::Zero(n + 1, n);
  MatrixXd S_dot = S;
  S.topLeftCorner<3, 2>() = platform.S_v;
  S.bottomRightCorner(n - 2, n - 2).setIdentity();
  S_dot.topLeftCorner<3, 2>() = platform.S_v_dot;
  unreduced.SetState(q, S * xi);
  unreduced.CalcDynamics();
  t.C() -= S.transpose() * unreduced.M() * S_dot;
}

void DropWheelSpin(const Terms& t) {
  const WheelProperties& wheel = t.model().base().wheel;
  const Matrix2d W = CalcWheelRateMap(t.model().base());
  t.M().topLeftCorner<2, 2>() -= (wheel.spin_inertia + wheel.armature) * W.transpose() * W;
}

void DropArmature(const Terms& t) {
  const Eigen::Index base = t.M().rows() - t.model().num_joints();
  for (int i = 0; i < t.model().num_joints(); ++i)
    t.M()(base + i, base + i) -= t.model().joints()[static_cast<size_t>(i)].armature;
}

/// G_i by another transform of wrenches than Ad^-T.
template <typename Transform>
void MapWrenches(const Terms& t, Transform transform) {
  for (int i = 0; i < t.num_contacts(); ++i) {
    const Matrix6d map = transform(t.geometry(i).g_o_cf);
    t.G(i) = map.leftCols<3>();
  }
}

/// kappa_dot by another equation than (40).
template <typename Rate>
void Roll(const Terms& t, Rate rate) {
  for (int i = 0; i < t.num_contacts(); ++i) t.SetKappaDot(i, rate(t.geometry(i), t.CalcTwist(i)));
}

void AddRobot(const RobotModel& model, std::vector<EquationFault>* list) {
  list->push_back({"Coriolis terms dropped", "C_bar_xi", [](const Terms& t) { t.C().setZero(); }});
  list->push_back(
      {"Coriolis matrix transposed", "C_bar_xi", [](const Terms& t) { t.C().transposeInPlace(); }});
  list->push_back({"Coriolis terms doubled", "C_bar_xi", [](const Terms& t) { t.C() *= 2.0; }});
  list->push_back({"Coriolis matrix without coupling", "C_bar_xi",
                   [](const Terms& t) { t.C() = MatrixXd(t.C().diagonal().asDiagonal()); }});
  list->push_back({"gravity with the wrong sign", "gravity", [](const Terms& t) { t.gravity() *= -1.0; }});
  list->push_back({"friction dropped", "friction", [](const Terms& t) { t.friction().setZero(); }});
  list->push_back({"friction with the wrong sign", "friction", [](const Terms& t) { t.friction() *= -1.0; }});
  list->push_back({"half of the mass matrix not mirrored", "M_bar",
                   [](const Terms& t) { t.M().triangularView<Eigen::StrictlyUpper>().setZero(); }});
  const auto& joints = model.joints();
  if (std::any_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.armature > 0.0; }))
    list->push_back({"armature left out of M", "M_bar", DropArmature});
  if (model.base().type != BaseType::kDifferentialDrive) return;
  list->push_back({"S_v_dot = 0", "C_bar_xi", DropConstraintRate});
  list->push_back({"wheel spin left out of M", "M_bar", DropWheelSpin});
}

void AddContacts(std::vector<EquationFault>* list) {
  list->push_back({"G without moments", "G", [](const Terms& t) {
                     for (int i = 0; i < t.num_contacts(); ++i) t.G(i).bottomRows<3>().setZero();
                   }});
  list->push_back({"G with Ad^T instead of Ad^-T", "G", [](const Terms& t) {
                     MapWrenches(t, [](const Pose& g) -> Matrix6d { return CalcAdjoint(g).transpose(); });
                   }});
  list->push_back({"G with Ad instead of Ad^-T", "G", [](const Terms& t) {
                     MapWrenches(t, [](const Pose& g) -> Matrix6d { return CalcAdjoint(g); });
                   }});
  list->push_back({"J_B' with Ad instead of its inverse", "J_B", [](const Terms& t) {
                     for (int i = 0; i < t.num_contacts(); ++i)
                       t.J_B(i) = (CalcAdjoint(t.geometry(i).g_f_cf) * t.J_f(i)).topRows<3>();
                   }});
  list->push_back({"J_B' at the fingertip's centre", "J_B", [](const Terms& t) {
                     for (int i = 0; i < t.num_contacts(); ++i)
                       t.J_B(i) = t.geometry(i).g_f_cf.linear().transpose() * t.J_f(i).topRows<3>();
                   }});
  list->push_back({"J_dot = 0", "J_B_dot_xi", [](const Terms& t) {
                     for (int i = 0; i < t.num_contacts(); ++i) t.J_B_dot(i).setZero();
                   }});
  list->push_back({"J_dot doubled", "J_B_dot_xi", [](const Terms& t) {
                     for (int i = 0; i < t.num_contacts(); ++i) t.J_B_dot(i) *= 2.0;
                   }});
  list->push_back({"G_dot = 0", "G_dot_T_V", [](const Terms& t) {
                     for (int i = 0; i < t.num_contacts(); ++i) t.G_dot(i).setZero();
                   }});
  list->push_back({"G_dot with the wrong sign", "G_dot_T_V", [](const Terms& t) {
                     for (int i = 0; i < t.num_contacts(); ++i) t.G_dot(i) *= -1.0;
                   }});
  list->push_back({"spin term dropped in (40)", "G_dot_T_V", [](const Terms& t) {
                     Roll(t, [](const ContactGeometry& contact, Vector6d V) {
                       V[5] = 0.0;
                       return CalcKappaDot(contact, V);
                     });
                   }});
  list->push_back({"rolling about the wrong axis in (40)", "G_dot_T_V", [](const Terms& t) {
                     Roll(t, [](const ContactGeometry& contact, Vector6d V) {
                       std::swap(V[3], V[4]);
                       return CalcKappaDot(contact, V);
                     });
                   }});
  list->push_back({"object's curvature not turned by psi in (40)", "G_dot_T_V", [](const Terms& t) {
                     Roll(t, [](ContactGeometry contact, const Vector6d& V) {
                       contact.object.K = contact.R_psi * contact.object.K * contact.R_psi;
                       return CalcKappaDot(contact, V);
                     });
                   }});
  list->push_back({"fingertip's torsion dropped in (40)", "G_dot_T_V", [](const Terms& t) {
                     Roll(t, [](ContactGeometry contact, const Vector6d& V) {
                       contact.fingertip.T.setZero();
                       return CalcKappaDot(contact, V);
                     });
                   }});
  list->push_back({"object's metric dropped in (40)", "G_dot_T_V", [](const Terms& t) {
                     Roll(t, [](ContactGeometry contact, const Vector6d& V) {
                       contact.object.M.setIdentity();
                       return CalcKappaDot(contact, V);
                     });
                   }});
}

void AddObject(bool coordinates, std::vector<EquationFault>* list) {
  list->push_back({"N_o with the wrong sign", "N_o", [](const Terms& t) { t.body().N_o *= -1.0; }});
  list->push_back(
      {"object without gyroscopic terms", "C_hat_V", [](const Terms& t) { t.body().C_hat.setZero(); }});
  list->push_back({"object as a point mass", "M_hat",
                   [](const Terms& t) { t.body().M_hat.bottomRightCorner<3, 3>() *= 1e-3; }});
  if (!coordinates) return;
  list->push_back({"rate of P^-1 with the wrong sign", "C_o_X_o_dot", [](const Terms& t) {
                     ObjectTerms& object = t.coordinates();
                     object.P_inv_dot *= -1.0;
                     object.C_o = object.body.M_hat * object.P_inv_dot + object.body.C_hat * object.P_inv;
                   }});
  list->push_back({"M_o of the Lagrange form", "M_o", [](const Terms& t) {
                     t.coordinates().M_o = t.coordinates().P_inv.transpose() * t.coordinates().M_o;
                   }});
}

}  // namespace

const ContactGeometry& SpoiledTerms::geometry(int contact) const {
  return grasp().contacts()[static_cast<size_t>(contact)].geometry;
}

Vector6d SpoiledTerms::CalcTwist(int contact) const {
  return CalcRelativeTwist(geometry(contact), J_f(contact) * state_.xi, grasp().V_Bo());
}

void SpoiledTerms::SetKappaDot(int contact, const Vector5d& kappa_dot) const {
  const Contact& shown = grasp().contacts()[static_cast<size_t>(contact)];
  Open(shown).kappa_dot = kappa_dot;
  CalcContactJacobianDot(shown, grasp().J_f(contact), grasp().J_f_dot(contact),
                         Open(grasp().J_B_dot()).middleRows(3 * contact, 3));
  CalcGraspMapDot(grasp().contacts(), Open(grasp().G_dot()));
}

void SpoiledTerms::Finish() const {
  Open(grasp().slip()) = grasp().J_B() * state_.xi - grasp().G().transpose() * grasp().V_Bo();
  Open(grasp().slip_bias()) = grasp().J_B_dot() * state_.xi - grasp().G_dot().transpose() * grasp().V_Bo();
}

std::vector<EquationFault> ListEquationFaults(const RobotModel& model, bool coordinates) {
  std::vector<EquationFault> list;
  AddRobot(model, &list);
  AddContacts(&list);
  AddObject(coordinates, &list);
  return list;
}

}  // namespace dexcheck
