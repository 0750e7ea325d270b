#include "harness/recordings/compare_recordings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "harness/diagnosis/sine_fit.h"

namespace dexcheck {
namespace {

using Traces = std::vector<TorqueTrace>;

/// Positions and measured torques of all joints at a time, by interpolation; none outside.
std::optional<VectorXd> Interpolate(const Traces& traces, double time) {
  const auto after = std::lower_bound(traces.begin(), traces.end(), time,
                                      [](const TorqueTrace& one, double t) { return one.time < t; });
  if (after == traces.begin() || after == traces.end()) return std::nullopt;
  const TorqueTrace& a = *(after - 1);
  const double weight = (time - a.time) / (after->time - a.time);
  VectorXd values(a.q.size() + a.measured.size());
  values << a.q + weight * (after->q - a.q), a.measured + weight * (after->measured - a.measured);
  return values;
}

/// Mean squares of the differences at the first's times, entry by entry; none where too little overlaps.
std::optional<VectorXd> CalcDifference(const Traces& first, const Traces& second, double delay) {
  VectorXd squares, counts;
  size_t overlap = 0;
  for (const TorqueTrace& one : first) {
    const std::optional<VectorXd> other = Interpolate(second, one.time + delay);
    if (!other) continue;
    VectorXd own(other->size());
    own << one.q, one.measured;
    if (squares.size() == 0) squares = counts = VectorXd::Zero(own.size());
    ++overlap;
    // A joint that friction holds has no known torque.
    for (Eigen::Index i = 0; i < own.size(); ++i) {
      if (!std::isfinite(own[i]) || !std::isfinite((*other)[i])) continue;
      squares[i] += ((*other)[i] - own[i]) * ((*other)[i] - own[i]);
      counts[i] += 1.0;
    }
  }
  if (overlap < first.size() / 2) return std::nullopt;
  return VectorXd(squares.cwiseQuotient(counts.cwiseMax(1.0)));
}

/// The delay at which the positions agree best.
double FindDelay(const Traces& first, const Traces& second, Eigen::Index joints) {
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  constexpr int kHalvings = 10;
  const double length = first.back().time - first.front().time;
  const double at_once = second.front().time - first.front().time;
  const auto calc_likeness = [&](double delay) {
    const std::optional<VectorXd> squares = CalcDifference(first, second, delay);
    return squares ? -squares->head(joints).sum() : kNever;
  };
  return FindMost(calc_likeness, at_once - 0.5 * length, at_once + 0.5 * length,
                  length / static_cast<double>(first.size()), kNever, kHalvings);
}

bool Differ(const Fault& a, const Fault& b) {
  constexpr double kErrors = 3.0, kEqual = 0.01;
  const double apart = std::abs(a.value - b.value);
  return apart > kErrors * std::hypot(a.error, b.error) &&
         apart > kEqual * std::max(std::abs(a.value), std::abs(b.value));
}

std::vector<CauseDifference> CompareCauses(const RecordingJudgement& first,
                                           const RecordingJudgement& second) {
  std::vector<CauseDifference> differences;
  std::vector<Fault> others;
  for (const Explanation& other : second.causes) others.push_back(other.faults.front());
  for (const Explanation& cause : first.causes) {
    const Fault& one = cause.faults.front();
    const auto same =
        std::find_if(others.begin(), others.end(), [&](const Fault& other) { return one.IsLike(other); });
    if (same == others.end()) {
      differences.push_back({one, std::nullopt});
      continue;
    }
    if (Differ(one, *same)) differences.push_back({one, *same});
    others.erase(same);
  }
  for (const Fault& other : others) differences.push_back({std::nullopt, other});
  return differences;
}

}  // namespace

std::string CauseDifference::Describe() const {
  if (!second) return first->Describe() + " in the first, none in the second";
  if (!first) return second->Describe() + " in the second, none in the first";
  return first->Describe() + " in the first, " + second->Describe() + " in the second";
}

RecordingComparison CompareRecordings(const RobotModel& model, std::vector<Recording>* recordings,
                                      const JudgeOptions& options,
                                      const std::function<bool(long rows)>& on_rows) {
  RecordingComparison comparison;
  RecordingJudgement* const judgements[] = {&comparison.first, &comparison.second};
  for (size_t i = 0; i < 2; ++i) {
    std::vector<Recording> one;
    one.push_back(std::move((*recordings)[i]));
    *judgements[i] = JudgeRecordings(model, &one, options, on_rows);
  }
  comparison.causes = CompareCauses(comparison.first, comparison.second);
  if (comparison.first.joints != comparison.second.joints) return comparison;
  const Traces& first = comparison.first.traces;
  const Traces& second = comparison.second.traces;
  const Eigen::Index n = model.num_joints();
  comparison.delay = FindDelay(first, second, n);
  const std::optional<VectorXd> squares = CalcDifference(first, second, comparison.delay);
  if (!squares) return comparison;
  // Alike when far closer to each other than to their own means.
  VectorXd mean = VectorXd::Zero(n), spread = VectorXd::Zero(n);
  for (const TorqueTrace& one : first) mean += one.q / static_cast<double>(first.size());
  for (const TorqueTrace& one : first)
    spread += (one.q - mean).cwiseAbs2() / static_cast<double>(first.size());
  constexpr double kAlike = 0.05;
  comparison.is_same_motion = squares->head(n).sum() < kAlike * spread.sum();
  if (!comparison.is_same_motion) return comparison;
  for (size_t place = 0; place < comparison.first.joints.size(); ++place) {
    const int joint = comparison.first.joints[place];
    comparison.joints.push_back(
        {joint, std::sqrt((*squares)[joint]), std::sqrt((*squares)[n + static_cast<Eigen::Index>(place)])});
  }
  return comparison;
}

}  // namespace dexcheck
