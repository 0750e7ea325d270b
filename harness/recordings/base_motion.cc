#include "harness/recordings/base_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "controller/common/linear_algebra.h"
#include "harness/diagnosis/line_search.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// A push does not hide behind what it adds to its joint's noise.
VectorXd InUnitsOfMedian(const VectorXd& squares) {
  const double usual = Median({squares.begin(), squares.end()});
  return usual > 0.0 ? VectorXd(squares / usual) : squares;
}

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

/// The effect of a constant acceleration of the base in a block: products of its three columns, of all
/// joints, and with the residual.
struct BlockProducts {
  double from = 0.0, to = 0.0;  // s
  Matrix3d squares = Matrix3d::Zero();
  Vector3d products = Vector3d::Zero();
};

struct Blocks {
  std::vector<BlockProducts> blocks;
  double left = 0.0;  // squares of all
};

void AddPart(const TorqueRows::Part& part, double weight, const VectorXd& left, Blocks* all) {
  for (size_t b = 0; b < all->blocks.size(); ++b) {
    const TorqueBalance::Block& block = part.balance->blocks()[b];
    const double count = block.counts[part.place];
    BlockProducts& one = all->blocks[b];
    one.from = block.from;
    one.to = block.to;
    if (!(count > 0.0)) continue;
    const Vector3d x = block.gravity.row(static_cast<Index>(part.place)).transpose() *
                       (std::sqrt(count) / block.samples / weight);
    const double y = left[part.begin + part.within + static_cast<Index>(b)];
    one.squares += x * x.transpose();
    one.products += x * y;
    all->left += y * y;
  }
}

Blocks MakeBlocks(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left,
                  size_t recording) {
  Blocks all;
  if (recordings.model().base().type != BaseType::kFixed) return all;
  all.blocks.resize(recordings[recording].fit->blocks().size());
  for (const TorqueRows::Part& part : rows.parts)
    if (part.recording == recording)
      AddPart(part, recordings[recording].weight[static_cast<Index>(part.place)], left, &all);
  return all;
}

/// Squares of the residual that accelerations of this frequency explain.
double CalcExplained(const std::vector<BlockProducts>& blocks, double frequency) {
  Matrix6d G = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  for (const BlockProducts& one : blocks) {
    const Vector2d phase(std::sin(0.5 * frequency * (one.from + one.to)),
                         std::cos(0.5 * frequency * (one.from + one.to)));
    for (int i = 0; i < 2; ++i) {
      b.segment<3>(3 * i) += phase[i] * one.products;
      for (int k = 0; k < 2; ++k) G.block<3, 3>(3 * i, 3 * k) += phase[i] * phase[k] * one.squares;
    }
  }
  return b.dot(SolveLeastSquares(G, b));
}

constexpr double kFraction = 0.2;  // of the residual, that makes a motion of the base worth a look

}  // namespace

double FindShaking(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left) {
  const Blocks all = MakeBlocks(recordings, rows, left, 0);
  if (all.blocks.empty()) return 0.0;
  constexpr double kFewestCycles = 3.0, kMostOfCycle = 0.3, kGrid = 0.2;
  const double length = all.blocks.back().to - all.blocks.front().from;
  double longest = length / static_cast<double>(all.blocks.size());
  for (const BlockProducts& one : all.blocks) longest = std::max(longest, one.to - one.from);
  const double cycle = 2.0 * kPi / length;
  const double begin = kFewestCycles * cycle, end = kMostOfCycle * 2.0 * kPi / longest;
  if (!(begin < end)) return 0.0;
  const auto explained = [&](double frequency) { return CalcExplained(all.blocks, frequency); };
  const double best = FindMost(explained, begin, end, kGrid * cycle);
  return explained(best) > kFraction * all.left ? best : 0.0;
}

/// Since when.
static std::optional<double> FindStep(const RecordingSet& recordings, const TorqueRows& rows,
                                      const VectorXd& left, size_t recording) {
  const Blocks all = MakeBlocks(recordings, rows, left, recording);
  std::optional<double> best;
  double most = kFraction * all.left;
  Matrix3d G = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  // An acceleration that holds nearly all the time is gravity.
  for (size_t i = all.blocks.size(); i-- > 1 + all.blocks.size() / 10;) {
    G += all.blocks[i].squares;
    b += all.blocks[i].products;
    const double explained = b.dot(SolveLeastSquares(G, b));
    if (explained > most) most = explained, best = all.blocks[i].from;
  }
  return best;
}

std::vector<Push> FindPushes(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left,
                             size_t recording) {
  const std::vector<TorqueBalance::Block>& blocks = recordings[recording].fit->blocks();
  VectorXd squares = VectorXd::Zero(static_cast<Index>(blocks.size()));
  for (const TorqueRows::Part& part : rows.parts)
    if (part.recording == recording)
      squares += InUnitsOfMedian(left.segment(part.begin + part.within, part.size - part.within).cwiseAbs2());
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
  std::vector<const TorqueBalance::Block*> blocks;
  std::vector<Eigen::RowVectorXd> columns;
  std::vector<double> y;
  constexpr double kBeside = 0.5;  // s: what is held out may hide an end
  const std::vector<TorqueBalance::Block>& all =
      recordings[static_cast<size_t>(push.recording)].fit->blocks();
  // The rest of a stuck torque passes through zero, so that it stands out for a part of the time.
  const double beside = push.is_stuck ? all.back().to - all.front().from : push.reach + kBeside;
  for (const TorqueRows::Part& part : rows.parts) {
    if (part.recording != static_cast<size_t>(push.recording)) continue;
    for (size_t b = 0; b < part.balance->blocks().size(); ++b) {
      const TorqueBalance::Block& block = part.balance->blocks()[b];
      if (block.to < push.from - 2.0 * beside || block.from > push.to + 2.0 * beside) continue;
      const Eigen::RowVectorXd own = CalcPushColumns(recordings, push, part, b);
      if (own.isZero(0.0)) continue;
      blocks.push_back(&block);
      columns.push_back(own);
      y.push_back(left[part.begin + part.within + static_cast<Index>(b)]);
    }
  }
  if (blocks.empty()) return push;
  const auto explained = [&](double from, double to) {
    const Index width = columns.front().size();
    MatrixXd G = MatrixXd::Zero(width, width);
    VectorXd b = VectorXd::Zero(width);
    for (size_t i = 0; i < blocks.size() && from < to; ++i) {
      const double share = CalcShare({.from = from, .to = to, .reach = push.reach}, *blocks[i]);
      if (share == 0.0) continue;
      G.noalias() += share * share * columns[i].transpose() * columns[i];
      b += share * y[i] * columns[i].transpose();
    }
    return b.dot(SolveLeastSquares(G, b));
  };
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
