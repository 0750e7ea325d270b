#include "harness/descriptions/random_states.h"

#include <algorithm>
#include <cmath>

namespace dexcheck {

StateSource::StateSource(const RobotModel& model, const StateRange& range, std::uint64_t seed)
    : model_(&model), range_(range), bits_(seed) {}

double StateSource::Draw(double low, double high) {
  constexpr double kUnit = 0x1.0p-53;
  return low + (high - low) * static_cast<double>(bits_() >> 11) * kUnit;
}

Eigen::Vector4d StateSource::DrawTurn(double widest) {
  // A uniformly distributed direction, by its height and longitude.
  const double z = Draw(-1.0, 1.0);
  const double longitude = Draw(-kPi, kPi);
  const double half = 0.5 * Draw(0.0, widest);
  const double level = std::sqrt(1.0 - z * z);
  return {std::cos(half), std::sin(half) * level * std::cos(longitude),
          std::sin(half) * level * std::sin(longitude), std::sin(half) * z};
}

void StateSource::DrawPositions(VectorXd* q) {
  const int offset = model_->num_base_positions();
  if (offset == 3) {
    for (int i = 0; i < 2; ++i) (*q)[i] = Draw(-range_.area, range_.area);
    (*q)[2] = Draw(-kPi, kPi);
  }
  if (model_->base().type == BaseType::kFloating) {
    for (int i = 0; i < 3; ++i) (*q)[i] = Draw(-range_.area, range_.area);
    // A uniformly distributed rotation [Shoemake, Uniform random rotations, Graphics Gems III, 1992].
    const double u = Draw(0.0, 1.0);
    const double first = Draw(0.0, 2.0 * kPi);
    const double second = Draw(0.0, 2.0 * kPi);
    q->segment<4>(3) << std::sqrt(1.0 - u) * std::sin(first), std::sqrt(1.0 - u) * std::cos(first),
        std::sqrt(u) * std::sin(second), std::sqrt(u) * std::cos(second);
  }
  for (int i = 0; i < model_->num_joints(); ++i) {
    const Joint& joint = model_->joint(i);
    const int at = model_->position_index(i);
    if (joint.type != JointType::kBall) {
      (*q)[at] = Draw(joint.lower, joint.upper);
    } else {
      q->segment<4>(at) = DrawTurn(std::min(joint.upper, kPi));
    }
  }
}

void StateSource::DrawVelocity(VectorXd* xi) {
  const auto draw = [&](double limit) { return Draw(-limit, limit); };
  const int base = model_->num_base_velocities();
  for (int i = 0; i < base; ++i) {
    const bool linear = base == 6 ? i < 3 : base == 3 ? i < 2 : i == 0;
    (*xi)[i] = draw(linear ? range_.linear_speed : range_.joint_speed);
  }
  if (base == 2 && model_->base().velocity == DriveVelocity::kWheelRates) {
    const double forward = (*xi)[0] / model_->base().wheel_radius;
    const double turn = 0.5 * model_->base().wheel_distance / model_->base().wheel_radius * (*xi)[1];
    (*xi)[0] = forward + turn;
    (*xi)[1] = forward - turn;
  }
  for (int i = 0; i < model_->num_dofs(); ++i) {
    const Joint& joint = model_->joint(model_->joint_of_dof(i));
    const bool slides = joint.type == JointType::kPrismatic;
    (*xi)[base + i] = draw(slides ? range_.linear_speed : range_.joint_speed);
  }
}

void StateSource::DrawObject(Vector6d* X_o, Vector6d* X_o_dot) {
  constexpr double kHeight = 2.0;
  for (int i = 0; i < 2; ++i) (*X_o)[i] = Draw(-range_.area, range_.area);
  (*X_o)[2] = Draw(0.0, kHeight);
  for (int i = 3; i < 6; ++i) (*X_o)[i] = Draw(-kPi, kPi);
  for (int i = 0; i < 6; ++i) {
    const double limit = i < 3 ? range_.linear_speed : range_.joint_speed;
    (*X_o_dot)[i] = Draw(-limit, limit);
  }
}

}  // namespace dexcheck
