#include "harness/plant/disturbances.h"

#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

/// Sines that make a noise: their sum is near enough to normal.
constexpr int kNoiseSines = 32;

int FindBody(const RobotModel& model, const DisturbanceOptions& options, const std::string& source) {
  if (model.object() && (options.body == "object" || options.body == model.object()->name)) {
    return Wrench::kObject;
  }
  try {
    return model.FindLink(options.body);
  } catch (const std::invalid_argument&) {
    std::vector<std::string> names = {"object"};
    for (int i = -1; i < model.num_joints(); ++i) names.push_back(model.link_name(i));
    throw InputError(source + ": " + options.key + ".body: is no link of the robot and not the object" +
                     SuggestInBrackets(options.body, names, "") + ", got " + Quote(options.body));
  }
}

}  // namespace

Disturbances::Disturbances(std::span<const DisturbanceOptions> options, const PartContext& context)
    : robot_(*context.model) {
  for (const DisturbanceOptions& one : options) {
    sources_.push_back(
        {one, FindBody(*context.model, one, context.source), RandomStream(context.seed, one.key + ".begin"),
         RandomStream(context.seed, one.key + ".size"), RandomStream(context.seed, one.key + ".noise")});
    on_robot_ = on_robot_ || sources_.back().body != Wrench::kObject;
  }
  wrenches_.reserve(sources_.size());
}

double Disturbances::CalcShape(const Source& source, double since, std::uint64_t repetition) const {
  using Kind = DisturbanceOptions::Kind;
  const DisturbanceOptions& o = source.options;
  if (since < 0.0 || (o.duration > 0.0 && since >= o.duration)) return 0.0;
  double shape = 1.0;
  if (o.kind == Kind::kSine) {
    shape = std::sin(2.0 * kPi * o.frequency * since);
  } else if (o.kind == Kind::kNoise) {
    // sqrt(2 / n) sum cos(2 pi f_i t + phase_i), f_i spread over [0, frequency): variance 1
    shape = 0.0;
    for (std::uint64_t i = 0; i < kNoiseSines; ++i) {
      const double f = o.frequency * (static_cast<double>(i) + source.noise.Uniform(i, 0)) / kNoiseSines;
      shape += std::cos(2.0 * kPi * (f * since + source.noise.Uniform(i, 1)));
    }
    shape *= std::sqrt(2.0 / kNoiseSines);
  }
  return shape * (1.0 + o.size_within * source.size.Symmetric(repetition));
}

double Disturbances::CalcSize(size_t disturbance, double t) const {
  const Source& source = sources_[disturbance];
  const DisturbanceOptions& o = source.options;
  // A time that is off a step by rounding alone is that step's.
  constexpr double kRounding = 1e-9;
  double since = t - o.begin + kRounding;
  if (since < 0.0) return 0.0;
  std::uint64_t repetition = 0;
  if (o.period > 0.0) {
    const double count = std::floor(since / o.period);
    repetition = static_cast<std::uint64_t>(count);
    since -= count * o.period;
  }
  return CalcShape(source, since - o.begin_within * source.moment.Uniform(repetition), repetition);
}

std::span<const Wrench> Disturbances::Evaluate(double t, const MeasuredState& state) {
  wrenches_.clear();
  if (on_robot_) robot_.SetState(state.q, state.xi);
  for (size_t i = 0; i < sources_.size(); ++i) {
    const double size = CalcSize(i, t);
    if (size == 0.0) continue;
    const Source& source = sources_[i];
    const Pose X_Bb = source.body == Wrench::kObject ? state.X_Bo : robot_.CalcLinkPose(source.body);
    const Matrix3d R = source.options.in_body_frame ? Matrix3d(X_Bb.linear()) : Matrix3d::Identity();
    wrenches_.push_back({source.body, X_Bb * source.options.at, size * (R * source.options.force),
                         size * (R * source.options.torque)});
  }
  return wrenches_;
}

std::span<const Wrench> Disturbances::Evaluate(double t, const PlantReading& reading) {
  Evaluate(t, reading.state);
  if (!on_robot_) return wrenches_;
  const Pose shift = reading.X_W0 * robot_.CalcLinkPose(-1).inverse(Eigen::Isometry);
  for (Wrench& w : wrenches_) {
    if (w.body != Wrench::kObject) w.point = shift * w.point;
  }
  return wrenches_;
}

void AddRobotForce(std::span<const Wrench> wrenches, const ModelTerms& robot, Eigen::Ref<VectorXd> force) {
  const RobotModel& model = robot.model();
  const Base& base = model.base();
  const int offset = model.num_base_velocities();
  for (const Wrench& w : wrenches) {
    if (w.body == Wrench::kObject) continue;
    for (int joint = w.body; joint >= 0; joint = model.joint(joint).parent) {
      const Pose X_Bj = robot.CalcLinkPose(joint);
      const Vector3d axis = X_Bj.linear().col(2);
      const bool turns = model.joint(joint).type == JointType::kRevolute;
      // A point moves by z x (p - o), or by z, for each unit of q_i.
      force[offset + joint] +=
          turns ? axis.dot(w.torque + (w.point - X_Bj.translation()).cross(w.force)) : axis.dot(w.force);
    }
    if (offset == 0) continue;
    const Pose X_B0 = robot.CalcLinkPose(-1);
    const Vector3d moments = w.torque + (w.point - X_B0.translation()).cross(w.force);
    if (base.type == BaseType::kFloating) {
      // v along the world's axes, w about the base's.
      force.head<3>() += w.force;
      force.segment<3>(3) += X_B0.linear().transpose() * moments;
      continue;
    }
    const double moment = moments.z();
    const double forward = X_B0.linear().col(0).dot(w.force);
    if (base.type == BaseType::kPlanar) {
      force.head<3>() += Vector3d(w.force.x(), w.force.y(), moment);
    } else if (base.velocity == DriveVelocity::kTwist) {
      force.head<2>() += Vector2d(forward, moment);
    } else {
      // v = r (w_r + w_l) / 2, w = r (w_r - w_l) / b
      const double turn = moment / base.wheel_distance;
      force.head<2>() += base.wheel_radius * Vector2d(0.5 * forward + turn, 0.5 * forward - turn);
    }
  }
}

Vector6d CalcObjectWrench(std::span<const Wrench> wrenches, const Pose& X_Bo) {
  Vector6d sum = Vector6d::Zero();
  const Matrix3d R_T = X_Bo.linear().transpose();
  for (const Wrench& w : wrenches) {
    if (w.body != Wrench::kObject) continue;
    sum.head<3>() += R_T * w.force;
    sum.tail<3>() += R_T * (w.torque + (w.point - X_Bo.translation()).cross(w.force));
  }
  return sum;
}

}  // namespace dexcheck
