#include "controller/handling/pick_and_place.h"

#include <algorithm>
#include <array>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/grasp/serial_chain.h"
#include "controller/object/so3.h"

namespace dexcheck {
namespace {

constexpr double kPlatformDamping = 20.0;  // 1/s, while the platform should stand
constexpr double kArmFraction = 0.2;       // of the posture's frequency, for arm and waist while carrying
constexpr double kFirstTouch = 0.2;        // of the touch force comes at once, so that no fingertip bounces
constexpr double kFirstTouchTime = 0.03;   // s
constexpr double kTouchTime = 0.6;         // s to build up or take back a touch force
constexpr double kLastTouch = 0.015;       // N, of the touch force is left when the fingers open
constexpr double kPause = 0.1;             // s between movements
constexpr double kFreeRate = 0.4;          // rad/s that joints turn at most on average without the object
constexpr double kRest = 0.5;              // s until the arm is at rest
constexpr double kReleaseTime = 1.2;       // s
constexpr double kOpenTime = 0.8;          // s
constexpr double kSearchRamp = 0.1;        // s
constexpr double kNominal = 0.01;          // of the weight: less counts as nothing
constexpr double kWeighingRate = 0.2;      // of the stated weight, 1/s

}  // namespace

const char* NameOf(Phase phase) {
  constexpr std::array<const char*, 9> kNames = {"approach",  "close",   "grip",     "take over", "carry",
                                                 "hand over", "release", "withdraw", "done"};
  return kNames.at(static_cast<size_t>(phase));
}

PickAndPlace::PickAndPlace(const RobotModel& model, const Hand& hand, const Surface& surface,
                           const MassProperties& object, const VectorXd& start,
                           const PickAndPlaceOptions& options, double time_step)
    : model_(&model),
      hand_(hand),
      surface_(&surface),
      weight_(object.mass * model.gravity().norm()),
      start_(start),
      options_(options),
      half_step_(0.5 * time_step),
      own_joints_(grasp_internal::ListOwnJoints(model, hand.fingertips)),
      posture_(model),
      touched_at_(hand.fingertips.size()) {
  demand_.touch_force.assign(hand.fingertips.size(), 0.0);
}

void PickAndPlace::Begin(double t, const MeasuredState& state) {
  history_.clear();
  attempt_ = 0;
  StartMove(start_.tail(model_->num_joints()), start_.tail(model_->num_joints()), t, 0.0);
  PlanAttempt(t, state);
  if (!plan_.found) throw InputError(plan_.problem);
}

void PickAndPlace::PlanAttempt(double t, const MeasuredState& state) {
  ++attempt_;
  // From the posture of the start, where the platform is now.
  VectorXd q = start_;
  q.head(model_->num_base_positions()) = state.q.head(model_->num_base_positions());
  carried_over_ = false;
  plan_ = MakePickPlan(*model_, hand_, *surface_, state.X_Bo, q, options_.plan);
  lay_at_ = state.X_Bo.translation();
  push_ = 0.0;
  if (!plan_.found) return;
  const VectorXd above = plan_.rise.Evaluate(1.0);
  const auto last = [](double least, const VectorXd& from, const VectorXd& to, double rate) {
    return std::max(least, (to - from).cwiseAbs().maxCoeff() / rate);
  };
  const VectorXd from = move_.to;
  approach_time_ = last(options_.approach_time, from, above, kFreeRate);
  raise_time_ = last(options_.raise_time, plan_.q_open, above, options_.arm_rate);
  transport_time_ = options_.transport_time;
  if (plan_.along.size() > 0) {
    const VectorXd there = plan_.along.Evaluate(1.0);
    raise_time_ = last(raise_time_, there, plan_.landing.Evaluate(0.0), options_.arm_rate);
    transport_time_ = last(transport_time_, above, there, options_.arm_rate);
    approach_time_ = last(approach_time_, there, start_.tail(there.size()), kFreeRate);
  }
  lower_time_ = last(options_.lower_time, plan_.q_open, above, kFreeRate);
  Enter(Phase::kApproach, t);
  StartMove(from, above, t, approach_time_);
}

void PickAndPlace::Enter(Phase phase, double t) {
  phase_ = phase;
  stage_ = 0;
  begin_ = stage_begin_ = t;
  history_.push_back({phase, t, attempt_});
}

void PickAndPlace::StartMove(const VectorXd& from, const VectorXd& to, double t, double duration,
                             bool steady) {
  move_.from = from;
  move_.to = to;
  move_.begin = t;
  move_.duration = duration;
  move_.steady = steady;
  move_.path = nullptr;
}

void PickAndPlace::StartPath(const VectorXd& from, const PosturePath& path, bool backwards, double t,
                             double duration) {
  const VectorXd begin = path.Evaluate(backwards ? 1.0 : 0.0);
  const VectorXd end = path.Evaluate(backwards ? 0.0 : 1.0);
  move_.offset = from - begin;
  StartMove(from, move_.offset + end, t, duration);
  move_.path = &path;
  move_.backwards = backwards;
}

ScalarMotion PickAndPlace::EvaluateMove(double t) const {
  if (move_.duration <= 0.0) return {1.0, 0.0, 0.0};
  if (!move_.steady) return CalcMinSnap(t - move_.begin, move_.duration);
  // A ramp up to 1 / duration, and a stop at the end, which is only reached when nothing was found.
  ScalarMotion motion = CalcSpeedRamp(std::max(0.0, t - move_.begin), kSearchRamp);
  motion.s /= move_.duration;
  motion.s_dot /= move_.duration;
  motion.s_ddot /= move_.duration;
  return motion.s < 1.0 ? motion : ScalarMotion{1.0, 0.0, 0.0};
}

void PickAndPlace::EvaluateWay(double s) {
  if (move_.path == nullptr) {
    way_s_ = move_.to - move_.from;
    way_ = move_.from + s * way_s_;
    way_ss_.setZero(way_.size());
    return;
  }
  move_.path->Evaluate(move_.backwards ? 1.0 - s : s, &way_, &way_s_, &way_ss_);
  if (move_.backwards) way_s_ = -way_s_;
  way_ += move_.offset;
}

void PickAndPlace::FollowMove(double t) {
  const Eigen::Index joints = model_->num_joints();
  const ScalarMotion before = EvaluateMove(t - half_step_);
  EvaluateWay(before.s);
  posture_.xi_reference.tail(joints) = before.s_dot * way_s_;
  const ScalarMotion now = EvaluateMove(t);
  EvaluateWay(now.s);
  posture_.q_posture = way_;
  posture_.acceleration.tail(joints) = now.s_ddot * way_s_ + now.s_dot * now.s_dot * way_ss_;
  SetPostureGains(t);
}

void PickAndPlace::SetPostureGains(double t) {
  // Platform and arm are free to follow the object, so that the fingers need not roll; they come to rest
  // without a jolt.
  double standing = phase_ == Phase::kCarry ? 0.0 : 1.0;
  const double change = CalcMinSnap(t - begin_, options_.take_over_time).s;
  if (phase_ == Phase::kTakeOver) standing = 1.0 - change;
  if (phase_ == Phase::kHandOver) standing = change;
  const double frequency = options_.posture_frequency;
  const double arm = frequency * (kArmFraction + standing * (1.0 - kArmFraction));
  const Eigen::Index base = model_->num_base_velocities();
  posture_.stiffness.setConstant(arm * arm);
  posture_.damping.head(base).setConstant(standing * kPlatformDamping);
  posture_.damping.tail(posture_.stiffness.size()).setConstant(2.0 * arm);
  for (const std::vector<int>& joints : own_joints_) {
    for (const int joint : joints) {
      posture_.stiffness[joint] = frequency * frequency;
      posture_.damping[base + joint] = 2.0 * frequency;
    }
  }
}

void PickAndPlace::Update(double t, const MeasuredState& state, const Touch& touch) {
  if (phase_ == Phase::kClose || phase_ == Phase::kGrip) {
    push_ = std::max(push_, (state.X_Bo.translation() - lay_at_).norm());
  }
  constexpr std::array<void (PickAndPlace::*)(double, const MeasuredState&, const Touch&), 9> kUpdates = {
      &PickAndPlace::UpdateApproach, &PickAndPlace::UpdateClose,    &PickAndPlace::UpdateGrip,
      &PickAndPlace::UpdateTakeOver, &PickAndPlace::UpdateCarry,    &PickAndPlace::UpdateHandOver,
      &PickAndPlace::UpdateRelease,  &PickAndPlace::UpdateWithdraw, nullptr};
  if (const auto update = kUpdates.at(static_cast<size_t>(phase_))) (this->*update)(t, state, touch);
  FollowMove(t);
}

void PickAndPlace::UpdateApproach(double t, const MeasuredState& /*state*/, const Touch& /*touch*/) {
  if (!MoveDone(t)) return;
  if (stage_ == 0) {
    stage_ = 1;
    StartPath(move_.to, plan_.rise, /*backwards=*/true, t, lower_time_);
  } else if (t >= move_.begin + move_.duration + kPause) {
    Enter(Phase::kClose, t);
    demand_.by_inertia = true;
    StartMove(plan_.q_open, plan_.q_near, t, options_.close_time);
  }
}

void PickAndPlace::UpdateClose(double t, const MeasuredState& state, const Touch& touch) {
  bool all = true;
  bool settled = true;
  int missing = 0;
  for (size_t i = 0; i < hand_.fingertips.size(); ++i) {
    if (!Contains(demand_.contacts, i) && Contains(touch.fingertips, i)) {
      demand_.contacts |= ContactSet{1} << i;
      touched_at_[i] = t;
      for (const int joint : own_joints_[i]) {
        move_.from[joint] = move_.to[joint] = state.q[model_->num_base_positions() + joint];
      }
    }
    if (!Contains(demand_.contacts, i)) {
      all = false;
      missing = hand_.fingertips[i];
      continue;
    }
    const double since = t - touched_at_[i];
    demand_.touch_force[i] = options_.touch_force * (kFirstTouch * CalcMinSnap(since, kFirstTouchTime).s +
                                                     (1.0 - kFirstTouch) * CalcMinSnap(since, kTouchTime).s);
    settled = settled && t - touched_at_[i] >= kTouchTime;
  }
  if (push_ > options_.largest_push) {
    return GiveUp(t, state, "the closing hand pushed the object by " + FormatNumber(push_) + " m");
  }
  if (all && settled) {
    Enter(Phase::kGrip, t);
    return HoldPosture(move_.to);
  }
  if (all || !MoveDone(t)) return;
  if (stage_ == 0) {
    stage_ = 1;
    const double way = options_.plan.nearness + options_.plan.depth;
    VectorXd to = plan_.q_deep;
    for (size_t i = 0; i < hand_.fingertips.size(); ++i) {
      if (!Contains(demand_.contacts, i)) continue;
      for (const int joint : own_joints_[i]) to[joint] = move_.to[joint];
    }
    StartMove(move_.to, to, t, way / options_.search_speed, /*steady=*/true);
  } else {
    const std::string& name = model_->frame(missing).name;
    GiveUp(t, state, "fingertip " + Quote(name) + " found no object where it should be");
  }
}

void PickAndPlace::UpdateGrip(double t, const MeasuredState& state, const Touch& /*touch*/) {
  const double s = CalcMinSnap(t - begin_, options_.grip_time).s;
  demand_.grip = s;
  demand_.weight = 0.0;
  demand_.f_min = options_.touch_force + s * (options_.f_min - options_.touch_force);
  if (push_ > options_.largest_push) {
    return GiveUp(t, state, "building up grasp forces pushed the object by " + FormatNumber(push_) + " m");
  }
  if (t - begin_ < options_.grip_time + kPause) return;
  Enter(Phase::kTakeOver, t);
  // At rest a posture error moves nothing; without one the change of weights cannot either.
  HoldPosture(Joints(state));
  X_start_ << state.X_Bo.translation(), CalcAnyZyzAngles(state.X_Bo.linear());
  demand_.by_inertia = false;
  demand_.carried = true;
  demand_.desired = DesiredMotion{};
  demand_.desired.X_d = X_start_;
}

void PickAndPlace::UpdateTakeOver(double t, const MeasuredState& /*state*/, const Touch& touch) {
  borne_ = demand_.weight;
  const bool free = touch.support_force <= 0.0;
  if (stage_ == 0) {
    demand_.weight = CalcMinSnap(t - begin_, options_.take_over_time).s;
    if (free && demand_.weight > 0.1 && demand_.weight < 1.0 - kNominal) {
      demand_.scale = demand_.weight;
      return Enter(Phase::kCarry, t);
    }
    if (t - begin_ < options_.take_over_time + kPause) return;
    if (touch.support_force < kNominal * weight_) return Enter(Phase::kCarry, t);
    BeginStage(1, t);
  }
  // Heavier than stated.
  demand_.weight = 1.0 + kWeighingRate * (t - stage_begin_);
  if (free) {
    demand_.scale = demand_.weight;
    return Enter(Phase::kCarry, t);
  }
  if (demand_.weight <= options_.overload) return;
  Refuse(t,
         "the object weighs more than " + FormatNumber(options_.overload) + " times what the model states");
}

void PickAndPlace::Refuse(double t, const std::string& reason) {
  if (refused_) throw GraspForceError(reason);
  refused_ = true;
  failure_ = "refused to lift: " + reason;
  if (phase_ == Phase::kGrip) {
    demand_.grip = 0.0;
    Enter(Phase::kRelease, t);
    stage_ = 1;
    return;
  }
  lowering_from_ = demand_.weight = borne_;
  Enter(Phase::kHandOver, t);
}

DesiredMotion PickAndPlace::EvaluateCarry(double t) const {
  DesiredMotion desired;
  desired.X_d = X_start_;
  const auto add = [&](const Vector3d& way, double from, double duration) {
    const ScalarMotion now = CalcMinSnap(t - from, duration);
    desired.X_d.head<3>() += now.s * way;
    desired.X_d_dot.head<3>() += CalcMinSnap(t - half_step_ - from, duration).s_dot * way;
    desired.X_d_ddot.head<3>() += now.s_ddot * way;
  };
  add(options_.raise, begin_, raise_time_);
  add(options_.transport, raised_at(), transport_time_);
  add(-options_.raise, there_at(), raise_time_);
  return desired;
}

void PickAndPlace::UpdateCarry(double t, const MeasuredState& /*state*/, const Touch& /*touch*/) {
  demand_.weight = demand_.scale;
  demand_.desired = EvaluateCarry(t);
  // The arm bends as the plan has it, so that fingers need not.
  if (stage_ == 0) {
    StartPath(move_.to, plan_.rise, /*backwards=*/false, begin_, raise_time_);
    stage_ = 1;
  } else if (stage_ == 1 && t >= raised_at()) {
    if (plan_.along.size() > 0) {
      StartPath(move_.to, plan_.along, /*backwards=*/false, raised_at(), transport_time_);
    }
    stage_ = 2;
  } else if (stage_ == 2 && t >= there_at()) {
    carried_over_ = true;
    StartPath(move_.to, rise(), /*backwards=*/true, there_at(), raise_time_);
    stage_ = 3;
  }
  if (t < begin_ + 2.0 * raise_time_ + transport_time_ + kPause) return;
  lowering_from_ = demand_.weight;
  Enter(Phase::kHandOver, t);
}

void PickAndPlace::UpdateHandOver(double t, const MeasuredState& /*state*/, const Touch& /*touch*/) {
  demand_.weight = lowering_from_ * (1.0 - CalcMinSnap(t - begin_, options_.take_over_time).s);
  if (t < begin_ + options_.take_over_time + kRest) return;
  demand_.carried = false;
  Enter(Phase::kRelease, t);
}

void PickAndPlace::UpdateRelease(double t, const MeasuredState& state, const Touch& /*touch*/) {
  const double since = t - stage_begin_;
  if (stage_ == 0) {
    const double s = CalcMinSnap(since, kReleaseTime).s;
    demand_.grip = 1.0 - s;
    demand_.f_min = options_.f_min + s * (options_.touch_force - options_.f_min);
    if (since < kReleaseTime) return;
    demand_.grip = 0.0;
    BeginStage(1, t);
  } else if (stage_ == 1) {
    const double s = CalcMinSnap(since, kTouchTime).s;
    const double last = std::min(kLastTouch, options_.touch_force);
    std::ranges::fill(demand_.touch_force, options_.touch_force + s * (last - options_.touch_force));
    if (since < kTouchTime) return;
    demand_.contacts = 0;
    stage_ = 2;
    VectorXd to = Joints(state);
    for (const std::vector<int>& joints : own_joints_) {
      for (const int joint : joints) to[joint] = plan_.q_open[joint];
    }
    StartMove(Joints(state), to, t, kOpenTime);
  } else if (t >= move_.begin + move_.duration + kPause) {
    Enter(Phase::kWithdraw, t);
    StartPath(move_.to, rise(), /*backwards=*/false, t, lower_time_);
  }
}

void PickAndPlace::UpdateWithdraw(double t, const MeasuredState& state, const Touch& /*touch*/) {
  if (!MoveDone(t)) return;
  if (stage_ == 0 && retrying_) {
    retrying_ = false;
    PlanAttempt(t, state);
    if (plan_.found) return;
    failure_ = plan_.problem;
  }
  if (stage_ == 0) {
    stage_ = 1;
    StartMove(move_.to, start_.tail(model_->num_joints()), t, approach_time_);
  } else if (t >= move_.begin + move_.duration + kPause) {
    Enter(Phase::kDone, t);
  }
}

void PickAndPlace::GiveUp(double t, const MeasuredState& state, const std::string& reason) {
  retrying_ = attempt_ < options_.attempts;
  if (retrying_ && first_failure_.empty()) first_failure_ = reason;
  if (!retrying_) {
    failure_ = reason + ", attempt " + std::to_string(attempt_) + " of " + std::to_string(options_.attempts);
  }
  demand_.grip = 0.0;
  HoldPosture(Joints(state));
  Enter(Phase::kRelease, t);
  stage_ = 1;
}

}  // namespace dexcheck
