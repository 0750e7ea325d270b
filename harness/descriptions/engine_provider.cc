#include "harness/descriptions/engine_provider.h"

#include <mujoco/mujoco.h>

#include <algorithm>

#include "controller/common/linear_algebra.h"

namespace dexcheck {

namespace {

EngineTerms MakeTerms(const Adapter& adapter, std::span<const int> fingertips) {
  return fingertips.empty() ? EngineTerms(adapter, Coordinates::kReduced) : EngineTerms(adapter, fingertips);
}

}  // namespace

struct EngineProvider::OwnModel {
  OwnModel(const RobotSpec& robot, MjModelPtr own, const std::string& source)
      : model(robot), engine(std::move(own)), adapter(model, *engine, source) {}
  RobotModel model;
  MjModelPtr engine;
  Adapter adapter;
};

EngineProvider::EngineProvider(const Adapter& adapter, std::string name)
    : MechanismProvider(std::move(name)),
      adapter_(&adapter),
      terms_(adapter, Coordinates::kReduced),
      unreduced_(std::make_unique<EngineTerms>(adapter, Coordinates::kUnreduced)) {
  has_object_ = has_coordinates_ = adapter.model().object().has_value();
  if (has_object_) terms_.RequireObject();
  PrepareFrames(ListIndices(adapter.model().frames().size()), /*contacts=*/false);
  unreduced_velocity_.setZero(unreduced_->size());
}

EngineProvider::EngineProvider(const RobotSpec& robot, MjModelPtr engine, const std::string& source,
                               std::string name)
    : MechanismProvider(std::move(name)),
      own_(std::make_shared<const OwnModel>(robot, std::move(engine), source)),
      adapter_(&own_->adapter),
      terms_(own_->adapter, Coordinates::kReduced) {
  PrepareFrames({}, /*contacts=*/false);
}

EngineProvider::EngineProvider(const Adapter& adapter, std::span<const int> fingertips, bool has_coordinates)
    : MechanismProvider("engine"), adapter_(&adapter), terms_(MakeTerms(adapter, fingertips)) {
  has_object_ = adapter.model().object().has_value();
  has_coordinates_ = has_coordinates;
  if (fingertips.empty()) {
    if (has_object_) terms_.RequireObject();
    PrepareFrames(ListIndices(adapter.model().frames().size()), /*contacts=*/false);
  } else {
    PrepareFrames(fingertips, /*contacts=*/true);
  }
}

void EngineProvider::PrepareFrames(std::span<const int> frames, bool contacts) {
  frames_.assign(frames.begin(), frames.end());
  for (const int frame : frames_)
    columns_.emplace_back(Matrix6Xd::Zero(6, static_cast<Eigen::Index>(terms_.chain(frame).size())));
  if (contacts) {
    contacts_.resize(frames_.size());
    for (ContactValues& contact : contacts_) contact.J_B.setZero(3, terms_.size());
  }
  xi_.setZero(terms_.size());
}

void EngineProvider::SetState(const DynamicsState& state) {
  const ObjectCoordinates coordinates{state.X_o, state.X_o_dot};
  const ObjectRates object = CalcObjectRates(state.X_o, state.X_o_dot);
  SetState(state.q, state.xi, object.X_Bo, object.V_Bo, &coordinates);
  w_ = state.w;
  if (unreduced_ != nullptr) unreduced_->SetState(state.q, unreduced_velocity_);
  links_ = terms_.links();
}

void EngineProvider::SetState(const VectorXd& q, const VectorXd& xi, const Pose& X_Bo, const Vector6d& V_Bo,
                              const ObjectCoordinates* coordinates, const EvaluatedPositions& evaluated) {
  xi_ = xi;
  terms_.SetState(q, xi, X_Bo, V_Bo, evaluated);
  for (size_t i = 0; i < frames_.size(); ++i) terms_.CalcFrameColumns(frames_[i], columns_[i]);
  energy_ = terms_.energy_and_momentum();
  if (has_object_) ReadObject(coordinates);
}

void EngineProvider::ReadObject(const ObjectCoordinates* coordinates) {
  const Pose X = terms_.ObjectPose();
  object_.pose = X.matrix().topRows<3>();
  object_.V_Bo = terms_.ObjectVelocity();
  object_.M_hat = terms_.ObjectInertia();
  object_.C_hat_V = terms_.ObjectCoriolis();
  object_.N_o = terms_.ObjectGravity();
  object_.kinetic = 0.5 * object_.V_Bo.dot(object_.M_hat * object_.V_Bo);
  object_.potential = (X.linear() * object_.N_o.head<3>()).dot(X.translation());
  if (coordinates == nullptr) return;
  const ObjectRates rates = CalcObjectRates(coordinates->X_o, coordinates->X_o_dot);
  object_.M_o = object_.M_hat * rates.P_inv;
  object_.C_o_X_o_dot = object_.C_hat_V + object_.M_hat * rates.bias;
}

bool EngineProvider::Has(Term term) const {
  if (term == Term::kM) return unreduced_ != nullptr;
  return term != Term::kCBar && HasValue(term);
}

bool EngineProvider::HasMass(int link) const {
  const std::vector<int>& bodies = adapter_->welded_bodies()[static_cast<size_t>(link + 1)];
  return std::ranges::any_of(bodies, [&](int body) { return adapter_->engine().body_mass[body] > 0.0; });
}

void EngineProvider::ReadJacobians(Eigen::Ref<MatrixXd> out) const {
  for (size_t i = 0; i < frames_.size(); ++i) {
    const Matrix3d R_T = (terms_.tilt().linear() * terms_.FramePose(frames_[i]).linear()).transpose();
    Eigen::Index k = 0;
    for (const int col : terms_.chain(frames_[i])) {
      const Eigen::Index to = static_cast<Eigen::Index>(i) * terms_.size() + col;
      out.col(to).head<3>() = R_T * columns_[i].col(k).head<3>();
      out.col(to).tail<3>() = R_T * columns_[i].col(k++).tail<3>();
    }
  }
}

void EngineProvider::Read(Term term, Eigen::Ref<MatrixXd> out) {
  const auto put = [&](const auto& values) { out = values; };
  switch (term) {
    case Term::kJointAxis:
      for (int i = 0; i < static_cast<int>(out.cols()); ++i) {
        const int joint = adapter_->model().joint_of_dof(i);
        out.col(i) << terms_.JointAxis(joint, i - adapter_->model().dof(joint)), terms_.JointAnchor(joint);
      }
      return;
    case Term::kLinkCom:
    case Term::kLinkInertia:
      // A fixed base, which is the first, has nothing to compare.
      for (Eigen::Index i = 1; i <= out.cols(); ++i) {
        const MassProperties& link = links_[links_.size() - static_cast<size_t>(i)];
        if (term == Term::kLinkCom) out.col(out.cols() - i) = link.com;
        if (term == Term::kLinkInertia) out.col(out.cols() - i) = link.inertia.reshaped();
      }
      return;
    case Term::kFramePose:
      for (int i = 0; i < static_cast<int>(out.cols()); ++i)
        out.col(i) = terms_.FramePose(i).matrix().topRows<3>().reshaped();
      return;
    case Term::kJ:
      return ReadJacobians(out);
    case Term::kJDotXi:
      for (size_t i = 0; i < frames_.size(); ++i) {
        const EngineMotion motion = terms_.FrameMotion(frames_[i]);
        const Matrix3d R_T = terms_.FramePose(frames_[i]).linear().transpose();
        out.col(static_cast<Eigen::Index>(i)) << R_T * motion.a, R_T * motion.alpha;
      }
      return;
    case Term::kM:
      return put(unreduced_->M());
    case Term::kMBar:
      return put(M());
    case Term::kCBarXi:
      return put(terms_.coriolis());
    case Term::kCBarProduct:
      return terms_.CalcCoriolisProduct(xi_, w_, out.col(0));
    case Term::kGravity:
      return put(terms_.gravity());
    case Term::kBias:
      return put(terms_.coriolis() + terms_.gravity());
    case Term::kFriction:
      return put(terms_.friction());
    default:
      ReadValues(term, out);
  }
}

ObjectRates CalcObjectRates(const Vector6d& X_o, const Vector6d& X_o_dot) {
  // Quaternion z(alpha) y(beta) z(gamma). Each angle's rate turns about its axis; the later rotations carry
  // that axis along, and move it: d/dt (S^T w) = S^T w_dot - rate axis x S^T w for S a turn about `axis`.
  const mjtNum axes[3][3] = {{0, 0, 1}, {0, 1, 0}, {0, 0, 1}};
  mjtNum rotation[4] = {1, 0, 0, 0};
  Matrix3d W = Matrix3d::Zero();      // columns: the axes of the three angles
  Vector3d omega = Vector3d::Zero();  // W times the rates
  Vector3d omega_dot = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    mjtNum step[4];
    mjtNum inverse[4];
    mju_axisAngle2Quat(step, axes[k], X_o[3 + k]);
    mju_mulQuat(rotation, rotation, step);
    mju_negQuat(inverse, step);
    const auto turn = [&](const Vector3d& vector) {
      Vector3d turned;
      mju_rotVecQuat(turned.data(), vector.data(), inverse);
      return turned;
    };
    const Vector3d axis(axes[k][0], axes[k][1], axes[k][2]);
    for (int col = 0; col < k; ++col) W.col(col) = turn(W.col(col));
    W.col(k) = axis;
    omega = turn(omega);
    omega_dot = turn(omega_dot) - X_o_dot[3 + k] * axis.cross(omega);
    omega += X_o_dot[3 + k] * axis;
  }
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R;
  mju_quat2Mat(R.data(), rotation);
  ObjectRates rates;
  rates.P_inv.topLeftCorner<3, 3>() = R.transpose();
  rates.P_inv.bottomRightCorner<3, 3>() = W;
  const Vector3d v = R.transpose() * X_o_dot.head<3>();
  rates.bias << -omega.cross(v), omega_dot;
  // Rounding is taken out of the quaternion first.
  mju_normalize4(rotation);
  mju_quat2Mat(R.data(), rotation);
  rates.X_Bo.linear() = R;
  rates.X_Bo.translation() = X_o.head<3>();
  rates.V_Bo << R.transpose() * X_o_dot.head<3>(), omega;
  return rates;
}

}  // namespace dexcheck
