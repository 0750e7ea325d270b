#include "harness/comparison/rounding_scales.h"

#include <cmath>

#include "harness/base/worst.h"
#include "harness/descriptions/random_states.h"

namespace dexcheck {
namespace {

// Rounding errors of one joint's step outward, in eps of the coordinates' size: a rotation of three products
// and sums per entry on either side, and the engine's normalised quaternion. Joints add up.
constexpr double kErrorsPerJoint = 16.0;

double RowReach(const Joint& joint) {
  const double slide =
      joint.type == JointType::kPrismatic ? Worst(std::abs(joint.lower), std::abs(joint.upper)) : 0.0;
  return joint.X_PB.translation().norm() + std::abs(joint.mdh.a) + std::abs(joint.mdh.d) + slide;
}

/// Farthest that a point of the robot (centres of mass, frames) can be from Sigma_0's origin, over all
/// postures.
double CalcReach(const RobotModel& model) {
  std::vector<double> reach(static_cast<size_t>(model.num_joints()) + 1, 0.0);
  double farthest = model.base_with_wheels().com.norm() + 0.5 * model.base().wheel_distance;
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joint(i);
    double& mine = reach[static_cast<size_t>(i + 1)];
    mine = reach[static_cast<size_t>(joint.parent + 1)] + RowReach(joint);
    farthest = Worst(farthest, mine + joint.body.com.norm());
  }
  for (const Frame& frame : model.frames()) {
    farthest = Worst(farthest, reach[static_cast<size_t>(frame.link + 1)] + frame.X_LF.translation().norm());
  }
  return farthest;
}

/// Returns the length of an arm, m. An arm is the difference of points in the world, with a few rounding
/// errors of their coordinates' size, however short it is; a bound allows as many of the arm's own per joint
/// of a chain.
double CalcArm(const RobotModel& model, double reach) {
  constexpr double kErrorsOfWorld = 4.0;
  double world = reach + model.base().X_B0.translation().norm();
  if (model.base().type != BaseType::kFixed) world += std::sqrt(3.0) * StateRange{}.area;
  const double arm = Worst(reach, kErrorsOfWorld * world / (kErrorsPerJoint * (model.max_depth() + 1)));
  if (arm > 0.0) return arm;
  // All points coincide: an inertia has the arm at which its mass would have it.
  double squared = 0.0;
  for (int i = 0; i < model.num_joints(); ++i) {
    const MassProperties& body = model.joint(i).body;
    if (body.mass > 0.0) squared = Worst(squared, body.inertia.trace() / body.mass);
  }
  return squared > 0.0 ? std::sqrt(squared) : 1.0;
}

}  // namespace

double CalcRoundingBound(int depth, double factors) {
  return factors * kErrorsPerJoint * (depth + 1) * std::numeric_limits<double>::epsilon();
}

double CalcInertiaScale(double mass, const Matrix3d& a, const Matrix3d& b) {
  constexpr double kPoint = 1e-9;  // m
  return Positive(Worst(a.trace(), b.trace(), mass * kPoint * kPoint));
}

RoundingScales::RoundingScales(const RobotModel& model)
    : model_(&model),
      base_velocities_(model.num_base_velocities()),
      reach_(CalcReach(model)),
      arm_(CalcArm(model, reach_)) {
  squared_rate_.assign(static_cast<size_t>(model.num_joints()) + 1, 0.0);
  subtree_mass_.assign(static_cast<size_t>(model.num_joints()) + 1, 0.0);
  // An inertia that no mass within reach has counts as the mass that would have it at this arm.
  const auto count_mass = [this](const MassProperties& body) {
    return Worst(body.mass, body.inertia.trace() / (arm_ * arm_));
  };
  subtree_mass_[0] = model.base().type == BaseType::kFixed ? 0.0 : count_mass(model.base_with_wheels());
  for (int i = model.num_joints() - 1; i >= 0; --i) {
    const Joint& joint = model.joint(i);
    subtree_mass_[static_cast<size_t>(i + 1)] += count_mass(joint.body);
    subtree_mass_[static_cast<size_t>(joint.parent + 1)] += subtree_mass_[static_cast<size_t>(i + 1)];
    rotors_ += CountVelocities(joint.type) * joint.armature;
  }
}

void RoundingScales::SetState(const ModelTerms& terms, const Eigen::Ref<const VectorXd>& q,
                              const Eigen::Ref<const VectorXd>& xi) {
  world_length_ = reach_ + model_->base().X_B0.translation().norm();
  if (model_->num_base_positions() == 3) world_length_ += q.head<2>().norm();
  if (model_->base().type == BaseType::kFloating) world_length_ += q.head<3>().norm();
  world_length_ = Positive(world_length_);  // all may lie at the origin

  base_velocity_ = terms.CalcLinkVelocity(-1);
  double sliding = base_velocity_.head<3>().squaredNorm();
  squared_rate_[0] = base_velocity_.tail<3>().squaredNorm();
  double fastest = squared_rate_[0];
  for (int i = 0; i < model_->num_joints(); ++i) {
    const Joint& joint = model_->joint(i);
    const double squared =
        xi.segment(base_velocities_ + model_->dof(i), CountVelocities(joint.type)).squaredNorm();
    double& rate = squared_rate_[static_cast<size_t>(i + 1)];
    rate = squared_rate_[static_cast<size_t>(joint.parent + 1)];
    (joint.type == JointType::kPrismatic ? sliding : rate) += squared;
    fastest = Worst(fastest, rate);
  }
  angular_rate_ = std::sqrt(fastest);
  linear_rate_ = std::sqrt(sliding) + angular_rate_ * arm_;
}

double RoundingScales::CalcVelocityScale(int coordinate) const {
  if (coordinate >= base_velocities_) return JointOf(coordinate).type == JointType::kPrismatic ? 1.0 : arm_;
  if (base_velocities_ == 6) return coordinate < 3 ? 1.0 : arm_;
  if (base_velocities_ == 3) return coordinate < 2 ? 1.0 : arm_;
  if (model_->base().velocity == DriveVelocity::kTwist) return coordinate == 0 ? 1.0 : arm_;
  return 0.5 * model_->base().wheel_radius +
         model_->base().wheel_radius / model_->base().wheel_distance * arm_;
}

const Joint& RoundingScales::JointOf(int coordinate) const {
  return model_->joint(model_->joint_of_dof(coordinate - base_velocities_));
}

double RoundingScales::GetSubtreeMass(int coordinate) const {
  if (coordinate < base_velocities_) return subtree_mass_[0];
  return subtree_mass_[static_cast<size_t>(model_->joint_of_dof(coordinate - base_velocities_) + 1)];
}

double RoundingScales::CalcMassScale(int row, int col) const {
  const double mass = std::min(GetSubtreeMass(row), GetSubtreeMass(col));
  const double armature = row == col && row >= base_velocities_ ? JointOf(row).armature : 0.0;
  return Positive(mass * CalcVelocityScale(row) * CalcVelocityScale(col) + armature);
}

VectorXd RoundingScales::CalcLeastForces() const {
  constexpr double kLeast = 1e-3;
  VectorXd forces = VectorXd::Zero(model_->num_velocities());
  for (int i = base_velocities_; i < forces.size(); ++i) forces[i] = kLeast * CalcGravityScale(i);
  return forces;
}

double RoundingScales::CalcGravityScale(int coordinate) const {
  return Positive(GetSubtreeMass(coordinate) * CalcVelocityScale(coordinate) * model_->gravity().norm());
}

double RoundingScales::acceleration() const {
  return linear_rate_ * Worst(angular_rate_, linear_rate_ / arm_);
}

double RoundingScales::CalcCoriolisScale(int coordinate) const {
  return Positive(GetSubtreeMass(coordinate) * CalcVelocityScale(coordinate) * acceleration());
}

double RoundingScales::CalcFrictionScale(int coordinate, const Eigen::Ref<const VectorXd>& xi) const {
  if (coordinate >= base_velocities_) return Positive(JointOf(coordinate).damping * std::abs(xi[coordinate]));
  if (model_->base().type != BaseType::kDifferentialDrive) return 1.0;
  // K^T D K v with K of size velocity / r: the two wheels' parts may cancel.
  const double r = model_->base().wheel_radius;
  const double arm = 0.5 * model_->base().wheel_distance;
  const double wheel_rate = (base_velocity_.head<3>().norm() + arm * base_velocity_.tail<3>().norm()) / r;
  return Positive(2.0 * model_->base().wheel.damping * wheel_rate * CalcVelocityScale(coordinate) / r);
}

double RoundingScales::CalcKineticEnergyScale() const {
  return Positive(CalcMomentumScale() * linear_rate_ + rotors_ * angular_rate_ * angular_rate_);
}

double RoundingScales::CalcPotentialEnergyScale() const {
  return Positive(total_mass() * model_->gravity().norm() * world_length_);
}

}  // namespace dexcheck
