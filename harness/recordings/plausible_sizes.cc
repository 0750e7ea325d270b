#include "harness/recordings/plausible_sizes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace dexcheck {
namespace {

constexpr double kG = 9.81;  // m/s^2
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// The table of kinds: the largest that an amplitude (with its nominal value; of the world's kinds the norm
/// of all) can plausibly be. @param joint that it is of; -1 for none.
double FindMost(const RobotModel& model, const MotionExtents& extents, double shaking,
                const TorqueFault& fault, const TorqueColumn& column, int joint) {
  // Slower or nearer than this a motion tells no rate.
  constexpr double kSlow = 0.1, kNear = 0.01;
  constexpr double kGravityError = 1.02, kForce = 300.0, kMostGain = 1100.0, kLatest = 0.5, kAngle = 0.3;
  constexpr double kPlay = 0.2, kSmallPlay = 0.02;  // rad, m
  const bool is_recorded = joint >= 0 && extents.torque.size() > 0;
  double torque = kInfinite;
  if (is_recorded) torque = extents.torque[joint];
  const bool turns = joint < 0 || model.joint(joint).type == JointType::kRevolute;
  const double width = joint < 0 ? kInfinite : model.joint(joint).upper - model.joint(joint).lower;
  using enum TorqueFault::Kind;
  switch (fault.kind) {
    case kDryFriction:
    case kAllDry:
    case kStribeckFriction:
    case kOffset:
    case kAllOffsets:
      return torque;
    case kViscousFriction:
    case kAllFriction: {
      const bool is_viscous = column.kind == TorqueColumn::kViscous && is_recorded;
      return is_viscous ? torque / std::max(kSlow, extents.speed[joint]) : torque;
    }
    case kSpring:
      return column.kind == TorqueColumn::kAngle && is_recorded
                 ? torque / std::max(kNear, extents.span[joint])
                 : kInfinite;
    case kArmature:
      return is_recorded ? torque / std::max(kSlow, extents.acceleration[joint]) : kInfinite;
    case kLoadFriction:
      return 1.0;
    case kTorqueGain:
      return kMostGain;
    case kDelay:
      return kLatest;
    case kZero:
      return std::min(turns ? kPi : 1.0, width > 0.0 ? width : kInfinite);
    case kBacklash:
      return turns ? kPlay : kSmallPlay;
    case kPayload:
      return column.component == 0
                 ? std::accumulate(model.joints().begin(), model.joints().end(), 0.0,
                                   [](double sum, const Joint& one) { return sum + one.body.mass; })
                 : kInfinite;
    case kGravity:
      return kGravityError * std::max(kG, model.gravity().norm());
    case kShaking:
      return std::min(kAngle, kG / (shaking * shaking));
    case kPush:
      return fault.push.link >= 0 ? kForce : joint >= 0 ? torque : 2.0 * kG;
    case kSaturation:
    case kMass:
    case kCentre:
    case kInertia:
      return kInfinite;  // bounded by what they are
  }
  return kInfinite;
}

}  // namespace

void LimitToPlausible(const RobotModel& model, const MotionExtents& extents, double shaking,
                      TorqueFault* fault) {
  const auto count = static_cast<Eigen::Index>(
      fault->columns.empty() ? static_cast<size_t>(fault->scale.size()) : fault->columns.size());
  const bool is_norm = fault->kind == TorqueFault::kGravity || fault->kind == TorqueFault::kShaking ||
                       fault->kind == TorqueFault::kPush;
  VectorXd nominal = VectorXd::Zero(count), most(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const bool has_column = !fault->columns.empty() && !fault->columns[static_cast<size_t>(k)].empty();
    const ColumnPart part =
        has_column ? fault->columns[static_cast<size_t>(k)].front() : ColumnPart{{TorqueColumn::kOffset}};
    const bool is_of_one = fault->kind != TorqueFault::kTorqueGain && fault->kind != TorqueFault::kDelay &&
                           fault->index < 0 && count > 1;
    const int joint = fault->kind == TorqueFault::kPush  ? fault->push.joint
                      : is_of_one                        ? part.joint
                      : fault->kind < TorqueFault::kMass ? fault->index
                                                         : -1;
    if (fault->kind < TorqueFault::kMass) nominal[k] = k == 0 ? fault->nominal : 0.0;
    if (fault->kind == TorqueFault::kGravity) nominal[k] = model.gravity()[k];
    most[k] = FindMost(model, extents, shaking, *fault, part.column, joint);
  }
  // No torque is recorded before it acts.
  if (fault->kind == TorqueFault::kDelay) fault->least = VectorXd::Constant(1, -1.5 * extents.step);
  fault->is_possible = [nominal, most, is_norm, own = fault->is_possible](const VectorXd& a) {
    const VectorXd whole = nominal + a;
    const bool is_small = is_norm ? whole.norm() <= most[0] : (whole.array().abs() <= most.array()).all();
    return is_small && (!own || own(a));
  };
}

}  // namespace dexcheck
