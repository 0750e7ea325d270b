#include "harness/recordings/judge_recordings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/recordings/base_motion.h"
#include "harness/recordings/position_faults.h"
#include "harness/recordings/torque_estimator.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// Times the noise: more than errors of derivatives, known to a factor of two, can be.
constexpr double kFar = 5.0;
/// Of what the model does not explain: a cause that explains less is no reason to read again.
constexpr double kMuch = 0.05;

/// A fault of the recording itself, that holds all the time.
Explanation MakeCause(const Fault& fault) {
  Explanation one;
  one.channel = CauseChannel::kMeasurement;
  one.from = one.to = std::numeric_limits<double>::quiet_NaN();
  one.faults = {fault};
  return one;
}

/// One judgement, put into words.
class Judge {
 public:
  Judge(const RobotModel& model, std::vector<Recording>* recordings, const JudgeOptions& options,
        const std::function<bool(long)>& on_rows)
      : model_(model),
        recordings_(*recordings),
        set_(model, recordings, options, on_rows),
        estimator_(&set_, options.most_causes) {}

  RecordingJudgement Run() {
    result_.joints = set_.joints();
    result_.rows = set_.rows();
    result_.notes = set_.notes();
    for (const Fault& fault : set_.faults()) result_.causes.push_back(MakeCause(fault));
    Tell();
    return std::move(result_);
  }

 private:
  void Tell() {
    const CauseSelection& selection = estimator_.selection();
    const VectorXd amplitudes = estimator_.CalcAmplitudes(selection.terms);
    const VectorXd before = estimator_.CalcLeft({}), after = estimator_.CalcLeft(selection.terms);
    result_.left = estimator_.CalcRms(estimator_.rows(), after);
    const double all =
        std::max(estimator_.CalcRms(estimator_.rows(), before), std::numeric_limits<double>::min());
    result_.explained = 1.0 - Square(result_.left / all);
    const TorqueRows held = MakeTorqueRows(set_, estimator_.faults(), /*is_held=*/true);
    VectorXd nothing = VectorXd::Zero(held.columns - 1);
    nothing.head(CountForced(set_)) = estimator_.CalcAmplitudes({}).head(CountForced(set_));
    Index rank = 0;
    result_.by_all.held_left = estimator_.CalcRms(
        held, held.CalcLeft(estimator_.FitAmplitudes(TorqueEstimator::Part::kPlain, &rank)));
    result_.by_all.numbers = rank;
    for (const CauseTerm& term : selection.terms) result_.by_causes.numbers += term.amplitude.size();
    result_.by_causes.numbers += CountForced(set_);
    result_.by_causes.held_left = estimator_.CalcRms(held, held.CalcLeft(amplitudes));
    const VectorXd held_before = held.CalcLeft(nothing), held_after = held.CalcLeft(amplitudes);
    std::vector<size_t> first_fit, first_held;
    for (size_t recording = 0; recording < set_.size(); ++recording) {
      first_fit.push_back(MakeTraces(recording, *set_[recording].fit));
      first_held.push_back(MakeTraces(recording, *set_[recording].held));
    }
    for (size_t i = 0; i < estimator_.rows().parts.size(); ++i) {
      const TorqueRows::Part& part = estimator_.rows().parts[i];
      const TorqueRows::Part& other = held.parts[i];
      const double noise = set_[part.recording].weight[static_cast<Index>(part.place)];
      const auto rms = [&](const VectorXd& rows, const TorqueRows::Part& of) {
        return noise * rows.segment(of.begin, of.size).norm() / std::sqrt(std::max(1.0, of.samples));
      };
      JointJudgement& joint = result_.balances.emplace_back();
      joint.recording = static_cast<int>(part.recording);
      joint.joint = set_.joints()[part.place];
      joint.samples = part.samples + other.samples;
      joint.noise = set_[part.recording].noise[static_cast<Index>(part.place)];
      joint.residual = rms(before, part);
      joint.left = rms(after, part);
      joint.held_residual = rms(held_before, other);
      joint.held_left = rms(held_after, other);
      if (set_.has_currents())
        joint.drive_gain = set_.gain(part.place) / (1.0 + amplitudes[static_cast<Index>(part.place)]);
      joint.torque = CalcMeasured(part);
      const ReadRecording& recording = set_[part.recording];
      FillTraces(part, *recording.fit, first_fit[part.recording], before, after);
      FillTraces(other, *recording.held, first_held[part.recording], held_before, held_after);
    }
    std::sort(result_.traces.begin(), result_.traces.end(), [](const TorqueTrace& a, const TorqueTrace& b) {
      return std::pair(a.recording, a.time) < std::pair(b.recording, b.time);
    });
    for (const CauseTerm& term : selection.terms) Name(term);
    Refine(after);
  }

  /// Positions that are off by more than a little, rad or m: what that changes is no longer in proportion. Of
  /// friction at low speed and of a base that shakes, velocity and frequency are sought on what was found.
  void Refine(const VectorXd& left) {
    constexpr double kLittle = 0.01;
    Refinements& next = result_.refinements;
    next.shaking = set_.refinements().shaking;
    next.gravity = set_.refinements().gravity;
    const size_t own = result_.causes.size() - result_.found.size();
    for (size_t i = 0; i < result_.found.size(); ++i) {
      const auto& [fault, amplitude, error, is_named] = result_.found[i];
      if (result_.causes[own + i].fraction < kMuch) continue;
      if (fault.kind == TorqueFault::kZero && std::abs(amplitude[0]) > kLittle)
        next.offsets[fault.index] = amplitude[0];
      if (fault.kind == TorqueFault::kStribeckFriction)
        next.stribeck[fault.index] = StribeckVelocityOf(fault, amplitude);
      if (fault.kind == TorqueFault::kSaturation) next.limits[fault.index] = LimitOf(fault, amplitude);
      if (fault.kind == TorqueFault::kGravity && !result_.IsWhole()) next.gravity = amplitude;
      for (const int joint : fault.kind == TorqueFault::kDelay ? set_.joints() : std::vector<int>())
        if (fault.index < 0 || fault.index == joint)
          next.delays[joint] += std::lround(amplitude[0] / set_.step());
    }
    if (!result_.IsWhole() && next.shaking == 0.0) next.shaking = FindShaking(set_, estimator_.rows(), left);
  }
  [[nodiscard]] double StribeckVelocityOf(const TorqueFault& fault, const VectorXd& a) const {
    const double v = set_[0].shape_velocities(fault.index, fault.columns.front().front().column.component);
    return a.size() == 1 ? v : v * std::sqrt(kFineRatio) * std::exp(a[1] / a[0]);
  }

  [[nodiscard]] double LimitOf(const TorqueFault& fault, const VectorXd& a) const {
    const int component = fault.columns.front().front().column.component;
    return FindCutOff(set_.refinements(), fault.index, component, set_[0].most_torque[fault.index]) *
           (1.0 + a[1] / a[0]);
  }

  /// Root mean square of the measured torque: of y, the model's torque and friction.
  double CalcMeasured(const TorqueRows::Part& part) const {
    const TorqueBalance& balance = *set_[part.recording].fit;
    const TorqueColumn current{TorqueColumn::kCurrent, set_.joints()[part.place]};
    VectorXd b = ModelledOf(part);
    if (set_.has_currents()) {
      b = set_.gain(part.place) * VectorXd::Unit(b.size(), balance.Find(part.place, current));
    } else {
      b[b.size() - 1] = 1.0;
    }
    return std::sqrt(std::max(0.0, b.dot(balance.products(part.place) * b)) / std::max(1.0, part.samples));
  }

  [[nodiscard]] VectorXd ModelledOf(const TorqueRows::Part& part) const {
    const TorqueBalance& balance = *set_[part.recording].fit;
    const int joint = set_.joints()[part.place];
    VectorXd b = VectorXd::Zero(balance.products(part.place).cols());
    b[balance.Find(part.place, {TorqueColumn::kTorque, joint})] = 1.0;
    return b;
  }

  /// Traces of a balance's blocks, to be filled joint by joint. @return the place of the first.
  size_t MakeTraces(size_t recording, const TorqueBalance& balance) {
    const size_t first = result_.traces.size();
    for (const TorqueBalance::Block& block : balance.blocks()) {
      TorqueTrace& trace = result_.traces.emplace_back();
      trace.recording = static_cast<int>(recording);
      trace.time = 0.5 * (block.from + block.to);
      trace.q = block.q / block.samples;
      for (VectorXd* vector : {&trace.measured, &trace.modelled, &trace.explained, &trace.left})
        vector->setConstant(static_cast<Index>(set_.joints().size()),
                            std::numeric_limits<double>::quiet_NaN());
    }
    return first;
  }

  void FillTraces(const TorqueRows::Part& part, const TorqueBalance& balance, size_t first,
                  const VectorXd& before, const VectorXd& after) {
    const VectorXd modelled = ModelledOf(part);
    const auto place = static_cast<Index>(part.place);
    const double noise = set_[part.recording].weight[place];
    for (size_t b = 0; b < balance.blocks().size(); ++b) {
      const TorqueBalance::Block& block = balance.blocks()[b];
      const double count = block.counts[part.place];
      if (!(count > 0.0)) continue;
      TorqueTrace& trace = result_.traces[first + b];
      const Index row = part.begin + part.within + static_cast<Index>(b);
      trace.modelled[place] = modelled.dot(block.sums[part.place]) / count;
      trace.left[place] = noise * after[row] / std::sqrt(count);
      trace.measured[place] = trace.modelled[place] + noise * before[row] / std::sqrt(count);
      trace.explained[place] = trace.measured[place] - trace.left[place];
    }
  }

  void Name(const CauseTerm& term) {
    const TorqueFault& fault = estimator_.faults()[term.candidate];
    if (fault.kind == TorqueFault::kDelay && std::abs(term.amplitude[0]) <= 1.5 * set_.step()) {
      result_.notes.push_back(fmt::format("{}: torques are {:.2g} s late, less than two rows: no cause",
                                          fault.place, term.amplitude[0]));
      return;
    }
    Explanation one;
    one.channel = CauseChannel::kBalance;
    one.from = one.to = std::numeric_limits<double>::quiet_NaN();
    if (fault.kind == TorqueFault::kPush) {
      const auto& blocks = set_[static_cast<size_t>(fault.push.recording)].fit->blocks();
      one.from = std::max(fault.push.from, blocks.front().from);
      one.to = std::min(fault.push.to, blocks.back().to);
      one.ends = true;
    }
    one.faults.push_back(Describe(fault, term.amplitude, term.error));
    for (const auto& [candidate, amplitude] : term.same) {
      Fault same = Describe(estimator_.faults()[candidate], amplitude, {});
      if (!same.IsLike(one.faults.front())) one.faults.push_back(std::move(same));
    }
    one.fraction = term.fraction;
    one.left = result_.left;
    if (term.rival != SIZE_MAX) {
      one.rival = estimator_.faults()[term.rival].place + ": " + estimator_.faults()[term.rival].fault;
      one.log_odds = term.log_odds;
    }
    one.SetOutcome();
    if (IsDoubtful(fault, term)) one.outcome = CauseOutcome::kNotExplained;
    result_.causes.push_back(std::move(one));
    result_.found.push_back(
        {fault, term.amplitude, term.error, result_.causes.back().outcome == CauseOutcome::kNamed});
  }

  /// Whether more than noise is left, so that something else is at work, and it explains little, or where far
  /// more is left not far more: a wrong mass fits a little of any. Friction is named all the same: drives
  /// have more shapes of it than are tried.
  [[nodiscard]] bool IsDoubtful(const TorqueFault& fault, const CauseTerm& term) const {
    if (fault.IsFriction() || result_.left <= kMostNoise) return false;
    const double left = 1.0 - estimator_.selection().fraction;
    // Measured, no bounds: the nearest cause of drawn torques that were cut off explains less than the last.
    constexpr double kMost = 100.0;
    return (term.fraction - left < kMuch && fault.kind > TorqueFault::kArmature) ||
           (result_.left > kFar && fault.kind != TorqueFault::kPayload && term.fraction <= kMost * left);
  }

  [[nodiscard]] Fault Describe(const TorqueFault& fault, const VectorXd& a, VectorXd error) const {
    if (error.size() == 0) error = VectorXd::Zero(a.size());
    Fault one;
    one.fault = fault.fault;
    one.place = fault.place;
    one.unit = fault.unit;
    const bool is_number =
        a.size() == 1 || fault.kind == TorqueFault::kSpring || fault.kind == TorqueFault::kStribeckFriction;
    one.value = is_number ? fault.nominal + a[0] : a.norm();
    one.error = is_number ? error[0] : error.norm();
    const auto vector = [](const VectorXd& v) {
      std::string text = "(";
      for (Index i = 0; i < v.size(); ++i) text += (i == 0 ? "" : ", ") + FormatNumber(v[i], 3);
      return text + ")";
    };
    using enum TorqueFault::Kind;
    if (fault.kind == kPayload) {
      one.value = a[0];
      one.error = error[0];
      one.detail = "at " + vector(a.segment<3>(1) / a[0]) + " m in its frame";
    } else if (fault.kind == kSaturation) {
      one.value = LimitOf(fault, a);
      one.error = error[1] * one.value;
    } else if (fault.kind == kSpring) {
      one.detail = "at rest at " + FormatNumber(-a[1] / a[0], 3);
    } else if (fault.kind == kShaking) {
      one.value = a.head<6>().norm();
      one.error = error.head<6>().norm();
      const auto size = [&](Index i) { return a.segment<2>(2 * i).norm(); };
      one.detail = fmt::format("at {} Hz, along its axes {}",
                               FormatNumber(set_.refinements().shaking / (2.0 * kPi), 4),
                               vector(Vector3d(size(0), size(1), size(2))));
      if (a.size() > 6) one.detail += ", about them " + vector(Vector3d(size(3), size(4), size(5))) + " rad";
    } else if (fault.kind == kPush && fault.push.has_moment) {
      one.value = a.head<3>().norm();
      one.error = error.head<3>().norm();
      one.detail = vector(a.head<3>()) + " N and " + vector(a.tail<3>()) + " N m at its centre of mass";
    } else if (fault.kind == kPush && fault.push.link < 0 && fault.push.joint < 0) {
      const double turned = 2.0 * std::asin(std::min(1.0, 0.5 * a.norm() / model_.gravity().norm()));
      one.detail = vector(a) + ", or tilted by " + FormatNumber(RadToDeg(turned), 3) + " deg";
    } else if (fault.kind == kGravity) {
      const Vector3d now = model_.gravity() + a.head<3>();
      const double turned = std::atan2(now.cross(model_.gravity()).norm(), now.dot(model_.gravity()));
      one.value = now.norm();
      one.detail = vector(now) + ", turned by " + FormatNumber(RadToDeg(turned), 3) + " deg";
    } else if (fault.kind == kTorqueGain && std::abs(one.value + 1.0) < 0.2) {
      one.detail = "(the other sign)";
    } else if (fault.kind == kStribeckFriction) {
      one.detail = "below about " + FormatNumber(StribeckVelocityOf(fault, a), 2) + " per s";
    } else if (!is_number) {
      one.detail = vector(a);
    }
    if (fault.recording >= 0 && recordings_.size() > 1)
      one.detail += " in " + recordings_[static_cast<size_t>(fault.recording)].name;
    return one;
  }

  const RobotModel& model_;
  const std::vector<Recording>& recordings_;
  RecordingSet set_;
  TorqueEstimator estimator_;
  RecordingJudgement result_;
};

}  // namespace

bool RecordingJudgement::IsWhole() const {
  return std::all_of(balances.begin(), balances.end(),
                     [](const JointJudgement& one) { return one.left <= kMostNoise * one.noise; });
}

size_t RecordingJudgement::CountExplaining() const {
  return static_cast<size_t>(std::count_if(causes.begin(), causes.end(), [](const Explanation& one) {
    return one.outcome != CauseOutcome::kNotExplained;
  }));
}

bool RecordingJudgement::Agrees() const { return causes.empty() && IsWhole(); }

namespace {

/// Opens all of them again, with a change of their channels; false where that cannot be.
bool Reopen(std::vector<Recording>* recordings, const std::function<void(Recording*)>& change) {
  for (Recording& one : *recordings) {
    if (!one.reopen) return false;
    one = one.reopen();
    change(&one);
  }
  return true;
}

}  // namespace

RecordingJudgement JudgeRecordings(const RobotModel& model, std::vector<Recording>* recordings,
                                   const JudgeOptions& options,
                                   const std::function<bool(long rows)>& on_rows) {
  bool goes_on = true;
  const auto count = [&](long rows) { return goes_on = !on_rows || on_rows(rows); };
  RecordingJudgement judgement = Judge(model, recordings, options, count).Run();
  if (!goes_on) return judgement;
  constexpr double kWell = 0.95;
  std::vector<PositionFault> faults;
  const auto undo = [&](Recording* one) {
    for (const PositionFault& fault : faults) fault.Undo(one);
  };
  constexpr size_t kMostFaults = 3;
  while (goes_on && options.tries_positions && faults.size() < kMostFaults && !judgement.IsWhole() &&
         (judgement.explained < kWell || judgement.left > kFar || judgement.causes.size() > 3)) {
    if (!recordings->front().reopen) break;
    Recording begin = recordings->front().reopen();
    undo(&begin);
    const std::optional<PositionFault> fault = FindPositionFault(model, std::move(begin));
    const auto is_like = [&](const PositionFault& one) { return one.fault.IsLike(fault->fault); };
    if (!fault || std::ranges::any_of(faults, is_like)) break;
    faults.push_back(*fault);
    if (!Reopen(recordings, undo)) break;
    judgement = Judge(model, recordings, options, count).Run();
  }
  constexpr int kReadings = 5;
  JudgeOptions next = options;
  for (int i = 1; i < kReadings && goes_on && judgement.refinements != next.refinements; ++i) {
    next.refinements = judgement.refinements;
    if (!Reopen(recordings, undo)) break;
    RecordingJudgement again = Judge(model, recordings, next, count).Run();
    // What a reading leaves out is no reason to find nothing.
    if (again.Agrees()) break;
    judgement = std::move(again);
  }
  for (const PositionFault& fault : faults)
    judgement.causes.insert(judgement.causes.begin(), MakeCause(fault.fault));
  return judgement;
}

}  // namespace dexcheck
