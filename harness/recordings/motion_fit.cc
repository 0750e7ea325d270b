#include "harness/recordings/motion_fit.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/ranges.h"
#include "harness/recordings/filtered_noise.h"

namespace dexcheck {
namespace {

constexpr size_t kMostCentres = 300;  // at which noise is measured
constexpr double kMostNoisy = 6.0;    // times its noise, what a torque at its limit is below it
constexpr long kHeld = 5;             // rows that repeat one another; more of them are a robot at rest

}  // namespace

MotionFit::MotionFit(const RobotModel& model, Recording* recording, size_t ahead,
                     const Refinements& refinements)
    : model_(&model),
      recording_(recording),
      regressor_(model),
      refinements_(refinements),
      part_(std::max<size_t>(1, ahead / 8)) {
  has_currents_ = !recording->Has(RecordedQuantity::kTorque);
  for (int joint = 0; joint < model.num_joints(); ++joint)
    if (recording->FindColumn(Effort(), joint) >= 0) judged_.push_back(joint);
  while (rows_ahead_.size() < ahead && Fill()) {
  }
  Analyse();
  // Logs have zeros where a drive reports no torque.
  std::erase_if(judged_, [&](int joint) {
    return facts_.moves[static_cast<size_t>(joint)] && facts_.torque[joint] == 0.0 &&
           sample_.most_torque[joint] == 0.0;
  });
}

int MotionFit::ChannelOf(RecordedQuantity quantity, int joint) const {
  for (size_t i = 0; i < recording_->channels.size(); ++i)
    if (recording_->channels[i].quantity == quantity && recording_->channels[i].joint == joint)
      return static_cast<int>(i);
  return -1;
}

bool MotionFit::ReadRow(Row* row) {
  while (recording_->reader->Next(&numbers_)) {
    ++rows_;
    size_t missing = 0;
    for (size_t i = 0; i < recording_->channels.size(); ++i) {
      const Channel& channel = recording_->channels[i];
      const double number = numbers_[channel.column];
      (*row)[static_cast<Eigen::Index>(i)] = channel.scale * number + channel.offset;
      if (!std::isfinite(number) && channel.quantity != RecordedQuantity::kTime) ++missing;
    }
    // Messages of other joints.
    if (missing + 1 == recording_->channels.size()) {
      ++empty_;
      continue;
    }
    for (const Channel& channel : recording_->channels) {
      const double number = numbers_[channel.column];
      if (std::isfinite(number)) continue;
      const std::string& name = recording_->reader->names()[channel.column];
      throw InputError(fmt::format("{}: column {}: must be a finite number, {}", recording_->reader->Where(),
                                   name.empty() ? std::to_string(channel.column + 1) : name,
                                   std::isnan(number) ? "is missing" : "got " + std::to_string(number)));
    }
    return true;
  }
  return false;
}

/// Appends the next row that says something new; false at the end.
bool MotionFit::Fill() {
  const int time = ChannelOf(RecordedQuantity::kTime, -1);
  Row row(static_cast<Eigen::Index>(recording_->channels.size()));
  while (!has_ended_) {
    if (!ReadRow(&row)) {
      has_ended_ = true;
      break;
    }
    if (recording_->Has(RecordedQuantity::kBase)) CheckBase(&row);
    if (jumps_.size() > 0) row += jumps_;
    if (last_.size() > 0) {
      Unwrap(&row);
      const double passed = row[time] - last_[time];
      if (passed < 0.0)
        throw InputError(fmt::format("{}: time goes back from {:.9g} to {:.9g} s",
                                     recording_->reader->Where(), last_[time], row[time]));
      if (passed == 0.0) {
        ++doubled_;
        continue;
      }
      bool is_same = true;
      for (Eigen::Index i = 0; i < row.size(); ++i) is_same = is_same && (i == time || row[i] == last_[i]);
      held_run_ = is_same ? held_run_ + 1 : 0;
      if (is_same && held_run_ < kHeld) {
        ++held_;
        continue;
      }
      if (facts_.step > 0.0 && passed > kGap * facts_.step) ++segment_, ++gaps_;
    }
    last_ = row;
    rows_ahead_.push_back(row);
    segments_.push_back(segment_);
    if (most_alone_.size() > 0) ReplaceWrongSamples(rows_ahead_.size() < 3 ? 0 : rows_ahead_.size() - 3);
    return true;
  }
  return false;
}

void MotionFit::Unwrap(Row* row) {
  constexpr double kTurn = 2.0 * kPi, kMostStep = 1.0;  // rad
  for (size_t i = 0; i < recording_->channels.size(); ++i) {
    const Channel& channel = recording_->channels[i];
    if (channel.quantity != RecordedQuantity::kPosition ||
        model_->joint(channel.joint).type != JointType::kRevolute)
      continue;
    double& turned = turned_[channel.joint];
    double& q = (*row)[static_cast<Eigen::Index>(i)];
    q += turned;
    const double step = q - last_[static_cast<Eigen::Index>(i)], whole = kTurn * std::round(step / kTurn);
    if (whole == 0.0 || std::abs(step - whole) > kMostStep) continue;
    q -= whole;
    turned -= whole;
    ++wraps_[channel.joint];
  }
}

bool MotionFit::IsWhole(size_t centre, size_t half) const {
  return centre >= half && centre + half < rows_ahead_.size() &&
         segments_[centre - half] == segments_[centre + half];
}

MatrixXd MotionFit::GetWindow(size_t centre, size_t half) const {
  MatrixXd window(static_cast<Eigen::Index>(2 * half + 1), last_.size());
  for (size_t k = 0; k <= 2 * half; ++k)
    window.row(static_cast<Eigen::Index>(k)) = rows_ahead_[centre - half + k].transpose();
  return window;
}

MatrixXd MotionFit::CalcCoefficients(size_t centre, size_t half, int order) const {
  const int time = ChannelOf(RecordedQuantity::kTime, -1);
  const double t = rows_ahead_[centre][time];
  const auto m = static_cast<Eigen::Index>(2 * half + 1);
  const double scale = static_cast<double>(half) * facts_.step;
  // Equally spaced rows have the same coefficients everywhere.
  constexpr double kEven = 1e-3;
  bool is_even = true;
  for (size_t k = 0; k <= 2 * half && is_even; ++k) {
    const double expected = (static_cast<double>(k) - static_cast<double>(half)) * facts_.step;
    is_even = std::abs(rows_ahead_[centre - half + k][time] - t - expected) < kEven * facts_.step;
  }
  MatrixXd& even = even_[{half, order}];
  if (is_even && even.size() > 0) return even;
  MatrixXd V(m, order + 1);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double u = (rows_ahead_[centre - half + static_cast<size_t>(k)][time] - t) / scale;
    double power = 1.0;
    for (int p = 0; p <= order; ++p, power *= u) V(k, p) = power;
  }
  const Eigen::HouseholderQR<MatrixXd> qr(V);
  const MatrixXd Q = qr.householderQ() * MatrixXd::Identity(m, order + 1);
  MatrixXd C = qr.matrixQR().topRows(order + 1).triangularView<Eigen::Upper>().solve(Q.transpose());
  double unit = 1.0;
  for (int p = 0; p <= order; ++p, unit /= scale) C.row(p) *= unit;
  if (is_even) even = C;
  return C;
}

std::vector<size_t> MotionFit::ListCentres(size_t half) const {
  std::vector<size_t> centres;
  const size_t every = std::max<size_t>(1, rows_ahead_.size() / kMostCentres);
  for (size_t i = half; i + half < rows_ahead_.size(); i += every)
    if (IsWhole(i, half)) centres.push_back(i);
  return centres;
}

/// A unit quaternion, of the sign of the row before.
void MotionFit::CheckBase(Row* row) const {
  Eigen::Vector4d quaternion, before = Eigen::Vector4d::Zero();
  for (int k = 0; k < 4; ++k) {
    const int channel = ChannelOf(RecordedQuantity::kBase, 3 + k);
    quaternion[k] = (*row)[channel];
    if (last_.size() > 0) before[k] = last_[channel];
  }
  constexpr double kLittle = 0.01;
  if (std::abs(quaternion.norm() - 1.0) > kLittle)
    throw InputError(fmt::format("{}: base: must have a unit quaternion, got one of length {:.4g}",
                                 recording_->reader->Where(), quaternion.norm()));
  if (quaternion.dot(before) >= 0.0) return;
  for (int k = 0; k < 4; ++k) (*row)[ChannelOf(RecordedQuantity::kBase, 3 + k)] *= -1.0;
}

BaseMotion MotionFit::CalcBase(const MatrixXd& fitted) const {
  MatrixXd pose(3, 7);
  for (int k = 0; k < 7; ++k) pose.col(k) = fitted.col(ChannelOf(RecordedQuantity::kBase, k)).head(3);
  const auto quaternion = [&](int order) {
    return Eigen::Quaterniond(pose(order, 3), pose(order, 4), pose(order, 5), pose(order, 6));
  };
  const Eigen::Quaterniond now = quaternion(0).normalized();
  BaseMotion base;
  base.R = now.toRotationMatrix();
  // w = 2 q_dot q^*; the second derivative is twice the polynomial's coefficient.
  base.w = 2.0 * (quaternion(1) * now.conjugate()).vec();
  base.w_dot = 4.0 * (quaternion(2) * now.conjugate()).vec();
  const Vector3d r = base.R * model_->base().X_B0.translation();
  base.a = 2.0 * pose.row(2).head<3>().transpose() + base.w_dot.cross(r) + base.w.cross(base.w.cross(r));
  return base;
}

VectorXd MotionFit::CalcRateErrors(const VectorXd& times, const MatrixXd& C, bool of_positions) const {
  MatrixXd powers = MatrixXd::Zero(times.size(), C.rows());
  const Eigen::Index lowest = of_positions ? 1 : 0;
  powers.col(lowest).setOnes();
  for (Eigen::Index p = lowest + 1; p < powers.cols(); ++p)
    powers.col(p) = powers.col(p - 1).cwiseProduct(times);
  if (of_positions) powers *= VectorXd::LinSpaced(C.rows(), 0.0, kOrder).asDiagonal();
  const MatrixXd covariance = C * C.transpose();
  return ((powers * covariance).cwiseProduct(powers).rowwise().sum() / covariance(lowest, lowest))
      .cwiseSqrt();
}

void MotionFit::AverageFriction(int joint, const VectorXd& times, const VectorXd& rate,
                                const VectorXd& weights, const VectorXd& errors) {
  auto shapes = sample_.friction.row(joint);
  shapes.setZero();
  double direction = 0.0, slip = 0.0, first = 0.0, slowest = std::numeric_limits<double>::infinity();
  const double rest = facts_.rest[joint];
  const bool moves = std::abs(sample_.qd[joint]) >= rest;
  for (Eigen::Index k = 0; k < times.size() && moves; ++k) {
    double v = 0.0;
    for (Eigen::Index p = rate.size(); p-- > 0;) v = v * times[k] + rate[p];
    FrictionRow here = CalcFrictionShapes(v, facts_.shape_velocities.row(joint));
    const double sign = here[kSlipShape];
    slip = k > 0 ? CalcSlip(sign, slip, std::abs(v) * (times[k] - times[k - 1])) : sign;
    here[kSlipShape] = slip;
    direction += weights[k] * sign;
    if (k == 0) first = sign;
    slowest = std::min(slowest, v * first / errors[k]);
    shapes += weights[k] * here;
  }
  sample_.direction[joint] = direction;
  sample_.slowest[joint] = moves ? slowest : 0.0;
}

void MotionFit::AdvanceVelocities(MatrixXd* fitted) const {
  for (const auto& [joint, lag] : velocity_lags_) {
    auto polynomial = fitted->col(ChannelOf(RecordedQuantity::kVelocity, joint));
    const double own = polynomial[0];
    // Horner's scheme, once for each coefficient: p(t + lag) in powers of t.
    for (int low = 0; low < kOrder; ++low)
      for (int k = kOrder - 1; k >= low; --k) polynomial[k] += lag * polynomial[k + 1];
    if (!refinements_.advances_velocities) polynomial[0] = own;
  }
}

size_t MotionFit::CalcReach() const {
  long most = 0;
  for (const auto& [joint, delay] : refinements_.delays) most = std::max(most, std::abs(delay));
  return half_ + static_cast<size_t>(most);
}

double MotionFit::CalcTorqueRate(int joint, size_t centre, const Eigen::Ref<const VectorXd>& fitted) const {
  const auto known = refinements_.delays.find(joint);
  if (known == refinements_.delays.end() || known->second == 0) return fitted[1];
  const size_t late = centre + static_cast<size_t>(known->second);
  const int time = ChannelOf(RecordedQuantity::kTime, -1);
  const MatrixXd C = CalcCoefficients(late, half_, kOrder);
  const double then = C.row(0).dot(GetWindow(late, half_).col(ChannelOf(Effort(), joint)));
  return (then - fitted[0]) / (rows_ahead_[late][time] - rows_ahead_[centre][time]);
}

bool MotionFit::Emit(size_t centre, const Receiver& receive) {
  const MatrixXd window = GetWindow(centre, half_);
  const MatrixXd C = CalcCoefficients(centre, half_, kOrder);
  MatrixXd fitted = C * window;
  AdvanceVelocities(&fitted);
  const int time = ChannelOf(RecordedQuantity::kTime, -1);
  sample_.time = rows_ahead_[centre][time];
  sample_.passed = sample_.time - begin_;
  const VectorXd times = window.col(time).array() - sample_.time;
  const VectorXd phases = refinements_.shaking * window.col(time);
  sample_.swing =
      C.row(0) * (MatrixXd(phases.size(), 2) << phases.array().sin(), phases.array().cos()).finished();
  VectorXd errors[2];
  for (int joint = 0; joint < model_->num_joints(); ++joint) {
    const int position = ChannelOf(RecordedQuantity::kPosition, joint);
    if (position < 0) continue;
    const int velocity = ChannelOf(RecordedQuantity::kVelocity, joint);
    const int acceleration = ChannelOf(RecordedQuantity::kAcceleration, joint);
    sample_.q[joint] = fitted(0, position);
    sample_.qd[joint] = velocity >= 0 ? fitted(0, velocity) : fitted(1, position);
    sample_.qdd[joint] = acceleration >= 0 ? fitted(0, acceleration)
                         : velocity >= 0   ? fitted(1, velocity)
                                           : 2.0 * fitted(2, position);
    const VectorXd rate =
        velocity >= 0
            ? VectorXd(fitted.col(velocity))
            : VectorXd(fitted.col(position).tail<kOrder>().cwiseProduct(Eigen::Vector4d(1.0, 2.0, 3.0, 4.0)));
    sample_.jerk[joint] = velocity >= 0 ? 2.0 * fitted(2, velocity) : 6.0 * fitted(3, position);
    sample_.snap[joint] = velocity >= 0 ? 6.0 * fitted(3, velocity) : 24.0 * fitted(4, position);
    if (facts_.stands)
      for (VectorXd* const each : {&sample_.qd, &sample_.qdd, &sample_.jerk, &sample_.snap})
        (*each)[joint] = 0.0;
    VectorXd& known = errors[velocity >= 0 ? 1 : 0];
    if (known.size() == 0) known = CalcRateErrors(times, C, velocity < 0);
    AverageFriction(joint, times, rate, C.row(0).transpose(), known);
    const int torque = ChannelOf(Effort(), joint);
    if (torque < 0) continue;
    sample_.torque[joint] = fitted(0, torque);
    if (const auto limit = refinements_.limits.find(joint); limit != refinements_.limits.end())
      sample_.beyond[joint] =
          (window.col(torque).array().abs() > limit->second - kMostNoisy * facts_.torque[joint])
              .cast<double>()
              .mean();
    sample_.torque_rate[joint] = CalcTorqueRate(joint, centre, fitted.col(torque));
  }
  if (recording_->Has(RecordedQuantity::kBase)) sample_.base = CalcBase(fitted);
  for (Eigen::Index k = 0; k < sample_.wrench.size(); ++k)
    if (const int channel = ChannelOf(RecordedQuantity::kWrench, static_cast<int>(k)); channel >= 0)
      sample_.wrench[k] = fitted(0, channel);
  return receive(sample_);
}

void MotionFit::CalcSpeeds() {
  const Eigen::Index n = model_->num_joints();
  VectorXd squares = VectorXd::Zero(n), moving = VectorXd::Zero(n);
  VectorXd lowest = VectorXd::Constant(n, std::numeric_limits<double>::infinity()), highest = -lowest;
  facts_.shape_velocities = ListShapeVelocities(VectorXd::Ones(n));
  double count = 0.0;
  for (const size_t centre : ListCentres(CalcReach())) {
    Emit(centre, [&](const RecordedSample& sample) {
      squares += sample.qd.cwiseAbs2();
      lowest = lowest.cwiseMin(sample.q);
      highest = highest.cwiseMax(sample.q);
      moving += sample.direction.unaryExpr([](double s) { return s != 0.0 ? 1.0 : 0.0; });
      return true;
    });
    count += 1.0;
  }
  const VectorXd speeds = (squares / std::max(1.0, count)).cwiseSqrt();
  facts_.shape_velocities = ListShapeVelocities(speeds, refinements_.stribeck, refinements_.smooth);
  // A joint that friction holds moves far at few times where joints move one after another.
  constexpr double kSlow = 2e-3, kMoving = 0.2, kMovingFar = 0.02, kFar = 0.02;
  constexpr double kHeld = 2e-3;  // rad or m, that a joint gives under its friction
  facts_.rest = facts_.rest.cwiseMax(kSlow * speeds);
  for (int joint = 0; joint < n; ++joint) {
    const double least = model_->joint(joint).dry_friction > 0.0 ? kHeld : 0.0;
    const double span = highest[joint] - lowest[joint];
    const bool moves_far = least > 0.0 && span > kFar;
    facts_.moves.push_back(moving[joint] > (moves_far ? kMovingFar : kMoving) * count && span > least);
  }
}

VectorXd MotionFit::CalcFilteredNoise() {
  const Eigen::Index n = model_->num_joints();
  const int time = ChannelOf(RecordedQuantity::kTime, -1);
  VectorXd noise = VectorXd::Zero(n), quanta = noise;
  for (int joint = 0; joint < n; ++joint) {
    const int channel = ChannelOf(Effort(), joint);
    const double quantum = channel < 0 ? 0.0 : FindQuantum(channel);
    // Errors of a third of a step make up for what rounding leaves out.
    if (quantum > 3.0 * facts_.torque[joint]) quanta[joint] = quantum;
  }
  FilteredNoise filtered(static_cast<Eigen::Index>(2 * half_ + 1), n, kOrder);
  if (!filtered.is_possible()) return noise;
  for (const size_t centre : ListCentres(CalcReach())) {
    const MatrixXd window = GetWindow(centre, half_);
    filtered.SetWindow(window.col(time).array() - rows_ahead_[centre][time],
                       CalcCoefficients(centre, half_, kOrder).row(0));
    Emit(centre, [&](const RecordedSample& sample) {
      for (int joint = 0; joint < n; ++joint) {
        const int channel = ChannelOf(Effort(), joint);
        // Friction that turns round is no noise.
        const bool slides =
            !facts_.moves[static_cast<size_t>(joint)] || sample.slowest[joint] >= facts_.rest[joint];
        if (channel >= 0 && slides) filtered.Add(joint, window.col(channel), quanta[joint]);
      }
      return true;
    });
  }
  for (int joint = 0; joint < n; ++joint) noise[joint] = filtered.Calc(joint);
  return noise;
}

std::vector<bool> MotionFit::IsJudged(const RecordedSample& sample) const {
  std::vector<bool> judged(facts_.moves.size());
  // A torque that reaches its limit within a window is neither the one nor the other.
  constexpr double kFew = 0.02;
  for (size_t joint = 0; joint < judged.size(); ++joint) {
    const auto at = static_cast<Eigen::Index>(joint);
    const bool has_friction = model_->joint(static_cast<int>(joint)).dry_friction > 0.0;
    const bool slides = has_friction ? sample.slowest[at] >= facts_.rest[at] : sample.direction[at] != 0.0;
    judged[joint] =
        (!facts_.moves[joint] || slides) && std::min(sample.beyond[at], 1.0 - sample.beyond[at]) < kFew;
  }
  return judged;
}

void MotionFit::Run(const Receiver& receive) {
  const size_t reach = CalcReach();
  size_t next = reach;
  for (;;) {
    for (; next + reach < rows_ahead_.size(); next += stride_)
      if (IsWhole(next, reach) && !Emit(next, receive)) return;
    // Rows that no window needs any more make room.
    while (next > reach && !rows_ahead_.empty()) {
      rows_ahead_.pop_front();
      segments_.pop_front();
      --next;
    }
    bool has_more = false;
    for (size_t i = 0; i < part_ && Fill(); ++i) has_more = true;
    if (!has_more) return;
  }
}

std::vector<std::string> MotionFit::ListNotes() const {
  std::vector<std::string> notes = notes_;
  const auto note = [&](long count, const std::string& what) {
    if (count > 0) notes.push_back(fmt::format("{}: {} {}", recording_->name, count, what));
  };
  note(doubled_, "rows have the time of the row before: left out");
  note(held_, "rows repeat the row before: left out");
  note(empty_, "rows have no numbers of these joints: left out");
  for (const auto& [joint, count] : wraps_)
    note(count, "times the position of " + model_->joint(joint).name +
                    " passes from one end of a turn to the other: unwrapped");
  std::vector<double> lags;
  for (const auto& [joint, lag] : velocity_lags_) lags.push_back(lag / facts_.step);
  if (!lags.empty())
    notes.push_back(
        fmt::format("{}: velocities are {:.2g} rows {} than positions: accelerations are those at the "
                    "positions' times",
                    recording_->name, std::abs(Median(lags)), Median(lags) > 0.0 ? "earlier" : "later"));
  if (facts_.stands) notes.push_back(recording_->name + ": the robot stands: torques alone are compared");
  note(gaps_, fmt::format("gaps longer than {:.3g} s: nothing is smoothed across them", kGap * facts_.step));
  notes.push_back(fmt::format(
      "{}: {} from {} by polynomials over {:.3g} s (a row every {:.3g} s)", recording_->name,
      recording_->Has(RecordedQuantity::kVelocity) ? "accelerations" : "velocities and accelerations",
      recording_->Has(RecordedQuantity::kVelocity) ? "velocities" : "positions", window(), facts_.step));
  return notes;
}

}  // namespace dexcheck
