#include "harness/checks/contact_check.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "controller/common/errors.h"
#include "controller/contact/adjoint.h"
#include "controller/contact/object_surface.h"

namespace dexcheck {
namespace {

// As the model's terms: a chain of joints, and a contact frame at its end on either side.
constexpr double kRoundingPerJoint = 64.0 * std::numeric_limits<double>::epsilon();

/// R_co_cf as section 4.3 says it, written here once more: c_u of the object turned by psi about the outward
/// normal of the fingertip is c_u of the fingertip, and the normals are opposite.
Matrix3d CalcContactTurn(double psi) {
  Matrix3d R;
  R << std::cos(psi), -std::sin(psi), 0.0, -std::sin(psi), -std::cos(psi), 0.0, 0.0, 0.0, -1.0;
  return R;
}

}  // namespace

ContactCheck::ContactCheck(const Adapter& adapter, ContactFormulas formulas)
    : adapter_(&adapter),
      formulas_(std::move(formulas)),
      engine_(mj_copyModel(nullptr, &adapter.engine())),
      data_(MakeData(*engine_)),
      map_(adapter, Coordinates::kReduced),
      terms_(adapter.model()) {
  const RobotModel& model = adapter.model();
  const auto fail = [&](const std::string& problem) {
    throw InputError(model.spec().source + ": " + problem);
  };
  if (model.fingertips().empty()) fail("frame: contacts need a frame with sphere_radius, got none");
  if (!model.object()) fail("object: contacts need one, got none");
  try {
    object_ = MakeSurface(model.object()->shape);
  } catch (const std::invalid_argument& error) {
    fail(std::string("object: ") + error.what());
  }
  const int joint = engine_->body_jntadr[adapter.object_body()];
  if (engine_->body_jntnum[adapter.object_body()] != 1 || engine_->jnt_type[joint] != mjJNT_FREE)
    fail("object: its body must move by a free joint");
  object_qpos_ = engine_->jnt_qposadr[joint];
  object_dof_ = engine_->jnt_dofadr[joint];
  records_.resize(kTermCount);
  const char* const names[] = {"contact_frame", "J_B", "G", "kappa_dot"};
  for (size_t i = 0; i < records_.size(); ++i) {
    records_[i].name = names[i];
    records_[i].bound = kRoundingPerJoint * (model.max_depth() + 1);
  }
}

void ContactCheck::PlaceObject(const Pose& X_Bo) {
  const Eigen::Quaterniond rotation(X_Bo.linear());
  const Vector3d p = X_Bo.translation();
  const double pose[7] = {p.x(), p.y(), p.z(), rotation.w(), rotation.x(), rotation.y(), rotation.z()};
  mju_copy(data_->qpos + object_qpos_, pose, 7);
  mj_kinematics(engine_.get(), data_.get());
  mj_comPos(engine_.get(), data_.get());
}

Matrix3Xd ContactCheck::CalcPointJacobian(int body, const Vector3d& point, Matrix3Xd* angular) const {
  RowMatrixXd linear = RowMatrixXd::Zero(3, engine_->nv);
  RowMatrixXd turning = RowMatrixXd::Zero(3, engine_->nv);
  mj_jac(engine_.get(), data_.get(), linear.data(), turning.data(), point.data(), body);
  *angular = turning;
  return linear;
}

void ContactCheck::Compare(const VectorXd& q, const VectorXd& xi, StateSource* source, long sample_number) {
  const auto sample = static_cast<double>(sample_number);
  const RobotModel& model = adapter_->model();
  const size_t tip_index = static_cast<size_t>(sample_number) % model.fingertips().size();
  const int frame = model.fingertips()[tip_index];
  const Location where{Location::Kind::kFrame, frame, -1};
  const Sphere tip(*model.frames()[static_cast<size_t>(frame)].sphere_radius);

  // Away from the sphere's poles and where a torus is convex, so that the bodies touch at one point only.
  ContactCoordinates kappa;
  kappa.alpha_f = {source->Draw(-kPi, kPi), source->Draw(-1.0, 1.0), 0};
  kappa.alpha_o = {source->Draw(-kPi, kPi), source->Draw(-1.0, 1.0), 0};
  kappa.psi = source->Draw(-kPi, kPi);

  // The engine's fingertip, and the object where these coordinates put it.
  adapter_->SetPositions(q, data_->qpos);
  mj_kinematics(engine_.get(), data_.get());
  const int site = adapter_->frame_sites()[static_cast<size_t>(frame)];
  Pose X_f = Pose::Identity();
  X_f.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data_->site_xmat + 9 * site);
  X_f.translation() = Eigen::Map<const Vector3d>(data_->site_xpos + 3 * site);
  const SurfaceGeometry on_tip = tip.Evaluate(kappa.alpha_f);
  const SurfaceGeometry on_object = object_->Evaluate(kappa.alpha_o);
  Pose X_o_cf = on_object.CalcPose();
  X_o_cf.linear() = on_object.R * CalcContactTurn(kappa.psi);
  const Pose X_cf = X_f * on_tip.CalcPose();
  const Pose X_Bo = X_cf * X_o_cf.inverse();
  PlaceObject(X_Bo);

  // Velocities: the object rolls, spins and slides on the fingertip at rates of order 1.
  map_.SetState(q, xi);
  mju_zero(data_->qvel, engine_->nv);
  map_.Expand(xi, data_->qvel);
  const int tip_body = engine_->site_bodyid[site];
  const int object_body = adapter_->object_body();
  Matrix3Xd tip_turn;
  Matrix3Xd object_turn;
  const Matrix3Xd tip_point = CalcPointJacobian(tip_body, X_cf.translation(), &tip_turn);
  const Matrix3Xd object_point = CalcPointJacobian(object_body, X_cf.translation(), &object_turn);
  const Eigen::Map<VectorXd> qvel(data_->qvel, engine_->nv);
  const Matrix3d R_cf = X_cf.linear();
  const Vector3d tip_velocity = tip_point * qvel;
  const Vector3d tip_omega = tip_turn * qvel;
  Vector6d V_relative;
  for (double& entry : V_relative) entry = source->Draw(-1.0, 1.0);
  V_relative[2] = 0.0;
  const Vector3d omega_o = tip_omega - R_cf * V_relative.tail<3>();
  const Vector3d at_contact = tip_velocity - R_cf * V_relative.head<3>();
  const Vector3d v_o = at_contact - omega_o.cross(X_cf.translation() - X_Bo.translation());
  Vector6d V_o;
  V_o << X_Bo.linear().transpose() * v_o, X_Bo.linear().transpose() * omega_o;

  // The model's side.
  terms_.SetState(q, xi);
  Matrix6Xd J_f(6, terms_.size());
  Matrix6Xd J_f_dot(6, terms_.size());
  terms_.CalcFrameJacobian(frame, J_f, J_f_dot);
  Contact contact;
  contact.geometry = formulas_.geometry(tip, *object_, kappa);
  const Vector6d V_f = J_f * xi;
  contact.kappa_dot = formulas_.kappa_dot(contact.geometry, CalcRelativeTwist(contact.geometry, V_f, V_o));
  MatrixXd J_B(3, terms_.size());
  formulas_.jacobian(contact, J_f, J_B);
  Matrix6Xd G(6, 3);
  formulas_.grasp_map(contact, G);

  const double length = 1.0 + X_cf.translation().norm();
  const auto compare = [&](Term term, const auto& of_model, const auto& of_engine, double scale) {
    for (Eigen::Index col = 0; col < of_model.cols(); ++col) {
      for (Eigen::Index row = 0; row < of_model.rows(); ++row)
        records_[term].Compare(of_model(row, col), of_engine(row, col), scale, where, sample);
    }
  };
  const Pose placed = X_Bo * contact.geometry.g_o_cf;
  compare(kFrame, placed.matrix().topRows<3>(), X_cf.matrix().topRows<3>(), length);
  MatrixXd J_engine(3, terms_.size());
  map_.ProjectJacobian(RowMatrixXd(R_cf.transpose() * tip_point), J_engine);
  compare(kJacobian, J_B, J_engine, length);
  // qvel = [R v; omega] of the object's body velocity.
  Matrix6d B = Matrix6d::Identity();
  B.topLeftCorner<3, 3>() = X_Bo.linear();
  const MatrixXd G_T_engine = R_cf.transpose() * object_point.middleCols(object_dof_, 6) * B;
  compare(kGraspMap, MatrixXd(G.transpose()), G_T_engine, length);
  // Both ways to Sigma_cf: V_f_cf + Ad^-1 V_f = V_o_cf + Ad^-1 V_o.
  const Vector6d over_tip = CalcFrameTwistOnFingertip(contact.geometry, contact.kappa_dot);
  const Vector6d over_object = CalcFrameTwistOnObject(contact.geometry, contact.kappa_dot);
  // Rolling rates are the relative rates over the surfaces' relative curvature.
  const double rates = 1.0 + tip_velocity.norm() + tip_omega.norm() * length + over_tip.norm();
  compare(kRolling, Vector6d(over_object - over_tip), V_relative, rates);
}

}  // namespace dexcheck
