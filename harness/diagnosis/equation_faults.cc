#include "harness/diagnosis/equation_faults.h"

#include <algorithm>
#include <utility>

#include "controller/contact/contact_geometry.h"
#include "controller/model/platform.h"
#include "controller/object/object_dynamics.h"
#include "controller/object/so3.h"

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

// Changes of an equation that is made anew.
EquationChange OfRobot(void (*make)(const Robot&)) { return {.robot = make}; }
EquationChange OfJacobian(Matrix6d (*make)(const Pose&)) { return {.jacobian = make}; }
EquationChange OfEnergy(void (*make)(EnergyAndMomentum*)) { return {.energy = make}; }
EquationChange OfPose(void (*make)(const Vector6d&, Pose*)) { return {.object_pose = make}; }
EquationChange OfObject(void (*make)(ObjectTerms*)) { return {.object = make}; }
EquationChange OfBody(void (*make)(ObjectBodyTerms*)) { return {.object_body = make}; }
EquationChange OfFrame(decltype(EquationChange::contact_frame) make) { return {.contact_frame = make}; }
EquationChange OfGraspMap(Matrix6d (*make)(const Pose&)) { return {.grasp_map = make}; }
EquationChange OfContact(decltype(EquationChange::contact_jacobian) make) {
  return {.contact_jacobian = make};
}
EquationChange OfRolling(void (*make)(ContactGeometry*, Vector6d*)) { return {.rolling = make}; }

const EquationFault kEquations[] = {
    {"Coriolis terms dropped", "C_bar_xi", "C_bar_xi", OfRobot([](const Robot& t) { t.C.setZero(); })},
    {"Coriolis matrix transposed", "C_bar_xi", "C_bar_xi",
     OfRobot([](const Robot& t) { t.C.transposeInPlace(); })},
    {"one joint's Coriolis row dropped", "C_bar_xi", nullptr,
     OfRobot([](const Robot& t) { t.C.row(t.C.rows() / 2).setZero(); })},
    {"Coriolis terms doubled", nullptr, "C_bar_xi", OfRobot([](const Robot& t) { t.C *= 2.0; })},
    {"Coriolis matrix without coupling", "C_bar", "C_bar_xi",
     OfRobot([](const Robot& t) { t.C = MatrixXd(t.C.diagonal().asDiagonal()); })},
    {"Coriolis matrix without Property 2", "C_bar", nullptr, OfRobot(LosePropertyTwo), kTwoVelocities},
    {"Coriolis matrix plus an antisymmetric part", "C_bar", nullptr, OfRobot(AddAntisymmetricPart),
     kThreeVelocities},
    {"gravity with the wrong sign", "gravity", "gravity", OfRobot([](const Robot& t) { t.gravity *= -1.0; })},
    {"friction dropped", "friction", "friction", OfRobot([](const Robot& t) { t.friction.setZero(); })},
    {"friction with the wrong sign", "friction", "friction",
     OfRobot([](const Robot& t) { t.friction *= -1.0; })},
    {"half of the mass matrix not mirrored", "M_bar", "M_bar",
     OfRobot([](const Robot& t) { t.M.triangularView<Eigen::StrictlyUpper>().setZero(); })},
    {"armature left out of M", "M_bar", "M_bar", OfRobot(DropArmature), kArmature},
    {"S_v_dot = 0", "C_bar_xi", "C_bar_xi", OfRobot(DropConstraintRate), kWheels},
    {"wheel spin left out of M", "M_bar", "M_bar", OfRobot(DropWheelSpin), kWheels},
    {"link rotations transposed", "joint_axis", nullptr, {.transposes_links = true}},
    {"frame rotations transposed", "frame_pose", nullptr, {.transposes_frames = true}},
    {"body Jacobian taken in world axes", "J", nullptr, OfJacobian(TurnToWorld)},
    {"linear and angular part exchanged", "J", nullptr, OfJacobian(ExchangeParts)},
    {"moment arm of the adjoint with the wrong sign", "J", nullptr, OfJacobian(CalcWrongAdjoint)},
    {"J_dot = 0", "J_dot_xi", "J_B_dot_xi", {.jacobian_rate = 0.0}},
    {"J_dot doubled", "J_dot_xi", "J_B_dot_xi", {.jacobian_rate = 2.0}},
    {"kinetic energy doubled", "kinetic_energy", nullptr,
     OfEnergy([](EnergyAndMomentum* t) { t->kinetic *= 2.0; })},
    {"potential energy with the wrong sign", "potential_energy", nullptr,
     OfEnergy([](EnergyAndMomentum* t) { t->potential *= -1.0; })},
    {"angular momentum about the origin", "angular_momentum", nullptr,
     OfEnergy([](EnergyAndMomentum* t) { t->angular_momentum += t->com.cross(t->linear_momentum); })},
    {"psi with the wrong sign", "contact_frame", nullptr,
     OfFrame([](const Surface& tip, const Surface& object, ContactCoordinates kappa) {
       kappa.psi = -kappa.psi;
       return CalcContactGeometry(tip, object, kappa);
     })},
    {"psi about the object's normal", "contact_frame", nullptr,
     OfFrame([](const Surface& tip, const Surface& object, ContactCoordinates kappa) {
       ContactGeometry geometry = CalcContactGeometry(tip, object, kappa);
       geometry.g_o_cf.linear() = geometry.object.R * Vector3d(1.0, -1.0, -1.0).asDiagonal() *
                                  Eigen::AngleAxisd(-kappa.psi, Vector3d::UnitZ()).toRotationMatrix();
       return geometry;
     })},
    {"G without moments", "G", "G", OfGraspMap([](const Pose& g) {
       Matrix6d transform = CalcWrenchTransform(g);
       transform.bottomRows<3>().setZero();
       return transform;
     })},
    {"G with Ad^T instead of Ad^-T", "G", "G",
     OfGraspMap([](const Pose& g) { return Matrix6d(CalcAdjoint(g).transpose()); })},
    {"G with Ad instead of Ad^-T", "G", "G", OfGraspMap([](const Pose& g) { return CalcAdjoint(g); })},
    {"G with the rotation transposed", "G", nullptr, OfGraspMap([](const Pose& g) {
       Pose turned = g;
       turned.linear().transposeInPlace();
       return CalcWrenchTransform(turned);
     })},
    {"J_B' with Ad instead of its inverse", "J_B", "J_B",
     OfContact([](const ContactGeometry& contact, const Matrix6Xd& J_f) {
       return MatrixXd((CalcAdjoint(contact.g_f_cf) * J_f).topRows<3>());
     })},
    {"J_B' at the fingertip's centre", "J_B", "J_B",
     OfContact([](const ContactGeometry& contact, const Matrix6Xd& J_f) {
       return MatrixXd(contact.g_f_cf.linear().transpose() * J_f.topRows<3>());
     })},
    {"G_dot = 0", nullptr, "G_dot_T_V", {.grasp_map_rate = 0.0}},
    {"G_dot with the wrong sign", nullptr, "G_dot_T_V", {.grasp_map_rate = -1.0}},
    {"spin term dropped in (40)", "kappa_dot", "G_dot_T_V",
     OfRolling([](ContactGeometry*, Vector6d* V) { (*V)[5] = 0.0; })},
    {"slip dropped in (40)", "kappa_dot", nullptr,
     OfRolling([](ContactGeometry*, Vector6d* V) { V->head<2>().setZero(); })},
    {"rolling about the wrong axis in (40)", "kappa_dot", "G_dot_T_V",
     OfRolling([](ContactGeometry*, Vector6d* V) { std::swap((*V)[3], (*V)[4]); })},
    {"object's curvature not turned by psi in (40)", "kappa_dot", "G_dot_T_V",
     OfRolling([](ContactGeometry* contact, Vector6d*) {
       contact->object.K = contact->R_psi * contact->object.K * contact->R_psi;
     })},
    {"fingertip's torsion dropped in (40)", "kappa_dot", "G_dot_T_V",
     OfRolling([](ContactGeometry* contact, Vector6d*) { contact->fingertip.T.setZero(); })},
    {"object's torsion dropped in (40)", "kappa_dot", nullptr,
     OfRolling([](ContactGeometry* contact, Vector6d*) { contact->object.T.setZero(); })},
    {"object's metric dropped in (40)", "kappa_dot", "G_dot_T_V",
     OfRolling([](ContactGeometry* contact, Vector6d*) { contact->object.M.setIdentity(); })},
    {"rotation of the object transposed", "object_pose", nullptr,
     OfPose([](const Vector6d&, Pose* X) { X->linear().transposeInPlace(); })},
    {"X_o read as roll, pitch, yaw", "object_pose", nullptr,
     OfPose([](const Vector6d& X_o, Pose* X) { X->linear() = TurnRollPitchYaw(X_o.tail<3>()); })},
    {"N_o with the wrong sign", nullptr, "N_o", OfBody([](ObjectBodyTerms* t) { t->N_o *= -1.0; })},
    {"object without gyroscopic terms", nullptr, "C_hat_V",
     OfBody([](ObjectBodyTerms* t) { t->C_hat.setZero(); })},
    {"object as a point mass", nullptr, "M_hat",
     OfBody([](ObjectBodyTerms* t) { t->M_hat.bottomRightCorner<3, 3>() *= 1e-3; })},
    {"body velocity in world axes", "P_inv", nullptr, OfObject([](ObjectTerms* t) {
       t->V_Bo.head<3>() = (Rotation(*t) * t->V_Bo.head<3>()).eval();
       t->V_Bo.tail<3>() = (Rotation(*t) * t->V_Bo.tail<3>()).eval();
     })},
    {"M_o of the Lagrange form", "M_o", "M_o",
     OfObject([](ObjectTerms* t) { t->M_o = t->P_inv.transpose() * t->M_o; })},
    // A wrong P^-1 that M_o and C_o share.
    {"P^-1 of angles in reverse", "M_o", nullptr, OfObject([](ObjectTerms* t) {
       t->P_inv.col(3).swap(t->P_inv.col(5));
       t->M_o = t->body.M_hat * t->P_inv;
     })},
    {"rate of P^-1 with the wrong sign", "C_o_X_o_dot", "C_o_X_o_dot", OfObject([](ObjectTerms* t) {
       t->P_inv_dot *= -1.0;
       t->C_o = t->body.M_hat * t->P_inv_dot + t->body.C_hat * t->P_inv;
     })},
    {"C_o without the rate of P^-1", "C_o_X_o_dot", nullptr,
     OfObject([](ObjectTerms* t) { t->C_o = t->body.C_hat * t->P_inv; })},
    {"C_o without gyroscopic terms", "C_o_X_o_dot", nullptr,
     OfObject([](ObjectTerms* t) { t->C_o = t->body.M_hat * t->P_inv_dot; })},
    {"N_o with the wrong sign", "N_o", nullptr, OfObject([](ObjectTerms* t) { t->N_o *= -1.0; })},
    {"N_o in world axes", "N_o", nullptr,
     OfObject([](ObjectTerms* t) { t->N_o.head<3>() = (Rotation(*t) * t->N_o.head<3>()).eval(); })},
};

/// Whether the robot has what the equation is of.
bool Applies(const EquationFault& fault, const RobotModel& model) {
  const EquationChange& change = fault.change;
  if ((change.transposes_frames || change.jacobian || change.jacobian_rate) && model.frames().empty())
    return false;
  if (change.is_of_contact() && model.fingertips().empty()) return false;
  if ((change.is_of_contact() || change.is_of_object()) && !model.object()) return false;
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
                    "joint_axis",
                    nullptr,
                    {.exchanged = std::pair(joint.parent, b)}});
  }
  return list;
}

template <typename T>
static T& Open(const T& shown) {
  return const_cast<T&>(shown);
}

void MakeFault(const EquationChange& change, const MeasuredState& state, GraspModel* model) {
  const ModelTerms& robot = model->robot();
  const GraspTerms& grasp = model->grasp();
  if (change.robot)
    change.robot({robot.model(), state.q, state.xi, Open(robot.M()), Open(robot.C()), Open(robot.gravity()),
                  Open(robot.friction())});
  if (change.jacobian_rate) Open(grasp.J_B_dot()) *= *change.jacobian_rate;
  if (change.grasp_map_rate) Open(grasp.G_dot()) *= *change.grasp_map_rate;
  if (change.object) change.object(&Open(grasp.coordinates()));
  if (change.object_body) change.object_body(&Open(grasp.body()));
  for (int i = 0; i < grasp.num_contacts(); ++i) {
    const Contact& contact = grasp.contacts()[static_cast<size_t>(i)];
    const Matrix6Xd& J_f = grasp.J_f(i);
    if (change.grasp_map)
      Open(grasp.G()).middleCols<3>(3 * i) = change.grasp_map(contact.geometry.g_o_cf).leftCols<3>();
    if (change.contact_jacobian)
      Open(grasp.J_B()).middleRows<3>(3 * i) = change.contact_jacobian(contact.geometry, J_f);
    if (!change.rolling) continue;
    // And the rates that are taken along kappa_dot.
    ContactGeometry geometry = contact.geometry;
    Vector6d V = CalcRelativeTwist(geometry, J_f * state.xi, grasp.V_Bo());
    change.rolling(&geometry, &V);
    Open(contact).kappa_dot = CalcKappaDot(geometry, V);
    CalcContactJacobianDot(contact, J_f, grasp.J_f_dot(i), Open(grasp.J_B_dot()).middleRows(3 * i, 3));
  }
  if (change.rolling) CalcGraspMapDot(grasp.contacts(), Open(grasp.G_dot()));
  Open(grasp.slip()) = grasp.J_B() * state.xi - grasp.G().transpose() * grasp.V_Bo();
  Open(grasp.slip_bias()) = grasp.J_B_dot() * state.xi - grasp.G_dot().transpose() * grasp.V_Bo();
}

}  // namespace dexcheck
