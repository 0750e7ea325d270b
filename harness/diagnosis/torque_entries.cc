// Faults of a law that its torques show by themselves.

#include "harness/diagnosis/law_entries.h"

namespace dexcheck {

std::vector<LawEntry> ListTorqueEntries(const RobotModel& model, const std::vector<std::string>& places,
                                        const std::vector<const LawSnapshot*>& steps) {
  const ActuationMap actuation(model);
  const Eigen::Index n = model.num_velocities();
  const auto count = static_cast<Eigen::Index>(steps.size());
  const auto calc_torque = [actuation](const VectorXd& force) {
    VectorXd tau(force.size());
    actuation.CalcTorque(force, tau);
    return tau;
  };
  const auto calc_before = [calc_torque](const LawSnapshot& step) {
    return calc_torque(step.before.empty() ? step.inputs.now.force : step.before.front().sent);
  };
  MatrixXd sent(n, count), change(n, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const LawSnapshot& step = *steps[static_cast<size_t>(k)];
    sent.col(k) = calc_torque(step.inputs.now.force + step.difference);
    change.col(k) = sent.col(k) - calc_before(step);
  }
  std::vector<LawEntry> entries;
  // @param make the torques that are sent of those that are asked for and those of the step before.
  const auto add = [&](const std::string& fault, const std::string& place, double value, const auto& make) {
    LawEntry& entry = entries.emplace_back();
    entry.fault = fault;
    entry.place = place;
    entry.unit = "N m";
    entry.nominal = value - 1.0;  // of a size of 1
    entry.is_whole = true;
    entry.force = [=](const LawAtStep& at) -> MatrixXd {
      VectorXd tau = calc_torque(at.force);
      tau = (make(tau, calc_before(at.step)) - tau).eval();
      actuation.CalcForce(tau, tau);
      return tau;
    };
  };
  constexpr double kSame = 1e-9;
  // A limited value is largest at several steps.
  const double least = kSame * sent.cwiseAbs().maxCoeff();
  const auto find_limit = [&](const auto& values) {
    const double most = values.cwiseAbs().maxCoeff();
    return most > least && (values.cwiseAbs().array() > most * (1.0 - kSame)).count() > 1 ? most : 0.0;
  };
  const auto add_limits = [&](const std::string& what, const MatrixXd& values, double of_before) {
    const auto limit = [of_before](const VectorXd& tau, const VectorXd& before, double most) {
      const VectorXd middle = of_before * before;
      return VectorXd(middle + (tau - middle).cwiseMax(-most).cwiseMin(most));
    };
    for (Eigen::Index i = 0; i < n; ++i) {
      const double most = find_limit(values.row(i));
      if (most == 0.0) continue;
      add(what + " the torque", places[static_cast<size_t>(i)], most,
          [=](VectorXd tau, const VectorXd& before) {
            tau[i] = limit(tau, before, most)[i];
            return tau;
          });
    }
    const double most = find_limit(values);
    if (most > 0.0)
      add(what + " all torques", "law", most,
          [=](const VectorXd& tau, const VectorXd& before) { return limit(tau, before, most); });
  };
  add_limits("limit of", sent, 0.0);
  add_limits("limit of the change in a step of", change, 1.0);
  for (const double unit : {1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.02, 0.01, 5e-3, 1e-3, 1e-4, 1e-5, 1e-6}) {
    const MatrixXd steps_sent = sent / unit;
    if (!((steps_sent.array() - steps_sent.array().round()).abs() < kSame * (1.0 + steps_sent.array().abs()))
             .all())
      continue;
    add("all torques rounded to", "law", unit, [unit](const VectorXd& tau, const VectorXd&) {
      return VectorXd((tau / unit).array().round() * unit);
    });
    break;
  }
  return entries;
}

}  // namespace dexcheck
