#include "harness/diagnosis/equation_faults.h"

#include <algorithm>
#include <utility>

#include "controller/contact/adjoint.h"
#include "controller/contact/contact_geometry.h"
#include "controller/model/platform.h"
#include "controller/object/object_dynamics.h"

namespace dexcheck {
namespace {

using Robot = RobotEquations;

/// A view without the wheels' constraint has terms of another size.
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

Matrix6d TurnToWorld(const Pose& X) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = X.linear();
  turn.bottomRightCorner<3, 3>() = X.linear();
  return turn;
}

Matrix6d ExchangeParts(const Pose&) {
  Matrix6d exchange = Matrix6d::Zero();
  exchange.topRightCorner<3, 3>().setIdentity();
  exchange.bottomLeftCorner<3, 3>().setIdentity();
  return exchange;
}

/// The adjoint with the sign of its moment arm turned about.
Matrix6d CalcWrongAdjoint(const Pose& X) {
  Pose arm = Pose::Identity();
  arm.translation() = X.linear().transpose() * X.translation();
  return CalcAdjoint(arm);
}

/// R of the object, from P^-1.
auto Rotation(const ObjectTerms& t) { return t.P_inv.topLeftCorner<3, 3>().transpose(); }

using Condition = bool (*)(const RobotModel&);

constexpr Condition kTwoVelocities = [](const RobotModel& model) { return model.num_velocities() >= 2; };
constexpr Condition kThreeVelocities = [](const RobotModel& model) { return model.num_velocities() >= 3; };
constexpr Condition kWheels = [](const RobotModel& model) {
  return model.base().type == BaseType::kDifferentialDrive;
};
constexpr Condition kArmature = [](const RobotModel& model) {
  const auto& joints = model.joints();
  return std::any_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.armature > 0.0; });
};

const EquationFault kEquations[] = {
    {"Coriolis terms dropped", "C_bar_xi", "C_bar_xi", RobotChange{[](const Robot& t) { t.C.setZero(); }}},
    {"Coriolis matrix transposed", "C_bar_xi", "C_bar_xi",
     RobotChange{[](const Robot& t) { t.C.transposeInPlace(); }}},
    {"one joint's Coriolis row dropped", "C_bar_xi", nullptr,
     RobotChange{[](const Robot& t) { t.C.row(t.C.rows() / 2).setZero(); }}},
    {"Coriolis terms doubled", nullptr, "C_bar_xi", RobotChange{[](const Robot& t) { t.C *= 2.0; }}},
    {"Coriolis matrix without coupling", "C_bar", "C_bar_xi",
     RobotChange{[](const Robot& t) { t.C = MatrixXd(t.C.diagonal().asDiagonal()); }}},
    {"Coriolis matrix without Property 2", "C_bar", nullptr, RobotChange{LosePropertyTwo}, kTwoVelocities},
    {"Coriolis matrix plus an antisymmetric part", "C_bar", nullptr, RobotChange{AddAntisymmetricPart},
     kThreeVelocities},
    {"gravity with the wrong sign", "gravity", "gravity",
     RobotChange{[](const Robot& t) { t.gravity *= -1.0; }}},
    {"friction dropped", "friction", "friction", RobotChange{[](const Robot& t) { t.friction.setZero(); }}},
    {"friction with the wrong sign", "friction", "friction",
     RobotChange{[](const Robot& t) { t.friction *= -1.0; }}},
    {"half of the mass matrix not mirrored", "M_bar", "M_bar",
     RobotChange{[](const Robot& t) { t.M.triangularView<Eigen::StrictlyUpper>().setZero(); }}},
    {"armature left out of M", "M_bar", "M_bar", RobotChange{DropArmature}, kArmature},
    {"S_v_dot = 0", "C_bar_xi", "C_bar_xi", RobotChange{DropConstraintRate}, kWheels},
    {"wheel spin left out of M", "M_bar", "M_bar", RobotChange{DropWheelSpin}, kWheels},
    {"link rotations transposed", "joint_axis", nullptr, RotationsTransposed{false}},
    {"frame rotations transposed", "frame_pose", nullptr, RotationsTransposed{true}},
    {"body Jacobian taken in world axes", "J", nullptr, JacobianChange{TurnToWorld}},
    {"linear and angular part exchanged", "J", nullptr, JacobianChange{ExchangeParts}},
    {"moment arm of the adjoint with the wrong sign", "J", nullptr, JacobianChange{CalcWrongAdjoint}},
    {"J_dot = 0", "J_dot_xi", "J_B_dot_xi", JacobianRate{0.0}},
    {"J_dot doubled", "J_dot_xi", "J_B_dot_xi", JacobianRate{2.0}},
    {"kinetic energy doubled", "kinetic_energy", nullptr,
     EnergyChange{[](EnergyAndMomentum* t) { t->kinetic *= 2.0; }}},
    {"potential energy with the wrong sign", "potential_energy", nullptr,
     EnergyChange{[](EnergyAndMomentum* t) { t->potential *= -1.0; }}},
    {"angular momentum about the origin", "angular_momentum", nullptr,
     EnergyChange{[](EnergyAndMomentum* t) { t->angular_momentum += t->com.cross(t->linear_momentum); }}},
    {"psi with the wrong sign", "contact_frame", nullptr,
     ContactFrameChange{[](const Surface& tip, const Surface& object, ContactCoordinates kappa) {
       kappa.psi = -kappa.psi;
       return CalcContactGeometry(tip, object, kappa);
     }}},
    {"psi about the object's normal", "contact_frame", nullptr,
     ContactFrameChange{[](const Surface& tip, const Surface& object, ContactCoordinates kappa) {
       ContactGeometry geometry = CalcContactGeometry(tip, object, kappa);
       geometry.g_o_cf.linear() = geometry.object.R * Vector3d(1.0, -1.0, -1.0).asDiagonal() *
                                  Eigen::AngleAxisd(-kappa.psi, Vector3d::UnitZ()).toRotationMatrix();
       return geometry;
     }}},
    {"G without moments", "G", "G", GraspMapChange{[](const Pose& g) {
       Matrix6d transform = CalcWrenchTransform(g);
       transform.bottomRows<3>().setZero();
       return transform;
     }}},
    {"G with Ad^T instead of Ad^-T", "G", "G",
     GraspMapChange{[](const Pose& g) { return Matrix6d(CalcAdjoint(g).transpose()); }}},
    {"G with Ad instead of Ad^-T", "G", "G", GraspMapChange{[](const Pose& g) { return CalcAdjoint(g); }}},
    {"G with the rotation transposed", "G", nullptr, GraspMapChange{[](const Pose& g) {
       Pose turned = g;
       turned.linear().transposeInPlace();
       return CalcWrenchTransform(turned);
     }}},
    {"J_B' with Ad instead of its inverse", "J_B", "J_B",
     ContactJacobianChange{[](const ContactGeometry& contact, const Matrix6Xd& J_f) {
       return MatrixXd((CalcAdjoint(contact.g_f_cf) * J_f).topRows<3>());
     }}},
    {"J_B' at the fingertip's centre", "J_B", "J_B",
     ContactJacobianChange{[](const ContactGeometry& contact, const Matrix6Xd& J_f) {
       return MatrixXd(contact.g_f_cf.linear().transpose() * J_f.topRows<3>());
     }}},
    {"G_dot = 0", nullptr, "G_dot_T_V", GraspMapRate{0.0}},
    {"G_dot with the wrong sign", nullptr, "G_dot_T_V", GraspMapRate{-1.0}},
    {"spin term dropped in (40)", "kappa_dot", "G_dot_T_V",
     RollingChange{[](ContactGeometry contact, Vector6d V) {
       V[5] = 0.0;
       return CalcKappaDot(contact, V);
     }}},
    {"slip dropped in (40)", "kappa_dot", nullptr, RollingChange{[](ContactGeometry contact, Vector6d V) {
       V.head<2>().setZero();
       return CalcKappaDot(contact, V);
     }}},
    {"rolling about the wrong axis in (40)", "kappa_dot", "G_dot_T_V",
     RollingChange{[](ContactGeometry contact, Vector6d V) {
       std::swap(V[3], V[4]);
       return CalcKappaDot(contact, V);
     }}},
    {"object's curvature not turned by psi in (40)", "kappa_dot", "G_dot_T_V",
     RollingChange{[](ContactGeometry contact, Vector6d V) {
       contact.object.K = contact.R_psi * contact.object.K * contact.R_psi;
       return CalcKappaDot(contact, V);
     }}},
    {"fingertip's torsion dropped in (40)", "kappa_dot", "G_dot_T_V",
     RollingChange{[](ContactGeometry contact, Vector6d V) {
       contact.fingertip.T.setZero();
       return CalcKappaDot(contact, V);
     }}},
    {"object's torsion dropped in (40)", "kappa_dot", nullptr,
     RollingChange{[](ContactGeometry contact, Vector6d V) {
       contact.object.T.setZero();
       return CalcKappaDot(contact, V);
     }}},
    {"object's metric dropped in (40)", "kappa_dot", "G_dot_T_V",
     RollingChange{[](ContactGeometry contact, Vector6d V) {
       contact.object.M.setIdentity();
       return CalcKappaDot(contact, V);
     }}},
    {"rotation of the object transposed", "object_pose", nullptr,
     ObjectPoseChange{[](const Vector6d&, Pose* X) { X->linear().transposeInPlace(); }}},
    {"X_o read as roll, pitch, yaw", "object_pose", nullptr,
     ObjectPoseChange{[](const Vector6d& X_o, Pose* X) { X->linear() = TurnRollPitchYaw(X_o.tail<3>()); }}},
    {"N_o with the wrong sign", nullptr, "N_o", ObjectBodyChange{[](ObjectBodyTerms* t) { t->N_o *= -1.0; }}},
    {"object without gyroscopic terms", nullptr, "C_hat_V",
     ObjectBodyChange{[](ObjectBodyTerms* t) { t->C_hat.setZero(); }}},
    {"object as a point mass", nullptr, "M_hat",
     ObjectBodyChange{[](ObjectBodyTerms* t) { t->M_hat.bottomRightCorner<3, 3>() *= 1e-3; }}},
    {"body velocity in world axes", "P_inv", nullptr, ObjectChange{[](ObjectTerms* t) {
       t->V_Bo.head<3>() = (Rotation(*t) * t->V_Bo.head<3>()).eval();
       t->V_Bo.tail<3>() = (Rotation(*t) * t->V_Bo.tail<3>()).eval();
     }}},
    {"M_o of the Lagrange form", "M_o", "M_o",
     ObjectChange{[](ObjectTerms* t) { t->M_o = t->P_inv.transpose() * t->M_o; }}},
    // A wrong P^-1 that M_o and C_o share.
    {"P^-1 of angles in reverse", "M_o", nullptr, ObjectChange{[](ObjectTerms* t) {
       t->P_inv.col(3).swap(t->P_inv.col(5));
       t->M_o = t->body.M_hat * t->P_inv;
     }}},
    {"rate of P^-1 with the wrong sign", "C_o_X_o_dot", "C_o_X_o_dot", ObjectChange{[](ObjectTerms* t) {
       t->P_inv_dot *= -1.0;
       t->C_o = t->body.M_hat * t->P_inv_dot + t->body.C_hat * t->P_inv;
     }}},
    {"C_o without the rate of P^-1", "C_o_X_o_dot", nullptr,
     ObjectChange{[](ObjectTerms* t) { t->C_o = t->body.C_hat * t->P_inv; }}},
    {"C_o without gyroscopic terms", "C_o_X_o_dot", nullptr,
     ObjectChange{[](ObjectTerms* t) { t->C_o = t->body.M_hat * t->P_inv_dot; }}},
    {"N_o with the wrong sign", "N_o", nullptr, ObjectChange{[](ObjectTerms* t) { t->N_o *= -1.0; }}},
    {"N_o in world axes", "N_o", nullptr,
     ObjectChange{[](ObjectTerms* t) { t->N_o.head<3>() = (Rotation(*t) * t->N_o.head<3>()).eval(); }}},
};

/// Whether the robot has what the equation is of.
bool Applies(const EquationFault& fault, const RobotModel& model) {
  const auto is_any = [&]<typename... Changes>(std::variant<Changes...>*) {
    return (std::holds_alternative<Changes>(fault.change) || ...);
  };
  using OfObject = std::variant<ObjectPoseChange, ObjectChange, ObjectBodyChange>;
  using OfContact =
      std::variant<ContactFrameChange, GraspMapChange, GraspMapRate, ContactJacobianChange, RollingChange>;
  using OfFrame = std::variant<JacobianChange, JacobianRate>;
  const auto* const rotations = std::get_if<RotationsTransposed>(&fault.change);
  const bool is_of_frame =
      is_any(static_cast<OfFrame*>(nullptr)) || (rotations != nullptr && rotations->of_frames);
  const bool is_of_contact = is_any(static_cast<OfContact*>(nullptr));
  if (is_of_frame && model.frames().empty()) return false;
  if (is_of_contact && model.fingertips().empty()) return false;
  if ((is_of_contact || is_any(static_cast<OfObject*>(nullptr))) && !model.object()) return false;
  return fault.applies == nullptr || fault.applies(model);
}

}  // namespace

std::vector<EquationFault> ListEquationFaults(const RobotModel& model) {
  std::vector<EquationFault> list;
  std::copy_if(std::begin(kEquations), std::end(kEquations), std::back_inserter(list),
               [&](const EquationFault& fault) { return Applies(fault, model); });
  for (int b = 0; b < model.num_joints(); ++b) {
    const Joint& joint = model.joints()[static_cast<size_t>(b)];
    if (joint.parent < 0) continue;
    list.push_back({"joints " + model.joints()[static_cast<size_t>(joint.parent)].name + " and " +
                        joint.name + " exchanged in q and xi",
                    "joint_axis", nullptr, JointsExchanged{joint.parent, b}});
  }
  return list;
}

const ContactGeometry& FaultyTerms::geometry(int contact) const {
  return grasp().contacts()[static_cast<size_t>(contact)].geometry;
}

void FaultyTerms::MakeOne(const RobotChange& change) const {
  const ModelTerms& terms = model_.robot();
  change.make({terms.model(), state_.q, state_.xi, Open(terms.M()), Open(terms.C()), Open(terms.gravity()),
               Open(terms.friction())});
}

void FaultyTerms::MakeOne(const GraspMapChange& change) const {
  for (int i = 0; i < grasp().num_contacts(); ++i)
    Open(grasp().G()).middleCols<3>(3 * i) = change.make(geometry(i).g_o_cf).leftCols<3>();
}

void FaultyTerms::MakeOne(const ContactJacobianChange& change) const {
  for (int i = 0; i < grasp().num_contacts(); ++i)
    Open(grasp().J_B()).middleRows<3>(3 * i) = change.make(geometry(i), grasp().J_f(i));
}

/// And the rates that are taken along kappa_dot.
void FaultyTerms::MakeOne(const RollingChange& change) const {
  for (int i = 0; i < grasp().num_contacts(); ++i) {
    const Matrix6Xd& J_f = grasp().J_f(i);
    const Contact& contact = grasp().contacts()[static_cast<size_t>(i)];
    const Vector6d V = CalcRelativeTwist(contact.geometry, J_f * state_.xi, grasp().V_Bo());
    Open(contact).kappa_dot = change.make(contact.geometry, V);
    CalcContactJacobianDot(contact, J_f, grasp().J_f_dot(i), Open(grasp().J_B_dot()).middleRows(3 * i, 3));
  }
  CalcGraspMapDot(grasp().contacts(), Open(grasp().G_dot()));
}

void FaultyTerms::Make(const EquationChange& change) const {
  std::visit(
      [this](const auto& one) {
        if constexpr (requires { MakeOne(one); }) MakeOne(one);
      },
      change);
  Open(grasp().slip()) = grasp().J_B() * state_.xi - grasp().G().transpose() * grasp().V_Bo();
  Open(grasp().slip_bias()) = grasp().J_B_dot() * state_.xi - grasp().G_dot().transpose() * grasp().V_Bo();
}

}  // namespace dexcheck
