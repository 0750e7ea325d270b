// How a recording is smoothed: its noise, and the window at which accelerations' errors are least.

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "harness/base/ranges.h"
#include "harness/recordings/jumps.h"
#include "harness/recordings/motion_fit.h"

namespace dexcheck {
namespace {

constexpr int kHigherOrder = 6;
constexpr size_t kHalves[] = {3, 4, 6, 8, 11, 16, 23, 32, 45, 64, 90, 128};

}  // namespace

double MotionFit::FindQuantum(Eigen::Index channel) const {
  double least = std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (size_t i = 1; i < rows_ahead_.size(); ++i) {
    const double change = std::abs(rows_ahead_[i][channel] - rows_ahead_[i - 1][channel]);
    largest = std::max(largest, std::abs(rows_ahead_[i][channel]));
    if (change > 1e-12 * largest) least = std::min(least, change);
  }
  if (!std::isfinite(least)) return 0.0;
  // Beyond a few steps, the printed digits decide whether a change is whole.
  constexpr double kFew = 100.0, kWhole = 0.05, kNearlyAll = 0.95, kMany = 0.05;
  double whole = 0.0, few = 0.0;
  for (size_t i = 1; i < rows_ahead_.size(); ++i) {
    const double steps = std::abs(rows_ahead_[i][channel] - rows_ahead_[i - 1][channel]) / least;
    if (!(steps < kFew)) continue;
    few += 1.0;
    whole += std::abs(steps - std::round(steps)) < kWhole ? 1.0 : 0.0;
  }
  const bool is_step = few > kMany * static_cast<double>(rows_ahead_.size()) && whole > kNearlyAll * few;
  return is_step ? least : 0.0;
}

void MotionFit::MeasureSteadiness() {
  // The first is 5.4 standard deviations of Gaussian noise: by chance, one of 15 million rows is replaced.
  constexpr double kTimes = 8.0, kQuanta = 3.0;
  most_alone_ = VectorXd::Zero(last_.size());
  for (Eigen::Index channel = 0; channel < last_.size(); ++channel) {
    if (!IsSmooth(recording_->channels[static_cast<size_t>(channel)])) continue;
    std::vector<double> bends;
    for (size_t i = 1; i + 1 < rows_ahead_.size(); ++i)
      bends.push_back(std::abs(rows_ahead_[i][channel] -
                               0.5 * (rows_ahead_[i - 1][channel] + rows_ahead_[i + 1][channel])));
    // A torque at its limit does not bend.
    std::erase(bends, 0.0);
    most_alone_[channel] = std::max(kTimes * Median(bends), kQuanta * FindQuantum(channel));
  }
  for (size_t i = 0; i < rows_ahead_.size(); ++i) ReplaceWrongSamples(i);
}

void MotionFit::ReplaceWrongSamples(size_t row) {
  constexpr double kAgree = 0.3;  // of the distance
  constexpr size_t kBeside = 2;
  if (rows_ahead_.size() <= 2 * kBeside) return;
  const size_t last = rows_ahead_.size() - 1;
  const size_t first = std::min(row < kBeside ? 0 : row - kBeside, last - 2 * kBeside);
  for (Eigen::Index channel = 0; channel < last_.size(); ++channel) {
    const Channel& own = recording_->channels[static_cast<size_t>(channel)];
    if (!IsSmooth(own)) continue;
    const auto at = [&](size_t i) { return rows_ahead_[i][channel]; };
    const double mean = 0.5 * (at(row > 0 ? row - 1 : 1) + at(row < last ? row + 1 : last - 1));
    const double alone = std::abs(at(row) - mean);
    double apart = 0.0;
    for (size_t i = first; i <= first + 2 * kBeside; ++i)
      if (i != row) apart = std::max(apart, std::abs(at(i) - mean));
    if (!(alone > most_alone_[channel] && apart < kAgree * alone)) continue;
    rows_ahead_[row][channel] = mean;
    ++wrong_[{own.joint, own.quantity}];
  }
}

void MotionFit::ReportWrongSamples() {
  constexpr double kFew = 0.002;        // of the rows: these are noise
  constexpr double kFewTorques = 0.01;  // these say nothing of the robot, and are left out
  for (const auto& [place, count] : wrong_) {
    const bool is_position = place.second == RecordedQuantity::kPosition;
    const std::string quantity = is_position ? "position" : "torque";
    const std::string& joint = model_->joint(place.first).name;
    const double share = static_cast<double>(count) / static_cast<double>(rows_);
    if (share > (is_position ? kFew : kFewTorques)) {
      faults_.push_back({"lost or wrong samples of the " + quantity, "joint " + joint, 100.0 * share, 0.0,
                         "%", "(not used)"});
    } else if (share > kFew) {
      notes_.push_back(fmt::format("{}: {} wrong samples of the torque of {} are left out", recording_->name,
                                   count, joint));
    }
  }
}

void MotionFit::UndoJumps() {
  jumps_ = VectorXd::Zero(last_.size());
  JumpOptions options{.time = ChannelOf(RecordedQuantity::kTime, -1),
                      .quanta = VectorXd::Zero(last_.size()),
                      .step = facts_.step,
                      .longest_gap = kGap};
  for (Eigen::Index i = 0; i < last_.size(); ++i) {
    if (recording_->channels[static_cast<size_t>(i)].quantity != RecordedQuantity::kPosition) continue;
    options.positions.push_back(i);
    options.quanta[i] = FindQuantum(i);
  }
  for (const auto& [at, jumps] : FindJumps(rows_ahead_, options)) {
    for (const Jump& jump : jumps) {
      for (size_t i = jump.row; i < rows_ahead_.size(); ++i) rows_ahead_[i][at] -= jump.size;
      jumps_[at] -= jump.size;
    }
    const Jump& most =
        *std::ranges::max_element(jumps, {}, [](const Jump& one) { return std::abs(one.size); });
    std::string when = fmt::format("at {:.4g} s", rows_ahead_[most.row - 1][options.time]);
    if (jumps.size() > 1) when += fmt::format(", the largest of {}", jumps.size());
    const int joint = recording_->channels[static_cast<size_t>(at)].joint;
    if (joint >= 0) {
      const bool turns = model_->joint(joint).type == JointType::kRevolute;
      faults_.push_back({"jump of the position", "joint " + model_->joint(joint).name, most.size, 0.0,
                         turns ? "rad" : "m", when});
    } else if (most.size > 0.0) {
      faults_.push_back({"jump of the time", "all joints", most.size, 0.0, "s", when});
    } else {
      faults_.push_back({"lost rows", "all joints", std::numeric_limits<double>::quiet_NaN(), 0.0, "",
                         when + " (the time has no gap)"});
    }
  }
  last_ += jumps_;
}

VectorXd MotionFit::MeasureNoise(const std::vector<size_t>& centres, size_t half) const {
  const int time = ChannelOf(RecordedQuantity::kTime, -1);
  std::vector<std::vector<double>> left(static_cast<size_t>(last_.size()));
  for (const size_t centre : centres) {
    const MatrixXd window = GetWindow(centre, half);
    const MatrixXd C = CalcCoefficients(centre, half, kOrder);
    MatrixXd V = MatrixXd::Ones(window.rows(), kOrder + 1);
    for (int p = 1; p <= kOrder; ++p)
      V.col(p) = V.col(p - 1).array() * (window.col(time).array() - rows_ahead_[centre][time]);
    const MatrixXd rest = window - V * (C * window);
    for (Eigen::Index i = 0; i < rest.cols(); ++i)
      left[static_cast<size_t>(i)].push_back(rest.col(i).squaredNorm() /
                                             std::max(1.0, static_cast<double>(rest.rows() - kOrder - 1)));
  }
  VectorXd sigma(last_.size());
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    constexpr double kMedianToMean = 1.06;  // of chi^2 with twelve degrees of freedom
    sigma[i] = std::sqrt(
        std::max(kMedianToMean * Median(left[static_cast<size_t>(i)]), Square(FindQuantum(i)) / 12.0));
  }
  return sigma;
}

void MotionFit::CheckRows() {
  const std::string& name = recording_->name;
  constexpr size_t kFewest = 16;
  if (rows_ahead_.size() < kFewest) {
    throw InputError(
        fmt::format("{}: has {} rows that differ, fewer than {}", name, rows_ahead_.size(), kFewest));
  }
  const int time = ChannelOf(RecordedQuantity::kTime, -1);
  const auto list_steps = [&] {
    std::vector<double> steps;
    for (size_t i = 1; i < rows_ahead_.size(); ++i)
      steps.push_back(rows_ahead_[i][time] - rows_ahead_[i - 1][time]);
    return steps;
  };
  facts_.step = Median(list_steps());
  begin_ = rows_ahead_.front()[time];
  constexpr double kLongest = 0.5;
  if (facts_.step > kLongest)
    throw InputError(fmt::format("{}: time: a row every {:.4g} s shows no motion; its unit may be another",
                                 name, facts_.step));
  MeasureSteadiness();
  UndoJumps();
  const std::vector<double> steps = list_steps();
  for (size_t i = 1; i < rows_ahead_.size(); ++i) {
    if (steps[i - 1] > kGap * facts_.step) ++segment_, ++gaps_;
    segments_[i] = segment_;
  }
}

void MotionFit::Analyse() {
  CheckRows();
  const Eigen::Index n = model_->num_joints();
  for (VectorXd* vector : {&facts_.position, &facts_.velocity, &facts_.torque, &facts_.smooth_position,
                           &facts_.smooth_torque, &facts_.acceleration, &facts_.rest, &sample_.q, &sample_.qd,
                           &sample_.qdd, &sample_.jerk, &sample_.snap, &sample_.torque, &sample_.torque_rate,
                           &sample_.direction, &sample_.slowest, &sample_.beyond, &sample_.most_torque})
    *vector = VectorXd::Zero(n);
  sample_.friction = MatrixXd::Zero(n, kFrictionShapes);
  constexpr size_t kShort = 8;
  const size_t half = std::min(kShort, (rows_ahead_.size() - 1) / 2);
  const std::vector<size_t> centres = ListCentres(half);
  if (centres.empty())
    throw InputError(recording_->name + ": has gaps everywhere: no " + std::to_string(2 * half + 1) +
                     " rows follow each other");
  const VectorXd sigma = MeasureNoise(centres, half);
  facts_.wrench = sample_.wrench = VectorXd::Zero(6 * static_cast<Eigen::Index>(recording_->wrenches.size()));
  Vector2d base = Vector2d::Zero();
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    const Channel& channel = recording_->channels[static_cast<size_t>(i)];
    if (channel.quantity == RecordedQuantity::kPosition) {
      constexpr double kMuch = 0.5;
      facts_.position[channel.joint] = sigma[i];
      facts_.is_quantised =
          facts_.is_quantised || (sigma[i] > 0.0 && FindQuantum(i) / std::sqrt(12.0) > kMuch * sigma[i]);
    } else if (channel.quantity == RecordedQuantity::kVelocity) {
      facts_.velocity[channel.joint] = sigma[i];
    } else if (channel.quantity == Effort()) {
      facts_.torque[channel.joint] = sigma[i];
      for (const Row& row : rows_ahead_) {
        double& most = sample_.most_torque[channel.joint];
        most = std::max(most, std::abs(row[i]) - 3.0 * sigma[i]);
      }
    } else if (channel.quantity == RecordedQuantity::kWrench) {
      facts_.wrench[channel.joint] = sigma[i];
    } else if (channel.quantity == RecordedQuantity::kBase) {
      base[channel.joint / 3 > 0 ? 1 : 0] += Square(sigma[i]);
    }
  }
  CheckVelocities();
  ReportWrongSamples();
  facts_.stands = Stands();
  facts_.inertia = CalcInertia(centres);
  ChooseWindow(centres);
  AddWrenchErrors();
  const MatrixXd C = CalcCoefficients(ListCentres(half_).front(), half_, kOrder);
  facts_.base = 2.0 * std::sqrt(base[0] * C.row(2).squaredNorm() +
                                base[1] * C.row(0).squaredNorm() * model_->gravity().squaredNorm());
  CalcSpeeds();
  facts_.smooth_torque = facts_.smooth_torque.cwiseMax(CalcFilteredNoise()).eval();
}

void MotionFit::AddWrenchErrors() {
  // When a force acted is known to a row's time, and where, if its moment was not measured, to what soft
  // ground gives.
  constexpr double kPlace = 1e-4;  // m
  const std::vector<size_t> centres = ListCentres(half_);
  VectorXd errors = VectorXd::Zero(facts_.wrench.size());
  for (const size_t centre : centres) {
    const MatrixXd fitted = CalcCoefficients(centre, half_, kOrder) * GetWindow(centre, half_);
    for (int k = 0; k < errors.size(); ++k) {
      const int channel = ChannelOf(RecordedQuantity::kWrench, k);
      if (channel < 0) continue;
      errors[k] += Square(fitted(1, channel) * facts_.step) / 12.0;
      if (k % 6 < 3 && ChannelOf(RecordedQuantity::kWrench, k + 3) < 0)
        errors.segment<3>(k - k % 6 + 3).array() += Square(kPlace * fitted(0, channel));
    }
  }
  facts_.wrench =
      (facts_.wrench.cwiseAbs2() + errors / static_cast<double>(centres.size())).cwiseSqrt().eval();
}

bool MotionFit::Stands() const {
  constexpr double kLittle = 1e-3, kErrors = 10.0;  // rad or m; times the noise of a number
  if (!has_ended_ || gaps_ > 0) return false;
  for (size_t i = 0; i < recording_->channels.size(); ++i) {
    if (recording_->channels[i].quantity != RecordedQuantity::kPosition) continue;
    const auto at = static_cast<Eigen::Index>(i);
    const auto [low, high] = std::ranges::minmax(rows_ahead_, {}, [at](const Row& row) { return row[at]; });
    if (high[at] - low[at] > kLittle + kErrors * facts_.position[recording_->channels[i].joint]) return false;
  }
  return !recording_->Has(RecordedQuantity::kBase);
}

std::optional<Fault> MotionFit::CheckVelocity(int joint, const std::vector<size_t>& centres, size_t half,
                                              double least) {
  constexpr double kFarOff = 0.1, kShows = 5.0, kLate = 1.5, kErrors = 6.0, kExplains = 0.5;
  const int position = ChannelOf(RecordedQuantity::kPosition, joint),
            velocity = ChannelOf(RecordedQuantity::kVelocity, joint),
            time = ChannelOf(RecordedQuantity::kTime, -1);
  if (position < 0 || velocity < 0 || centres.empty()) return std::nullopt;
  // v = gain r + lag (-r'), of derivatives r and r' of the position, whose noise makes squares too large.
  Eigen::Matrix2d G = Eigen::Matrix2d::Zero(), noise = G;
  Vector2d b = Vector2d::Zero();
  double squares = 0.0;
  for (const size_t centre : centres) {
    const MatrixXd window = GetWindow(centre, half);
    const MatrixXd C = CalcCoefficients(centre, half, kOrder);
    const Vector2d rates(C.row(1).dot(window.col(position)), -2.0 * C.row(2).dot(window.col(position)));
    // Both are smoothed in the same way: the velocities as what they add up to.
    VectorXd moved = VectorXd::Zero(window.rows());
    for (Eigen::Index k = 1; k < moved.size(); ++k)
      moved[k] = moved[k - 1] + 0.5 * (window(k, time) - window(k - 1, time)) *
                                    (window(k, velocity) + window(k - 1, velocity));
    const double v = C.row(1).dot(moved);
    const double variance = Square(facts_.position[joint]);
    G += rates * rates.transpose();
    noise.diagonal() += variance * Vector2d(C.row(1).squaredNorm(), 4.0 * C.row(2).squaredNorm());
    b += v * rates;
    squares += v * v;
  }
  constexpr double kStill = 1e-6;  // rad/s or m/s
  if (!(G(0, 0) > kShows * noise(0, 0) + Square(kStill) * static_cast<double>(centres.size())))
    return std::nullopt;
  const Eigen::Matrix2d right = G - noise;
  const double gain = b[0] / right(0, 0);
  const std::string place = "joint " + model_->joint(joint).name;
  // Windows that overlap have the same noise.
  const auto windows = static_cast<double>(rows_ahead_.size()) / static_cast<double>(2 * half + 1);
  const auto count = static_cast<double>(centres.size());
  const auto error_of = [&](double left, Eigen::Index k) {
    return std::sqrt(left / right(k, k) / std::max(1.0, std::min(windows, count) - 2.0) *
                     std::min(windows, count) / count);
  };
  const double without = std::max(0.0, squares - gain * b[0]), off = Square(gain - 1.0) * right(0, 0);
  if (std::abs(gain - 1.0) >= std::max(least, kErrors * error_of(without, 0)) &&
      off > kExplains * (off + without))
    return Fault{
        "velocity gain", place, gain, 0.0, "", std::abs(gain + 1.0) < kFarOff ? "(the other sign)" : ""};
  std::optional<Fault> unless_late;
  if (std::abs(gain - 1.0) >= kFarOff)
    unless_late = Fault{"velocity", place, std::numeric_limits<double>::quiet_NaN(),
                        0.0,        "",    "(not the position's derivative)"};
  if (!(G(1, 1) > kShows * noise(1, 1))) return unless_late;
  const Vector2d x = right.ldlt().solve(b);
  const double left = std::max(0.0, squares - x.dot(b)), error = error_of(left, 1);
  // A logger may read velocities half a step before positions, as a leapfrog has them.
  constexpr double kLeast = 0.02;  // rows
  if (std::abs(x[1]) > std::max(kErrors * error, kLeast * facts_.step) &&
      std::abs(x[1]) < kLate * facts_.step)
    velocity_lags_[joint] = x[1];
  if (x[1] < kLate * facts_.step || x[1] < kErrors * error || without - left < kExplains * without)
    return unless_late;
  return Fault{"velocity lag", place, x[1], error, "s", "(late or filtered)"};
}

void MotionFit::CheckVelocities() {
  // Over a time in which noise of positions determines accelerations, too.
  constexpr double kWindow = 0.1;  // s to each side
  constexpr size_t kLeast = 8, kMost = 64;
  const size_t half = std::min(std::clamp(static_cast<size_t>(kWindow / facts_.step), kLeast, kMost),
                               (rows_ahead_.size() - 1) / 8);
  const std::vector<size_t> centres = half > 2 ? ListCentres(half) : std::vector<size_t>();
  size_t recorded = 0;
  std::vector<Fault> found;
  const auto check = [&](double least) {
    recorded = 0;
    found.clear();
    for (int joint = 0; joint < model_->num_joints(); ++joint) {
      if (ChannelOf(RecordedQuantity::kVelocity, joint) >= 0) ++recorded;
      if (const auto fault = CheckVelocity(joint, centres, half, least)) found.push_back(*fault);
    }
  };
  constexpr double kAlike = 0.1;
  const auto are_alike = [&](double nominal) {
    return found.size() > 1 && found.size() == recorded && std::ranges::all_of(found, [&](const Fault& one) {
             const Fault& first = found.front();
             return one.fault == first.fault &&
                    std::abs(one.value - first.value) <= kAlike * std::abs(first.value - nominal);
           });
  };
  // A filter takes a little off a joint's velocities. A clock is as wrong for all joints.
  constexpr double kOff = 0.015, kOffTogether = 3e-3;
  check(kOff);
  if (found.empty()) {
    check(kOffTogether);
    if (!are_alike(1.0)) return;
  }
  // One fault of all joints is listed once.
  if (are_alike(0.0)) {
    Fault& all = found.front();
    all.place = "all joints";
    for (size_t i = 1; i < recorded; ++i)
      all.value += (found[i].value - all.value) / static_cast<double>(i + 1);
    constexpr double kDegrees = 180.0 / kPi;
    if (all.fault == "velocity gain" && std::abs(all.value - kDegrees) < kAlike * kDegrees)
      all.fault = "velocity unit", all.detail = "(degrees per second)";
    found.resize(1);
  }
  faults_.insert(faults_.end(), found.begin(), found.end());
  velocity_lags_.clear();
  std::vector<Channel> kept;
  std::vector<Eigen::Index> columns;
  for (size_t i = 0; i < recording_->channels.size(); ++i) {
    if (recording_->channels[i].quantity == RecordedQuantity::kVelocity) continue;
    kept.push_back(recording_->channels[i]);
    columns.push_back(static_cast<Eigen::Index>(i));
  }
  recording_->channels = kept;
  for (Row& row : rows_ahead_) row = Row(row(columns));
  for (VectorXd* const one : {&last_, &most_alone_, &jumps_}) *one = VectorXd((*one)(columns));
  facts_.velocity.setZero();
}

MatrixXd MotionFit::CalcInertia(const std::vector<size_t>& centres) {
  const Eigen::Index n = model_->num_joints();
  MatrixXd squares = MatrixXd::Zero(n, n);
  VectorXd q = VectorXd::Zero(n), zero = VectorXd::Zero(n), rest(n), moved(n);
  const size_t every = std::max<size_t>(1, centres.size() / 20);
  double count = 0.0;
  for (size_t i = 0; i < centres.size(); i += every, count += 1.0) {
    for (int joint = 0; joint < n; ++joint)
      if (const int channel = ChannelOf(RecordedQuantity::kPosition, joint); channel >= 0)
        q[joint] = rows_ahead_[centres[i]][channel];
    regressor_.SetMotion(q, zero, zero);
    regressor_.CalcTorques(rest);
    for (Eigen::Index k = 0; k < n; ++k) {
      regressor_.SetMotion(q, zero, VectorXd::Unit(n, k));
      regressor_.CalcTorques(moved);
      squares.col(k) += (moved - rest).cwiseAbs2();
    }
  }
  return (squares / count).cwiseSqrt();
}

void MotionFit::ChooseWindow(const std::vector<size_t>& all) {
  // The source of the accelerations, and the order of the derivative.
  const bool has_acceleration = recording_->Has(RecordedQuantity::kAcceleration);
  const bool has_velocity = recording_->Has(RecordedQuantity::kVelocity);
  const RecordedQuantity source = has_acceleration ? RecordedQuantity::kAcceleration
                                  : has_velocity   ? RecordedQuantity::kVelocity
                                                   : RecordedQuantity::kPosition;
  const int derivative = has_acceleration ? 0 : has_velocity ? 1 : 2;
  VectorXd damping(model_->num_joints());
  for (int joint = 0; joint < damping.size(); ++joint) damping[joint] = model_->joint(joint).damping;
  double best = std::numeric_limits<double>::infinity(), smoothed = 1.0;
  for (const size_t half : kHalves) {
    const std::vector<size_t> centres = ListCentres(half);
    if (2 * half + 1 > rows_ahead_.size() / 4 || centres.size() < all.size() / 2) break;
    const Eigen::Index n = model_->num_joints();
    // The columns are accelerations and velocities.
    MatrixXd variance = MatrixXd::Zero(n, 2), bias = variance;
    double value = 0.0, rate = 0.0;
    for (const size_t centre : centres) {
      const MatrixXd window = GetWindow(centre, half);
      const MatrixXd C = CalcCoefficients(centre, half, kOrder);
      const MatrixXd higher = CalcCoefficients(centre, half, kHigherOrder);
      value += C.row(0).squaredNorm();
      rate += C.row(1).squaredNorm();
      for (int joint = 0; joint < n; ++joint) {
        const int channel = ChannelOf(source, joint);
        if (channel < 0) continue;
        const double sigma = source == RecordedQuantity::kPosition   ? facts_.position[joint]
                             : source == RecordedQuantity::kVelocity ? facts_.velocity[joint]
                                                                     : 0.0;
        for (int k = 0, order = derivative; k < 2 && order >= 0; ++k, --order) {
          const double factorial = order == 2 ? 2.0 : 1.0;
          const Eigen::RowVectorXd beyond = C.row(order) - higher.row(order);
          variance(joint, k) += Square(factorial * sigma) * C.row(order).squaredNorm();
          bias(joint, k) += Square(factorial) *
                            (Square(beyond.dot(window.col(channel))) - Square(sigma) * beyond.squaredNorm());
        }
      }
    }
    const double count = static_cast<double>(centres.size());
    bias = bias.cwiseMax(0.0).eval();
    const MatrixXd squares = (variance + bias) / count;
    const double score =
        (facts_.inertia.cwiseAbs2() * squares.col(0)).sum() + damping.cwiseAbs2().dot(squares.col(1));
    // A robot at rest shows torques alone, over a time as short as a push.
    if (!(score < best) || (facts_.stands && std::isfinite(best))) continue;
    best = score;
    half_ = half;
    facts_.acceleration = squares.col(0).cwiseSqrt();
    facts_.damped = damping.cwiseProduct(squares.col(1).cwiseSqrt());
    smoothed = std::sqrt(value / count);
    facts_.smooth_position = smoothed * facts_.position;
    facts_.smooth_torque = smoothed * facts_.torque;
    const VectorXd velocity = has_velocity ? VectorXd(smoothed * facts_.velocity)
                                           : VectorXd(std::sqrt(rate / count) * facts_.position);
    facts_.rest = 3.0 * velocity;
  }
  if (!std::isfinite(best))
    throw InputError(recording_->name + ": is too short to derive accelerations from");
  if (facts_.stands) facts_.acceleration.setZero(), facts_.damped.setZero();
  stride_ = std::max<size_t>(1, half_ / 2);
  facts_.wrench *= smoothed;
}

}  // namespace dexcheck
