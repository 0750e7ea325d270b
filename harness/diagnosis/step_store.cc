#include "harness/diagnosis/step_store.h"

#include <algorithm>
#include <cmath>

#include "harness/engine/map_vector.h"

namespace dexcheck {
namespace {

/// The entries of a reading that one fingertip's contact adds.
constexpr const char* kContactEntries[][2] = {
    {"contact u on the object", "rad"},    {"contact v on the object", "rad"},
    {"contact u on the fingertip", "rad"}, {"contact v on the fingertip", "rad"},
    {"contact angle psi", "rad"},          {"overlap", "m"}};
constexpr Eigen::Index kContactSize = std::size(kContactEntries);
constexpr Eigen::Index kObjectSize = 12, kTouchSize = 2;

// Rounding relative to summands: right runs leave a tenth of it, and the bound of the check
// equations_of_motion is 30 times as much.
constexpr double kRounding = 3e-15;
// A residual jumps whose change from one step to the next is further from that of the steps around than this
// many times what theirs are, this in units of noise, and this part of itself.
constexpr double kJump = 5.0, kJumpNoise = 3.0, kJumpPart = 1e-7;

/// Wheels of right runs roll to this fraction of the check's bound, and what slipping is.
constexpr double kRollingRounding = 0.01;

template <typename Range>
Eigen::Index CountOf(const Range& range) {
  return static_cast<Eigen::Index>(range.size());
}

}  // namespace

StepStore::StepStore(const Setup& setup, JudgedLaw* law, double rolling_bound)
    : setup_(&setup),
      law_(law),
      rolling_bound_(rolling_bound),
      rounding_(std::max(kRounding, setup.scenario().tolerance)),
      moving_model_(setup.scenario().plant.type == PlantType::kRigid
                        ? setup.declared_model()
                        : MakeWholeRobot(setup.declared_model(), setup.plant_adapter())),
      kinematics_(MakeDataWithoutContacts(setup.engine())) {
  NameReadings();
  const RobotModel& model = setup.model();
  const Eigen::Index n = model.num_velocities(), m = CountOf(readings_);
  const Eigen::Index tips = CountOf(setup.fingertips());
  const Eigen::Index moving = moving_model_.num_velocities();
  const Eigen::Index entries = moving + (setup.has_object() ? 6 : 0);
  const Eigen::Index sizes[kSignalCount] = {1,      n,      n,       model.num_positions(),
                                            n,      m,      m,       moving_model_.num_positions(),
                                            moving, moving, entries, entries,
                                            12,     12,     n,       2,
                                            2,      2,      tips,    1};
  for (int i = 0; i < kSignalCount; ++i) offsets_[i + 1] = offsets_[i] + sizes[i];
  before_.resize(offsets_[kSignalCount], kHistory);
  data_.resize(offsets_[kSignalCount], kCapacity);  // its pages are used only when something differs
  block_.resize(kCapacity);
  row_.resize(offsets_[kSignalCount]);
  recent_.resize(offsets_[kSignalCount], kRecent);
  changes_.resize(entries, kRecent);
  noise_.resize(entries);
  apart_.resize(2, kRecent);
  jumps_.resize(kMostJumps, {row_, row_, VectorXd(entries)});
  Reset();
}

void StepStore::NameReadings() {
  const RobotModel& model = setup_->model();
  const Base& base = model.base();
  const auto add = [&](const std::string& place, const std::string& what, const char* unit,
                       const std::string& group) {
    readings_.push_back({place, what, unit, group});
  };
  const std::string platform = "base " + base.link;
  constexpr const char* kAxes[] = {"x", "y", "z"};
  const int base_positions = model.num_base_positions();
  for (int i = 0; i < base_positions; ++i) {
    constexpr const char* kPlanar[] = {"x", "y", "heading"};
    add(platform, base_positions == 3 ? kPlanar[i] : "coordinate " + std::to_string(i), i == 2 ? "rad" : "m",
        "base positions");
  }
  const bool turns = base.type == BaseType::kDifferentialDrive && base.velocity == DriveVelocity::kWheelRates;
  for (size_t j = 0; j < model.joints().size(); ++j) {
    const Joint& joint = model.joints()[j];
    const int count = joint.type == JointType::kBall ? 4 : 1;
    for (int k = 0; k < count; ++k)
      add("joint " + joint.name, count == 1 ? "position" : "quaternion " + std::to_string(k),
          joint.type == JointType::kPrismatic ? "m"
          : count == 1                        ? "rad"
                                              : "",
          "joint positions");
  }
  for (int i = 0; i < model.num_base_velocities(); ++i) {
    add(platform,
        turns ? (i == 0 ? "rate of " + base.wheel_joint_right : "rate of " + base.wheel_joint_left)
              : "velocity " + std::to_string(i),
        turns || i > 0 ? "rad/s" : "m/s", "base velocities");
    const bool wheels = base.type == BaseType::kDifferentialDrive;
    motors_.push_back(
        {"motor " + (wheels ? (i == 0 ? base.wheel_joint_right : base.wheel_joint_left) : base.link),
         "torque", "N m", "motors"});
  }
  for (int k = 0; k < model.num_dofs(); ++k) {
    const bool slides =
        model.joints()[static_cast<size_t>(model.joint_of_dof(k))].type == JointType::kPrismatic;
    add("joint " + model.dof_name(k), "rate", slides ? "m/s" : "rad/s", "joint rates");
    motors_.push_back({"motor " + model.dof_name(k), "torque", slides ? "N" : "N m", "motors"});
  }
  const std::string object = "object " + (setup_->has_object() ? setup_->object().name : std::string());
  for (const char* axis : kAxes) add(object, std::string("position ") + axis, "m", "object position");
  for (const char* axis : kAxes) add(object, std::string("orientation ") + axis, "rad", "object orientation");
  for (const char* axis : kAxes) add(object, std::string("velocity ") + axis, "m/s", "object velocity");
  for (const char* axis : kAxes)
    add(object, std::string("angular velocity ") + axis, "rad/s", "object velocity");
  for (const int tip : setup_->fingertips()) {
    for (const auto& [what, unit] : kContactEntries)
      add("fingertip " + model.frames()[static_cast<size_t>(tip)].name, what, unit, what);
  }
  add("hand", "support force", "N", "support force");
  add("hand", "set of touching fingertips", "", "touch");
}

void StepStore::Reset() {
  seen_ = size_ = added_ = num_recent_ = 0, stride_ = 1, has_begun_ = false;
  num_jumps_ = 0;
  motor_spans_.assign(motors_.size(), {});
  reading_spans_.assign(readings_.size(), {});
  misplaced_.clear();
  misplaced_wheels_ = 0;
  largest_torque_ = 0.0;
}

void StepStore::PackReading(const Reading& reading, const Reading& declared,
                            Eigen::Ref<VectorXd> entries) const {
  const MeasuredState& state = reading.state;
  const Eigen::Index p = state.q.size(), n = state.xi.size();
  entries.setZero();
  entries.head(p) = state.q;
  entries.segment(p, n) = state.xi;
  // The orientation is kept as the rotation from the declared one: log(R_declared^T R).
  const Matrix3d R = declared.state.X_Bo.linear().transpose() * state.X_Bo.linear();
  entries.segment<kObjectSize>(p + n) << state.X_Bo.translation(), 0.5 * (R(2, 1) - R(1, 2)),
      0.5 * (R(0, 2) - R(2, 0)), 0.5 * (R(1, 0) - R(0, 1)), state.V_Bo;
  Eigen::Index row = p + n + kObjectSize;
  for (size_t i = 0; i < setup_->fingertips().size(); ++i, row += kContactSize) {
    if (i >= state.kappa.size() || i >= state.overlap.size()) continue;
    const ContactCoordinates& kappa = state.kappa[i];
    entries.segment<kContactSize>(row) << kappa.alpha_o.u, kappa.alpha_o.v, kappa.alpha_f.u, kappa.alpha_f.v,
        kappa.psi, state.overlap[i];
  }
  entries.segment<kTouchSize>(row) << reading.touch.support_force,
      static_cast<double>(reading.touch.fingertips);
}

void StepStore::Pack(const StepRecord& step, const StepAnalysis& now, Judged judged,
                     Eigen::Ref<VectorXd> row) {
  const auto at = [&](Signal signal) {
    return row.segment(offsets_[signal], offsets_[signal + 1] - offsets_[signal]);
  };
  const bool answered = judged != Judged::kReadings, has_forces = judged == Judged::kAll;
  const DeclaredStep& declared = *now.declared;
  const PlantResponse& response = step.response;
  at(kTime)[0] = step.time;
  at(kTauDeclared) = declared.tau;
  at(kTauReceived) = answered ? response.motor_torques : declared.tau;
  at(kPosition) = step.reading.state.q;
  at(kVelocity) = step.reading.state.xi;
  PackReading(declared.measured, declared.measured, at(kDeclaredReading));
  PackReading(step.measured, declared.measured, at(kReading));
  at(kMotionPosition).setZero();
  for (const Signal signal : {kMotionVelocity, kMotionAcceleration, kResidual, kSize, kDryFriction})
    at(signal).setZero();
  if (has_forces) {
    at(kMotionPosition) = now.motion.q;
    at(kMotionVelocity) = now.motion.nu;
    at(kMotionAcceleration) = now.motion.nu_dot;
    at(kResidual) = now.motion.residual;
    at(kSize) = now.motion.size;
    if (response.dry_friction.size() == at(kDryFriction).size()) {
      at(kDryFriction) = response.dry_friction;
      for (int k = 0; k < setup_->model().num_dofs(); ++k) {
        const double declared =
            setup_->model().joints()[static_cast<size_t>(setup_->model().joint_of_dof(k))].dry_friction;
        double& force = at(kDryFriction)[setup_->model().num_base_velocities() + k];
        force -= std::clamp(force, -declared, declared);
      }
    }
  }
  const Pose& X_Bo = step.reading.state.X_Bo;
  at(kObjectPose).head<9>() = X_Bo.linear().reshaped();
  at(kObjectPose).tail<3>() = X_Bo.translation();
  at(kObjectMotion) << step.reading.state.V_Bo, response.V_Bo_dot;
  at(kWheelRates) = now.wheels.rates;
  at(kWheelMismatch) = now.wheels.mismatch;
  at(kWheelNoise).setZero();
  if (has_forces && response.wheels.size() == 2)
    at(kWheelNoise) = now.wheels.slip.array() + kRollingRounding * rolling_bound_;
  at(kContactMismatch) = now.contacts.mismatch;
  at(kLawDiffers)[0] = now.law && law_ != nullptr && law_->differs() ? 1.0 : 0.0;
}

void StepStore::Add(const StepRecord& step, const StepAnalysis& analysis, bool differs, Judged judged) {
  last_time_ = step.time;
  Pack(step, analysis, judged, row_);
  Watch(row_);
  if (has_begun_ || differs) WatchJumps(row_);
  if (differs) FindMisplaced(step);
  if (!has_begun_ && !differs) {
    before_.col(seen_++ % kHistory) = row_;
    return;
  }
  if (!has_begun_) {
    has_begun_ = true;
    for (Eigen::Index i = std::max<Eigen::Index>(0, seen_ - kHistory); i < seen_; ++i)
      Keep(added_++ / kBlock, before_.col(i % kHistory));
  }
  const Eigen::Index block = added_++ / kBlock;
  if (block % stride_ == 0) Keep(block, row_);
}

void StepStore::Watch(const Eigen::Ref<const VectorXd>& row) {
  const auto watch = [&](Signal expected, Signal got, double noise, std::vector<Span>* spans) {
    for (size_t i = 0; i < spans->size(); ++i) {
      const Eigen::Index entry = static_cast<Eigen::Index>(i);
      if (std::abs(row[offsets_[got] + entry] - row[offsets_[expected] + entry]) <= noise) continue;
      Span& span = (*spans)[i];
      span.last = row[0];
      if (std::isnan(span.first)) span.first = row[0];
    }
  };
  const auto torques = row.segment(offsets_[kTauDeclared], offsets_[kTauReceived] - offsets_[kTauDeclared]);
  largest_torque_ = std::max(largest_torque_, torques.cwiseAbs().maxCoeff());
  watch(kTauDeclared, kTauReceived, kTorqueRounding * largest_torque_, &motor_spans_);
  watch(kDeclaredReading, kReading, 0.0, &reading_spans_);
}

Vector2d StepStore::CalcApart(Eigen::Index step) const {
  const Eigen::Index robot = moving_model_.num_velocities(), at = step % kRecent;
  Vector2d apart = Vector2d::Constant(std::numeric_limits<double>::infinity());
  // A push that grows evenly changes as one of its neighbours does, even where it begins, or between two
  // jumps.
  for (const Eigen::Index other : {step - 2, step - 1, step + 1, step + 2}) {
    const auto change = (changes_.col(at) - changes_.col(other % kRecent)).cwiseQuotient(noise_);
    const Eigen::Index object = change.size() - robot;
    const Vector2d size(
        change.head(robot).squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, robot)),
        change.tail(object).squaredNorm() / 6.0);
    apart = apart.cwiseMin(size.cwiseSqrt());
  }
  return apart;
}

void StepStore::WatchJumps(const Eigen::Ref<const VectorXd>& row) {
  if (!HasForces(row)) {
    num_recent_ = 0;
    return;
  }
  const auto at = [](Eigen::Index step) { return step % kRecent; };
  const Eigen::Index now = num_recent_++;
  recent_.col(at(now)) = row;
  CalcNoise(row, &noise_);
  changes_.col(at(now)).setZero();
  if (now > 0) {
    changes_.col(at(now)) = Part(row, kResidual) - Part(recent_.col(at(now - 1)), kResidual);
    // Friction that the plant says comes and goes.
    const Eigen::Index count = setup_->model().num_dofs();
    changes_.col(at(now)).segment(moving_model_.num_velocities() - count, count) -=
        Part(row, kDryFriction).tail(count) - Part(recent_.col(at(now - 1)), kDryFriction).tail(count);
  }
  const Eigen::Index judged = now - 4;  // by two steps on each side, which are judged by two themselves
  if (now - 2 >= 3) apart_.col(at(now - 2)) = CalcApart(now - 2);
  if (judged < 5) return;
  const auto around = apart_.col(at(judged - 2))
                          .cwiseMin(apart_.col(at(judged - 1)))
                          .cwiseMax(apart_.col(at(judged + 1)).cwiseMin(apart_.col(at(judged + 2))));
  const double size =
      Part(row, kResidual).cwiseQuotient(noise_).norm() / std::sqrt(static_cast<double>(noise_.size()));
  const double least = std::max(kJumpNoise, kJumpPart * size);
  if (!(apart_.col(at(judged)).array() > (kJump * around).array().max(least)).any()) return;
  if (num_jumps_ < kMostJumps) {
    Jump& jump = jumps_[num_jumps_];
    jump.before = recent_.col(at(judged - 1));
    jump.after = recent_.col(at(judged));
    const auto earlier = changes_.col(at(judged - 1)), later = changes_.col(at(judged + 1));
    jump.change = changes_.col(at(judged));
    // The one beside may be a jump as well.
    jump.change -=
        earlier.cwiseQuotient(noise_).norm() < later.cwiseQuotient(noise_).norm() ? earlier : later;
  }
  ++num_jumps_;
}

/// Pose of one of the engine's bodies on another, by the places of all.
static Pose CalcPoseOn(int other, int body, const mjtNum* positions, const mjtNum* rotations) {
  const Pose X = MapPose(rotations + 9 * other, positions + 3 * other);
  return X.inverse(Eigen::Isometry) * MapPose(rotations + 9 * body, positions + 3 * body);
}

void StepStore::FindMisplaced(const StepRecord& step) {
  const PlantReading& plant = step.reading;
  const mjModel& engine = setup_->engine();
  if (plant.body_positions.size() != 3 * engine.nbody || !plant.qpos.allFinite()) return;
  if (!misplaced_.empty()) return FindAxes(plant);
  std::copy_n(plant.qpos.data(), engine.nq, kinematics_->qpos);
  mj_kinematics(&engine, kinematics_.get());
  // Offset (m) and turn (rad) of a body in its parent's axes, beyond rounding.
  const auto find = [&](int body, int parent, const std::string& name) {
    const Pose declared = CalcPoseOn(parent, body, kinematics_->xpos, kinematics_->xmat);
    const Pose actual = CalcPoseOn(parent, body, plant.body_positions.data(), plant.body_rotations.data());
    const Vector3d offset = actual.translation() - declared.translation();
    const double turn = Eigen::AngleAxisd(Matrix3d(actual.linear() * declared.linear().transpose())).angle();
    constexpr double kRounding = 1e-10;  // m and rad
    const bool differs = offset.norm() > kRounding || turn > kRounding;
    if (!differs) return;
    Misplaced& one = misplaced_.emplace_back();
    one.place = name, one.parent = "link " + NameOf(engine, mjOBJ_BODY, parent);
    one.from = step.time, one.offset = offset, one.turn = turn;
    one.body = body, one.on = parent, one.X = actual;
    if (engine.body_jntnum[body] == 1)
      one.position = plant.qpos[engine.jnt_qposadr[engine.body_jntadr[body]]];
  };
  const std::vector<int>& bodies = setup_->adapter().link_bodies();
  for (int link = 0; link < setup_->model().num_joints(); ++link) {
    const int body = bodies[static_cast<size_t>(link + 1)];
    const int parent = bodies[static_cast<size_t>(setup_->model().joint(link).parent + 1)];
    if (body < 0 || parent < 0) continue;
    find(body, parent, "link " + setup_->model().link_name(link));
  }
  const size_t links = misplaced_.size();
  for (const EngineWheel& wheel : setup_->adapter().wheels()) {
    const int body = engine.jnt_bodyid[wheel.joint];
    if (bodies[0] >= 0) find(body, bodies[0], "wheel " + NameOf(engine, mjOBJ_BODY, body));
  }
  misplaced_wheels_ = misplaced_.size() - links;
}

void StepStore::FindAxes(const PlantReading& plant) {
  constexpr double kLeast = 1e-3;      // rad or m, that a joint has to move
  constexpr double kRounding = 1e-10;  // of poses, m and rad
  const mjModel& engine = setup_->engine();
  for (Misplaced& one : misplaced_) {
    if (engine.body_jntnum[one.body] != 1) continue;
    const int joint = engine.body_jntadr[one.body];
    const bool slides = engine.jnt_type[joint] == mjJNT_SLIDE;
    if (!slides && engine.jnt_type[joint] != mjJNT_HINGE) continue;
    const double moved = plant.qpos[engine.jnt_qposadr[joint]] - one.position;
    const bool is_far = !slides && std::abs(moved) > 3.0;  // turns are known to half of one
    if (is_far || std::abs(moved) < std::max(kLeast, 2.0 * std::abs(one.moved))) continue;
    one.moved = moved;
    const Pose way = one.X.inverse(Eigen::Isometry) *
                     CalcPoseOn(one.on, one.body, plant.body_positions.data(), plant.body_rotations.data());
    const Eigen::AngleAxisd turn(Matrix3d(way.linear()));
    const Vector3d axis = (slides ? way.translation() : Vector3d(turn.angle() * turn.axis())) / moved;
    const Vector3d declared = MapVector(engine.jnt_axis + 3 * joint);
    const double angle = std::atan2(axis.cross(declared).norm(), axis.dot(declared));
    one.axis_turn = angle > kRounding / std::abs(moved) ? angle : 0.0;
  }
}

void StepStore::Keep(Eigen::Index block, const Eigen::Ref<const VectorXd>& row) {
  if (size_ == kCapacity) {
    stride_ *= 2;
    Eigen::Index kept = 0;
    for (Eigen::Index i = 0; i < size_; ++i) {
      if (block_[static_cast<size_t>(i)] % stride_ != 0) continue;
      if (kept != i) data_.col(kept) = data_.col(i);
      block_[static_cast<size_t>(kept++)] = block_[static_cast<size_t>(i)];
    }
    size_ = kept;
    if (block % stride_ != 0) return;
  }
  block_[static_cast<size_t>(size_)] = block;
  data_.col(size_++) = row;
}

void StepStore::CalcNoise(const Eigen::Ref<const VectorXd>& row, VectorXd* noise) const {
  *noise = (rounding_ * Part(row, kSize)).cwiseMax(std::numeric_limits<double>::min());
  const int wheels = moving_model_.num_joints() - setup_->model().num_joints();
  if (misplaced_wheels_ > 0)
    noise->head(moving_model_.num_base_velocities() + wheels).fill(std::numeric_limits<double>::infinity());
}

StepStore StepStore::GetBefore(double time) const {
  StepStore before = *this;
  while (before.size_ > 0 && before.data_(0, before.size_ - 1) >= time) --before.size_;
  before.last_time_ = std::min(last_time_, time);
  return before;
}

bool StepStore::HasHistory(Eigen::Index step) const {
  if (step < kHistory) return false;
  const Eigen::Index first = step - kHistory;
  return block_[static_cast<size_t>(step)] - block_[static_cast<size_t>(first)] <= 1 &&
         (stride_ == 1 || block_[static_cast<size_t>(step)] == block_[static_cast<size_t>(first)]);
}

}  // namespace dexcheck
