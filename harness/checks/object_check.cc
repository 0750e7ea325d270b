#include "harness/checks/object_check.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/checks/object_rates.h"

namespace dexcheck {
namespace {

// Three rotations and the engine's normalised quaternion, of a few roundings each; products of two such
// factors.
constexpr double kRounding = 128.0 * std::numeric_limits<double>::epsilon();

}  // namespace

ObjectCheck::ObjectCheck(const Adapter& adapter, ObjectFormulas formulas)
    : adapter_(&adapter),
      formulas_(std::move(formulas)),
      engine_(mj_copyModel(nullptr, &adapter.engine())),
      data_(MakeData(*engine_)) {
  const int body = adapter.object_body();
  const int joint = engine_->body_jntadr[body];
  if (engine_->body_jntnum[body] != 1 || engine_->jnt_type[joint] != mjJNT_FREE) {
    throw InputError("MJCF: body " + Quote(NameOf(*engine_, mjOBJ_BODY, body)) +
                     ": must move by a free joint");
  }
  qpos_address_ = engine_->jnt_qposadr[joint];
  dof_address_ = engine_->jnt_dofadr[joint];
  force_nv_.setZero(engine_->nv);
  M_nv_.setZero(engine_->nv, engine_->nv);
  records_.resize(kTermCount);
  const char* const names[] = {"object_pose", "P_inv", "M_o", "C_o_X_o_dot", "N_o", "object_kinetic_energy"};
  for (int i = 0; i < kTermCount; ++i) {
    records_[static_cast<size_t>(i)].name = names[i];
    records_[static_cast<size_t>(i)].bound = kRounding;
  }
}

void ObjectCheck::SetEngineState(const Vector6d& X_o, const Vector6d& X_o_dot) {
  mjtNum* const qpos = data_->qpos + qpos_address_;
  mjtNum* const qvel = data_->qvel + dof_address_;
  mju_zero(data_->qvel, engine_->nv);
  for (int k = 0; k < 3; ++k) {
    qpos[k] = X_o[k];
    qvel[k] = X_o_dot[k];
  }
  // Quaternion z(alpha) y(beta) z(gamma); each angle's rate turns about its axis as the later rotations leave
  // it.
  const mjtNum axes[3][3] = {{0, 0, 1}, {0, 1, 0}, {0, 0, 1}};
  mjtNum rotation[4] = {1, 0, 0, 0};
  Vector3d omega = Vector3d::Zero();  // in the frame reached so far
  for (int k = 0; k < 3; ++k) {
    mjtNum step[4];
    mjtNum inverse[4];
    mjtNum turned[3];
    mju_axisAngle2Quat(step, axes[k], X_o[3 + k]);
    mju_mulQuat(rotation, rotation, step);
    mju_negQuat(inverse, step);
    mju_rotVecQuat(turned, omega.data(), inverse);
    omega = Vector3d(turned[0], turned[1], turned[2]) +
            X_o_dot[3 + k] * Vector3d(axes[k][0], axes[k][1], axes[k][2]);
  }
  mju_copy(qpos + 3, rotation, 4);
  mju_copy3(qvel + 3, omega.data());
  mj_kinematics(engine_.get(), data_.get());
  mj_comPos(engine_.get(), data_.get());
  mj_crb(engine_.get(), data_.get());
  mj_fullM(engine_.get(), M_nv_.data(), data_->qM);
}

void ObjectCheck::Compare(const Vector6d& X_o, const Vector6d& X_o_dot, long sample) {
  const MassProperties& body = adapter_->model().object()->body;
  const Vector3d gravity = adapter_->model().gravity();
  const ObjectTerms terms = formulas_.terms(body, gravity, X_o, X_o_dot);
  const Pose X = formulas_.pose(X_o);
  SetEngineState(X_o, X_o_dot);

  const Location where{Location::Kind::kObject, -1, -1};
  const auto compare = [&](Term term, const auto& model, const auto& engine, double scale) {
    CheckRecord& record = records_[static_cast<size_t>(term)];
    for (Eigen::Index col = 0; col < model.cols(); ++col) {
      for (Eigen::Index row = 0; row < model.rows(); ++row) {
        record.Add(model(row, col), engine(row, col), scale, where, sample);
      }
    }
  };
  const int id = adapter_->object_body();
  const Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data_->xmat + 9 * id);
  compare(kPose, X.linear(), R, 1.0);

  // The engine's velocity is [linear in the world; angular in the body]: qvel = B V^o, B = diag(R, 1).
  Matrix6d B = Matrix6d::Identity();
  B.topLeftCorner<3, 3>() = R;
  const Eigen::Map<const Vector6d> qvel(data_->qvel + dof_address_);
  const Vector6d V_engine = B.transpose() * qvel;
  const double linear_rate = X_o_dot.head<3>().norm();
  const double angular_rate = X_o_dot.tail<3>().cwiseAbs().sum();
  const double rate = std::max({linear_rate, angular_rate, 1e-3});
  compare(kBodyVelocity, terms.V_Bo, V_engine, rate);

  // Wrench of the body: F_o = B^T (M qacc + bias), qacc = B (V_dot + [omega x v; 0]), V_dot = P^-1 X_ddot +
  // d/dt (P^-1) X_dot.
  const ObjectRates rates = CalcObjectRates(X_o, X_o_dot);
  const Matrix6d M = M_nv_.block<6, 6>(dof_address_, dof_address_);
  const Matrix6d M_engine = B.transpose() * M * B * rates.P_inv;
  const Vector6d mass_scale =
      (Vector6d() << Vector3d::Constant(body.mass), Vector3d::Constant(body.inertia.trace())).finished();
  for (int row = 0; row < 6; ++row) {
    for (int col = 0; col < 6; ++col) {
      records_[kInertia].Add(terms.M_o(row, col), M_engine(row, col), mass_scale[row], where, sample);
    }
  }
  mj_comVel(engine_.get(), data_.get());
  mju_zero(engine_->opt.gravity, 3);
  mj_rne(engine_.get(), data_.get(), 0, force_nv_.data());
  Vector6d V_dot = rates.bias;
  V_dot.head<3>() += V_engine.tail<3>().cross(V_engine.head<3>());
  const Vector6d coriolis_engine = B.transpose() * (force_nv_.segment<6>(dof_address_) + M * (B * V_dot));
  const Vector6d coriolis = terms.C_o * X_o_dot;
  mju_copy3(engine_->opt.gravity, adapter_->engine().opt.gravity);
  mju_zero(data_->qvel, engine_->nv);
  mj_comVel(engine_.get(), data_.get());
  mj_rne(engine_.get(), data_.get(), 0, force_nv_.data());
  const Vector6d gravity_engine = B.transpose() * force_nv_.segment<6>(dof_address_);
  // Moments are sums of forces times world coordinates, which cancel to the moment about the centre of mass.
  const double place = 1.0 + X_o.head<3>().norm();
  const double coriolis_force = body.mass * rate * rate;
  const double weight = body.mass * gravity.norm();
  for (int row = 0; row < 6; ++row) {
    const double arm = row < 3 ? 1.0 : place;
    records_[kCoriolis].Add(coriolis[row], coriolis_engine[row], coriolis_force * arm, where, sample);
    records_[kGravity].Add(terms.N_o[row], gravity_engine[row], (weight > 0.0 ? weight : 1.0) * arm, where,
                           sample);
  }
  const double kinetic = CalcObjectKineticEnergy(body, terms.V_Bo);
  const double kinetic_engine = 0.5 * V_engine.dot(B.transpose() * M * B * V_engine);
  records_[kKineticEnergy].Add(kinetic, kinetic_engine, (body.mass + body.inertia.trace()) * rate * rate,
                               where, sample);
}

}  // namespace dexcheck
