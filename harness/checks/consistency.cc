#include "harness/checks/consistency.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <random>

#include "harness/checks/model_check.h"
#include "harness/checks/object_check.h"

namespace dexcheck {
namespace {

/// Uniform numbers that are the same on every platform and standard library.
class UniformSource {
 public:
  explicit UniformSource(std::uint64_t seed) : bits_(seed) {}

  double Draw(double low, double high) {
    constexpr double kUnit = 0x1.0p-53;
    return low + (high - low) * static_cast<double>(bits_() >> 11) * kUnit;
  }

 private:
  std::mt19937_64 bits_;
};

void DrawPositions(const RobotModel& model, const ConsistencyOptions& options, UniformSource* source,
                   VectorXd* q) {
  const int offset = model.num_base_positions();
  if (offset == 3) {
    for (int i = 0; i < 2; ++i) (*q)[i] = source->Draw(-options.area, options.area);
    (*q)[2] = source->Draw(-kPi, kPi);
  }
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joints()[static_cast<size_t>(i)];
    (*q)[offset + i] = source->Draw(joint.lower, joint.upper);
  }
}

void DrawVelocity(const RobotModel& model, const ConsistencyOptions& options, UniformSource* source,
                  VectorXd* xi) {
  const auto draw = [&](double limit) { return source->Draw(-limit, limit); };
  const int base = model.num_base_velocities();
  for (int i = 0; i < base; ++i) {
    const bool linear = base == 3 ? i < 2 : i == 0;
    (*xi)[i] = draw(linear ? options.linear_speed : options.joint_speed);
  }
  if (base == 2 && model.base().velocity == DriveVelocity::kWheelRates) {
    const double forward = (*xi)[0] / model.base().wheel_radius;
    const double turn = 0.5 * model.base().wheel_distance / model.base().wheel_radius * (*xi)[1];
    (*xi)[0] = forward + turn;
    (*xi)[1] = forward - turn;
  }
  for (int i = 0; i < model.num_joints(); ++i) {
    const bool revolute = model.joints()[static_cast<size_t>(i)].type == JointType::kRevolute;
    (*xi)[base + i] = draw(revolute ? options.joint_speed : options.linear_speed);
  }
}

void DrawObject(const ConsistencyOptions& options, UniformSource* source, Vector6d* X_o, Vector6d* X_o_dot) {
  constexpr double kHeight = 2.0;
  *X_o << source->Draw(-options.area, options.area), source->Draw(-options.area, options.area),
      source->Draw(0.0, kHeight), source->Draw(-kPi, kPi), source->Draw(-kPi, kPi), source->Draw(-kPi, kPi);
  for (int i = 0; i < 6; ++i) {
    const double limit = i < 3 ? options.linear_speed : options.joint_speed;
    (*X_o_dot)[i] = source->Draw(-limit, limit);
  }
}

}  // namespace

bool ConsistencyResult::Agrees() const {
  const auto good = [](const CheckRecord& record) { return !record.failed; };
  return std::all_of(gate.records.begin(), gate.records.end(), good) &&
         std::all_of(terms.begin(), terms.end(), good);
}

ConsistencyResult CheckConsistency(const Adapter& adapter, const ConsistencyOptions& options,
                                   const std::function<bool(long)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  const RobotModel& model = adapter.model();
  ConsistencyResult result;
  result.gate = RunStaticGate(adapter);

  ModelCheck check(adapter);
  std::optional<ObjectCheck> object_check;
  if (model.object()) object_check.emplace(adapter);
  UniformSource source(options.seed);
  VectorXd q = VectorXd::Zero(model.num_positions());
  VectorXd xi = VectorXd::Zero(model.num_velocities());
  VectorXd w = VectorXd::Zero(model.num_velocities());
  Vector6d X_o = Vector6d::Zero();
  Vector6d X_o_dot = Vector6d::Zero();
  bool go_on = true;
  while (go_on && result.samples < options.samples) {
    const long sample = result.samples++;
    DrawPositions(model, options, &source, &q);
    DrawVelocity(model, options, &source, &xi);
    DrawVelocity(model, options, &source, &w);
    check.Compare(q, xi, w, sample);
    if (object_check) {
      DrawObject(options, &source, &X_o, &X_o_dot);
      object_check->Compare(X_o, X_o_dot, sample);
    }
    go_on = progress(result.samples);
  }
  result.terms = check.records();
  if (object_check) {
    result.terms.insert(result.terms.end(), object_check->records().begin(), object_check->records().end());
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace dexcheck
