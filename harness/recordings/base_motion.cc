#include "harness/recordings/base_motion.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "controller/common/linear_algebra.h"
#include "harness/diagnosis/sine_fit.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// A stretch that stands out, without what smoothing makes of its begin and end.
Push TrimWindow(const VectorXd& squares, Index first, Index last,
                const std::vector<TorqueBalance::Block>& blocks) {
  const double whole = Median({squares.begin() + first, squares.begin() + last + 1});
  constexpr double kNearlyWhole = 0.25;  // half of it
  while (first < last && squares[first] < kNearlyWhole * whole) ++first;
  while (last > first && squares[last] < kNearlyWhole * whole) --last;
  return {.from = blocks[static_cast<size_t>(first)].from, .to = blocks[static_cast<size_t>(last)].to};
}

/// The few stretches that stand out most.
std::vector<Push> FindWindows(const VectorXd& squares, const std::vector<TorqueBalance::Block>& blocks) {
  constexpr size_t kMost = 3;
  constexpr double kStandsOut = 12.0, kStays = 4.0;
  if (squares.size() < 16) return {};
  const double usual = std::max(Median({squares.begin(), squares.end()}), std::numeric_limits<double>::min());
  VectorXd rest = squares;
  std::vector<Push> windows;
  while (windows.size() < kMost) {
    Index peak = 0;
    if (!(rest.maxCoeff(&peak) > kStandsOut * usual)) break;
    Index first = peak, last = peak;
    // A block in between may be small by chance.
    const auto stays = [&](Index at) { return at >= 0 && at < rest.size() && rest[at] > kStays * usual; };
    while (stays(first - 1) || stays(first - 2)) --first;
    while (stays(last + 1) || stays(last + 2)) ++last;
    // A residual that stands out half of the time is no push.
    const Push push = TrimWindow(squares, first, last, blocks);
    // Windows of smoothing overlap, so that what acts shows in more than one sample.
    if (last - first <= squares.size() / 2 && push.from < push.to) windows.push_back(push);
    rest.segment(first, last - first + 1).setZero();
  }
  return windows;
}

/// The effect of a push in blocks of its recording: products of its columns, of all joints, and with the
/// residual.
class PushProducts {
 public:
  using Block = TorqueBalance::Block;

  /// @param beside the time around the push from which blocks count, s.
  PushProducts(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left, const Push& push,
               double beside = std::numeric_limits<double>::infinity()) {
    const auto recording = static_cast<size_t>(push.recording);
    for (const Block& block : recordings[recording].fit->blocks())
      if (block.to >= push.from - beside && block.from <= push.to + beside) sums_.push_back({&block, {}, {}});
    for (const TorqueRows::Part& part : rows.parts)
      for (Sums& one : sums_) {
        if (part.recording != recording) break;
        const auto b = static_cast<size_t>(one.block - part.balance->blocks().data());
        const Eigen::RowVectorXd x = CalcPushColumns(recordings, push, part, b);
        const double y = left[part.begin + part.within + static_cast<Index>(b)];
        if (one.products.size() == 0)
          one.squares = MatrixXd::Zero(x.size(), x.size()), one.products = VectorXd::Zero(x.size());
        one.squares += x.transpose() * x;
        one.products += y * x.transpose();
        left_ += y * y;
      }
  }

  /// Squares of the residual.
  [[nodiscard]] double left() const { return left_; }
  /// Squares of it that a push explains whose size is a sum of such shapes in time, by their means in a
  /// block.
  [[nodiscard]] double CalcExplained(const std::function<VectorXd(const Block&)>& shapes) const {
    MatrixXd G;
    VectorXd b;
    for (const Sums& one : sums_) {
      const VectorXd shape = shapes(*one.block);
      const Index width = one.products.size();
      if (b.size() == 0) G.setZero(shape.size() * width, shape.size() * width), b.setZero(G.cols());
      for (Index i = 0; i < shape.size(); ++i) {
        if (shape[i] == 0.0) continue;
        b.segment(i * width, width) += shape[i] * one.products;
        for (Index k = 0; k < shape.size(); ++k)
          G.block(i * width, k * width, width, width) += shape[i] * shape[k] * one.squares;
      }
    }
    return b.dot(SolveLeastSquares(G, b));
  }

 private:
  struct Sums {
    const Block* block;
    MatrixXd squares;
    VectorXd products;
  };
  std::vector<Sums> sums_;
  double left_ = 0.0;
};

constexpr double kFraction = 0.2;  // of the residual, that makes a motion of the base worth a look

}  // namespace

double FindShaking(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left) {
  const std::vector<TorqueBalance::Block>& blocks = recordings[0].fit->blocks();
  if (recordings.model().base().type != BaseType::kFixed || blocks.empty()) return 0.0;
  constexpr double kFewestCycles = 3.0, kMostOfCycle = 0.3, kGrid = 0.2;
  const double length = blocks.back().to - blocks.front().from;
  double longest = length / static_cast<double>(blocks.size());
  for (const TorqueBalance::Block& one : blocks) longest = std::max(longest, one.to - one.from);
  const double cycle = 2.0 * kPi / length;
  const double begin = kFewestCycles * cycle, end = kMostOfCycle * 2.0 * kPi / longest;
  if (!(begin < end)) return 0.0;
  const PushProducts accelerations(recordings, rows, left, {});
  const auto explained = [&](double frequency) {
    return accelerations.CalcExplained([frequency](const TorqueBalance::Block& block) {
      return Vector2d(std::sin(frequency * block.centre()), std::cos(frequency * block.centre()));
    });
  };
  const double best = FindMost(explained, begin, end, kGrid * cycle);
  return explained(best) > kFraction * accelerations.left() ? best : 0.0;
}

/// Returns since when an acceleration of the base, or a payload, explains most to the end.
static std::optional<double> FindStep(const RecordingSet& recordings, const TorqueRows& rows,
                                      const VectorXd& left, size_t recording) {
  const RobotModel& model = recordings.model();
  const std::vector<TorqueBalance::Block>& blocks = recordings[recording].fit->blocks();
  std::vector<int> payloads = ListLastLinks(model);
  if (model.base().type == BaseType::kFixed) payloads.push_back(-1);
  // A cause that holds nearly all the time is gravity, or a payload of the whole recording.
  const double begin = blocks[blocks.size() / 10].to, end = blocks.back().from;
  std::optional<double> step;
  double most = 0.0;
  for (const int payload : payloads) {
    const PushProducts products(recordings, rows, left,
                                {.recording = static_cast<int>(recording), .payload = payload});
    const auto explained = [&](double from) {
      return products.CalcExplained([from](const TorqueBalance::Block& block) {
        return VectorXd::Constant(1, block.from >= from ? 1.0 : 0.0);
      });
    };
    most = std::max(most, kFraction * products.left());
    const double best =
        FindMost(explained, begin, end, (end - begin) / static_cast<double>(blocks.size()), most, 0);
    if (!(explained(best) > most)) continue;
    step = best;
    most = explained(best);
  }
  return step;
}

std::vector<Push> FindPushes(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left,
                             size_t recording) {
  const std::vector<TorqueBalance::Block>& blocks = recordings[recording].fit->blocks();
  VectorXd squares = VectorXd::Zero(static_cast<Index>(blocks.size()));
  for (const TorqueRows::Part& part : rows.parts)
    if (part.recording == recording)
      squares += left.segment(part.begin + part.within, part.size - part.within).cwiseAbs2();
  std::vector<Push> pushes = FindWindows(squares, blocks);
  if (const std::optional<double> when = FindStep(recordings, rows, left, recording))
    pushes.push_back({.from = *when, .to = blocks.back().to});
  for (Push& when : pushes) {
    when.recording = static_cast<int>(recording);
    when.reach = recordings[recording].reach;
    // A push that goes on at the end does not end there.
    if (when.to >= blocks.back().from) when.to = blocks.back().to + when.reach;
    if (when.from <= blocks.front().to) when.from = blocks.front().from - when.reach;
  }
  return pushes;
}

std::vector<TorqueFault> ListPushes(const RobotModel& model, const std::vector<int>& joints, const Push& when,
                                    const MotionExtents& extents) {
  constexpr double kMostAcceleration = 2.0 * 9.81;  // m/s^2
  std::vector<TorqueFault> faults;
  const auto add = [&](const std::string& fault, const std::string& place, const std::string& unit,
                       Eigen::Index width, double most) -> TorqueFault& {
    TorqueFault& one = faults.emplace_back();
    one.kind = TorqueFault::kPush;
    one.fault = fault;
    one.place = place;
    one.unit = unit;
    one.push = when;
    one.recording = when.recording;
    one.parameters = 2;  // when it begins and ends
    constexpr double kForce = 100.0;
    one.scale = VectorXd::Constant(width, kForce);
    one.is_possible = [most](const VectorXd& a) { return a.norm() <= most; };
    return one;
  };
  for (int link = 0; link < model.num_joints(); ++link)
    for (const bool has_moment : {false, true}) {
      constexpr double kMostForce = 300.0;
      TorqueFault& one = add("force", "link " + model.link_name(link), "N", has_moment ? 6 : 3, kMostForce);
      one.push.link = link;
      one.push.has_moment = has_moment;
    }
  add("acceleration", "base", "m/s^2", 3, kMostAcceleration);
  for (const int link : ListLastLinks(model)) {
    TorqueFault& payload = add("payload", "link " + model.link_name(link), "kg", 4, 0.0);
    payload.push.payload = link;
    payload.scale = Eigen::Vector4d(5.0, 0.5, 0.5, 0.5);
    payload.is_possible = IsPayload;
  }
  for (const int joint : joints) {
    const std::string place = "joint " + model.joint(joint).name;
    const char* const unit = model.joint(joint).type == JointType::kRevolute ? "N m" : "N";
    add("torque", place, unit, 1, extents.FindTorque(joint)).push.joint = joint;
    TorqueFault& stuck = add("stuck torque", place, unit, 2, 0.0);
    stuck.push.joint = joint;
    stuck.push.is_stuck = true;
    stuck.scale[1] = 1.0;
    constexpr double kWhole = 0.1;
    stuck.is_possible = [](const VectorXd& a) { return std::abs(a[1] - 1.0) < kWhole; };
  }
  return faults;
}

Push FindTimes(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left, Push push) {
  constexpr double kBeside = 0.5;  // s: what is held out may hide an end
  const std::vector<TorqueBalance::Block>& all =
      recordings[static_cast<size_t>(push.recording)].fit->blocks();
  // The rest of a stuck torque passes through zero, so that it stands out for a part of the time.
  const double beside = push.is_stuck ? all.back().to - all.front().from : push.reach + kBeside;
  const PushProducts products(recordings, rows, left, push, 2.0 * beside);
  const auto explained = [&](double from, double to) {
    return products.CalcExplained([&](const TorqueBalance::Block& block) {
      return VectorXd::Constant(
          1, from < to ? CalcShare({.from = from, .to = to, .reach = push.reach}, block) : 0.0);
    });
  };
  if (!(explained(push.from, push.to) > 0.0)) return push;
  constexpr double kGrid = 0.2, kSteps = 200.0;
  const double step = std::max(kGrid * push.reach, beside / kSteps);
  for (int twice = 0; twice < 2; ++twice) {
    push.from = FindMost([&](double from) { return explained(from, push.to); }, push.from - beside,
                         push.from + beside, step);
    push.to = FindMost([&](double to) { return explained(push.from, to); }, push.to - beside,
                       push.to + beside, step);
  }
  return push;
}

}  // namespace dexcheck
