#include "harness/run/joint_margins.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "controller/common/text.h"
#include "harness/plant/sensing.h"

namespace dexcheck {
namespace {

using Eigen::Index;

constexpr Index kLargestState = 300;
constexpr double kSmall = 1e-6;  // rad, rad/s of central differences

/// d f / d x by columns.
template <typename Function>
MatrixXd Differentiate(VectorXd x, const Function& f) {
  MatrixXd derivative(x.size(), x.size());
  for (Index i = 0; i < x.size(); ++i) {
    const double at = x[i];
    x[i] = at + kSmall;
    const VectorXd after = f(x);
    x[i] = at - kSmall;
    derivative.col(i) = (after - f(x)) / (2.0 * kSmall);
    x[i] = at;
  }
  return derivative;
}

/// Lists the postures in which the motion is judged, each once.
std::vector<VectorXd> ListPostures(const Setup& setup) {
  std::vector<VectorXd> postures = {setup.start().q};
  DesiredJoints at;
  for (const JointTask::Point& point : setup.scenario().joint_task()->points) {
    setup.joints()->motion.Evaluate(point.time, &at);
    if (std::ranges::find(postures, at.q) == postures.end()) postures.push_back(at.q);
  }
  return postures;
}

/// Returns the sampling of the scenario's law, with the delays of torques and measurements.
SampledLoop FindTiming(const Scenario& scenario) {
  SampledLoop loop;
  loop.time_step = scenario.plant.time_step;
  loop.hold = std::max(1L, std::lround(scenario.plant.control_step / loop.time_step));
  loop.delay = scenario.imperfections.actuation.delay;
  loop.latency = CountSteps(scenario.imperfections.sensing.latency, loop.time_step);
  return loop;
}

std::string DescribeMargins(const JointMargins& margins) {
  if (!margins.is_stable())
    return fmt::format("# margins: none, the loop is not stable: spectral radius {:.6g}\n", margins.radius);
  const StabilityMargins &one = margins.least, &all = margins.together;
  return fmt::format(
      "# margins, one torque at a time:\n#   gain {:.2f} ({})\n#   phase {:.1f} degrees ({})\n"
      "#   delay {:.2f} ms ({})\n"
      "# margins, all torques equally: gain {:.2f}, phase {:.1f} degrees, delay {:.2f} ms\n",
      one.gain, margins.gain_joint, RadToDeg(one.phase), margins.phase_joint, 1e3 * one.delay,
      margins.delay_joint, all.gain, RadToDeg(all.phase), 1e3 * all.delay);
}

}  // namespace

std::optional<LinearLoop> LineariseJoints(const Setup& setup, const JointGains& gains,
                                          const Eigen::Ref<const VectorXd>& q) {
  const Scenario& scenario = setup.scenario();
  const SensingOptions& sensing = scenario.imperfections.sensing;
  const Index n = setup.model().num_velocities();
  LinearLoop loop;
  loop.timing = FindTiming(scenario);
  if (sensing.velocity == VelocitySource::kDifferenced)
    loop.timing.low_pass = CalcLowPassGain(sensing.velocity_cutoff, loop.timing.time_step);
  loop.steps_together = scenario.plant.velocity_age() == 0.0;
  const double steps =
      5.0 + static_cast<double>(2 * loop.timing.latency) + loop.timing.delay / loop.timing.time_step;
  const bool is_large = steps * static_cast<double>(n) > static_cast<double>(kLargestState);
  if (is_large || q.size() != n || sensing.velocity == VelocitySource::kKalman) return std::nullopt;
  std::vector<std::string> names;
  for (int i = 0; i < static_cast<int>(n); ++i) names.push_back(setup.model().dof_name(i));
  loop.lag = scenario.imperfections.actuation.lag.Resolve(names, scenario.source);

  ModelTerms plant(setup.declared_model(), Coordinates::kReduced);
  const auto at = [&](const VectorXd& position, const VectorXd& rate) -> const ModelTerms& {
    plant.SetState(position, rate);
    plant.CalcDynamics();
    return plant;
  };
  const VectorXd rest = VectorXd::Zero(n);
  loop.M = at(q, rest).M();
  loop.G = Differentiate(q, [&](const VectorXd& x) { return VectorXd(at(x, rest).gravity()); });
  loop.D = Differentiate(rest, [&](const VectorXd& v) { return VectorXd(at(q, v).friction()); });

  JointLaw law(setup.model(), scenario.control.law, gains);
  ModelTerms model(setup.model(), Coordinates::kReduced);
  const DesiredJoints desired{q, rest, rest};
  const auto torque = [&](const VectorXd& position, const VectorXd& rate) {
    model.SetState(position, rate);
    model.CalcDynamics();
    return VectorXd(-law.CalcTorque(model, position, rate, desired));
  };
  loop.K = Differentiate(q, [&](const VectorXd& x) { return torque(x, rest); });
  loop.V = Differentiate(rest, [&](const VectorXd& v) { return torque(q, v); });
  return loop;
}

std::optional<JointMargins> CalcJointMargins(const Setup& setup, const JointGains& gains, bool together) {
  if (setup.joints() == nullptr) return std::nullopt;
  JointMargins all;
  for (const VectorXd& q : ListPostures(setup)) {
    const std::optional<LinearLoop> loop = LineariseJoints(setup, gains, q);
    if (!loop) return std::nullopt;
    const LoopMargins margins = CalcMargins(CalcSampledSystem(*loop), together);
    all.radius = std::max(all.radius, margins.radius);
    for (size_t i = 0; i < margins.loops.size(); ++i) {
      const StabilityMargins& one = margins.loops[i];
      const std::string& joint = setup.model().dof_name(static_cast<int>(i));
      if (one.gain < all.least.gain) all.gain_joint = joint;
      if (one.phase < all.least.phase) all.phase_joint = joint;
      if (one.delay < all.least.delay) all.delay_joint = joint;
      all.least.Narrow(one);
    }
    all.together.Narrow(margins.together);
  }
  return all;
}

JointGains ScaleGains(JointGains gains, double factor) {
  for (VectorXd* gain : {&gains.K_p, &gains.K}) *gain *= factor * factor;
  for (VectorXd* gain : {&gains.K_v, &gains.D}) *gain *= factor;
  return gains;
}

BestGains FindBestGains(const Setup& setup) {
  // Which margin is too small; empty for none.
  const auto find_limit = [&](double factor) -> std::string {
    const auto margins = CalcJointMargins(setup, ScaleGains(setup.joints()->gains, factor), false);
    if (!margins || !margins->is_stable()) return "loop, which is not stable";
    const double gain = margins->least.gain / BestGains::kGain,
                 phase = margins->least.phase / BestGains::kPhase;
    if (std::min(gain, phase) >= 1.0) return "";
    return gain < phase ? "gain margin of " + margins->gain_joint : "phase margin of " + margins->phase_joint;
  };
  constexpr double kMost = 1000.0, kAccuracy = 1.01;
  BestGains best{.limited_by = find_limit(1.0)};
  double good = best.limited_by.empty() ? 1.0 : 0.0;
  for (double factor = 2.0; good == 0.0 && factor < kMost; factor *= 2.0) {
    if (find_limit(factor).empty()) {
      good = factor;
    } else if (find_limit(1.0 / factor).empty()) {
      good = 1.0 / factor;
    }
  }
  if (good == 0.0) return best;
  double bad = 2.0 * good;
  while (bad < kMost && (best.limited_by = find_limit(bad)).empty()) good = std::exchange(bad, 2.0 * bad);
  while (bad > kAccuracy * good) {
    const double middle = std::sqrt(good * bad);
    const std::string limit = find_limit(middle);
    if (limit.empty()) {
      good = middle;
    } else {
      bad = middle;
      best.limited_by = limit;
    }
  }
  best.factor = good;
  return best;
}

std::string WriteJointControl(const Scenario& scenario, double factor) {
  std::string text = fmt::format("[control]\nlaw = \"{}\"\n", NameOf(scenario.control.law));
  const auto add = [&](const char* key, const ByName& numbers, double times) {
    if (numbers.key.empty()) return;
    // Values are rounded down to three digits, so that they do not exceed the best ones.
    const auto show = [&](double value) {
      if (times == 1.0 || value == 0.0) return FormatNumber(value, 6);
      const double digit = std::pow(10.0, std::floor(std::log10(value * times)) - 2.0);
      return FormatNumber(digit * std::floor(value * times / digit), 3);
    };
    std::string value = numbers.groups.empty() ? show(numbers.all) : "";
    for (const auto& [name, number] : numbers.groups)
      value += fmt::format("{}{} = {}", value.empty() ? "" : ", ", Quote(name), show(number));
    if (!numbers.groups.empty()) value = "{ " + value + " }";
    text += fmt::format("{} = {}\n", key, value);
  };
  const JointTask& task = *scenario.joint_task();
  add("natural_frequency", task.natural_frequency, factor);
  add("damping_ratio", task.damping_ratio, 1.0);
  add("stiffness", task.stiffness, factor * factor);
  add("damping", task.damping, factor);
  add("coulomb", task.coulomb, 1.0);
  add("viscous", task.viscous, 1.0);
  if (!task.coulomb.key.empty()) text += "coulomb_velocity = " + FormatNumber(task.coulomb_velocity) + "\n";
  return text;
}

std::string CommentLines(const std::string& text) {
  std::istringstream lines(text);
  std::string commented;
  for (std::string line; std::getline(lines, line);) commented += "#   " + line + "\n";
  return commented;
}

void JudgeGains(const Setup& setup, const ClosedLoop& loop, RunResult* result) {
  if (setup.joints() == nullptr || !loop.knows_law() || loop.record().step == 0) return;
  // Margins belong to the scenario's law, and these torques do not.
  if (loop.is_checking() && loop.checks().Has("law_torque") && loop.checks().Find("law_torque").failed)
    return;
  result->margins = CalcJointMargins(setup, setup.joints()->gains);
  if (!result->margins) return;
  std::string& card = result->gain_card;
  card = fmt::format("# your gains: largest error of a joint {:.3g}, rms {:.3g}", result->tracking.joints.max,
                     result->tracking.joints.rms());
  if (result->peak_effort > 0.0)
    card += fmt::format("\n# largest torque {:.3g} of its limit ({})", result->peak_effort,
                        result->busiest_motor);
  card += "\n" + CommentLines(WriteJointControl(setup.scenario(), 1.0)) + DescribeMargins(*result->margins);
  const BestGains best = FindBestGains(setup);
  const bool found = best.factor > 0.0;
  card +=
      "# margins are the linearised loop's: without quantisation, noise, dry friction and torque limits\n";
  card += fmt::format("# best gains with margins of at least {} (gain) and {:.0f} degrees (phase): {}\n",
                      BestGains::kGain, RadToDeg(BestGains::kPhase), found ? "below" : "none found");
  if (!best.limited_by.empty()) card += "# limited by the " + best.limited_by + "\n";
  if (result->peak_effort >= 1.0) card += "# limited by the torque limit of " + result->busiest_motor + "\n";
  if (found) card += WriteJointControl(setup.scenario(), best.factor);
}

}  // namespace dexcheck
