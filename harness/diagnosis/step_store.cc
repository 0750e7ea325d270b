#include "harness/diagnosis/step_store.h"

#include <algorithm>
#include <cmath>

#include "harness/checks/check_table.h"
#include "harness/comparison/rounding_scales.h"
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
      root_mass_(std::sqrt(RoundingScales(setup.model()).total_mass())),
      actuation_(setup.model()),
      kinematics_(MakeDataWithoutContacts(setup.engine())) {
  NameReadings();
  const RobotModel& model = setup.model();
  const Eigen::Index n = model.num_velocities(), m = CountOf(readings_);
  const Eigen::Index tips = CountOf(setup.fingertips());
  const Eigen::Index sizes[kSignalCount] = {
      1, n, n, model.num_positions(), n, n, m, m, n, 6, 12, 12, n, 2, 1, 2, 2, 2, tips, 3 * tips, 1};
  for (int i = 0; i < kSignalCount; ++i) offsets_[i + 1] = offsets_[i] + sizes[i];
  before_.resize(offsets_[kSignalCount], kHistory);
  data_.resize(offsets_[kSignalCount], kCapacity);  // its pages are used only when something differs
  block_.resize(kCapacity);
  row_.resize(offsets_[kSignalCount]);
  force_.resize(n);
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
  for (int i = 0; i < model.num_base_positions(); ++i) {
    constexpr const char* kPlanar[] = {"x", "y", "heading"};
    add(platform, model.num_base_positions() == 3 ? kPlanar[i] : "coordinate " + std::to_string(i),
        i == 2 ? "rad" : "m", "base positions");
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
  }
  for (int k = 0; k < model.num_dofs(); ++k) {
    const bool slides =
        model.joints()[static_cast<size_t>(model.joint_of_dof(k))].type == JointType::kPrismatic;
    add("joint " + model.dof_name(k), "rate", slides ? "m/s" : "rad/s", "joint rates");
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

  for (int i = 0; i < model.num_base_velocities(); ++i) {
    const bool wheels = base.type == BaseType::kDifferentialDrive;
    motors_.push_back(
        {"motor " + (wheels ? (i == 0 ? base.wheel_joint_right : base.wheel_joint_left) : base.link),
         "torque", "N m", "motors"});
  }
  for (int k = 0; k < model.num_dofs(); ++k) {
    const bool slides =
        model.joints()[static_cast<size_t>(model.joint_of_dof(k))].type == JointType::kPrismatic;
    motors_.push_back({"motor " + model.dof_name(k), "torque", slides ? "N" : "N m", "motors"});
  }
}

void StepStore::Reset() {
  seen_ = size_ = added_ = 0, stride_ = 1, has_begun_ = false;
  motor_spans_.assign(motors_.size(), {});
  reading_spans_.assign(readings_.size(), {});
  misplaced_.clear();
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
  if (answered) {
    at(kTauReceived) = response.motor_torques;
    at(kAcceleration) = response.xi_dot;
  } else {
    at(kTauReceived) = declared.tau;
    at(kAcceleration).setZero();
  }
  at(kPosition) = step.reading.state.q;
  at(kVelocity) = step.reading.state.xi;
  PackReading(declared.measured, declared.measured, at(kDeclaredReading));
  PackReading(step.measured, declared.measured, at(kReading));
  at(kRobotResidual).setZero();
  at(kNoise).setZero();
  at(kUneven).setZero();
  at(kDryFriction).setZero();
  if (has_forces) {
    // Torques that motors did not give are their fault, and no force of its own.
    force_ = step.drive.tau - response.motor_torques;
    actuation_.CalcForce(force_, force_);
    at(kRobotResidual) = now.robot.residual + force_;
    if (response.dry_friction.size() == at(kDryFriction).size()) {
      at(kDryFriction) = response.dry_friction;
      for (int k = 0; k < setup_->model().num_dofs(); ++k) {
        const double declared =
            setup_->model().joints()[static_cast<size_t>(setup_->model().joint_of_dof(k))].dry_friction;
        double& force = at(kDryFriction)[setup_->model().num_base_velocities() + k];
        force -= std::clamp(force, -declared, declared);
      }
    }
    // The bounds of the inverse dynamics have it so, by entry.
    at(kNoise) << 1e-6 * now.robot.balanced / std::sqrt(static_cast<double>(force_.size())),
        1e-9 * std::max(now.findings.f_c.norm(), 1e-3) / std::sqrt(6.0);
    // The columns of causes are those of a platform that is level and rolls: gravity along a floor that
    // tilts, and sideways in a turn, on all masses.
    double slip = 0.0;
    for (const BodyContact& wheel : response.wheels) slip = std::max(slip, wheel.slip.norm());
    const double turn = response.wheels.empty()
                            ? 0.0
                            : std::abs(CalcRollingTwist(setup_->model().base(), step.reading.state.xi)[1]);
    at(kUneven)[0] =
        (setup_->model().gravity().norm() * step.reading.departure.tilt + 2.0 * slip * turn) * root_mass_;
  }
  at(kObjectResidual) = has_forces ? now.object.residual : Vector6d(Vector6d::Zero());
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
  at(kContactMoment).setZero();
  for (size_t i = 0; i < std::min(response.contacts.size(), setup_->fingertips().size()); ++i) {
    const PlantContact& contact = response.contacts[i];
    at(kContactMoment).segment<3>(3 * static_cast<Eigen::Index>(i)) = contact.normal.cross(contact.force);
  }
  at(kLawDiffers)[0] = now.law && law_ != nullptr && law_->differs() ? 1.0 : 0.0;
}

void StepStore::Add(const StepRecord& step, const StepAnalysis& analysis, bool differs, Judged judged) {
  last_time_ = step.time;
  Pack(step, analysis, judged, row_);
  Watch(row_);
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

void StepStore::FindMisplaced(const StepRecord& step) {
  const PlantReading& plant = step.reading;
  const mjModel& engine = setup_->engine();
  if (!misplaced_.empty() || plant.body_positions.size() != 3 * engine.nbody || !plant.qpos.allFinite())
    return;
  std::copy_n(plant.qpos.data(), engine.nq, kinematics_->qpos);
  mj_kinematics(&engine, kinematics_.get());
  const std::vector<int>& bodies = setup_->adapter().link_bodies();
  for (int link = 0; link < setup_->model().num_joints(); ++link) {
    const int body = bodies[static_cast<size_t>(link + 1)];
    const int parent = bodies[static_cast<size_t>(setup_->model().joint(link).parent + 1)];
    if (body < 0 || parent < 0) continue;
    const auto place = [&](const mjtNum* positions, const mjtNum* rotations) {
      const Pose X = MapPose(rotations + 9 * parent, positions + 3 * parent);
      return X.inverse(Eigen::Isometry) * MapPose(rotations + 9 * body, positions + 3 * body);
    };
    const Pose declared = place(kinematics_->xpos, kinematics_->xmat);
    const Pose actual = place(plant.body_positions.data(), plant.body_rotations.data());
    const Vector3d offset = actual.translation() - declared.translation();
    const double turn = Eigen::AngleAxisd(Matrix3d(actual.linear() * declared.linear().transpose())).angle();
    constexpr double kRounding = 1e-10;  // m and rad
    if (offset.norm() > kRounding || turn > kRounding) misplaced_.push_back({link, step.time, offset, turn});
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
