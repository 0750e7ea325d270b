// Faults of a law that its torques are not linear in, and those that its torques show by themselves.

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness/diagnosis/law_entries.h"

namespace dexcheck {

std::vector<FittedLawEntry> ListFittedLawEntries(const Setup& setup, JudgedLaw* law) {
  if (setup.joints() == nullptr) return {};
  // x_k = x_(k-1) + a (u_k - x_(k-1)), from the oldest step that is remembered on.
  const auto filter = [](const LawSnapshot& step, double a, const auto& signal) {
    VectorXd x = signal(step.before.empty() ? step.inputs.now : step.before.back());
    for (size_t k = step.before.size(); k-- > 0;) x += a * (signal(step.before[k]) - x);
    return VectorXd(x + a * (signal(step.inputs.now) - x));
  };
  const auto friction = [](const VectorXd& v, double width) { return VectorXd((v / width).array().tanh()); };
  const auto xi = [](const LawStep& state) -> const VectorXd& { return state.xi; };
  const auto force = [](const LawStep& state) -> const VectorXd& { return state.force; };
  const auto acceleration = [](const LawStep& state) -> const VectorXd& { return state.joints.q_ddot; };
  return {
      {"filter of the measured velocity in the feedback, share of the new one", "", 0.02, 0.999, true,
       [=](const LawSnapshot& step, double a) {
         LawInputs inputs = step.inputs;
         inputs.velocity_error += inputs.now.xi - filter(step, a, xi);
         return VectorXd(law->CalcForce(std::move(inputs)) - step.inputs.now.force);
       }},
      {"filter of the desired acceleration, share of the new one", "", 0.02, 0.999, true,
       [=](const LawSnapshot& step, double a) {
         LawInputs inputs = step.inputs;
         inputs.now.joints.q_ddot = filter(step, a, acceleration);
         return VectorXd(law->CalcForce(std::move(inputs)) - step.inputs.now.force);
       }},
      {"filter of the torques, share of the new ones", "", 0.02, 0.999, true,
       [=](const LawSnapshot& step, double a) {
         return VectorXd(filter(step, a, force) - step.inputs.now.force);
       }},
      {"friction of all joints as tanh of the measured velocity over", "rad/s", 1e-3, 1.0, false,
       [=](const LawSnapshot& step, double width) { return friction(step.inputs.now.xi, width); }},
      {"friction of all joints as tanh of the desired velocity over", "rad/s", 1e-3, 1.0, false,
       [=](const LawSnapshot& step, double width) { return friction(step.inputs.now.joints.q_dot, width); }}};
}

std::vector<LawEntry> ListTorqueEntries(const RobotModel& model, const std::vector<std::string>& places,
                                        const std::vector<const LawSnapshot*>& steps) {
  const ActuationMap actuation(model);
  const Eigen::Index n = model.num_velocities();
  const auto count = static_cast<Eigen::Index>(steps.size());
  MatrixXd right(n, count), sent(n, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const LawSnapshot& step = *steps[static_cast<size_t>(k)];
    VectorXd tau(n);
    actuation.CalcTorque(step.inputs.now.force, tau);
    right.col(k) = tau;
    actuation.CalcTorque(step.inputs.now.force + step.difference, tau);
    sent.col(k) = tau;
  }
  std::vector<LawEntry> entries;
  // @param change of tau'.
  const auto add = [&](const std::string& fault, const std::string& place, double value, const auto& change) {
    LawEntry& entry = entries.emplace_back();
    entry.fault = fault;
    entry.place = place;
    entry.unit = "N m";
    entry.nominal = value - 1.0;  // of an amplitude of 1
    entry.is_whole = true;
    entry.force = [&model, change](const LawSnapshot& step) -> MatrixXd {
      const ActuationMap map(model);
      VectorXd tau(step.difference.size());
      map.CalcTorque(step.inputs.now.force, tau);
      tau = (change(tau) - tau).eval();
      map.CalcForce(tau, tau);
      return tau;
    };
  };
  constexpr double kSame = 1e-9;
  // A limit sends the same torque wherever it sends less than the law asks for.
  VectorXd limits = VectorXd::Zero(n);
  double common = 0.0;
  bool is_common = true;
  for (Eigen::Index i = 0; i < n; ++i) {
    bool is_same = true;
    for (Eigen::Index k = 0; k < count; ++k) {
      const double size = std::abs(sent(i, k));
      if (!(size < std::abs(right(i, k)) * (1.0 - kSame)) || size == 0.0) continue;
      is_same = is_same && (limits[i] == 0.0 || std::abs(size - limits[i]) < kSame * size);
      limits[i] = size;
    }
    if (limits[i] == 0.0) continue;
    if (!is_same) limits[i] = 0.0;
    is_common = is_common && is_same && (common == 0.0 || std::abs(limits[i] - common) < kSame * common);
    if (is_same) common = limits[i];
    if (!is_same) continue;
    add("limit of the torque", places[static_cast<size_t>(i)], limits[i],
        [i, limit = limits[i]](VectorXd tau) {
          tau[i] = std::clamp(tau[i], -limit, limit);
          return tau;
        });
  }
  if (is_common && common > 0.0)
    add("limit of all torques", "law", common,
        [common](const VectorXd& tau) { return VectorXd(tau.cwiseMax(-common).cwiseMin(common)); });
  for (const double unit : {1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 1e-3, 1e-4, 1e-5, 1e-6}) {
    const MatrixXd steps_sent = sent / unit;
    if (!((steps_sent.array() - steps_sent.array().round()).abs() < kSame * (1.0 + steps_sent.array().abs()))
             .all())
      continue;
    add("all torques rounded to", "law", unit,
        [unit](const VectorXd& tau) { return VectorXd((tau / unit).array().round() * unit); });
    break;
  }
  return entries;
}

}  // namespace dexcheck
