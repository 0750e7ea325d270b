#include "harness/diagnosis/signal_causes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "controller/model/platform.h"
#include "harness/diagnosis/signal_fit.h"

namespace dexcheck {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

/// A fault that several signals have, with the same value.
struct CommonFault {
  Fault fault;
  std::vector<size_t> members;
  std::set<std::string> groups;
};

/// Whether a fault of one signal is that of all: the same kind, with values that differ by no more than
/// errors.
bool IsOne(const Fault& fault, const Fault& of_all) {
  constexpr double kSame = 1e-4;
  if (fault.fault != of_all.fault || fault.unit != of_all.unit) return false;
  return fault.detail == kOrMore ? of_all.value >= fault.value
                                 : std::abs(fault.value - of_all.value) <=
                                       kSame * std::abs(of_all.value) + 3.0 * (fault.error + of_all.error);
}

/// The signals of one channel.
class SignalGroup {
 public:
  SignalGroup(std::vector<SignalSeries> series, CauseChannel channel)
      : series_(std::move(series)), channel_(channel) {
    for (const SignalSeries& one : series_) {
      verdicts_.push_back(JudgeSignal(one, series_));
      // What never changes shows no delay.
      if (one.expected.maxCoeff() - one.expected.minCoeff() > SignalSeries::kFaint * one.noise)
        ++moving_[one.name.group];
      ++sizes_[one.name.group];
    }
  }

  [[nodiscard]] Causes Explain() const {
    Causes causes;
    const std::optional<CommonFault> common = FindCommon();
    if (common) causes.push_back(TellCommon(*common));
    for (size_t i = 0; i < series_.size(); ++i) {
      if (common && (Has(common->members, i) || IsLateOrientation(*common, i))) continue;
      Causes own;
      TellVerdict(verdicts_[i], channel_, &own);
      if (common) SubtractCommon(common->fault, &own);
      std::move(own.begin(), own.end(), std::back_inserter(causes));
    }
    return causes;
  }

 private:
  static bool Has(const std::vector<size_t>& members, size_t i) {
    return std::find(members.begin(), members.end(), i) != members.end();
  }

  /// Whether a fault of all would do in the place of the one fault of a signal.
  [[nodiscard]] bool MayHave(size_t i, const Fault& of_all) const {
    return verdicts_[i].is_explained && std::ranges::any_of(verdicts_[i].fits, [&](const SignalFit& fit) {
             return fit.faults.size() == 1 && std::ranges::any_of(fit.same.front(), [&](const Fault& other) {
                      return IsOne(other, of_all);
                    });
           });
  }

  /// Faults that alone explain a signal, those of like value together.
  [[nodiscard]] std::vector<CommonFault> ListCommon() const {
    std::vector<CommonFault> all;
    for (size_t i = 0; i < verdicts_.size(); ++i) {
      if (!verdicts_[i].is_explained) continue;
      for (const SignalFit& fit : verdicts_[i].fits)
        if (fit.faults.size() == 1 && !fit.is_noise) Collect(i, fit.faults.front(), &all);
    }
    // A signal of which nothing came may have any step that is large enough.
    for (CommonFault& one : all) {
      for (size_t i = 0; i < verdicts_.size(); ++i)
        if (!Has(one.members, i) && one.groups.contains(series_[i].name.group) && MayHave(i, one.fault))
          one.members.push_back(i);
    }
    return all;
  }

  void Collect(size_t i, const Fault& fault, std::vector<CommonFault>* all) const {
    auto same = std::ranges::find_if(*all, [&](const CommonFault& one) { return IsOne(fault, one.fault); });
    if (same == all->end()) same = all->insert(all->end(), CommonFault{fault, {}, {}});
    if (fault.error < same->fault.error) same->fault = fault;
    same->members.push_back(i);
    same->groups.insert(series_[i].name.group);
  }

  [[nodiscard]] std::optional<CommonFault> FindCommon() const {
    constexpr size_t kSeveral = 3;
    const std::vector<CommonFault> all = ListCommon();
    const auto most =
        std::ranges::max_element(all, {}, [](const CommonFault& one) { return one.members.size(); });
    if (most == all.end() || most->members.size() < kSeveral) return std::nullopt;
    size_t could = 0;
    for (const std::string& group : most->groups) could += sizes_.at(group);
    return 3 * most->members.size() < could ? std::nullopt : std::optional(*most);
  }

  /// Leaves what a signal has of its own: a second gain multiplies that of all, a second delay adds to
  /// theirs. An explanation without the fault of all explains nothing, since the signal has that fault, too.
  static void SubtractCommon(const Fault& common, Causes* own) {
    const auto has_kind = [&](const Explanation& one) {
      return std::ranges::any_of(one.faults, [&](const Fault& fault) { return fault.fault == common.fault; });
    };
    const bool has_any = std::ranges::any_of(*own, has_kind);
    for (Explanation& one : *own) {
      if (!has_any || one.faults.front().fault == kNoise) one.outcome = CauseOutcome::kNotExplained;
    }
    std::erase_if(*own, [&](const Explanation& one) {
      return one.outcome != CauseOutcome::kNotExplained &&
             std::ranges::any_of(one.faults, [&](const Fault& fault) { return IsOne(fault, common); });
    });
    for (Explanation& one : *own) {
      for (Fault& fault : one.faults) {
        if (fault.fault != common.fault || fault.detail == kOrMore) continue;
        fault.value = fault.fault == "gain" ? fault.value / common.value : fault.value - common.value;
      }
    }
  }

  /// Whether these are all groups that move.
  [[nodiscard]] bool IsOfAll(const CommonFault& common) const {
    return channel_ == CauseChannel::kMeasurement &&
           (common.groups.size() > 2 || (common.groups.size() > 1 && common.groups.size() >= moving_.size()));
  }

  /// Whether this is an orientation under a delay of all: only its change is kept, which shows no delay.
  [[nodiscard]] bool IsLateOrientation(const CommonFault& common, size_t i) const {
    return common.fault.fault == "delay" && IsOfAll(common) && series_[i].name.group == "object orientation";
  }

  [[nodiscard]] Explanation TellCommon(const CommonFault& common) const {
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

  std::vector<SignalSeries> series_;
  CauseChannel channel_;
  std::vector<SignalVerdict> verdicts_;  // of each
  std::map<std::string, size_t> sizes_, moving_;
};

/// Of the joint that this velocity moves; empty for one of a ball joint.
VectorXd FindPositions(const StepStore& store, Index velocity) {
  const RobotModel& model = store.setup().model();
  const int joint = model.joint_of_dof(static_cast<int>(velocity) - model.num_base_velocities());
  if (model.joints()[static_cast<size_t>(joint)].type == JointType::kBall) return {};
  return store.Get(StepStore::kPosition).row(model.position_index(joint));
}

std::vector<SignalSeries> ListSeries(const StepStore& store, bool motors) {
  // A step that a motor refuses has no torques.
  const bool is_refused =
      motors && store.size() > 1 && store.Get(StepStore::kNoise)(0, store.size() - 1) == 0.0;
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
