#include "harness/run/closed_loop.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "controller/common/text.h"

namespace dexcheck {

namespace {

using Clock = std::chrono::steady_clock;

double Seconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

constexpr double kRoughTime = 0.02;      // s after the first contact, when assumptions need not hold,
constexpr double kFindsGrip = 0.1;       // nor until here, if the grasp lasts longer
constexpr double kLargestSkew = 1e-2;    // rad between the platform's heading and the way ahead
constexpr double kSettleMoving = 0.5;    // s
constexpr double kLargestTilt = 0.2;     // rad, of a robot that still stands
constexpr double kLargestSink = 0.02;    // m, of a robot that still stands
constexpr double kLeastUpright = 0.5;    // cosine of the tilt of a body that stands on feet
constexpr double kLeastHeight = 0.5;     // of the height at the start, of a body that stands on feet
constexpr double kGraspTimeout = 0.005;  // s without all fingertips on the object: lost

}  // namespace

ClosedLoop::ClosedLoop(const Setup& setup, bool check, LoopParts parts)
    : setup_(&setup),
      plant_(std::move(parts.plant)),
      sensing_(parts.sensing, setup.MakePartContext()),
      hidden_sensor_fault_(std::move(parts.hidden_sensor_fault)),
      controller_(std::move(parts.controller)),
      task_(parts.task),
      follower_(parts.follower),
      drive_(plant_->motors(), parts.actuation, setup.MakePartContext()),
      disturbances_(parts.disturbances, setup.MakePartContext()),
      knows_law_(parts.knows_law),
      num_steps_(std::lround(setup.scenario().duration / setup.scenario().plant.time_step)) {
  const Scenario& scenario = setup.scenario();
  RequireKnownBounds(scenario);
  if (check) checks_.emplace(setup, plant_->motors(), parts.knows_law);
  if (check)
    store_.emplace(setup, checks_->law(), checks_->Has("rolling") ? checks_->Find("rolling").bound : 0.0);
  record_.model = &controller_->model();
  record_.command.tau.setZero(setup.model().num_velocities());
  record_.reading.qvel.setZero(setup.engine().nv);
  trajectory_ = setup.MakeTrajectory();
  if (!trajectory_) return;
  if (scenario.start == Start::kMoving) CheckMovingStart();
}

void ClosedLoop::CheckMovingStart() const {
  const DesiredMotion at_start = trajectory_->Evaluate(0.0);
  const Vector3d v = at_start.X_d_dot.head<3>();
  const bool is_drive = setup_->model().base().type == BaseType::kDifferentialDrive;
  const double phi = is_drive ? setup_->start().q[2] : 0.0;
  const Vector3d heading(std::cos(phi), std::sin(phi), 0.0);
  const bool along = (v - v.dot(heading) * heading).norm() <= kLargestSkew * v.norm();
  if (is_drive && along && at_start.X_d_dot.tail<3>().norm() == 0.0 && at_start.X_d_ddot.norm() == 0.0)
    return;
  throw InputError(setup_->scenario().source +
                   ": start: \"moving\" needs a platform, and a trajectory that begins straight ahead at "
                   "constant speed");
}

bool ClosedLoop::Settle(const std::function<bool()>& should_stop) {
  const auto rest = MakeLineTrajectory(setup_->start().X_o, Vector6d::Zero(), 0.0);
  const bool moving = setup_->scenario().start == Start::kMoving;
  if (!SettleOn(*rest, setup_->scenario().settle, moving ? -kSettleMoving : 0.0, should_stop)) return false;
  if (moving && !StartMoving(trajectory_->Evaluate(0.0).X_d_dot.head<3>(), should_stop)) return false;
  if (trajectory_) controller_->Follow(*trajectory_);
  if (checks_) checks_->FollowMotion(nullptr, 0.0);
  BeginRun();
  times_ = LoopTimes{};
  ForgetSteps();
  is_running_ = true;
  return true;
}

void ClosedLoop::BeginRun() {
  const std::string where = setup_->scenario().source + (task_ != nullptr ? ": task: " : ": control: ");
  try {
    controller_->Begin(0.0, record_.measured);
  } catch (const InputError& error) {
    throw InputError(where + error.what());
  } catch (const std::invalid_argument& error) {
    throw InputError(where + error.what());
  }
}

bool ClosedLoop::SettleOn(const Trajectory& motion, double duration, double end,
                          const std::function<bool()>& should_stop) {
  const double dt = plant_->time_step();
  const long count = std::lround(duration / dt);
  const long rough = std::lround(kRoughTime / dt), grip = std::lround(kFindsGrip / dt);
  controller_->Follow(motion);
  if (checks_) checks_->FollowMotion(&motion, end - duration);
  ForgetSteps();
  for (long i = 0; i < count; ++i) {
    if (should_stop()) return false;
    const double t = static_cast<double>(i) * dt;
    record_.time = end - duration + t;
    MakeStep(t);
    if (checks_) checks_->JudgeEffort(record_, t);
    if (checks_) checks_->Follow(record_);
    // The first contact is rough; later errors have a cause that the checks should report.
    if (i == rough || i == grip) ForgetSteps(RunChecks::Keep::kHoldsAlways);
    if (checks_) {
      checks_->JudgeSettling(record_);
      store_->Add(record_, checks_->analysis(), checks_->differs());
    }
    try {
      CheckGrasp();
    } catch (const RunFailure&) {
      // A run that never begins is judged here, for the reason of its failure.
      if (checks_) {
        checks_->JudgeUnsent(record_);
        checks_->JudgeModel(record_);  // also of a run whose law is not known
        store_->Add(record_, checks_->analysis(), checks_->differs(), StepStore::Judged::kSignals);
      }
      throw;
    }
  }
  return true;
}

bool ClosedLoop::StartMoving(const Vector3d& v, const std::function<bool()>& should_stop) {
  plant_->AddVelocity(record_.reading.state, v);
  sensing_.AddVelocity(v);
  if (checks_) checks_->AddVelocity(v);
  Vector6d velocity = Vector6d::Zero();
  velocity.head<3>() = v;
  if (!SettleOn(*MakeLineTrajectory(setup_->start().X_o, velocity, 0.0), kSettleMoving, 0.0, should_stop))
    return false;
  // The robot moves back to where it began: all places of a level floor are the same.
  const double dt = plant_->time_step();
  const Vector3d way = static_cast<double>(std::lround(kSettleMoving / dt)) * dt * v;
  plant_->Translate(-way);
  sensing_.Translate(-way);
  if (checks_) checks_->Translate(-way);
  return true;
}

void ClosedLoop::ForgetSteps(RunChecks::Keep keep) {
  if (!checks_) return;
  checks_->Reset(keep);
  const bool has_failed = std::ranges::any_of(checks_->settling_failures(), HoldsAlways);
  const bool is_over = keep == RunChecks::Keep::kAll;
  if (is_over && has_failed && !settling_store_) settling_store_ = *store_;
  if (is_over || !has_failed) store_->Reset();
}

void ClosedLoop::ControlStep(double t) {
  const auto begin = Clock::now();
  plant_->BeginStep();
  const auto read = Clock::now();
  plant_->Read(&record_.reading);
  CheckRobot();
  sensing_.Measure(record_.reading, &record_.measured);
  if (hidden_sensor_fault_) hidden_sensor_fault_(t, &record_.measured.state);
  controller_->Step(record_.measured, t, &record_.command);
  record_.model = &controller_->model();
  DriveMotors(t);
  if (!disturbances_.empty()) {
    plant_->Push(disturbances_.Evaluate(record_.time, record_.reading));
  }
  const auto control = Clock::now();
  plant_->EndStep(record_.drive.tau);
  const auto end = Clock::now();
  plant_->Read(&record_.response);
  times_.plant += Seconds(begin, read) + Seconds(control, end);
  times_.controller += Seconds(read, control);
  times_.grasp_force += record_.command.force_seconds;
  times_.solves += record_.command.force_solves;
}

void ClosedLoop::DriveMotors(double t) {
  try {
    drive_.Apply(record_.command.tau, record_.reading.state.xi, &record_.drive);
  } catch (const RunFailure&) {
    if (checks_) checks_->JudgeEffort(record_, t);
    // Torques that are too large may be those of no law, or motors and sensors may be at fault.
    if (checks_) {
      checks_->Follow(record_);
      checks_->JudgeUnsent(record_);
      store_->Add(record_, checks_->analysis(), !is_running_ || checks_->differs(),
                  StepStore::Judged::kReadings);
    }
    throw;
  }
  is_driven_ = true;
}

void ClosedLoop::MakeStep(double t) {
  is_driven_ = false;
  try {
    ControlStep(t);
  } catch (...) {
    if (checks_ && is_driven_) checks_->JudgeEffort(record_, t);
    if (record_.step > 0) Observe();
    throw;
  }
}

void ClosedLoop::Check() {
  const auto begin = Clock::now();
  checks_->JudgeEffort(record_, record_.time);
  checks_->Follow(record_);
  checks_->JudgeModel(record_);
  checks_->JudgeStep(record_);
  record_.findings = checks_->analysis().findings;
  store_->Add(record_, checks_->analysis(), checks_->differs());
  times_.cross_check += Seconds(begin, Clock::now());
}

void ClosedLoop::Observe() const {
  if (observe_) observe_(record_);
}

void ClosedLoop::Step() {
  record_.time = time();
  MakeStep(record_.time);
  record_.error = CalcTrackingError(record_);
  if (follower_ != nullptr) record_.followed_kappa = follower_->followed_kappa();
  CalcContactDrifts(record_, &record_.drift);
  for (const ContactDrift& drift : record_.drift) largest_drift_.Raise(drift);
  ++record_.step;
  try {
    if (checks_) Check();
  } catch (...) {
    Observe();
    throw;
  }
  Observe();
  CheckGrasp();
  if (task_ != nullptr) CheckTask();
}

void ClosedLoop::CheckTask() const {
  const PickAndPlace& task = task_->task();
  if (task.is_done() && !task.failure().empty()) throw RunFailure(task.failure());
  if (!task.is_done() && record_.step >= num_steps_) {
    throw RunFailure("the task was not done in time, it was in phase " + Quote(NameOf(task.phase())));
  }
}

void ClosedLoop::CheckRobot() const {
  if (!setup_->feet().empty()) {
    const Vector3d up = record_.reading.X_W0.linear().col(2);
    const double height = record_.reading.X_W0.translation().z() / setup_->start().q[2];
    if (up.z() > kLeastUpright && height > kLeastHeight) return;
    throw RunFailure("the robot fell: its body is at " + FormatNumber(height, 3) +
                     " of the height that it stood at, upright by " + FormatNumber(up.z(), 3));
  }
  const BaseDeparture& departure = record_.reading.departure;
  if (departure.tilt < kLargestTilt && std::abs(departure.height) < kLargestSink) return;
  throw RunFailure("the robot fell: tilt " + FormatNumber(departure.tilt) + " rad, height " +
                   FormatNumber(departure.height) + " m off");
}

void ClosedLoop::CheckGrasp() {
  if (!record_.command.handling.holding) return;
  std::string missing;
  for (size_t i = 0; i < record_.response.contacts.size(); ++i) {
    if (!record_.response.contacts[i].touching) missing = setup_->scenario().grasp.fingertips[i];
  }
  steps_without_grasp_ = missing.empty() ? 0 : steps_without_grasp_ + 1;
  if (static_cast<double>(steps_without_grasp_) * plant_->time_step() < kGraspTimeout) return;
  throw GraspLost("the grasp is lost: fingertip " + Quote(missing) + " no longer touches the object");
}

}  // namespace dexcheck
