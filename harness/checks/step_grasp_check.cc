// Contacts and object of StepModelCheck.

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/checks/object_rates.h"
#include "harness/checks/step_model_check.h"

namespace dexcheck {
namespace {

// Three rotations and the engine's normalised quaternion, of a few roundings each; products of two such
// factors.
constexpr double kObjectBound = 128.0 * std::numeric_limits<double>::epsilon();

// Least rate of the object that errors of velocities are relative to, m/s and rad/s.
constexpr double kLeastRate = 1e-3;

}  // namespace

void StepModelCheck::DefineGraspTerms() {
  const int depth = adapter_->model().max_depth();
  const int n = engine_.size();
  const auto fingers = static_cast<Eigen::Index>(fingertips_.size());
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> may_differ;
  may_differ.setConstant(3 * fingers, n, false);
  std::vector<Location> jacobians;
  for (size_t i = 0; i < fingertips_.size(); ++i) {
    const std::vector<int>& chain = engine_.chain(static_cast<int>(i));
    jacobians.insert(jacobians.end(), 3 * chain.size(), {Location::Kind::kFrame, fingertips_[i], -1});
    for (const int col : chain) may_differ.block(3 * static_cast<Eigen::Index>(i), col, 3, 1) = true;
  }
  other_zeros_.emplace_back(may_differ);
  const auto define = [&](const char* name, double factors, size_t numbers) {
    std::vector<Location> where;
    for (const int frame : fingertips_)
      where.insert(where.end(), numbers, {Location::Kind::kFrame, frame, -1});
    terms_.emplace_back(name, CalcRoundingBound(depth, factors), where);
  };
  constexpr size_t kFrameNumbers = 3 + 3 + 1 + 12;  // position, normal, overlap, pose
  define("contact_frame", 1.0, kFrameNumbers);
  define("G", 1.0, 18);
  terms_.emplace_back("J_B", CalcRoundingBound(depth, 1.0), jacobians);
  define("J_B_dot_xi", 3.0, 3);
  define("G_dot_T_V", 3.0, 3);

  const auto define_object = [&](const char* name, size_t numbers) {
    terms_.emplace_back(name, kObjectBound,
                        std::vector<Location>(numbers, {Location::Kind::kObject, -1, -1}));
  };
  define_object("M_hat", 36);
  define_object("C_hat_V", 6);
  define_object("N_o", 6);
  define_object("object_kinetic_energy", 1);
  define_object("object_potential_energy", 1);
  if (!has_coordinates_) return;
  define_object("object_pose", 12);
  define_object("V_Bo", 6);
  define_object("M_o", 36);
  define_object("C_o_X_o_dot", 6);
}

StepModelCheck::ContactScales StepModelCheck::CalcContactScales(const ContactGeometry& contact) const {
  // A fingertip displaced by e over the object moves the contact by (K_f + Kt_o)^-1 K_f e on the object and
  // turns the normal by K_o times that.
  const Matrix2d sum = contact.fingertip.K + contact.R_psi * contact.object.K * contact.R_psi;
  // The smallest eigenvalue. R_psi K_o R_psi is symmetric but for rounding, and hypot knows no negative
  // squares.
  const double half = 0.5 * (sum(0, 0) - sum(1, 1));
  const double least = 0.5 * sum.trace() - std::hypot(half, 0.5 * (sum(0, 1) + sum(1, 0)));
  const double moved = contact.fingertip.K.norm() / least;
  const double length = scales_.world_length();
  return {1.0 + contact.object.K.norm() * moved * length, (1.0 + moved) * length};
}

void StepModelCheck::CompareContacts(const GraspTerms& grasp, const MeasuredState& state, const Pose& X_W0,
                                     long step) {
  StepTerm& frames = term(kContactFrame);
  StepTerm& maps = term(kG);
  StepTerm& jacobian = term(kJB);
  // Carries the projected robot to where the plant has it.
  const Pose shift = X_W0 * engine_.BasePose().inverse(Eigen::Isometry);
  const Pose X_oW = engine_.ObjectPose().inverse(Eigen::Isometry);
  J_B_dot_xi_.noalias() = grasp.J_B_dot() * state.xi;
  Eigen::Index k = 0;
  for (size_t i = 0; i < fingertips_.size(); ++i) {
    const auto finger = static_cast<int>(i);
    const auto row = 3 * static_cast<Eigen::Index>(i);
    const Contact& contact = grasp.contacts()[i];
    const Pose& g_o_cf = contact.geometry.g_o_cf;
    const ContactScales scales = CalcContactScales(contact.geometry);
    const EngineTouch touch = engine_.CalcTouch(finger, shift);
    const Pose X_cf = shift * engine_.FramePose(fingertips_[i]) * contact.geometry.g_f_cf;

    const auto f = 19 * static_cast<Eigen::Index>(i);
    frames.model.segment<3>(f) = g_o_cf.translation();
    frames.engine.segment<3>(f) = X_oW * touch.position;
    frames.model.segment<3>(f + 3) = g_o_cf.linear().col(2);
    frames.engine.segment<3>(f + 3) = X_oW.linear() * touch.normal;
    frames.model[f + 6] = state.overlap[i];
    frames.engine[f + 6] = -touch.distance;
    Eigen::Map<Eigen::Matrix<double, 3, 4>>(frames.model.data() + f + 7) = g_o_cf.matrix().topRows<3>();
    Eigen::Map<Eigen::Matrix<double, 3, 4>>(frames.engine.data() + f + 7) =
        (X_oW * X_cf).matrix().topRows<3>();
    frames.weight.segment<19>(f).setConstant(1.0 / scales.position);
    frames.weight.segment<3>(f + 3).setConstant(1.0 / scales.normal);
    frames.weight.segment<9>(f + 7).setConstant(1.0 / scales.normal);

    // Sigma_cf by the engine's normal; where its x axis points about the normal is a convention.
    Matrix3d R_cf;
    R_cf.col(2) = touch.normal;
    R_cf.col(1) = touch.normal.cross(X_cf.linear().col(0)).normalized();
    R_cf.col(0) = R_cf.col(1).cross(R_cf.col(2));
    const Eigen::Matrix<double, 3, 6> G_T = R_cf.transpose() * engine_.CalcObjectJacobian(touch.position);
    const auto g = 18 * static_cast<Eigen::Index>(i);
    const double moment = scales.position + g_o_cf.translation().norm() * scales.normal;
    for (Eigen::Index col = 0; col < 3; ++col) {
      maps.model.segment<6>(g + 6 * col) = grasp.G().col(row + col);
      maps.engine.segment<6>(g + 6 * col) = G_T.row(col).transpose();
      maps.weight.segment<3>(g + 6 * col).setConstant(1.0 / scales.normal);
      maps.weight.segment<3>(g + 6 * col + 3).setConstant(1.0 / moment);
    }

    const ContactPlace place{R_cf, touch.position, shift.linear().transpose() * R_cf,
                             shift.inverse(Eigen::Isometry) * touch.position, scales};
    const std::vector<int>& chain = engine_.chain(finger);
    const auto columns = static_cast<Eigen::Index>(chain.size());
    engine_.CalcTipJacobian(finger, place.p_projected, J_engine_.leftCols(columns));
    const double row_weight = 1.0 / (scales.normal + scales.position / scales_.length());
    for (Eigen::Index col = 0; col < columns; ++col, k += 3) {
      const int coordinate = chain[static_cast<size_t>(col)];
      jacobian.model.segment<3>(k) = grasp.J_B().block<3, 1>(row, coordinate);
      jacobian.engine.segment<3>(k) = place.R_projected.transpose() * J_engine_.col(col).head<3>();
      jacobian.weight.segment<3>(k).setConstant(velocity_weights_[coordinate] * row_weight);
    }

    term(kJBDotXi).model.segment<3>(row) = J_B_dot_xi_.segment<3>(row);
    term(kGDotV).model.segment<3>(row) = grasp.G_dot().middleCols<3>(row).transpose() * grasp.V_Bo();
    CompareContactRates(contact, finger, place);
  }
  const auto scale = [&](Eigen::Index, Eigen::Index col) {
    return scales_.CalcVelocityScale(static_cast<int>(col));
  };
  const auto where = [&](Eigen::Index row, Eigen::Index) {
    return Location{Location::Kind::kFrame, fingertips_[static_cast<size_t>(row / 3)], -1};
  };
  jacobian.CheckZeros(other_zeros_[1], grasp.J_B(), scale, where, step);
}

void StepModelCheck::CompareContactRates(const Contact& contact, int finger, const ContactPlace& place) {
  // Everything in Sigma_cf, which moves over the fingertip at u_f and turns at omega.
  const EngineMotion tip = engine_.TipMotion(finger).MoveTo(place.p_projected);
  const EngineMotion object = engine_.ObjectMotion().MoveTo(place.p);
  const Vector3d v_f = place.R_projected.transpose() * tip.v;
  const Vector3d omega_f = place.R_projected.transpose() * tip.omega;
  const Vector3d v_o = place.R.transpose() * object.v;
  const Vector3d omega_o = place.R.transpose() * object.omega;
  const Vector6d over_tip = CalcFrameTwistOnFingertip(contact.geometry, contact.kappa_dot);
  const Vector3d u_f = over_tip.head<3>();
  Vector3d u_o = v_f + u_f - v_o;
  u_o.z() = 0.0;  // kappa moves within the surfaces, also while the bodies approach
  const Vector3d omega = omega_f + over_tip.tail<3>();
  const Eigen::Index row = 3 * finger;
  // d/dt (R_cf^T v_f(p_c)), and the same of the object's velocity at p_c
  StepTerm& fingers = term(kJBDotXi);
  StepTerm& objects = term(kGDotV);
  fingers.engine.segment<3>(row) =
      place.R_projected.transpose() * tip.a + omega_f.cross(u_f) - omega.cross(v_f);
  objects.engine.segment<3>(row) = place.R.transpose() * object.a + omega_o.cross(u_o) - omega.cross(v_o);

  const ContactScales& scales = place.scales;
  const double turning = omega.norm();
  const double linear = scales_.linear_rate() + u_f.norm();
  const double angular = scales_.angular_rate() + turning;
  fingers.weight.segment<3>(row).setConstant(
      1.0 / Positive(linear * angular * scales.normal + scales.position * angular * angular));
  // An error of v_f - v_o is one of u_o, and turns Sigma_cf's rate by the fingertip's curvature.
  const double object_linear = v_o.norm() + u_o.norm();
  const double object_angular = omega_o.norm() + turning;
  const double curvature = contact.geometry.fingertip.K.norm() * scales.position / scales_.world_length();
  objects.weight.segment<3>(row).setConstant(
      1.0 / Positive(object_linear * object_angular * scales.normal +
                     scales.position * object_angular * object_angular +
                     scales_.linear_rate() * (omega_o.norm() + curvature * v_o.norm())));
}

void StepModelCheck::CompareObject(const GraspTerms& grasp, const MeasuredState& state) {
  const MassProperties& body = grasp.object();
  const Pose X = engine_.ObjectPose();
  const Vector6d V = engine_.ObjectVelocity();
  const Matrix6d M_hat = engine_.ObjectInertia();
  const Vector6d C_hat_V = engine_.ObjectCoriolis();
  const Vector6d N_o = engine_.ObjectGravity();
  const auto set = [&](Term which, const auto& model, const auto& engine) {
    for (Eigen::Index i = 0; i < term(which).size(); ++i) {
      term(which).model[i] = model.data()[i];
      term(which).engine[i] = engine.data()[i];
    }
  };
  const double place = 1.0 + state.X_Bo.translation().norm();
  const Vector6d& V_Bo = grasp.V_Bo();
  double linear_rate = V_Bo.head<3>().norm();
  double angular_rate = V_Bo.tail<3>().norm();
  if (has_coordinates_) angular_rate = std::max(angular_rate, grasp.X_o_dot().tail<3>().cwiseAbs().sum());
  const double rate = std::max({linear_rate, angular_rate, kLeastRate});

  const double inertia = body.inertia.trace();
  set(kMHat, grasp.body().M_hat, M_hat);
  for (Eigen::Index i = 0; i < 36; ++i) term(kMHat).weight[i] = 1.0 / (i % 6 < 3 ? body.mass : inertia);
  const Vector6d C_hat_V_model = grasp.body().C_hat * V_Bo;
  set(kCHatV, C_hat_V_model, C_hat_V);
  set(kNo, grasp.body().N_o, N_o);
  // Moments are sums of forces times world coordinates, which cancel to the moment about the centre of mass.
  const double weight = Positive(body.mass * grasp.gravity().norm());
  const auto set_weights = [&](Term which, double force) {
    term(which).weight.head<3>().setConstant(1.0 / force);
    term(which).weight.tail<3>().setConstant(1.0 / (force * place));
  };
  set_weights(kCHatV, body.mass * rate * rate);
  set_weights(kNo, weight);

  term(kObjectKineticEnergy).model[0] = CalcObjectKineticEnergy(body, V_Bo);
  term(kObjectKineticEnergy).engine[0] = 0.5 * V.dot(M_hat * V);
  term(kObjectKineticEnergy).weight[0] = 1.0 / ((body.mass + inertia) * rate * rate);
  term(kObjectPotentialEnergy).model[0] =
      CalcObjectPotentialEnergy(body, grasp.gravity(), grasp.X_Bo().translation());
  term(kObjectPotentialEnergy).engine[0] = (X.linear() * N_o.head<3>()).dot(X.translation());
  term(kObjectPotentialEnergy).weight[0] = 1.0 / (weight * place);
  if (!has_coordinates_) return;

  const Eigen::Matrix<double, 3, 4> pose = grasp.X_Bo().matrix().topRows<3>();
  const Eigen::Matrix<double, 3, 4> pose_engine = X.matrix().topRows<3>();
  set(kObjectPose, pose, pose_engine);
  term(kObjectPose).weight.tail<3>().setConstant(1.0 / place);
  set(kBodyVelocity, V_Bo, V);
  term(kBodyVelocity).weight.setConstant(1.0 / rate);
  const ObjectTerms& terms = grasp.coordinates();
  const ObjectRates rates = CalcObjectRates(grasp.X_o(), grasp.X_o_dot());
  const Matrix6d M_o = M_hat * rates.P_inv;
  set(kMo, terms.M_o, M_o);
  term(kMo).weight = term(kMHat).weight;
  const Vector6d C_o_X_o_dot = terms.C_o * grasp.X_o_dot();
  const Vector6d C_o_X_o_dot_engine = C_hat_V + M_hat * rates.bias;
  set(kCoXoDot, C_o_X_o_dot, C_o_X_o_dot_engine);
  set_weights(kCoXoDot, body.mass * rate * rate);
}

}  // namespace dexcheck
