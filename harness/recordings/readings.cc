#include "harness/recordings/readings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "controller/common/text.h"
#include "harness/recordings/nonlinear_search.h"

namespace dexcheck {

Explanation MakeCause(const Fault& fault) {
  Explanation one;
  one.channel = CauseChannel::kMeasurement;
  one.from = one.to = std::numeric_limits<double>::quiet_NaN();
  one.faults = {fault};
  return one;
}

namespace {

/// A fault of the recording or of the model's geometry. An offset of the joint that a fixed base carries is
/// gravity that is turned about its axis.
Explanation MakeCause(const RobotModel& model, const LinkFrames& frames, const NonlinearFault& found) {
  Explanation one = MakeCause(found.fault);
  if (found.IsOfModel()) {
    one.channel = CauseChannel::kBalance;
    const bool is_turn = found.number != NonlinearFault::Number::kPlacement;
    one.faults.front().detail =
        DescribeGeometry(model, frames, found.joint, is_turn, is_turn ? found.turn : found.shift);
    if (!found.shows_all) one.faults.front().detail += ", as far as this motion shows it";
  }
  const bool is_offset = found.offset != 0.0 && found.joint >= 0 && model.joint(found.joint).parent < 0;
  if (!is_offset || model.base().type != BaseType::kFixed) return one;
  const Joint& joint = model.joint(found.joint);
  const Vector3d axis = model.base().X_B0.linear() * joint.X_PB.linear() *
                        Eigen::AngleAxisd(joint.mdh.alpha, Vector3d::UnitX()) * Vector3d::UnitZ();
  const Vector3d turned = Eigen::AngleAxisd(-found.offset, axis) * model.gravity();
  constexpr double kLittle = 1e-3;
  if ((turned - model.gravity()).norm() < kLittle * model.gravity().norm()) return one;
  one.faults.push_back({"gravity", "world", turned.norm(), 0.0, "m/s^2",
                        FormatVector(turned, 3) + ", or a base that is turned as far"});
  one.SetOutcome();
  return one;
}

/// A wrong geometry of the model is rarer than a wrong body.
constexpr long kRarer = 2;

/// Returns how many numbers explain a judgement, with those that velocities are off by.
long CountNumbers(const RecordingJudgement& judgement) {
  const long guesses = std::ranges::count_if(judgement.found, &FoundFault::is_guess);
  return judgement.by_causes.numbers + (kRarer + 1) * guesses +
         std::ranges::count(judgement.causes, CauseChannel::kMeasurement, &Explanation::channel);
}

/// Whether a nonlinear fault may say more simply what was found, or what was not.
bool MayBeOtherwise(const RecordingJudgement& judgement) {
  constexpr long kFewNumbers = 1;
  if (std::ranges::any_of(judgement.unjudged, &UnjudgedJoint::has_no_gain)) return true;
  constexpr double kWorse = 1.15;  // than all numbers of the model together: a reason to look, no verdict
  return !judgement.IsWhole() || CountNumbers(judgement) > kFewNumbers ||
         judgement.by_causes.IsWorseThan(judgement.by_all, kWorse);
}

/// Returns the sum over the joints of the residual's logarithm.
double CalcLeft(const RecordingJudgement& judgement) {
  double sum = 0.0;
  for (const JointJudgement& joint : judgement.balances)
    sum += std::log(std::max(joint.left, std::numeric_limits<double>::min()));
  return sum;
}

/// Whether a judgement leaves so much less in the logarithm, of one joint and of all. Less than noise is no
/// better than noise.
bool LeavesLess(const RecordingJudgement& one, const RecordingJudgement& other, double of_joint,
                double of_all) {
  double most = 0.0, all = 0.0;
  for (size_t i = 0; i < std::min(one.balances.size(), other.balances.size()); ++i) {
    const double noise = std::max(one.balances[i].noise, other.balances[i].noise);
    const auto left = [&](const RecordingJudgement& of) {
      return std::max({of.balances[i].left, noise, std::numeric_limits<double>::min()});
    };
    const double fall = std::log(left(other) / left(one));
    most = std::max(most, fall);
    all += fall;
  }
  return most > of_joint && all > of_all;
}

/// A judgement beside faults that were undone.
struct TriedReading {
  RecordingJudgement judgement;
  std::vector<NonlinearFault> faults = {};
};

/// Returns how many numbers explain a reading.
long CountNumbers(const TriedReading& reading) {
  long count = CountNumbers(reading.judgement);
  for (const NonlinearFault& one : reading.faults)
    count += one.CountNumbers() + (one.IsOfModel() ? kRarer : 0);
  return count;
}

/// Whether a reading explains more, or the same with fewer numbers.
bool IsBetter(const TriedReading& one, const TriedReading& other) {
  const RecordingJudgement &a = one.judgement, &b = other.judgement;
  if (a.unjudged.size() != b.unjudged.size()) return a.unjudged.size() < b.unjudged.size();
  if (a.IsWhole() != b.IsWhole()) return a.IsWhole();
  const long more = CountNumbers(one) - CountNumbers(other);
  constexpr double kWorse = 0.1, kMuchOfNumber = 0.25, kMuch = 0.4;  // in the logarithm
  // A much better prediction of the quarter that was held out is worth a few numbers.
  constexpr double kMuchBetter = 1.25;
  constexpr long kFewMore = 2;
  if (a.IsWhole() && more <= kFewMore && b.by_causes.IsWorseThan(a.by_causes, kMuchBetter)) return true;
  if (a.IsWhole()) return more < 0 && !LeavesLess(b, a, 0.0, kWorse * static_cast<double>(a.balances.size()));
  return LeavesLess(a, b, kMuch, kMuchOfNumber * static_cast<double>(more));
}

/// Adds what was found of a joint's offset to what was undone of it. @return whether there is any.
bool AddFound(const RecordingJudgement& judgement, std::vector<NonlinearFault>* faults) {
  bool has_any = false;
  for (NonlinearFault& undone : *faults) {
    for (const FoundFault& one : judgement.found) {
      if (one.fault.kind != TorqueFault::kZero || one.fault.index != undone.joint ||
          undone.number != NonlinearFault::Number::kOffset)
        continue;
      undone.offset -= one.amplitude[0];
      undone.fault.value += one.amplitude[0];
      has_any = true;
    }
  }
  return has_any;
}

/// Whether a gain of positions was undone that is found once more: the two cancel each other.
bool HasGainTwice(const TriedReading& reading) {
  return std::ranges::any_of(reading.faults, [&](const NonlinearFault& undone) {
    return undone.number == NonlinearFault::Number::kGain &&
           std::ranges::any_of(reading.judgement.found, [&](const FoundFault& one) {
             return one.fault.kind == TorqueFault::kPositionGain && one.fault.index == undone.joint;
           });
  });
}

RobotModel Correct(const RobotModel& model, const std::vector<NonlinearFault>& faults) {
  RobotSpec spec = model.spec();
  for (const NonlinearFault& fault : faults) fault.Undo(&spec);
  return RobotModel(std::move(spec));
}

class Readings {
 public:
  Readings(const RobotModel& model, std::vector<Recording>* recordings, const JudgeOptions& options,
           const OnRows& on_rows, const JudgeOnce& judge)
      : model_(model),
        recordings_(recordings),
        options_(options),
        judge_(judge),
        count_([this, on_rows](long rows) { return goes_on_ = !on_rows || on_rows(rows); }),
        refinements_(options.refinements) {}

  RecordingJudgement Run() {
    TriedReading reading{Judge({}, refinements_)};
    AdvanceVelocities(&reading);
    HoldOutOthers(&reading);
    Search(/*of_model=*/false, &reading);
    Refine(&reading);
    Search(/*of_model=*/true, &reading);
    // Beside what nothing explains, a number explains a part of anything.
    for (const NonlinearFault& fault : reading.faults)
      reading.judgement.by_causes.numbers += fault.CountNumbers();
    for (const NonlinearFault& fault : reading.faults) {
      Explanation one = MakeCause(model_, options_.frames, fault);
      if (fault.number != NonlinearFault::Number::kNone && !reading.judgement.IsWhole())
        one.outcome = CauseOutcome::kNotExplained;
      reading.judgement.causes.insert(reading.judgement.causes.begin(), std::move(one));
    }
    return std::move(reading.judgement);
  }

 private:
  /// Opens all recordings again and undoes these faults; false where that cannot be.
  bool Reopen(const std::vector<NonlinearFault>& faults) {
    for (Recording& one : *recordings_) {
      if (!one.reopen) return false;
      one = one.reopen();
      for (const NonlinearFault& fault : faults) fault.Undo(&one);
    }
    return true;
  }

  RecordingJudgement Judge(const std::vector<NonlinearFault>& faults, const Refinements& refinements) {
    RecordingJudgement judgement = judge_(Correct(model_, faults), refinements, !faults.empty(), count_);
    for (const NonlinearFault& fault : faults) judgement.undone += fault.CountNumbers();
    return judgement;
  }

  /// Decides whether forces follow from velocities at the positions' times.
  void AdvanceVelocities(TriedReading* reading) {
    // A simulator's forces are those of the velocity that it has at a step, a robot's those of the position's
    // time.
    if (!goes_on_ || !reading->judgement.has_other_times || !Reopen({})) return;
    refinements_.advances_velocities = true;
    RecordingJudgement other = Judge({}, refinements_);
    if (goes_on_ && CalcLeft(other) < CalcLeft(reading->judgement)) {
      reading->judgement = std::move(other);
    } else {
      refinements_.advances_velocities = false;
    }
  }

  /// Looks for what happened while everything that would show it was held out.
  void HoldOutOthers(TriedReading* reading) {
    const auto happened = [](const JointJudgement& one) {
      constexpr double kMore = 1.2;  // than where the causes were found
      return one.held_left > std::max(kMostNoise * one.noise, kMore * one.left);
    };
    if (!goes_on_ || reading->judgement.left > kMostNoise ||
        std::ranges::none_of(reading->judgement.balances, happened) || !Reopen({}))
      return;
    Refinements others = refinements_;
    others.held_stretch = 1;
    TriedReading again{Judge({}, others)};
    const bool has_more = again.judgement.CountExplaining() > reading->judgement.CountExplaining();
    if (!goes_on_ || (!has_more && !IsBetter(again, *reading))) return;
    refinements_ = others;
    *reading = std::move(again);
  }

  /// Undoes one nonlinear fault after the other while that explains more.
  /// @param of_model of the geometry; otherwise of the recording.
  void Search(bool of_model, TriedReading* best) {
    constexpr size_t kMostFaults = 3;
    TriedReading now = *best;
    // A wrong geometry looks like wrong numbers of positions.
    if (of_model)
      std::erase_if(now.faults,
                    [](const NonlinearFault& one) { return one.number != NonlinearFault::Number::kNone; });
    while (goes_on_ && options_.tries_positions && now.faults.size() < kMostFaults &&
           MayBeOtherwise(now.judgement)) {
      if (!recordings_->front().reopen) {
        if (!of_model)
          best->judgement.notes.push_back(
              recordings_->front().name +
              ": is read once: other signs, units, offsets and orders of positions are not tried");
        return;
      }
      Recording begin = recordings_->front().reopen();
      for (const NonlinearFault& fault : now.faults) fault.Undo(&begin);
      const std::optional<NonlinearFault> fault =
          FindNonlinearFault(Correct(model_, now.faults), std::move(begin), of_model);
      const auto is_like = [&](const NonlinearFault& one) { return one.fault.IsLike(fault->fault); };
      if (!fault || std::ranges::any_of(now.faults, is_like)) return;
      now.faults.push_back(*fault);
      if (!Reopen(now.faults)) return;
      now.judgement = Judge(now.faults, refinements_);
      if (AddFound(now.judgement, &now.faults) && Reopen(now.faults))
        now.judgement = Judge(now.faults, refinements_);
      // A wrong geometry always explains a part of something.
      if (of_model) Refine(&now);
      // Fewer numbers than before, or none at all.
      const long others = CountNumbers(now.judgement);
      const bool replaces_others = now.judgement.IsWhole() && (others < CountNumbers(*best) ||
                                                               (others == 0 && !best->judgement.IsWhole()));
      const bool is_better = (!of_model || replaces_others) && !HasGainTwice(now) && IsBetter(now, *best);
      if (is_better) *best = now;
      if (of_model || (!is_better && fault->number != NonlinearFault::Number::kNone)) return;
    }
  }

  /// Reads again with the refinements of the reading before, until these settle.
  void Refine(TriedReading* reading) {
    constexpr int kReadings = 5;
    Refinements known = refinements_;
    for (int i = 1; i < kReadings && goes_on_ && reading->judgement.refinements != known; ++i) {
      known = reading->judgement.refinements;
      if (!Reopen(reading->faults)) return;
      RecordingJudgement again = Judge(reading->faults, known);
      // Rows that a reading leaves out are no reason to find nothing.
      if (again.Agrees()) return;
      reading->judgement = std::move(again);
    }
  }

  const RobotModel& model_;
  std::vector<Recording>* recordings_;
  const JudgeOptions& options_;
  const JudgeOnce& judge_;
  OnRows count_;
  Refinements refinements_;
  bool goes_on_ = true;
};

}  // namespace

RecordingJudgement ReadUntilSettled(const RobotModel& model, std::vector<Recording>* recordings,
                                    const JudgeOptions& options, const OnRows& on_rows,
                                    const JudgeOnce& judge) {
  return Readings(model, recordings, options, on_rows, judge).Run();
}

}  // namespace dexcheck
