#include "harness/checks/wheel_evidence.h"

#include "controller/common/text.h"
#include "controller/model/platform.h"

namespace dexcheck {
namespace {

constexpr double kWheelExplains = 0.95;
// A wheel with less than this fraction of the larger mismatch has none of its own.
constexpr double kOwn = 0.05;
constexpr std::array<double, 2> kSide = {1.0, -1.0};  // right, left

std::string Metres(double value) { return FormatNumber(value, 6) + " m"; }

}  // namespace

Vector2d WheelEvidence::CalcTwist(const VectorXd& xi) const {
  if (base_->velocity == DriveVelocity::kTwist) return xi.head<2>();
  const double r = base_->wheel_radius;
  return {0.5 * r * (xi[0] + xi[1]), r * (xi[0] - xi[1]) / base_->wheel_distance};
}

Vector2d WheelEvidence::CalcMismatch(const VectorXd& xi, const Vector2d& rates) const {
  const Vector2d twist = CalcTwist(xi);
  const double turn = 0.5 * base_->wheel_distance * twist[1];
  return Vector2d(twist[0] + turn, twist[0] - turn) - base_->wheel_radius * rates;
}

void WheelEvidence::Add(const VectorXd& xi, const Vector2d& rates) {
  const Vector2d d = CalcMismatch(xi, rates);
  const double turn = CalcTwist(xi)[1];
  squares_ += d.cwiseAbs2();
  by_rate_ += d.cwiseProduct(rates);
  rate_squares_ += rates.cwiseAbs2();
  for (size_t k = 0; k < 2; ++k) by_turn_ += d[static_cast<Eigen::Index>(k)] * (-0.5 * kSide[k] * turn);
  turn_squares_ += 0.5 * turn * turn;
}

std::string WheelEvidence::Tell() const {
  if (!has_any()) return {};
  // The distance is one number, the radii are two: what it explains needs no other.
  const double by_distance = turn_squares_ > 0.0 ? by_turn_ * by_turn_ / turn_squares_ / squares_.sum() : 0.0;
  if (by_distance >= kWheelExplains) {
    return "the wheels are " + Metres(base_->wheel_distance + by_turn_ / turn_squares_) +
           " apart instead of " + Metres(base_->wheel_distance);
  }
  std::string text;
  const std::array<const std::string*, 2> names = {&base_->wheel_joint_right, &base_->wheel_joint_left};
  for (size_t k = 0; k < 2; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    if (!(squares_[i] > kOwn * squares_.maxCoeff()) || !(rate_squares_[i] > 0.0)) continue;
    const double radius = base_->wheel_radius + by_rate_[i] / rate_squares_[i];
    text += (text.empty() ? "wheel " : ", wheel ") + *names[k] + " rolls with a radius of " + Metres(radius) +
            " instead of " + Metres(base_->wheel_radius);
  }
  return text;
}

}  // namespace dexcheck
