#include "harness/recordings/judge_recordings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/recordings/base_motion.h"
#include "harness/recordings/readings.h"

namespace dexcheck {
namespace {

using Eigen::Index;

/// Times the noise: more than errors of derivatives, known to a factor of two, can be.
constexpr double kFar = 5.0;
/// Fraction of the residual that a cause must explain to justify another reading.
constexpr double kMuch = 0.05;

/// One judgement, put into words.
class Judge {
 public:
  /// @param has_others whether other faults were undone.
  Judge(const RobotModel& model, std::vector<Recording>* recordings, const JudgeOptions& options,
        bool has_others, const std::function<bool(long)>& on_rows)
      : has_others_(has_others),
        set_(model, recordings, options, on_rows),
        estimator_(&set_, options.most_causes),
        description_(set_, estimator_, options.frames, names_) {
    for (const Recording& one : *recordings) names_.push_back(one.name);
  }

  RecordingJudgement Run() {
    result_.joints = set_.joints();
    result_.unjudged = set_.ListUnjudged();
    result_.rests = std::ranges::none_of(set_.joints(), [this](int joint) { return set_.Moves(joint); });
    result_.rows = set_.rows();
    result_.notes = set_.notes();
    result_.has_other_times = set_.has_other_times();
    for (const Fault& fault : set_.faults()) {
      Explanation& one = result_.causes.emplace_back(MakeCause(fault));
      // Velocities show no more of a clock.
      if (fault.fault != "velocity gain" || fault.place != "all joints" || !(fault.value > 0.0)) continue;
      one.faults.push_back({"clock", fault.place, fault.value, 0.0, "", "times the true time"});
      one.SetOutcome();
    }
    ReportSeconds();
    return std::move(result_);
  }

 private:
  void ReportSeconds() {
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
    result_.by_all = estimator_.PredictByAll(held);
    result_.by_causes = estimator_.PredictByCauses(held);
    result_.has_pushes = std::ranges::any_of(selection.terms, [this](const CauseTerm& term) {
      return estimator_.faults()[term.candidate].kind == TorqueFault::kPush;
    });
    const VectorXd held_before = held.CalcLeft(nothing), held_after = held.CalcLeft(amplitudes);
    std::vector<size_t> first_fit, first_held;
    for (size_t recording = 0; recording < set_.size(); ++recording) {
      first_fit.push_back(MakeTraces(recording, *set_[recording].fit));
      first_held.push_back(MakeTraces(recording, *set_[recording].held));
    }
    for (size_t i = 0; i < estimator_.rows().parts.size(); ++i) {
      const TorqueRows::Part& part = estimator_.rows().parts[i];
      const TorqueRows::Part& other = held.parts[i];
      if (!(part.samples > 0.0)) continue;
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
      joint.modelled = CalcSize(part, ModelledOf(part));
      joint.hidden = estimator_.CalcHidden(joint.noise, joint.left, part.samples);
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

  /// Refines the velocity of friction at low speed, and the frequency of a base that shakes.
  void Refine(const VectorXd& left) {
    Refinements& next = result_.refinements;
    next.held_stretch = set_.refinements().held_stretch;
    next.shaking = set_.refinements().shaking;
    next.gravity = set_.refinements().gravity;
    next.advances_velocities = set_.refinements().advances_velocities;
    const size_t own = result_.causes.size() - result_.found.size();
    const double beyond = 1.0 - result_.explained;
    for (size_t i = 0; i < result_.found.size(); ++i) {
      const TorqueFault& fault = result_.found[i].fault;
      const VectorXd& amplitude = result_.found[i].amplitude;
      const double fraction = result_.causes[own + i].fraction;
      if (fraction < kMuch && (result_.IsWhole() || fraction < 2.0 * beyond)) continue;
      if (fault.kind == TorqueFault::kStribeckFriction || fault.kind == TorqueFault::kDryFriction) {
        const TorqueColumn& shape = fault.sums.front().front().column;
        auto& known = fault.kind == TorqueFault::kDryFriction ? next.smooth : next.stribeck;
        if (shape.kind == TorqueColumn::kFriction && shape.component != kSlipShape)
          known[fault.index] = description_.ShapeVelocityOf(fault, amplitude);
      }
      if (fault.kind == TorqueFault::kSaturation)
        next.limits[fault.index] = description_.LimitOf(fault, amplitude);
      if (fault.kind == TorqueFault::kGravity && !result_.IsWhole()) next.gravity = amplitude;
      for (const int joint : fault.kind == TorqueFault::kDelay ? set_.joints() : std::vector<int>())
        if (fault.index < 0 || fault.index == joint)
          next.delays[joint] += std::lround(amplitude[0] / set_.step());
    }
    if (!result_.IsWhole() && next.shaking == 0.0) next.shaking = FindShaking(set_, estimator_.rows(), left);
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
    return CalcSize(part, b);
  }
  /// Returns the root mean square of a sum of a joint's columns, N m or N. @param b the factor of each.
  [[nodiscard]] double CalcSize(const TorqueRows::Part& part, const VectorXd& b) const {
    const MatrixXd& products = set_[part.recording].fit->products(part.place);
    return std::sqrt(std::max(0.0, b.dot(products * b)) / std::max(1.0, part.samples));
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
    const bool is_delay = fault.kind == TorqueFault::kDelay || fault.kind == TorqueFault::kLatePosition;
    if (is_delay && std::abs(term.amplitude[0]) <= 1.5 * set_.step()) {
      result_.notes.push_back(fmt::format("{}: {} {:.2g} s, less than two rows: no cause", fault.place,
                                          fault.fault, term.amplitude[0]));
      return;
    }
    const auto is_integrator = [this](size_t candidate) {
      return estimator_.faults()[candidate].kind == TorqueFault::kIntegrator;
    };
    if (is_integrator(term.candidate) ||
        std::ranges::any_of(term.same, [&](const auto& one) { return is_integrator(one.first); })) {
      result_.notes.push_back("the time step of a simulator explains a part of the torques: no cause");
      return;
    }
    Explanation one = MakeCause(description_.Describe(fault, term.amplitude, term.error));
    one.channel = CauseChannel::kBalance;
    if (fault.kind == TorqueFault::kPush) {
      const auto& blocks = set_[static_cast<size_t>(fault.push.recording)].fit->blocks();
      one.from = std::max(fault.push.from, blocks.front().from);
      one.to = std::min(fault.push.to, blocks.back().to);
      one.ends = true;
    }
    FoundFault found{fault, term.amplitude, term.error};
    found.is_guess = fault.IsGuess();
    const bool is_shared = description_.AddWholeNumbers(&found, &one.faults.front());
    for (const auto& [candidate, amplitude] : term.same) {
      const TorqueFault& other = estimator_.faults()[candidate];
      found.is_guess = found.is_guess && other.IsGuess();
      // With each joint's gain sought, the model's bodies are the scale that shows it.
      if (is_shared && (other.kind == fault.kind || other.IsOfLoad())) continue;
      Fault same = description_.Describe(other, amplitude, {});
      if (!same.IsLike(one.faults.front())) one.faults.push_back(std::move(same));
    }
    one.fraction = term.fraction;
    one.left = result_.left;
    if (term.rival != SIZE_MAX) one.SetRival(estimator_.faults()[term.rival], term.log_odds);
    one.SetOutcome();
    if (IsDoubtful(fault, term)) one.outcome = CauseOutcome::kNotExplained;
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    if (!found.HasSize()) {
      one.outcome = CauseOutcome::kNotExplained;
      one.faults = {{"no cause of a possible size", fault.place, kNone, 0.0, "", ""}};
      one.rival.clear();
    } else if (Fault& first = one.faults.front(); std::isinf(first.error)) {
      one.outcome = CauseOutcome::kNotExplained;
      first = {fault.fault, fault.place, kNone,
               0.0,         fault.unit,  "of a size that this motion does not determine"};
    }
    found.is_named = one.outcome == CauseOutcome::kNamed;
    result_.causes.push_back(std::move(one));
    result_.found.push_back(std::move(found));
  }

  /// Whether more than noise is left, so that something else is at work, and all causes or this one explain
  /// little, or where far more is left not far more: a wrong mass fits a little of any. Dry and viscous
  /// friction are named all the same, since drives have more shapes of it than are tried; a further shape
  /// that explains little is not.
  [[nodiscard]] bool IsDoubtful(const TorqueFault& fault, const CauseTerm& term) const {
    constexpr double kErrors = 3.0;  // standard errors from zero
    const VectorXd shown = term.error.array().isFinite().select(term.error, 0.0);
    const Index sizes = fault.HasVelocity() || fault.kind == TorqueFault::kSpring ? 1 : term.amplitude.size();
    if (term.amplitude.head(sizes).norm() < kErrors * shown.head(sizes).norm()) return true;
    // Noise is known to a factor of two: beside another cause, less may be what that one leaves.
    if ((has_others_ || !result_.found.empty()) && IsNoiseWithout(term)) return true;
    if (IsRemainder(term.candidate) ||
        std::ranges::any_of(term.same, [this](const auto& one) { return IsRemainder(one.first); }))
      return true;
    if (result_.IsWhole()) return false;
    // A payload is named by its mass and place, and has an inertia besides.
    const bool is_beaten = result_.IsBeaten() && fault.kind != TorqueFault::kPayload;
    if (is_beaten && !fault.IsFriction()) return true;
    const double left = 1.0 - estimator_.selection().fraction;
    constexpr double kMostLeft = 0.1;
    // A force on a link for a while fits a part of anything that is large then.
    if (fault.kind == TorqueFault::kPush && fault.push.joint < 0) return true;
    // Friction is no name for a remainder of another cause.
    const bool is_nearest = !has_others_ && std::ranges::all_of(result_.found, [](const FoundFault& before) {
      return before.is_named && before.fault.IsFriction();
    });
    if (fault.IsFriction())
      return !is_nearest ||
             ((fault.kind == TorqueFault::kStribeckFriction || fault.kind == TorqueFault::kLoadFriction ||
               fault.kind == TorqueFault::kSquareFriction) &&
              term.fraction - left < kMuch);
    // Measured, no bounds: the nearest cause of drawn torques that were cut off explains less than the last.
    constexpr double kMainly = 0.5, kMost = 100.0;
    return left > kMostLeft || term.fraction < kMainly ||
           (result_.left > kFar && fault.kind != TorqueFault::kPayload && term.fraction <= kMost * left);
  }

  /// Whether a fault may be what another one leaves that was found before: a payload has an inertia besides
  /// its mass and place, and a large error of a joint's position is not in proportion to its columns.
  [[nodiscard]] bool IsRemainder(size_t candidate) const {
    const TorqueFault& one = estimator_.faults()[candidate];
    return std::ranges::any_of(result_.found, [&](const FoundFault& before) {
      const bool is_of_payload =
          before.fault.kind == TorqueFault::kPayload && one.kind == TorqueFault::kInertia;
      return before.fault.index == one.index &&
             (is_of_payload || (before.fault.IsOfPosition() && one.IsOfPosition()));
    });
  }
  /// Whether the other causes leave no more than noise.
  [[nodiscard]] bool IsNoiseWithout(const CauseTerm& term) const {
    std::vector<CauseTerm> others = estimator_.selection().terms;
    std::erase_if(others, [&](const CauseTerm& one) { return one.candidate == term.candidate; });
    const TorqueRows& rows = estimator_.rows();
    const VectorXd left = estimator_.CalcLeft(others);
    return std::ranges::all_of(rows.parts, [&](const TorqueRows::Part& part) {
      const ReadRecording& one = set_[part.recording];
      const auto place = static_cast<Index>(part.place);
      return one.weight[place] * left.segment(part.begin, part.size).norm() <=
             kMostNoise * one.noise[place] * std::sqrt(part.samples);
    });
  }

  bool has_others_;
  std::vector<std::string> names_;
  RecordingSet set_;
  TorqueEstimator estimator_;
  CauseDescription description_;
  RecordingJudgement result_;
};

}  // namespace

bool RecordingJudgement::IsNoise() const {
  const double most_held = std::hypot(kMostNoise, by_causes.inexact);
  return !balances.empty() && (has_pushes || by_causes.held_left <= most_held) &&
         std::ranges::all_of(balances, [&](const JointJudgement& one) {
           return one.left <= kMostNoise * one.noise &&
                  (has_pushes || one.held_left <= most_held * one.noise);
         });
}

size_t RecordingJudgement::CountExplaining() const {
  return static_cast<size_t>(std::count_if(causes.begin(), causes.end(), [](const Explanation& one) {
    return one.outcome != CauseOutcome::kNotExplained;
  }));
}

bool RecordingJudgement::IsHidden() const { return std::ranges::all_of(balances, &JointJudgement::IsHidden); }

bool RecordingJudgement::Agrees() const {
  return causes.empty() && IsWhole() && std::ranges::none_of(balances, &JointJudgement::IsHidden) && !rests &&
         std::ranges::none_of(unjudged, &UnjudgedJoint::moves);
}

RecordingJudgement JudgeRecordings(const RobotModel& model, std::vector<Recording>* recordings,
                                   const JudgeOptions& options,
                                   const std::function<bool(long rows)>& on_rows) {
  const auto judge = [&](const RobotModel& corrected, const Refinements& refinements, bool has_others,
                         const auto& count) {
    JudgeOptions refined = options;
    refined.refinements = refinements;
    return Judge(corrected, recordings, refined, has_others, count).Run();
  };
  return ReadUntilSettled(model, recordings, options, on_rows, judge);
}

}  // namespace dexcheck
