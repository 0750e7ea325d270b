#include "harness/recordings/nonlinear_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// Samples of a recording, and how well the model explains them.
class Samples {
 public:
  Samples(const RobotModel& model, Recording* recording) : model_(model) {
    constexpr size_t kRows = 3000;
    MotionFit motion(model, recording, kRows);
    joints_ = motion.joints();
    has_currents_ = motion.has_currents();
    recording_faults_ = motion.faults();
    size_t every = 1, count = 0;
    motion.Run([&](const RecordedSample& sample) {
      if (count++ % every != 0) return true;
      // All of a long recording counts, at fewer times.
      if (samples_.size() == kRows) {
        for (size_t i = 0; i < kRows / 2; ++i) samples_[i] = std::move(samples_[2 * i]);
        samples_.resize(kRows / 2);
        every *= 2;
        if (count % every != 1) return true;
      }
      samples_.push_back(sample);
      // A joint that friction holds has a torque that says nothing.
      const std::vector<bool> judged = motion.IsJudged(sample);
      for (const int joint : joints_)
        if (!judged[static_cast<size_t>(joint)])
          samples_.back().torque[joint] = std::numeric_limits<double>::quiet_NaN();
      return true;
    });
  }

  [[nodiscard]] size_t size() const { return samples_.size(); }
  /// Whether recorded velocities are the derivatives of positions that have this gain undone.
  [[nodiscard]] bool HasRatesOf(const Fault& gain) const {
    constexpr double kNear = 0.1;
    return std::ranges::any_of(recording_faults_, [&](const Fault& rate) {
      return rate.fault == "velocity gain" && rate.place == gain.place &&
             std::abs(rate.value * gain.value - 1.0) < kNear;
    });
  }
  /// Lowest and highest positions (n x 2).
  [[nodiscard]] MatrixXd CalcRanges() const {
    MatrixXd ranges = MatrixXd::Zero(model_.num_joints(), 2);
    if (!samples_.empty()) ranges << samples_.front().q, samples_.front().q;
    for (const RecordedSample& sample : samples_)
      ranges << ranges.col(0).cwiseMin(sample.q), ranges.col(1).cwiseMax(sample.q);
    return ranges;
  }
  /// Returns what friction, an offset and a current's scale leave of each joint's torque beside the model's
  /// (samples x joints), at every such sample; 0 where it is not judged.
  MatrixXd CalcResiduals(const NonlinearFault& undone, size_t every) {
    std::optional<RobotModel> changed;
    if (undone.IsOfModel()) {
      RobotSpec spec = model_.spec();
      undone.Undo(&spec);
      changed.emplace(std::move(spec));
    }
    TorqueRegressor regressor(changed ? *changed : model_);
    const Index count = static_cast<Index>((samples_.size() + every - 1) / every);
    const auto joints = static_cast<Index>(joints_.size());
    std::vector<MatrixXd> columns(joints_.size(), MatrixXd::Zero(count, kColumns));
    MatrixXd measured = MatrixXd::Zero(count, joints);
    VectorXd torques(model_.num_joints());
    for (Index i = 0; i < count; ++i) {
      RecordedSample sample = samples_[static_cast<size_t>(i) * every];
      undone.Undo(&sample);
      regressor.SetMotion(sample.q, sample.qd, sample.qdd, sample.base);
      regressor.CalcTorques(torques);
      for (Index place = 0; place < joints; ++place) {
        const int joint = joints_[static_cast<size_t>(place)];
        if (std::isnan(sample.torque[joint])) continue;
        // A current's scale is free.
        measured(i, place) = sample.torque[joint] - (has_currents_ ? 0.0 : torques[joint]);
        columns[static_cast<size_t>(place)].row(i) << 1.0, sample.direction[joint], sample.qd[joint],
            has_currents_ ? torques[joint] : 0.0;
      }
    }
    for (Index place = 0; place < joints; ++place) {
      const MatrixXd& Z = columns[static_cast<size_t>(place)];
      auto y = measured.col(place);
      y -= (Z * SolveLeastSquares(Z.transpose() * Z, Z.transpose() * y)).eval();
    }
    return measured;
  }

 private:
  static constexpr Index kColumns = 4;  // offset, direction, velocity, the model's torque

  const RobotModel& model_;
  std::vector<int> joints_;
  bool has_currents_ = false;
  std::vector<Fault> recording_faults_;
  std::vector<RecordedSample> samples_;
};

/// Returns the sum over joints of the logarithm of the residual.
double CalcMisfit(const MatrixXd& residuals) {
  double misfit = 0.0;
  for (Index place = 0; place < residuals.cols(); ++place)
    misfit += std::log(residuals.col(place).norm() + std::numeric_limits<double>::min());
  return misfit;
}

using Number = NonlinearFault::Number;

/// Changes a fault's numbers. @param axes 3 x 3: about the first of which the joint turns.
void Change(const VectorXd& change, const MatrixXd& axes, NonlinearFault* fault) {
  switch (fault->number) {
    case Number::kNone:
      break;
    case Number::kGain:
      fault->factor *= 1.0 + change[0];
      break;
    case Number::kOffset:
      fault->offset += change[0];
      break;
    case Number::kClock:
      fault->clock *= 1.0 + change[0];
      break;
    case Number::kPlacement:
      fault->shift += change;
      break;
    case Number::kOrientation:
    case Number::kAxis:
      fault->turn += axes.leftCols(change.size()) * change;
      break;
  }
}

/// Returns the size of a fault's numbers, as it is said.
double CalcValue(const NonlinearFault& fault) {
  switch (fault.number) {
    case Number::kNone:
      return fault.fault.value;
    case Number::kGain:
      return 1.0 / fault.factor;
    case Number::kOffset:
      return -fault.offset;
    case Number::kClock:
      return 1.0 / fault.clock;
    case Number::kPlacement:
      return fault.shift.norm();
    case Number::kOrientation:
    case Number::kAxis:
      return fault.turn.norm();
  }
  return 0.0;
}

/// Returns how many samples say something of their own: those that follow one another have similar noise.
double CountIndependent(const MatrixXd& residuals) {
  double next = 0.0, all = std::numeric_limits<double>::min();
  for (Index place = 0; place < residuals.cols(); ++place) {
    const auto e = residuals.col(place).normalized();
    next += e.head(e.size() - 1).dot(e.tail(e.size() - 1));
    all += e.squaredNorm();
  }
  constexpr double kMost = 0.98;
  const double correlation = std::clamp(next / all, 0.0, kMost);
  return static_cast<double>(residuals.rows()) * (1.0 - correlation) / (1.0 + correlation);
}

/// Returns what Change moves of a wrong geometry. @param axes as for Change.
VectorXd GetGeometry(const NonlinearFault& fault, const MatrixXd& axes) {
  if (fault.number == Number::kPlacement) return fault.shift;
  return axes.leftCols(fault.CountNumbers()).transpose() * fault.turn;
}

/// Says how well the motion determines a fault's numbers. @param H their information, of residuals of norm 1
/// at each joint. @param samples of these that say something of their own.
void SetErrors(const MatrixXd& H, double samples, const MatrixXd& axes, NonlinearFault* fault) {
  VectorXd along = VectorXd::Ones(1);
  if (fault->number == Number::kGain || fault->number == Number::kClock) along[0] = CalcValue(*fault);
  if (fault->IsOfModel()) along = GetGeometry(*fault, axes);
  const double size = CalcValue(*fault), least = CalcSymmetricEigenvalues(H)[0];
  if (fault->IsOfModel()) along.normalize();
  fault->fault.error = std::sqrt(along.dot(SolveLeastSquares(H, along)) / samples);
  constexpr double kShown = 0.1;
  fault->shows_all = least * samples > 1.0 / Square(kShown * size);
  if (!fault->shows_all) fault->fault.error = 0.0;
}

/// Moves a fault's numbers to where it explains most, by Gauss and Newton's method. @param every of so many
/// samples one counts. @param settled the misfit that a step less gains. @return the misfit there.
double Refine(const RobotModel& model, size_t every, double settled, Samples* samples,
              NonlinearFault* fault) {
  MatrixXd residuals = samples->CalcResiduals(*fault, every);
  double misfit = CalcMisfit(residuals);
  if (fault->number == Number::kNone) return misfit;
  const MatrixXd axes = fault->joint >= 0 ? FindDirections(model, fault->joint) : MatrixXd();
  constexpr int kSteps = 20;
  constexpr double kDifference = 1e-5, kLeastPart = 0.05, kUnseen = 1e-9;
  // A direction that the motion does not show stays small, m or rad.
  constexpr double kUsual = 0.03;
  const double prior =
      fault->IsOfModel() ? 1.0 / (Square(kUsual) * static_cast<double>(residuals.rows())) : 0.0;
  const auto unusual = [&](const NonlinearFault& one) {
    return prior > 0.0 ? 0.5 * prior * GetGeometry(one, axes).squaredNorm() : 0.0;
  };
  misfit += unusual(*fault);
  double gained = 1.0;
  for (int i = 0; i < kSteps && gained > settled; ++i) {
    const VectorXd weights =
        residuals.colwise().norm().cwiseMax(std::numeric_limits<double>::min()).cwiseInverse();
    const VectorXd e = (residuals * weights.asDiagonal()).reshaped();
    MatrixXd J(e.size(), fault->CountNumbers());
    for (Index k = 0; k < J.cols(); ++k) {
      NonlinearFault near = *fault;
      Change(kDifference * VectorXd::Unit(J.cols(), k), axes, &near);
      J.col(k) = ((samples->CalcResiduals(near, every) * weights.asDiagonal()).reshaped() - e) / kDifference;
    }
    MatrixXd H = J.transpose() * J;
    SetErrors(H, CountIndependent(residuals), axes, fault);
    H.diagonal().array() += prior + kUnseen * H.diagonal().maxCoeff();
    VectorXd slope = J.transpose() * e;
    if (prior > 0.0) slope += prior * GetGeometry(*fault, axes);
    const VectorXd step = -SolveLeastSquares(H, slope);
    gained = 0.0;
    for (double part = 1.0; part > kLeastPart && gained == 0.0; part *= 0.5) {
      NonlinearFault near = *fault;
      Change(part * step, axes, &near);
      MatrixXd left = samples->CalcResiduals(near, every);
      const double then = CalcMisfit(left) + unusual(near);
      if (!(then < misfit)) continue;
      gained = misfit - then;
      misfit = then;
      residuals = std::move(left);
      *fault = std::move(near);
    }
  }
  fault->fault.value = CalcValue(*fault);
  return misfit;
}

/// Whether a fault's numbers are such as occur.
bool IsPlausible(const NonlinearFault& fault) {
  constexpr double kFarthest = 0.3, kMostTurn = 0.5;  // m, rad
  // A clock runs a little fast or slow, or has another rate.
  constexpr double kDrift = 0.05, kLeastDrift = 1e-3, kLeastGain = 2e-3;
  // A few standard errors are noise.
  constexpr double kErrors = 5.0;
  const double off =
      fault.fault.value - (fault.number == Number::kGain || fault.number == Number::kClock ? 1.0 : 0.0);
  if (fault.number != Number::kNone && std::abs(off) < kErrors * fault.fault.error) return false;
  const double octaves = fault.clock > 0.0 ? std::log2(fault.clock) : 0.5;
  return fault.shift.norm() <= kFarthest && fault.turn.norm() <= kMostTurn &&
         std::abs(octaves - std::round(octaves)) <= kDrift &&
         (fault.number != Number::kClock || std::abs(octaves) >= kLeastDrift) &&
         (fault.number != Number::kGain ||
          (fault.factor > 0.0 && std::abs(fault.factor - 1.0) >= kLeastGain));
}

}  // namespace

std::optional<NonlinearFault> FindNonlinearFault(const RobotModel& model, Recording recording,
                                                 bool of_model) {
  Samples samples(model, &recording);
  std::vector<NonlinearFault> all = ListNonlinearFaults(model, recording, samples.CalcRanges());
  // A few samples say which are worth all of them: of each kind and place the best number.
  constexpr size_t kFewSamples = 100, kFewFaults = 10;
  const size_t few = std::max<size_t>(1, samples.size() / kFewSamples);
  constexpr double kRoughly = 1e-3, kWell = 1e-6;
  std::vector<std::pair<double, NonlinearFault>> faults;
  for (NonlinearFault& one : all) {
    if (one.IsOfModel() != of_model) continue;
    const double misfit = CalcMisfit(samples.CalcResiduals(one, few));
    const auto same = std::ranges::find_if(faults, [&](const auto& known) {
      const NonlinearFault& other = known.second;
      return one.number != Number::kNone && one.number == other.number && one.joint == other.joint;
    });
    if (same == faults.end()) {
      faults.emplace_back(misfit, std::move(one));
    } else if (misfit < same->first) {
      *same = {misfit, std::move(one)};
    }
  }
  for (auto& [misfit, fault] : faults) misfit = Refine(model, few, kRoughly, &samples, &fault);
  std::ranges::sort(faults, {}, &std::pair<double, NonlinearFault>::first);
  faults.resize(std::min(faults.size(), kFewFaults));
  // The residual falls by a factor of three, of one joint or spread over several; with numbers something is
  // always explained.
  constexpr double kMuch = 1.1, kMuchOfNumber = 0.1;
  const double as_read = CalcMisfit(samples.CalcResiduals({}, 1));
  double best = as_read;
  const auto count = static_cast<double>(samples.size());
  const auto numbers_cost = [&](const NonlinearFault& fault) {
    return fault.number == Number::kNone
               ? 0.0
               : static_cast<double>(fault.CountNumbers()) * (2.0 + 0.5 * std::log(count)) / count;
  };
  std::optional<NonlinearFault> found;
  for (auto& [of_few, fault] : faults) {
    // Numbers pay by the Bayesian information criterion: degrees are degrees, and no gain of 57.2.
    const double misfit = Refine(model, 1, kWell, &samples, &fault) + numbers_cost(fault);
    const double most = as_read - (fault.number != Number::kNone ? kMuchOfNumber : kMuch);
    if (misfit < std::min(best, most) && IsPlausible(fault)) best = misfit, found = std::move(fault);
  }
  if (found && found->factor != 1.0 && samples.HasRatesOf(found->fault)) found->has_right_rates = true;
  return found;
}

}  // namespace dexcheck
