#include "harness/descriptions/analytic_provider.h"

#include <algorithm>

#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

const MassProperties& BodyOf(const RobotModel& model, int link) {
  return link < 0 ? model.base_with_wheels() : model.joint(link).body;
}

}  // namespace

CoordinateMap::CoordinateMap(const RobotModel& model, std::vector<int> compared)
    : positions(ListIndices(model.num_positions())),
      velocities(ListIndices(model.num_velocities())),
      joints(ListIndices(model.num_joints())),
      frames(ListIndices(model.frames().size())),
      compared_frames(std::move(compared)) {}

CoordinateMap::CoordinateMap(const RobotModel& model, const RobotModel& coordinates)
    : CoordinateMap(coordinates, ListIndices(coordinates.frames().size())) {
  is_identity = false;
  const int base = model.num_base_velocities();
  for (int i = 0; i < coordinates.num_joints(); ++i) {
    const Joint& joint = coordinates.joint(i);
    const int own = model.FindJoint(joint.name);
    joints[static_cast<size_t>(i)] = own;
    for (int k = 0; k < CountPositions(joint.type); ++k)
      positions[static_cast<size_t>(coordinates.position_index(i) + k)] = model.position_index(own) + k;
    for (int k = 0; k < CountVelocities(joint.type); ++k)
      velocities[static_cast<size_t>(base + coordinates.dof(i) + k)] = base + model.dof(own) + k;
  }
  for (size_t i = 0; i < frames.size(); ++i) frames[i] = model.FindFrame(coordinates.frames()[i].name);
  compared_frames = frames;
}

AnalyticProvider::AnalyticProvider(const RobotModel& model, std::string name, std::vector<int> frames)
    : MechanismProvider(std::move(name)), model_(&model), map_(model, std::move(frames)) {
  has_object_ = model.object().has_value();
  xi_.setZero(model.num_velocities());
  jacobians_.resize(map_.compared_frames.size());
  for (const int frame : map_.compared_frames)
    chains_.push_back(model.ListMovingEntries(model.frame(frame).link));
}

AnalyticProvider::AnalyticProvider(const RobotModel& model, std::string name, CoordinateMap map,
                                   const ModelViewFactory& make_view, ObjectFormulas object)
    : AnalyticProvider(model, std::move(name), map.compared_frames) {
  map_ = std::move(map);
  formulas_ = std::move(object);
  has_coordinates_ = has_object_;
  own_view_ = make_view(model, Coordinates::kReduced);
  unreduced_ = make_view(model, Coordinates::kUnreduced);
  view_ = own_view_.get();
  q_.setZero(model.num_positions());
  w_.setZero(xi_.size());
  unreduced_velocity_.setZero(unreduced_->size());
  own_jacobians_.assign(jacobians_.size(), {Matrix6Xd::Zero(6, xi_.size()), Matrix6Xd::Zero(6, xi_.size())});
  for (size_t i = 0; i < jacobians_.size(); ++i)
    jacobians_[i] = {&own_jacobians_[i].first, &own_jacobians_[i].second};
}

AnalyticProvider::AnalyticProvider(const RobotModel& model, std::string name,
                                   const ModelViewFactory& make_view, ObjectFormulas object)
    : AnalyticProvider(model, std::move(name), CoordinateMap(model, ListIndices(model.frames().size())),
                       make_view, std::move(object)) {}

AnalyticProvider::AnalyticProvider(const RobotSpec& robot, std::string name)
    : AnalyticProvider(std::make_shared<const RobotModel>(robot), std::move(name)) {}

AnalyticProvider::AnalyticProvider(std::shared_ptr<const RobotModel> model, std::string name)
    : AnalyticProvider(*model, std::move(name)) {
  own_model_ = std::move(model);
}

AnalyticProvider::AnalyticProvider(const RobotModel& model, std::string name, const RobotModel& coordinates)
    : AnalyticProvider(model, std::move(name), CoordinateMap(model, coordinates), MakeModelView, {}) {}

void AnalyticProvider::SetState(const DynamicsState& state) {
  q_(map_.positions) = state.q;
  xi_(map_.velocities) = state.xi;
  if (state.w.size() > 0) w_(map_.velocities) = state.w;
  own_view_->SetState(q_, xi_);
  has_jacobians_ = false;
  ReadEnergy();
  if (has_object_) ReadObject(state);
}

void AnalyticProvider::CalcJacobians() {
  if (has_jacobians_) return;
  has_jacobians_ = true;
  for (size_t i = 0; i < own_jacobians_.size(); ++i)
    own_view_->CalcFrameJacobian(map_.compared_frames[i], own_jacobians_[i].first, own_jacobians_[i].second);
}

bool AnalyticProvider::HasMass(int link) const {
  return BodyOf(*model_, link < 0 ? link : map_.joints[static_cast<size_t>(link)]).mass > 0.0;
}

void AnalyticProvider::ReadObject(const DynamicsState& state) {
  const MassProperties& body = model_->object()->body;
  const ObjectTerms terms = formulas_.terms(body, model_->gravity(), state.X_o, state.X_o_dot);
  object_.pose = formulas_.pose(state.X_o).matrix().topRows<3>();
  object_.V_Bo = terms.V_Bo;
  object_.N_o = terms.N_o;
  object_.kinetic = CalcObjectKineticEnergy(body, terms.V_Bo);
  object_.M_o = terms.M_o;
  object_.C_o_X_o_dot = terms.C_o * state.X_o_dot;
}

bool AnalyticProvider::Has(Term term) const {
  if (term == Term::kM) return unreduced_ != nullptr;
  return HasValue(term);
}

void AnalyticProvider::ReadVelocities(const Eigen::Ref<const VectorXd>& own, Eigen::Ref<MatrixXd> out) const {
  if (map_.is_identity) {
    out = own;
    return;
  }
  for (Eigen::Index i = 0; i < out.size(); ++i) out(i, 0) = own[map_.velocities[static_cast<size_t>(i)]];
}

void AnalyticProvider::ReadMatrix(const MatrixXd& own, Eigen::Ref<MatrixXd> out) const {
  if (map_.is_identity) {
    out = own;
  } else if (own.rows() == xi_.size()) {
    out = own(map_.velocities, map_.velocities);
  } else {
    // In unreduced coordinates the base has other entries, and the joints the same.
    const auto shift = static_cast<int>(own.rows() - xi_.size());
    std::vector<int> places = ListIndices(own.rows());
    for (int i = model_->num_base_velocities(); i < static_cast<int>(xi_.size()); ++i)
      places[static_cast<size_t>(i + shift)] = map_.velocities[static_cast<size_t>(i)] + shift;
    out = own(places, places);
  }
}

void AnalyticProvider::ReadJacobians(Eigen::Ref<MatrixXd> out) const {
  const Eigen::Index n = xi_.size();
  for (size_t i = 0; i < jacobians_.size(); ++i) {
    const Eigen::Index first = static_cast<Eigen::Index>(i) * n;
    if (map_.is_identity) {
      out.middleCols(first, n) = *jacobians_[i].first;
    } else {
      out.middleCols(first, n) = (*jacobians_[i].first)(Eigen::all, map_.velocities);
    }
  }
}

void AnalyticProvider::ReadAccelerations(Eigen::Ref<MatrixXd> out) const {
  for (size_t i = 0; i < jacobians_.size(); ++i) {
    const auto& [J, J_dot] = jacobians_[i];
    Vector6d V = Vector6d::Zero();
    Vector6d A = Vector6d::Zero();
    for (const int col : chains_[i]) {
      V += J->col(col) * xi_[col];
      A += J_dot->col(col) * xi_[col];
    }
    // The axes turn, too: R^T d/dt (R v) = v_dot + omega x v; omega x omega = 0.
    A.head<3>() += V.tail<3>().cross(V.head<3>());
    out.col(static_cast<Eigen::Index>(i)) = A;
  }
}

void AnalyticProvider::Read(Term term, Eigen::Ref<MatrixXd> out) {
  const RobotModel& model = *model_;
  const int first_link = model.base().type == BaseType::kFixed ? 0 : -1;
  const auto own_link = [&](Eigen::Index col) {
    const int link = static_cast<int>(col) + first_link;
    return link < 0 ? link : map_.joints[static_cast<size_t>(link)];
  };
  switch (term) {
    case Term::kJointAxis:
      for (Eigen::Index col = 0; col < out.cols(); ++col) {
        const int base = model.num_base_velocities();
        const int dof = map_.velocities[static_cast<size_t>(base + col)] - base;
        const int own = model.joint_of_dof(dof);
        const bool is_ball = model.joint(own).type == JointType::kBall;
        const Pose X = view_->CalcLinkPose(own);
        out.col(col) << X.linear().col(is_ball ? dof - model.dof(own) : 2), X.translation();
      }
      return;
    case Term::kLinkCom:
      for (Eigen::Index col = 0; col < out.cols(); ++col)
        out.col(col) = view_->CalcLinkPose(own_link(col)) * BodyOf(model, own_link(col)).com;
      return;
    case Term::kLinkInertia:
      for (Eigen::Index col = 0; col < out.cols(); ++col) {
        const Matrix3d R = view_->CalcLinkPose(own_link(col)).linear();
        const Matrix3d I = R * BodyOf(model, own_link(col)).inertia * R.transpose();
        out.col(col) = I.reshaped();
      }
      return;
    case Term::kFramePose:
      for (size_t i = 0; i < map_.frames.size(); ++i) {
        out.col(static_cast<Eigen::Index>(i)) =
            view_->CalcFramePose(map_.frames[i]).matrix().topRows<3>().reshaped();
      }
      return;
    case Term::kJ:
      CalcJacobians();
      return ReadJacobians(out);
    case Term::kJDotXi:
      CalcJacobians();
      return ReadAccelerations(out);
    case Term::kM:
      unreduced_->SetState(q_, unreduced_velocity_);
      return ReadMatrix(unreduced_->M(), out);
    case Term::kMBar:
      return ReadMatrix(view_->M(), out);
    case Term::kCBar:
      return ReadMatrix(view_->C(), out);
    case Term::kCBarXi:
      if (!map_.is_identity) return ReadVelocities(view_->C() * xi_, out);
      out.col(0).noalias() = view_->C() * xi_;
      return;
    case Term::kCBarProduct:
      return ReadVelocities(view_->C() * w_, out);
    case Term::kGravity:
      return ReadVelocities(view_->gravity(), out);
    case Term::kBias:
      return ReadVelocities(view_->C() * xi_ + view_->gravity(), out);
    case Term::kFriction:
      return ReadVelocities(view_->friction(), out);
    default:
      ReadValues(term, out);
  }
}

}  // namespace dexcheck
