#include "harness/checks/model_check.h"

#include <algorithm>
#include <cmath>

namespace dexcheck {

ModelCheck::ModelCheck(const Adapter& adapter, const ModelViewFactory& make_view)
    : terms_(make_view(adapter.model(), Coordinates::kReduced)),
      unreduced_(make_view(adapter.model(), Coordinates::kUnreduced)),
      engine_(adapter, Coordinates::kReduced),
      engine_unreduced_(adapter, Coordinates::kUnreduced),
      scales_(adapter.model()),
      terms_at_w_(adapter.model()),
      scales_at_w_(adapter.model()) {
  const RobotModel& model = adapter.model();
  const int depth = model.max_depth();
  records_.resize(kTermCount);
  const auto define = [&](Term term, const char* name, double factors) {
    records_[term].name = name;
    records_[term].bound = CalcRoundingBound(depth, factors);
  };
  define(kJointAxis, "joint_axis", 1.0);
  define(kLinkCom, "link_com", 1.0);
  define(kLinkInertia, "link_inertia", 2.0);
  define(kFramePose, "frame_pose", 1.0);
  define(kJ, "J", 1.0);
  define(kJDotXi, "J_dot_xi", 3.0);
  define(kMassMatrix, "M", 2.0);
  define(kReducedMassMatrix, "M_bar", 2.0);
  define(kCoriolisForce, "C_bar_xi", 4.0);
  define(kCoriolisMatrix, "C_bar", 4.0);
  define(kGravity, "gravity", 1.0);
  define(kFriction, "friction", 2.0);
  define(kKineticEnergy, "kinetic_energy", 2.0);
  define(kPotentialEnergy, "potential_energy", 1.0);
  define(kLinearMomentum, "linear_momentum", 1.0);
  define(kAngularMomentum, "angular_momentum", 2.0);

  const int n = terms_->size();
  unreduced_velocity_.setZero(unreduced_->size());
  J_.setZero(6, n);
  J_dot_.setZero(6, n);
  J_engine_.setZero(6, n);
  force_.setZero(n);
  force_engine_.setZero(n);
}

void ModelCheck::Compare(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                         const Eigen::Ref<const VectorXd>& w, long sample) {
  sample_ = static_cast<double>(sample);
  terms_->SetState(q, xi);
  engine_.SetState(q, xi);
  scales_.SetState(terms_->terms(), q, xi);
  CompareGeometry();
  CompareFrames(xi);
  unreduced_->SetState(q, unreduced_velocity_);
  engine_unreduced_.SetState(q, unreduced_velocity_);
  CompareMassMatrices();
  CompareEnergies();
  CompareForces(xi, w, q);
}

void ModelCheck::CompareGeometry() {
  const RobotModel& model = terms_->model();
  const double length = scales_.world_length();
  // From the base outward, so that the first failure is the one that the others follow from.
  for (int i = -1; i < model.num_joints(); ++i) {
    const Pose X = terms_->CalcLinkPose(i);
    if (i >= 0) {
      const Location at_joint{Location::Kind::kJoint, i, -1};
      const Vector3d axis = X.linear().col(2);
      const Vector3d axis_engine = engine_.JointAxis(i);
      for (int k = 0; k < 3; ++k) record(kJointAxis).Compare(axis[k], axis_engine[k], 1.0, at_joint, sample_);
      if (model.joints()[static_cast<size_t>(i)].type == JointType::kRevolute) {
        // Where along the axis the anchor stands is a choice of frames: compare the foot of the
        // perpendicular.
        const Vector3d anchor = engine_.JointAnchor(i);
        const Vector3d foot = X.translation() + axis.dot(anchor - X.translation()) * axis;
        for (int k = 0; k < 3; ++k) record(kJointAxis).Compare(foot[k], anchor[k], length, at_joint, sample_);
      }
    } else if (model.base().type == BaseType::kFixed) {
      continue;  // the world carries no mass
    }
    const MassProperties& body =
        i < 0 ? model.base_with_wheels() : model.joints()[static_cast<size_t>(i)].body;
    const LinkInWorld& link = engine_.links()[static_cast<size_t>(i + 1)];
    const Location at_link{Location::Kind::kLink, i, -1};
    if (body.mass > 0.0 || link.mass > 0.0) {
      const Vector3d com = X * body.com;
      for (int k = 0; k < 3; ++k) record(kLinkCom).Compare(com[k], link.com[k], length, at_link, sample_);
    }
    const Matrix3d inertia = X.linear() * body.inertia * X.linear().transpose();
    const double scale = Positive(std::max(inertia.trace(), link.inertia.trace()));
    for (int k = 0; k < 9; ++k) {
      record(kLinkInertia).Compare(inertia.data()[k], link.inertia.data()[k], scale, at_link, sample_);
    }
  }
}

void ModelCheck::CompareFrames(const Eigen::Ref<const VectorXd>& xi) {
  const int frames = static_cast<int>(terms_->model().frames().size());
  const int n = terms_->size();
  const double acceleration = Positive(scales_.acceleration());
  const double angular_acceleration = Positive(scales_.angular_rate() * scales_.angular_rate());
  for (int frame = 0; frame < frames; ++frame) {
    const Location where{Location::Kind::kFrame, frame, -1};
    const Pose X = terms_->CalcFramePose(frame);
    const Pose X_engine = engine_.FramePose(frame);
    for (int row = 0; row < 3; ++row) {
      record(kFramePose)
          .Compare(X.translation()[row], X_engine.translation()[row], scales_.world_length(), where, sample_);
      for (int col = 0; col < 3; ++col) {
        record(kFramePose).Compare(X.linear()(row, col), X_engine.linear()(row, col), 1.0, where, sample_);
      }
    }
    terms_->CalcFrameJacobian(frame, J_, J_dot_);
    engine_.CalcFrameJacobian(frame, J_engine_);
    Vector6d bias = Vector6d::Zero();
    const Vector6d bias_engine = engine_.CalcFrameBiasAcceleration(frame);
    Vector3d omega = Vector3d::Zero();
    Vector3d velocity = Vector3d::Zero();
    for (int col = 0; col < n; ++col) {
      // The body Jacobian turned to world axes; rows of the angular part are pure numbers.
      const Vector3d linear = X.linear() * J_.col(col).head<3>();
      const Vector3d angular = X.linear() * J_.col(col).tail<3>();
      const double scale = scales_.CalcVelocityScale(col);
      for (int k = 0; k < 3; ++k) {
        record(kJ).Compare(linear[k], J_engine_(k, col), scale, where, sample_);
        record(kJ).Compare(angular[k], J_engine_(3 + k, col), Positive(scale / scales_.length()), where,
                           sample_);
      }
      omega += angular * xi[col];
      velocity += linear * xi[col];
      bias.head<3>() += X.linear() * (J_dot_.col(col).head<3>() * xi[col]);
      bias.tail<3>() += X.linear() * (J_dot_.col(col).tail<3>() * xi[col]);
    }
    // In world axes d/dt (R V) = R V_dot + omega x R V; the angular part has omega x omega = 0.
    bias.head<3>() += omega.cross(velocity);
    for (int k = 0; k < 3; ++k) {
      record(kJDotXi).Compare(bias[k], bias_engine[k], acceleration, where, sample_);
      record(kJDotXi).Compare(bias[3 + k], bias_engine[3 + k], angular_acceleration, where, sample_);
    }
  }
}

void ModelCheck::CompareMassMatrices() {
  const int n = terms_->size();
  for (int col = 0; col < n; ++col) {
    for (int row = 0; row < n; ++row) {
      record(kReducedMassMatrix)
          .Compare(terms_->M()(row, col), engine_.M()(row, col), scales_.CalcMassScale(row, col),
                   {Location::Kind::kVelocityPair, row, col}, sample_);
    }
  }
  // M of (16): its first three rows are along the world's x, y and about z; the others are M_bar's.
  const int shift = unreduced_->size() - n;
  const int base = terms_->model().num_base_positions();
  const double mass = Positive(scales_.total_mass());
  for (int col = 0; col < unreduced_->size(); ++col) {
    for (int row = 0; row < unreduced_->size(); ++row) {
      const double row_scale =
          row < base ? (row < 2 ? 1.0 : scales_.length()) : scales_.CalcVelocityScale(row - shift);
      const double col_scale =
          col < base ? (col < 2 ? 1.0 : scales_.length()) : scales_.CalcVelocityScale(col - shift);
      const double row_mass = row < base ? mass : scales_.GetSubtreeMass(row - shift);
      const double col_mass = col < base ? mass : scales_.GetSubtreeMass(col - shift);
      record(kMassMatrix)
          .Compare(unreduced_->M()(row, col), engine_unreduced_.M()(row, col),
                   Positive(std::min(row_mass, col_mass) * row_scale * col_scale),
                   {Location::Kind::kVelocityPair, std::max(row - shift, 0), std::max(col - shift, 0)},
                   sample_);
    }
  }
}

void ModelCheck::CompareForces(const Eigen::Ref<const VectorXd>& xi, const Eigen::Ref<const VectorXd>& w,
                               const Eigen::Ref<const VectorXd>& q) {
  const int n = terms_->size();
  force_.noalias() = terms_->C() * xi;
  for (int i = 0; i < n; ++i) {
    const Location where{Location::Kind::kVelocity, i, -1};
    record(kCoriolisForce)
        .Compare(force_[i], engine_.coriolis()[i], scales_.CalcCoriolisScale(i), where, sample_);
    record(kGravity).Compare(terms_->gravity()[i], engine_.gravity()[i], scales_.CalcGravityScale(i), where,
                             sample_);
    record(kFriction).Compare(terms_->friction()[i], engine_.friction()[i], scales_.CalcFrictionScale(i, xi),
                              where, sample_);
  }

  // Every entry of C_bar(xi) at once.
  force_.noalias() = terms_->C() * w;
  engine_.CalcCoriolisProduct(xi, w, force_engine_);
  // The engine's quarters of the forces at xi + w and xi - w: |xi +- w|^2 / 4 is at most (|xi|^2 + |w|^2) /
  // 2, twice.
  terms_at_w_.SetState(q, w);
  scales_at_w_.SetState(terms_at_w_, q, w);
  for (int i = 0; i < n; ++i) {
    record(kCoriolisMatrix)
        .Compare(force_[i], force_engine_[i],
                 scales_.CalcCoriolisScale(i) + scales_at_w_.CalcCoriolisScale(i),
                 {Location::Kind::kVelocity, i, -1}, sample_);
  }
}

void ModelCheck::CompareEnergies() {
  const Location whole;
  const EnergyAndMomentum& engine = engine_.energy_and_momentum();
  const EnergyAndMomentum model = terms_->CalcEnergyAndMomentum();
  const double momentum = scales_.CalcMomentumScale();
  record(kKineticEnergy)
      .Compare(model.kinetic, engine.kinetic, scales_.CalcKineticEnergyScale(), whole, sample_);
  record(kPotentialEnergy)
      .Compare(model.potential, engine.potential, scales_.CalcPotentialEnergyScale(), whole, sample_);
  for (int k = 0; k < 3; ++k) {
    record(kLinearMomentum)
        .Compare(model.linear_momentum[k], engine.linear_momentum[k], Positive(momentum), whole, sample_);
    record(kAngularMomentum)
        .Compare(model.angular_momentum[k], engine.angular_momentum[k], Positive(momentum * scales_.length()),
                 whole, sample_);
  }
}

}  // namespace dexcheck
