#include "harness/recordings/read_recordings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// The model with what is declared to be attached to it.
RobotModel AddPayload(const RobotModel& model, const std::optional<DeclaredPayload>& payload) {
  RobotSpec spec = model.spec();
  if (payload) {
    MassProperties& body = spec.joints[static_cast<size_t>(payload->link)].body;
    body = Combine({body, {payload->mass, payload->com, Matrix3d::Zero()}});
  }
  return RobotModel(spec);
}

}  // namespace

RecordingSet::RecordingSet(const RobotModel& model, std::vector<Recording>* recordings,
                           const ReadOptions& options, const std::function<bool(long rows)>& on_rows)
    : model_(&model),
      first_name_(recordings->front().name),
      refinements_(options.refinements),
      frames_(options.frames) {
  for (const Recording& recording : *recordings)
    if (model.base().type != BaseType::kFixed && !recording.Has(RecordedQuantity::kBase))
      throw InputError(model.spec().source + ": base: moves; " + recording.name +
                       " must have its pose: base in a file of --columns");
  for (Recording& recording : *recordings) Read(&recording, options, on_rows);
  EstimateGains();
  first_gains_ = gains_;
  MeasureNoise();
}

std::vector<int> RecordingSet::ListJudged() const {
  std::vector<int> judged;
  for (size_t place = 0; place < joints_.size(); ++place)
    if (IsJudged(place)) judged.push_back(joints_[place]);
  return judged;
}

void RecordingSet::DivideGains(const Eigen::Ref<const VectorXd>& factors) {
  gains_ = gains_.cwiseQuotient(factors);
  MeasureNoise();
}

void RecordingSet::ResetWeights() {
  for (ReadRecording& one : read_) one.weight = one.noise;
}

void RecordingSet::Read(Recording* recording, const ReadOptions& options,
                        const std::function<bool(long rows)>& on_rows) {
  ReadRecording& one = read_.emplace_back();
  one.model = std::make_unique<RobotModel>(AddPayload(*model_, recording->payload));
  MotionFit motion(*one.model, recording, options.ahead, options.refinements);
  if (read_.size() == 1) {
    joints_ = motion.joints();
    has_currents_ = motion.has_currents();
    if (joints_.empty()) throw InputError(recording->name + ": has no torques of the model's joints");
  } else if (joints_ != motion.joints() || has_currents_ != motion.has_currents()) {
    throw InputError(recording->name + ": must have the quantities of " + first_name_);
  }
  step_ = std::max(step_, motion.facts().step);
  for (std::unique_ptr<TorqueBalance>* balance : {&one.fit, &one.held}) {
    *balance = std::make_unique<TorqueBalance>(*one.model, joints_, has_currents_, options.refinements);
    (*balance)->SetWrenches(recording->wrenches);
  }
  long samples = 0;
  double begin = 0.0;
  motion.Run([&](const RecordedSample& sample) {
    // Shorter than most pushes: what is held out says nothing of when they were.
    constexpr double kStretch = 0.25;  // s
    constexpr long kEvery = 4;
    if (samples == 0) begin = sample.time;
    const long stretch = std::lround(std::floor((sample.time - begin) / kStretch));
    // A robot that stands is of interest only when something acts.
    const bool is_held = stretch % kEvery == options.refinements.held_stretch && !motion.facts().stands;
    TorqueBalance& balance = is_held ? *one.held : *one.fit;
    balance.Add(sample, motion.IsJudged(sample));
    ReportSecond(options, sample.time, balance.residual());
    ++samples;
    return samples % 1024 != 0 || !on_rows || on_rows(rows_ + motion.rows());
  });
  rows_ += motion.rows();
  one.fit->Finish();
  one.held->Finish();
  std::vector<std::string> resting;
  for (int joint = 0; joint < model_->num_joints(); ++joint) {
    one.has_position.push_back(recording->FindColumn(RecordedQuantity::kPosition, joint) >= 0);
    if (!one.has_position.back()) resting.push_back(model_->joint(joint).name);
  }
  if (!resting.empty())
    notes_.push_back(recording->name + ": has no positions of " + JoinNames(resting) +
                     ": taken to rest at 0");
  if (model_->base().type == BaseType::kFloating && recording->wrenches.empty())
    notes_.push_back(recording->name +
                     ": has no forces of the ground: links are taken to touch nothing; wrench in a file of "
                     "--columns gives them, or leave the torques of those that touch out of tau");
  for (const std::string& note : motion.ListNotes()) notes_.push_back(note);
  has_other_times_ = has_other_times_ || motion.has_other_times();
  for (const Fault& fault : motion.faults()) faults_.push_back(fault);
  one.motion = motion.facts();
  one.reach = 0.5 * motion.window();
  one.most_torque = motion.most_torque();
}

void RecordingSet::ReportSecond(const ReadOptions& options, double time, const VectorXd& residual) {
  if (!options.on_second) return;
  if (second_samples_ == 0) second_ = VectorXd::Zero(residual.size()), second_begin_ = time;
  second_ += residual.cwiseAbs2();
  ++second_samples_;
  if (time - second_begin_ < 1.0) return;
  options.on_second(time, joints_, (second_ / second_samples_).cwiseSqrt());
  second_samples_ = 0;
}

double RecordingSet::CalcNoise(const ReadRecording& one, size_t place) const {
  const TorqueBalance& balance = *one.fit;
  const int joint = joints_[place];
  const double samples = std::max(1.0, balance.samples(place));
  const auto mean_square = [&](const TorqueColumn& column) {
    const Index at = balance.Find(place, column);
    return at < 0 ? 0.0 : balance.products(place)(at, at) / samples;
  };
  double variance = Square(one.motion.smooth_torque[joint] * gains_[static_cast<Index>(place)]) +
                    Square(one.motion.damped[joint]);
  for (int other = 0; other < model_->num_joints(); ++other) {
    variance += Square(one.motion.inertia(joint, other) * one.motion.acceleration[other]);
    variance += mean_square({TorqueColumn::kPosition, other}) * Square(one.motion.smooth_position[other]);
  }
  // An integrator may have the friction of a velocity half a row away.
  variance += mean_square({TorqueColumn::kAcceleration, joint}) *
              Square(0.5 * one.motion.step * model_->joint(joint).damping);
  // Dry friction that holds a joint is anything up to its largest value.
  if (!one.motion.moves[static_cast<size_t>(joint)]) variance += Square(model_->joint(joint).dry_friction);
  for (int k = 0; k < 3; ++k)
    variance += mean_square({TorqueColumn::kGravity, 0, k}) * Square(one.motion.base);
  if (one.motion.wrench.size() > 0)
    variance += balance.wrench_squares(place).dot(one.motion.wrench.cwiseAbs2()) / samples;
  variance += mean_square({TorqueColumn::kRate, joint}) *
              Square(gains_[static_cast<Index>(place)] * one.motion.step) / 12.0;
  // Polynomials leave 1e-6 of the torques of a simulated Panda, whose recording has no noise.
  constexpr double kExact = 1e-5;
  return std::sqrt(variance + Square(kExact) * mean_square({TorqueColumn::kTorque, joint}) +
                   std::numeric_limits<double>::min());
}

void RecordingSet::MeasureNoise() {
  for (ReadRecording& one : read_) {
    one.noise.resize(static_cast<Index>(joints_.size()));
    for (size_t place = 0; place < joints_.size(); ++place)
      one.noise[static_cast<Index>(place)] = CalcNoise(one, place);
    if (one.weight.size() == 0) one.weight = one.noise;
  }
}

void RecordingSet::EstimateGains() {
  gains_ = VectorXd::Ones(static_cast<Index>(joints_.size()));
  for (size_t place = 0; has_currents_ && place < joints_.size(); ++place) {
    const TorqueBalance& first = *read_.front().fit;
    std::vector<Index> at;
    for (const auto kind :
         {TorqueColumn::kTorque, TorqueColumn::kOffset, TorqueColumn::kDry, TorqueColumn::kViscous})
      at.push_back(first.Find(place, {kind, joints_[place]}));
    const Index current = first.Find(place, {TorqueColumn::kCurrent, joints_[place]});
    MatrixXd G = MatrixXd::Zero(first.products(place).rows(), first.products(place).cols());
    for (const ReadRecording& one : read_) G += one.fit->products(place);
    // The current for each N m of the model's torque, where that shows beside friction.
    const auto solve = [&](const std::vector<Index>& columns) {
      return SolveLeastSquares(G(columns, columns), VectorXd(G(columns, current)));
    };
    const auto left = [&](const std::vector<Index>& columns) {
      return G(current, current) - solve(columns).dot(VectorXd(G(columns, current)));
    };
    const double inverse = solve(at)[0];
    // The part of the current that the model's torque explains: beside friction, and of all.
    constexpr double kShows = 0.5, kLeastOfAll = 0.03;
    const double without = left({at.begin() + 1, at.end()}), with = left(at);
    const bool is_told = inverse > 0.0 && without > (1.0 + kShows) * with &&
                         without - with > kLeastOfAll * G(current, current);
    gains_[static_cast<Index>(place)] = is_told ? 1.0 / inverse : 0.0;
  }
}

bool RecordingSet::DropUnknownGains() {
  constexpr double kFar = 3.0;
  bool has_any = false;
  for (size_t place = 0; place < joints_.size(); ++place) {
    double& gain = gains_[static_cast<Index>(place)];
    const double first = first_gains_[static_cast<Index>(place)];
    if (gain == 0.0 || (gain > first / kFar && gain < first * kFar)) continue;
    gain = 0.0;
    has_any = true;
  }
  return has_any;
}

MotionExtents RecordingSet::CalcExtents() const {
  constexpr double kPeak = 3.0;  // times the root mean square
  MotionExtents extents;
  const VectorXd none = VectorXd::Zero(model_->num_joints());
  extents = {none, none, none, none, step_};
  for (size_t place = 0; place < joints_.size(); ++place)
    for (const ReadRecording& one : read_) {
      const int joint = joints_[place];
      const TorqueBalance& balance = *one.fit;
      const MatrixXd& G = balance.products(place);
      const double samples = std::max(1.0, balance.samples(place));
      const auto find = [&](TorqueColumn::Kind kind) { return balance.Find(place, {kind, joint}); };
      const auto peak = [&](double squares) { return kPeak * std::sqrt(std::max(0.0, squares) / samples); };
      const auto widen = [&](VectorXd* sizes, double size) {
        (*sizes)[joint] = std::max((*sizes)[joint], size);
      };
      const Index y = G.cols() - 1, torque = find(TorqueColumn::kTorque), angle = find(TorqueColumn::kAngle);
      const double measured =
          has_currents_ ? Square(gain(place)) * G(find(TorqueColumn::kCurrent), find(TorqueColumn::kCurrent))
                        : G(y, y) + 2.0 * G(y, torque) + G(torque, torque);
      widen(&extents.torque, peak(measured) + peak(G(torque, torque)));
      widen(&extents.speed, peak(G(find(TorqueColumn::kViscous), find(TorqueColumn::kViscous))));
      widen(&extents.acceleration,
            peak(G(find(TorqueColumn::kAcceleration), find(TorqueColumn::kAcceleration))));
      widen(&extents.span, peak(G(angle, angle) - Square(G(angle, find(TorqueColumn::kOffset))) / samples));
    }
  return extents;
}

bool RecordingSet::Moves(int joint) const {
  constexpr double kLittle = 2e-3, kErrors = 10.0;  // rad or m; times the noise of a sample
  for (const ReadRecording& one : read_) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto* balance : {&one.fit, &one.held})
      for (const TorqueBalance::Block& block : (*balance)->blocks()) {
        low = std::min(low, block.q[joint] / block.samples);
        high = std::max(high, block.q[joint] / block.samples);
      }
    if (high - low > std::max(kLittle, kErrors * one.motion.smooth_position[joint])) return true;
  }
  return false;
}

std::vector<UnjudgedJoint> RecordingSet::ListUnjudged() const {
  std::vector<UnjudgedJoint> unjudged;
  for (int joint = 0; joint < model_->num_joints(); ++joint) {
    const auto at = std::ranges::find(joints_, joint);
    const auto place = static_cast<size_t>(at - joints_.begin());
    const auto has_samples = [&](const ReadRecording& one) { return one.fit->samples(place) > 0.0; };
    const auto has_position = [&](const ReadRecording& one) {
      return one.has_position[static_cast<size_t>(joint)];
    };
    std::string reason;
    if (at == joints_.end()) {
      if (std::ranges::none_of(read_, has_position)) continue;
      reason = has_currents_ ? "no current of it is recorded" : "no torque of it is recorded, or only zeros";
    } else if (!IsJudged(place)) {
      reason = "its motion does not determine its drive's gain beside its friction";
    } else if (std::ranges::none_of(read_, has_samples)) {
      reason = "friction holds it at every sample";
    } else {
      continue;
    }
    unjudged.push_back({joint, Moves(joint), at != joints_.end() && !IsJudged(place), reason});
  }
  return unjudged;
}

}  // namespace dexcheck
