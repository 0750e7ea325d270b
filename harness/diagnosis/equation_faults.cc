#include "harness/diagnosis/equation_faults.h"

#include <algorithm>
#include <utility>

#include "controller/contact/adjoint.h"
#include "controller/contact/contact_geometry.h"
#include "controller/model/platform.h"

namespace dexcheck {
namespace {

using Robot = RobotEquations;

/// Of a view without the wheels' constraint the terms have another size.
bool IsReduced(const Robot& t) { return t.M.rows() == t.model.num_velocities(); }

/// C_bar' = S^T C S + S^T M S_dot of (14), without the second term.
void DropConstraintRate(const Robot& t) {
  if (!IsReduced(t)) return;
  const Eigen::Index n = t.M.rows();
  ModelTerms unreduced(t.model, Coordinates::kUnreduced);
  const PlatformConstraint platform = CalcPlatformConstraint(t.model.base(), t.q.head<3>(), t.xi.head<2>());
  MatrixXd S = MatrixXd::Zero(n + 1, n);
  MatrixXd S_dot = S;
  S.topLeftCorner<3, 2>() = platform.S_v;
  S.bottomRightCorner(n - 2, n - 2).setIdentity();
  S_dot.topLeftCorner<3, 2>() = platform.S_v_dot;
  unreduced.SetState(t.q, S * t.xi);
  unreduced.CalcDynamics();
  t.C -= S.transpose() * unreduced.M() * S_dot;
}

void DropWheelSpin(const Robot& t) {
  if (!IsReduced(t)) return;
  const WheelProperties& wheel = t.model.base().wheel;
  const Matrix2d W = CalcWheelRateMap(t.model.base());
  t.M.topLeftCorner<2, 2>() -= (wheel.spin_inertia + wheel.armature) * W.transpose() * W;
}

void DropArmature(const Robot& t) {
  const Eigen::Index base = t.M.rows() - t.model.num_joints();
  for (int i = 0; i < t.model.num_joints(); ++i)
    t.M(base + i, base + i) -= t.model.joints()[static_cast<size_t>(i)].armature;
}

// Other matrices with the same force: C + S with S xi = 0.
void LosePropertyTwo(const Robot& t) {
  const Eigen::Index last = t.C.rows() - 1;
  t.C(last, last - 1) += t.M(last, last) * t.xi[last];
  t.C(last, last) -= t.M(last, last) * t.xi[last - 1];
}

void AddAntisymmetricPart(const Robot& t) {
  const Eigen::Index last = t.C.rows() - 1;
  t.C.bottomRightCorner<3, 3>() += t.M(last, last) * Skew(t.xi.tail<3>());
}

using Applies = bool (*)(const RobotModel&);

constexpr Applies kTwoVelocities = [](const RobotModel& model) { return model.num_velocities() >= 2; };
constexpr Applies kThreeVelocities = [](const RobotModel& model) { return model.num_velocities() >= 3; };
constexpr Applies kWheels = [](const RobotModel& model) {
  return model.base().type == BaseType::kDifferentialDrive;
};
constexpr Applies kArmature = [](const RobotModel& model) {
  const auto& joints = model.joints();
  return std::any_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.armature > 0.0; });
};

constexpr RobotEquation kRobotEquations[] = {
    {"Coriolis terms dropped", "C_bar_xi", "C_bar_xi", [](const Robot& t) { t.C.setZero(); }},
    {"Coriolis matrix transposed", "C_bar_xi", "C_bar_xi", [](const Robot& t) { t.C.transposeInPlace(); }},
    {"one joint's Coriolis row dropped", "C_bar_xi", nullptr,
     [](const Robot& t) { t.C.row(t.C.rows() / 2).setZero(); }},
    {"Coriolis terms doubled", nullptr, "C_bar_xi", [](const Robot& t) { t.C *= 2.0; }},
    {"Coriolis matrix without coupling", "C_bar", "C_bar_xi",
     [](const Robot& t) { t.C = MatrixXd(t.C.diagonal().asDiagonal()); }},
    {"Coriolis matrix without Property 2", "C_bar", nullptr, LosePropertyTwo, kTwoVelocities},
    {"Coriolis matrix plus an antisymmetric part", "C_bar", nullptr, AddAntisymmetricPart, kThreeVelocities},
    {"gravity with the wrong sign", "gravity", "gravity", [](const Robot& t) { t.gravity *= -1.0; }},
    {"friction dropped", "friction", "friction", [](const Robot& t) { t.friction.setZero(); }},
    {"friction with the wrong sign", "friction", "friction", [](const Robot& t) { t.friction *= -1.0; }},
    {"half of the mass matrix not mirrored", "M_bar", "M_bar",
     [](const Robot& t) { t.M.triangularView<Eigen::StrictlyUpper>().setZero(); }},
    {"armature left out of M", "M_bar", "M_bar", DropArmature, kArmature},
    {"S_v_dot = 0", "C_bar_xi", "C_bar_xi", DropConstraintRate, kWheels},
    {"wheel spin left out of M", "M_bar", "M_bar", DropWheelSpin, kWheels},
};

const GraspMapEquation kGraspMapEquations[] = {
    {"G without moments", "G", "G",
     [](const Pose& g) {
       Matrix6d transform = CalcWrenchTransform(g);
       transform.bottomRows<3>().setZero();
       return transform;
     }},
    {"G with Ad^T instead of Ad^-T", "G", "G",
     [](const Pose& g) { return Matrix6d(CalcAdjoint(g).transpose()); }},
    {"G with Ad instead of Ad^-T", "G", "G", [](const Pose& g) { return CalcAdjoint(g); }},
    {"G with the rotation transposed", "G", nullptr,
     [](const Pose& g) {
       Pose turned = g;
       turned.linear().transposeInPlace();
       return CalcWrenchTransform(turned);
     }},
};

const ContactJacobianEquation kContactJacobianEquations[] = {
    {"J_B' with Ad instead of its inverse", "J_B", "J_B",
     [](const ContactGeometry& contact, const Matrix6Xd& J_f) {
       return MatrixXd((CalcAdjoint(contact.g_f_cf) * J_f).topRows<3>());
     }},
    {"J_B' at the fingertip's centre", "J_B", "J_B",
     [](const ContactGeometry& contact, const Matrix6Xd& J_f) {
       return MatrixXd(contact.g_f_cf.linear().transpose() * J_f.topRows<3>());
     }},
};

const RollingEquation kRollingEquations[] = {
    {"spin term dropped in (40)", "kappa_dot", "G_dot_T_V",
     [](ContactGeometry contact, Vector6d V) {
       V[5] = 0.0;
       return CalcKappaDot(contact, V);
     }},
    {"slip dropped in (40)", "kappa_dot", nullptr,
     [](ContactGeometry contact, Vector6d V) {
       V.head<2>().setZero();
       return CalcKappaDot(contact, V);
     }},
    {"rolling about the wrong axis in (40)", "kappa_dot", "G_dot_T_V",
     [](ContactGeometry contact, Vector6d V) {
       std::swap(V[3], V[4]);
       return CalcKappaDot(contact, V);
     }},
    {"object's curvature not turned by psi in (40)", "kappa_dot", "G_dot_T_V",
     [](ContactGeometry contact, Vector6d V) {
       contact.object.K = contact.R_psi * contact.object.K * contact.R_psi;
       return CalcKappaDot(contact, V);
     }},
    {"fingertip's torsion dropped in (40)", "kappa_dot", "G_dot_T_V",
     [](ContactGeometry contact, Vector6d V) {
       contact.fingertip.T.setZero();
       return CalcKappaDot(contact, V);
     }},
    {"object's torsion dropped in (40)", "kappa_dot", nullptr,
     [](ContactGeometry contact, Vector6d V) {
       contact.object.T.setZero();
       return CalcKappaDot(contact, V);
     }},
    {"object's metric dropped in (40)", "kappa_dot", "G_dot_T_V",
     [](ContactGeometry contact, Vector6d V) {
       contact.object.M.setIdentity();
       return CalcKappaDot(contact, V);
     }},
};

/// R of the object, from P^-1.
auto Rotation(const ObjectTerms& t) { return t.P_inv.topLeftCorner<3, 3>().transpose(); }

const ObjectEquation kObjectEquations[] = {
    {"body velocity in world axes", "P_inv", nullptr,
     [](ObjectTerms* t) {
       t->V_Bo.head<3>() = (Rotation(*t) * t->V_Bo.head<3>()).eval();
       t->V_Bo.tail<3>() = (Rotation(*t) * t->V_Bo.tail<3>()).eval();
     }},
    {"M_o of the Lagrange form", "M_o", "M_o",
     [](ObjectTerms* t) { t->M_o = t->P_inv.transpose() * t->M_o; }},
    // A wrong P^-1 that M_o and C_o share.
    {"P^-1 of angles in reverse", "M_o", nullptr,
     [](ObjectTerms* t) {
       t->P_inv.col(3).swap(t->P_inv.col(5));
       t->M_o = t->body.M_hat * t->P_inv;
     }},
    {"rate of P^-1 with the wrong sign", "C_o_X_o_dot", "C_o_X_o_dot",
     [](ObjectTerms* t) {
       t->P_inv_dot *= -1.0;
       t->C_o = t->body.M_hat * t->P_inv_dot + t->body.C_hat * t->P_inv;
     }},
    {"C_o without the rate of P^-1", "C_o_X_o_dot", nullptr,
     [](ObjectTerms* t) { t->C_o = t->body.C_hat * t->P_inv; }},
    {"C_o without gyroscopic terms", "C_o_X_o_dot", nullptr,
     [](ObjectTerms* t) { t->C_o = t->body.M_hat * t->P_inv_dot; }},
    {"N_o with the wrong sign", "N_o", nullptr, [](ObjectTerms* t) { t->N_o *= -1.0; }},
    {"N_o in world axes", "N_o", nullptr,
     [](ObjectTerms* t) { t->N_o.head<3>() = (Rotation(*t) * t->N_o.head<3>()).eval(); }},
};

/// Those that have a place in a run. @param apply of a change to the terms.
template <typename Equations, typename Apply>
void AddToRun(const Equations& equations, const Apply& apply, std::vector<EquationFault>* list) {
  for (const auto& equation : equations) {
    if (equation.check == nullptr) continue;
    list->push_back({equation.name, equation.check,
                     [apply, change = equation.change](const FaultyTerms& t) { apply(t, change); }});
  }
}

void AddContacts(std::vector<EquationFault>* list) {
  AddToRun(
      kGraspMapEquations,
      [](const FaultyTerms& t, const auto& transform) {
        for (int i = 0; i < t.num_contacts(); ++i)
          t.G(i) = Matrix6d(transform(t.geometry(i).g_o_cf)).leftCols<3>();
      },
      list);
  AddToRun(
      kContactJacobianEquations,
      [](const FaultyTerms& t, const auto& rows) {
        for (int i = 0; i < t.num_contacts(); ++i) t.J_B(i) = rows(t.geometry(i), t.J_f(i));
      },
      list);
  list->push_back({"J_dot = 0", "J_B_dot_xi", [](const FaultyTerms& t) { t.J_B_dot().setZero(); }});
  list->push_back({"J_dot doubled", "J_B_dot_xi", [](const FaultyTerms& t) { t.J_B_dot() *= 2.0; }});
  list->push_back({"G_dot = 0", "G_dot_T_V", [](const FaultyTerms& t) { t.G_dot().setZero(); }});
  list->push_back(
      {"G_dot with the wrong sign", "G_dot_T_V", [](const FaultyTerms& t) { t.G_dot() *= -1.0; }});
  AddToRun(
      kRollingEquations,
      [](const FaultyTerms& t, const auto& rate) {
        for (int i = 0; i < t.num_contacts(); ++i) t.SetKappaDot(i, rate(t.geometry(i), t.CalcTwist(i)));
      },
      list);
}

void AddObject(bool coordinates, std::vector<EquationFault>* list) {
  list->push_back({"N_o with the wrong sign", "N_o", [](const FaultyTerms& t) { t.body().N_o *= -1.0; }});
  list->push_back(
      {"object without gyroscopic terms", "C_hat_V", [](const FaultyTerms& t) { t.body().C_hat.setZero(); }});
  list->push_back({"object as a point mass", "M_hat",
                   [](const FaultyTerms& t) { t.body().M_hat.bottomRightCorner<3, 3>() *= 1e-3; }});
  if (!coordinates) return;
  AddToRun(
      kObjectEquations, [](const FaultyTerms& t, const auto& change) { change(&t.coordinates()); }, list);
}

}  // namespace

std::vector<RobotEquation> ListRobotEquations(const RobotModel& model) {
  std::vector<RobotEquation> list;
  for (const RobotEquation& equation : kRobotEquations) {
    if (equation.applies == nullptr || equation.applies(model)) list.push_back(equation);
  }
  return list;
}

std::span<const GraspMapEquation> ListGraspMapEquations() { return kGraspMapEquations; }
std::span<const ContactJacobianEquation> ListContactJacobianEquations() { return kContactJacobianEquations; }
std::span<const RollingEquation> ListRollingEquations() { return kRollingEquations; }
std::span<const ObjectEquation> ListObjectEquations() { return kObjectEquations; }

RobotEquations FaultyTerms::robot() const {
  const ModelTerms& terms = model_.robot();
  return {terms.model(),         state_.q, state_.xi, Open(terms.M()), Open(terms.C()), Open(terms.gravity()),
          Open(terms.friction())};
}

const ContactGeometry& FaultyTerms::geometry(int contact) const {
  return grasp().contacts()[static_cast<size_t>(contact)].geometry;
}

Vector6d FaultyTerms::CalcTwist(int contact) const {
  return CalcRelativeTwist(geometry(contact), J_f(contact) * state_.xi, grasp().V_Bo());
}

void FaultyTerms::SetKappaDot(int contact, const Vector5d& kappa_dot) const {
  const Contact& shown = grasp().contacts()[static_cast<size_t>(contact)];
  Open(shown).kappa_dot = kappa_dot;
  CalcContactJacobianDot(shown, grasp().J_f(contact), grasp().J_f_dot(contact),
                         Open(grasp().J_B_dot()).middleRows(3 * contact, 3));
  CalcGraspMapDot(grasp().contacts(), Open(grasp().G_dot()));
}

void FaultyTerms::Finish() const {
  Open(grasp().slip()) = grasp().J_B() * state_.xi - grasp().G().transpose() * grasp().V_Bo();
  Open(grasp().slip_bias()) = grasp().J_B_dot() * state_.xi - grasp().G_dot().transpose() * grasp().V_Bo();
}

std::vector<EquationFault> ListEquationFaults(const RobotModel& model, bool coordinates) {
  std::vector<EquationFault> list;
  AddToRun(
      ListRobotEquations(model), [](const FaultyTerms& t, const auto& change) { change(t.robot()); }, &list);
  AddContacts(&list);
  AddObject(coordinates, &list);
  return list;
}

}  // namespace dexcheck
