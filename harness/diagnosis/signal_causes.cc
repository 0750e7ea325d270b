#include "harness/diagnosis/signal_causes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "controller/model/platform.h"
#include "harness/diagnosis/signal_fit.h"
#include "harness/engine/engine.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

/// A fault that several signals have, with the same value.
struct CommonFault {
  Fault fault;
  Index begin = 0;  ///< The first step that shows it.
  std::vector<size_t> members;
  std::set<std::string> groups;
};

double CalcRms(const VectorXd& x) { return x.norm() / std::sqrt(static_cast<double>(x.size())); }

/// A fault with memory is not known where the steps before are not: there the signal is taken as right.
void Ignore(const Fault& fault, const VectorXd& right, const SignalSeries& series, VectorXd* signal) {
  const bool is_late = fault.fault == "delay";
  if ((!is_late && fault.fault != "lag") ||
      std::count(series.has_history.begin(), series.has_history.end(), true) < kFewestSteps)
    return;
  // A late signal is known after its delay, and another delay may need it.
  const double remembered = is_late ? fault.value : static_cast<double>(StepStore::kHistory);
  double known = 0.0;  // steps since the last gap
  for (Index i = 0; i < signal->size(); ++i, ++known) {
    if (series.has_history[static_cast<size_t>(i)]) known = -1.0;
    if (known >= 0.0 && known < remembered) (*signal)[i] = right[i];
  }
}

/// The series of one of which this fault is expected.
SignalSeries ExpectFault(const SignalSeries& series, const CommonFault& common) {
  SignalSeries after = series;
  after.from = after.to = std::numeric_limits<double>::quiet_NaN();
  after.expected = Transmit(common.fault, series, common.begin);
  Fault off = common.fault;
  off.value += off.error;
  after.noise = std::max(series.noise, CalcRms(Transmit(off, series, common.begin) - after.expected));
  Ignore(common.fault, series.got, series, &after.expected);
  return after;
}

/// The signals of one channel.
class SignalGroup {
 public:
  SignalGroup(std::vector<SignalSeries> series, CauseChannel channel)
      : series_(std::move(series)), channel_(channel) {
    for (const SignalSeries& one : series_) {
      verdicts_.push_back(JudgeSignal(one, series_));
      // A signal that never changes shows no delay.
      if (one.expected.maxCoeff() - one.expected.minCoeff() > SignalSeries::kFaint * one.noise)
        ++moving_[one.name.group];
      ++sizes_[one.name.group];
    }
  }

  [[nodiscard]] Causes Explain() const {
    Causes causes;
    const std::optional<CommonFault> common = FindCommon();
    if (common) causes.push_back(DescribeCommon(*common));
    for (size_t i = 0; i < series_.size(); ++i) {
      if (!common) {
        AddExplanations(verdicts_[i], channel_, &causes);
      } else if (!Has(common->members, i) && !IsLateOrientation(*common, i)) {
        AddExplanations(JudgeBeside(i, *common), channel_, &causes);
      }
    }
    return causes;
  }

 private:
  static bool Has(const std::vector<size_t>& members, size_t i) {
    return std::find(members.begin(), members.end(), i) != members.end();
  }

  /// Faults that alone explain a signal, those of like value together.
  [[nodiscard]] std::vector<CommonFault> ListCommon() const {
    std::vector<CommonFault> all;
    for (size_t i = 0; i < verdicts_.size(); ++i) {
      if (!verdicts_[i].is_explained) continue;
      for (const SignalFit& fit : verdicts_[i].fits)
        if (fit.faults.size() == 1 && !fit.is_noise) Collect(i, fit.faults.front(), &all);
    }
    return all;
  }

  void Collect(size_t i, const Fault& fault, std::vector<CommonFault>* all) const {
    constexpr double kSame = 1e-4;
    auto same = std::find_if(all->begin(), all->end(), [&](const CommonFault& one) {
      return one.fault.fault == fault.fault && one.fault.unit == fault.unit &&
             std::abs(one.fault.value - fault.value) <=
                 kSame * std::abs(one.fault.value) + 3.0 * (fault.error + one.fault.error);
    });
    const Index begin = verdicts_[i].steps.first;
    if (same == all->end()) same = all->insert(all->end(), CommonFault{fault, begin, {}, {}});
    if (fault.error < same->fault.error) same->fault = fault;
    same->begin = std::min(same->begin, begin);
    same->members.push_back(i);
    same->groups.insert(series_[i].name.group);
  }

  /// Those that differ as that fault alone would make them, whatever else does as well.
  void Absorb(CommonFault* common) const {
    for (size_t i = 0; i < series_.size(); ++i) {
      if (Has(common->members, i) || verdicts_[i].steps.rows.empty()) continue;
      if (common->groups.count(series_[i].name.group) == 0) continue;
      const SignalSeries after = ExpectFault(series_[i], *common);
      const SignalSteps& steps = verdicts_[i].steps;
      if (((steps.Take(after.got) - steps.Take(after.expected)).abs() <= SignalSeries::kLeft * after.noise)
              .all())
        common->members.push_back(i);
    }
    std::sort(common->members.begin(), common->members.end());
  }

  [[nodiscard]] std::optional<CommonFault> FindCommon() const {
    constexpr size_t kSeveral = 3;
    std::optional<CommonFault> most;
    for (CommonFault& one : ListCommon()) {
      if (one.members.size() < 2) continue;
      if (Transmit(one.fault, series_.front()).size() > 0) Absorb(&one);
      if (one.members.size() >= kSeveral && (!most || one.members.size() > most->members.size())) most = one;
    }
    if (!most) return most;
    size_t could = 0;
    for (const std::string& group : most->groups) could += sizes_.at(group);
    return 3 * most->members.size() < could ? std::nullopt : most;
  }

  /// Whether these are all groups that move.
  [[nodiscard]] bool IsOfAll(const CommonFault& common) const {
    return channel_ == CauseChannel::kMeasurement &&
           (common.groups.size() > 2 || (common.groups.size() > 1 && common.groups.size() >= moving_.size()));
  }

  /// An orientation is kept as a change, which shows no delay of its own.
  [[nodiscard]] bool IsLateOrientation(const CommonFault& common, size_t i) const {
    return common.fault.fault == "delay" && IsOfAll(common) && series_[i].name.group == "object orientation";
  }

  [[nodiscard]] Explanation DescribeCommon(const CommonFault& common) const {
    Explanation one = StartExplanation(verdicts_[common.members.front()], channel_);
    std::string groups;
    for (const std::string& group : common.groups) groups += (groups.empty() ? "" : ", ") + group;
    one.faults = {common.fault};
    one.faults.front().place = IsOfAll(common) ? "everything that is measured" : "all " + groups;
    for (const size_t i : common.members) {
      const SignalSteps& steps = verdicts_[i].steps;
      one.from = std::min(one.from, steps.from);
      one.to = std::max(one.to, steps.to);
      one.ends = one.ends && steps.ends;
    }
    return one;
  }

  /// Judges a signal for a fault of its own, after the fault that all signals share.
  [[nodiscard]] SignalVerdict JudgeBeside(size_t i, const CommonFault& common) const {
    const SignalVerdict& alone = verdicts_[i];
    if (alone.steps.rows.empty() || Transmit(common.fault, series_[i]).size() == 0) return alone;
    std::vector<SignalSeries> others;
    for (const SignalSeries& other : series_)
      if (other.name.group == series_[i].name.group) others.push_back(ExpectFault(other, common));
    const SignalVerdict beside = JudgeSignal(ExpectFault(series_[i], common), others);
    const auto count = [](const SignalVerdict& of) { return of.fits.front().faults.size(); };
    const bool is_beside = beside.is_explained && (!alone.is_explained || count(beside) <= count(alone));
    SignalVerdict best = is_beside ? beside : alone;
    // Noise that is rounded, or less than the steps, has another deviation.
    if (common.fault.fault == "rounding to steps of" && best.is_explained && best.fits.front().is_noise)
      best.is_explained = false;
    return best;
  }

  std::vector<SignalSeries> series_;
  CauseChannel channel_;
  std::vector<SignalVerdict> verdicts_;  // of each
  std::map<std::string, size_t> sizes_, moving_;
};

/// Returns the positions of the joint that has this velocity; empty for a ball joint.
VectorXd FindPositions(const StepStore& store, Index velocity) {
  const RobotModel& model = store.setup().model();
  const int joint = model.joint_of_dof(static_cast<int>(velocity) - model.num_base_velocities());
  if (model.joints()[static_cast<size_t>(joint)].type == JointType::kBall) return {};
  return store.Get(StepStore::kPosition).row(model.position_index(joint));
}

/// Returns the coarsest steps of torque that the motor of a joint may have: of a drive with 7 bits and a
/// sign.
double FindCoarsestStep(const mjModel& engine, std::string_view motor) {
  constexpr double kFewest = 100.0;  // steps up to the limit
  for (int i = 0; i < engine.nu; ++i) {
    const bool is_it = engine.actuator_ctrllimited[i] != 0 && engine.actuator_trntype[i] == mjTRN_JOINT &&
                       motor.ends_with(" " + NameOf(engine, mjOBJ_JOINT, engine.actuator_trnid[2 * i]));
    if (is_it) return std::abs(engine.actuator_ctrlrange[2 * i + 1] * engine.actuator_gear[6 * i]) / kFewest;
  }
  return std::numeric_limits<double>::infinity();
}

std::vector<SignalSeries> ListSeries(const StepStore& store, bool motors) {
  // A step that a motor refuses has no torques.
  const bool is_refused =
      motors && store.size() > 1 && store.Get(StepStore::kSize)(0, store.size() - 1) == 0.0;
  const Index count = store.size() - (is_refused ? 1 : 0);
  const auto get = [&](StepStore::Signal signal) { return store.Get(signal).leftCols(count); };
  const auto expected = get(motors ? StepStore::kTauDeclared : StepStore::kDeclaredReading);
  const auto got = get(motors ? StepStore::kTauReceived : StepStore::kReading);
  const auto rates = get(StepStore::kVelocity);
  const std::vector<SignalName>& names = motors ? store.motors() : store.readings();
  const VectorXd time = get(StepStore::kTime).row(0);
  const RobotModel& model = store.setup().model();
  const Base& base = model.base();
  MatrixXd motor_rates = rates;
  if (motors && base.type == BaseType::kDifferentialDrive)
    motor_rates.topRows<2>() = CalcWheelRateMap(base) * rates.topRows(2);
  std::vector<bool> history(static_cast<size_t>(count));
  for (Index i = 0; i < count; ++i) history[static_cast<size_t>(i)] = store.HasHistory(i);
  // Torques pass a gear once and back, relative to the largest of them; readings are copied.
  const double largest = motors ? expected.cwiseAbs().maxCoeff() : 0.0;
  std::vector<SignalSeries> series;
  for (Index i = 0; i < expected.rows(); ++i) {
    SignalSeries& one = series.emplace_back();
    one.name = names[static_cast<size_t>(i)];
    one.time = time;
    one.expected = expected.row(i);
    one.got = got.row(i);
    if (motors) one.rate = motor_rates.row(i);
    if (motors) one.coarsest = FindCoarsestStep(store.setup().engine(), one.name.place);
    if (motors && i >= model.num_base_velocities()) one.position = FindPositions(store, i).head(count);
    if (one.name.group == "joint positions") one.position = one.expected;
    const StepStore::Span span =
        (motors ? store.motor_spans() : store.reading_spans())[static_cast<size_t>(i)];
    one.from = span.first;
    one.to = span.last;
    one.has_history = history;
    const double size = std::max({one.expected.cwiseAbs().maxCoeff(), 1e-3 * largest, 1e-3});
    one.noise = (motors ? StepStore::kTorqueRounding : 1e-15) * size;
  }
  return series;
}

}  // namespace

Causes ExplainSignals(std::vector<SignalSeries> series, CauseChannel channel) {
  return SignalGroup(std::move(series), channel).Explain();
}

Causes ExplainSignals(const StepStore& store) {
  if (store.size() == 0) return {};
  Causes causes = ExplainSignals(ListSeries(store, /*motors=*/true), CauseChannel::kActuation);
  Causes readings = ExplainSignals(ListSeries(store, /*motors=*/false), CauseChannel::kMeasurement);
  std::move(readings.begin(), readings.end(), std::back_inserter(causes));
  return causes;
}

}  // namespace dexcheck
