#include "harness/checks/signal_evidence.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "controller/common/text.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

// One number that explains this much of the squares says all; what is left is rounding, or the first steps.
constexpr double kNumberExplains = 0.98;
// Readings' differences below this are rounding of packing them.
constexpr double kSignalRounding = 1e-15;
// Of entries that differ, this fraction is "all" of them.
constexpr double kMost = 0.5;

std::string FourDigits(double value) { return FormatNumber(value, 4); }

/// In words, of a signal in `unit`. Empty when no single number explains it.
std::string Describe(const SignalFinding& finding, const std::string& unit, double time_step) {
  using Kind = SignalFinding::Kind;
  switch (finding.kind) {
    case Kind::kGain:
      return FourDigits(finding.value) + " times";
    case Kind::kOffset:
      return FourDigits(std::abs(finding.value)) + " " + unit +
             (finding.value > 0.0 ? " more than" : " less than");
    case Kind::kDelay:
      return FourDigits(finding.value) + (finding.value == 1.0 ? " step (" : " steps (") +
             FourDigits(1e3 * finding.value * time_step) + " ms) after";
    case Kind::kLag:
      return FourDigits(finding.value) + " of the way a step (" +
             FourDigits(-1e3 * time_step / std::log1p(-std::min(finding.value, 0.999999))) + " ms) towards";
    case Kind::kDryFriction:
      return FourDigits(finding.value) + " " + unit + " of dry friction less than";
    case Kind::kDamping:
      return FourDigits(finding.value) + " " + unit + " s/rad of damping less than";
    case Kind::kNone:
      break;
  }
  return {};
}

}  // namespace

SignalEvidence::SignalEvidence(Eigen::Index size) {
  for (VectorXd* vector : {&difference_, &squares_, &largest_, &by_meant_, &meant_squares_, &by_sign_,
                           &by_rate_, &rate_squares_, &lag_by_, &lag_squares_, &lag_change_, &before_}) {
    vector->setZero(size);
  }
  history_.setZero(size, kMostDelay + 1);
  delay_left_.setZero(size, kMostDelay + 1);
  squares_before_ = delay_left_;
  step_difference_.setZero(size);
}

void SignalEvidence::Add(const VectorXd& meant, const VectorXd& got, const VectorXd& rate) {
  // Until something differs there is nothing to explain, and what was right before says nothing of how.
  const bool is_right = steps_ == 0 && got == meant;
  if (!is_right) Compare(meant, got, rate);
  history_.col(seen_ % (kMostDelay + 1)) = meant;
  before_ = got;
  ++seen_;
  if (seen_ <= kMostDelay) squares_before_.col(seen_) = squares_;
}

void SignalEvidence::Compare(const VectorXd& meant, const VectorXd& got, const VectorXd& rate) {
  const Eigen::Map<const Eigen::ArrayXd> m(meant.data(), meant.size()), g(got.data(), got.size());
  Eigen::ArrayXd& d = step_difference_;
  d = g - m;
  difference_.array() += d;
  squares_.array() += d.square();
  largest_ = largest_.array().max(d.abs());
  by_meant_.array() += d * m;
  meant_squares_.array() += m.square();
  by_sign_.array() += (m > 0.0).select(d, -d);
  if (rate.size() > 0) {
    by_rate_.array() += d * rate.array();
    rate_squares_.array() += rate.array().square();
  }
  for (long k = 1; k <= std::min(seen_, kMostDelay); ++k)
    delay_left_.col(k) += (g - history_.col((seen_ - k) % (kMostDelay + 1)).array()).square();
  if (seen_ > 0) {
    lag_by_.array() += (m - before_.array()) * (g - before_.array());
    lag_squares_.array() += (m - before_.array()).square();
    lag_change_.array() += (g - before_.array()).square();
  }
  ++steps_;
}

std::vector<Eigen::Index> SignalEvidence::ListDifferent(const VectorXd& weight) const {
  std::vector<Eigen::Index> different;
  for (Eigen::Index i = 0; i < squares_.size(); ++i) {
    if (largest_[i] > kSignalRounding * std::max(1.0, std::sqrt(meant_squares_[i]))) different.push_back(i);
  }
  std::sort(different.begin(), different.end(), [&](Eigen::Index a, Eigen::Index b) {
    return weight[a] * squares_[a] > weight[b] * squares_[b];
  });
  return different;
}

SignalFinding SignalEvidence::Fit(Eigen::Index begin, Eigen::Index count) const {
  using Kind = SignalFinding::Kind;
  const double all = squares_.segment(begin, count).sum();
  SignalFinding best;
  if (!(all > 0.0)) return best;
  const auto offer = [&](Kind kind, double value, double explained) {
    if (explained > best.explained) best = {kind, value, explained};
  };
  const auto slope = [&](Kind kind, double product, double square, double base, double sign) {
    if (square > 0.0) offer(kind, base + sign * product / square, product * product / square / all);
  };
  const double steps = static_cast<double>(steps_ * count);
  slope(Kind::kGain, by_meant_.segment(begin, count).sum(), meant_squares_.segment(begin, count).sum(), 1.0,
        1.0);
  slope(Kind::kOffset, difference_.segment(begin, count).sum(), steps, 0.0, 1.0);
  // Friction gives less, never more.
  const double by_sign = std::min(0.0, by_sign_.segment(begin, count).sum());
  const double by_rate = std::min(0.0, by_rate_.segment(begin, count).sum());
  slope(Kind::kDryFriction, by_sign, steps, 0.0, -1.0);
  slope(Kind::kDamping, by_rate, rate_squares_.segment(begin, count).sum(), 0.0, -1.0);
  for (long k = 1; k <= kMostDelay; ++k) {
    // Of steps whose delayed value is known.
    const double square =
        (squares_.array() - squares_before_.col(std::min(k, seen_))).segment(begin, count).sum();
    if (square > 0.0) {
      offer(Kind::kDelay, static_cast<double>(k),
            1.0 - delay_left_.col(k).segment(begin, count).sum() / square);
    }
  }
  const double by = lag_by_.segment(begin, count).sum();
  const double square = lag_squares_.segment(begin, count).sum();
  if (square > 0.0) {
    const double fraction = by / square;
    const double left = lag_change_.segment(begin, count).sum() - fraction * by;
    if (0.0 < fraction && fraction < 1.0) offer(Kind::kLag, fraction, 1.0 - left / all);
  }
  if (best.explained < kNumberExplains) best.kind = Kind::kNone;
  return best;
}

MotorEvidence::MotorEvidence(const RobotModel& model, double time_step)
    : time_step_(time_step), evidence_(model.num_velocities()) {
  const Base& base = model.base();
  for (int i = 0; i < model.num_base_velocities(); ++i) {
    const bool wheels = base.type == BaseType::kDifferentialDrive;
    names_.push_back(wheels ? (i == 0 ? base.wheel_joint_right : base.wheel_joint_left) : base.link);
  }
  for (const Joint& joint : model.joints()) names_.push_back(joint.name);
}

void MotorEvidence::Add(const VectorXd& sent, const VectorXd& received, const VectorXd& xi) {
  evidence_.Add(sent, received, xi);
}

std::string MotorEvidence::Tell() const {
  const std::vector<Eigen::Index> different =
      evidence_.ListDifferent(VectorXd::Ones(static_cast<Eigen::Index>(names_.size())));
  if (different.empty()) return {};
  if (static_cast<double>(different.size()) > kMost * static_cast<double>(names_.size())) {
    const std::string how = Describe(evidence_.FindCommon(), "N m", time_step_);
    const std::string& worst = names_[static_cast<size_t>(different.front())];
    return how.empty() ? "most motors differ, motor " + worst + " by up to " +
                             FourDigits(evidence_.largest(different.front())) + " N m"
                       : "all motors give " + how + " what was sent";
  }
  std::string text;
  constexpr size_t kMostNamed = 3;
  for (size_t i = 0; i < std::min(different.size(), kMostNamed); ++i) {
    const std::string how = Describe(evidence_.Find(different[i]), "N m", time_step_);
    text +=
        (i == 0 ? "motor " : ", motor ") + names_[static_cast<size_t>(different[i])] +
        (how.empty() ? " is up to " + FourDigits(evidence_.largest(different[i])) + " N m off what was sent"
                     : " gives " + how + " what was sent");
  }
  if (different.size() > kMostNamed)
    text += " and " + std::to_string(different.size() - kMostNamed) + " more";
  return text;
}

SensorEvidence::SensorEvidence(const RobotModel& model, const std::vector<int>& fingertips, double time_step)
    : time_step_(time_step),
      evidence_(model.num_positions() + model.num_velocities() + 12 +
                2 * static_cast<Eigen::Index>(fingertips.size())) {
  const auto add = [&](const std::string& name, const char* unit) {
    names_.push_back(name);
    units_.push_back(unit);
  };
  if (model.num_base_positions() == 3) {
    add("x of the base", "m");
    add("y of the base", "m");
    add("heading of the base", "rad");
  }
  for (const Joint& joint : model.joints())
    add("position of joint " + joint.name, joint.type == JointType::kRevolute ? "rad" : "m");
  for (int i = 0; i < model.num_base_velocities(); ++i)
    add("velocity " + std::to_string(i) + " of the base", "1/s");
  for (const Joint& joint : model.joints())
    add("rate of joint " + joint.name, joint.type == JointType::kRevolute ? "rad/s" : "m/s");
  for (const char* axis : {"x", "y", "z"}) add(std::string("place of the object, ") + axis, "m");
  for (const char* axis : {"x", "y", "z"}) add(std::string("orientation of the object, ") + axis, "rad");
  for (const char* axis : {"x", "y", "z"}) add(std::string("velocity of the object, ") + axis, "m/s");
  for (const char* axis : {"x", "y", "z"})
    add(std::string("angular velocity of the object, ") + axis, "rad/s");
  for (const int tip : fingertips) {
    const std::string& name = model.frames()[static_cast<size_t>(tip)].name;
    add("contact of " + name + " on the object, u", "rad");
    add("contact of " + name + " on the object, v", "rad");
  }
  measured_.setZero(static_cast<Eigen::Index>(names_.size()));
  truth_ = measured_;
}

void SensorEvidence::Pack(const MeasuredState& state, const MeasuredState& truth, VectorXd* entries) const {
  const Eigen::Index p = state.q.size();
  const Eigen::Index n = state.xi.size();
  *entries << state.q, state.xi, state.X_Bo.translation(), Vector3d::Zero(), state.V_Bo,
      VectorXd::Zero(entries->size() - p - n - 12);
  // Of the orientation, the rotation from the truth: log(R_truth^T R_told).
  const Matrix3d R = truth.X_Bo.linear().transpose() * state.X_Bo.linear();
  entries->segment<3>(p + n + 3) << 0.5 * (R(2, 1) - R(1, 2)), 0.5 * (R(0, 2) - R(2, 0)),
      0.5 * (R(1, 0) - R(0, 1));
  for (size_t i = 0; i < state.kappa.size(); ++i) {
    const auto row = p + n + 12 + 2 * static_cast<Eigen::Index>(i);
    (*entries)[row] = state.kappa[i].alpha_o.u;
    (*entries)[row + 1] = state.kappa[i].alpha_o.v;
  }
}

void SensorEvidence::Add(const MeasuredState& told, const MeasuredState& truth) {
  Pack(told, truth, &measured_);
  Pack(truth, truth, &truth_);
  evidence_.Add(truth_, measured_, none_);
}

std::string SensorEvidence::Tell() const {
  const std::vector<Eigen::Index> different = evidence_.ListDifferent(VectorXd::Ones(truth_.size()));
  if (different.empty()) return {};
  const SignalFinding common = evidence_.FindCommon();
  if (different.size() > 1 && common.kind == SignalFinding::Kind::kDelay) {
    return "everything is told " + Describe(common, "", time_step_) + " it was so";
  }
  std::string text;
  constexpr size_t kMostNamed = 3;
  for (size_t i = 0; i < std::min(different.size(), kMostNamed); ++i) {
    const auto entry = static_cast<size_t>(different[i]);
    const std::string how = Describe(evidence_.Find(different[i]), units_[entry], time_step_);
    text += (i == 0 ? "" : ", ") + names_[entry] + " is told " +
            (how.empty() ? "up to " + FourDigits(evidence_.largest(different[i])) + " " + units_[entry] +
                               " off what it is"
                         : how + " what it is");
  }
  if (different.size() > kMostNamed)
    text += " and " + std::to_string(different.size() - kMostNamed) + " more";
  return text;
}

}  // namespace dexcheck
