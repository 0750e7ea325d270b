#include "harness/simulation/closed_loop.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "controller/common/text.h"
#include "controller/object/euler_zyz.h"
#include "controller/object/so3.h"
#include "harness/adapter/velocity_map.h"

namespace dexcheck {
namespace {

using Clock = std::chrono::steady_clock;

double Seconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

constexpr double kRoughTime = 0.02;      // s after the first contact
constexpr double kLargestSkew = 1e-2;    // rad between the platform's heading and the way ahead
constexpr double kSettleMoving = 0.5;    // s
constexpr double kLargestTilt = 0.2;     // rad, of a robot that still stands
constexpr double kLargestSink = 0.02;    // m, likewise
constexpr double kGraspTimeout = 0.005;  // s without all fingertips on the object: lost

}  // namespace

ClosedLoop::ClosedLoop(const Setup& setup, bool check)
    : setup_(&setup),
      check_(check),
      plant_(setup.adapter(), setup.scenario().plant.implicit_damping),
      observer_(setup.adapter(), setup.fingertips(), setup.surface()),
      controller_(setup.model(), setup.fingertips(), setup.object().body, setup.surface(),
                  setup.MakeControllerOptions()),
      checks_(setup) {
  const Scenario& scenario = setup.scenario();
  if (!setup.bonds().empty()) observer_.SetBonds(setup.kappa_start(), setup.bond_constraints());
  num_steps_ = std::lround(scenario.duration / scenario.plant.time_step);
  control_interval_ = std::max(1L, std::lround(scenario.plant.control_step / scenario.plant.time_step));
  tau_.setZero(setup.model().num_velocities());
  qvel_.setZero(setup.engine().nv);
  if (check) {
    model_check_ =
        std::make_unique<StepModelCheck>(setup.adapter(), setup.fingertips(), scenario.control.orientation);
    const std::vector<CheckRecord> records = model_check_->records();
    const bool bonded = !setup.bonds().empty();
    model_check_->IncludeContacts(!bonded);
    for (size_t i = 0; i < records.size(); ++i) {
      RunCheck run_check;
      run_check.name = records[i].name;
      run_check.kind = records[i].kind;
      run_check.bound = records[i].bound;
      run_check.description = "model against engine at the same state, relative to the term's scale";
      run_check.applies = !bonded || !StepModelCheck::IsOfContacts(i);
      model_checks_.push_back(run_check);
    }
  }
  PlaceRobot();
  if (scenario.task) {
    handling_ = std::make_unique<HandlingController>(setup.model(), setup.fingertips(), setup.object().body,
                                                     setup.surface(), controller_);
    task_ = std::make_unique<PickAndPlace>(setup.model(), setup.hand(), setup.surface(), setup.object().body,
                                           setup.q_start(), scenario.task->pick_and_place,
                                           scenario.plant.time_step);
    return;
  }
  trajectory_ = MakeTrajectory(scenario, setup.X_start() + scenario.start_error);
  if (scenario.start == Start::kMoving) CheckMovingStart();
}

void ClosedLoop::CheckMovingStart() const {
  const DesiredMotion at_start = trajectory_->Evaluate(0.0);
  const Vector3d v = at_start.X_d_dot.head<3>();
  const bool is_drive = setup_->model().base().type == BaseType::kDifferentialDrive;
  const double phi = is_drive ? setup_->q_start()[2] : 0.0;
  const Vector3d heading(std::cos(phi), std::sin(phi), 0.0);
  const bool along = (v - v.dot(heading) * heading).norm() <= kLargestSkew * v.norm();
  if (is_drive && along && at_start.X_d_dot.tail<3>().norm() == 0.0 && at_start.X_d_ddot.norm() == 0.0)
    return;
  throw InputError(setup_->scenario().source +
                   ": start: \"moving\" needs a platform, and a trajectory that begins straight ahead at "
                   "constant speed");
}

void ClosedLoop::PlaceRobot() {
  const mjModel& m = setup_->engine();
  EngineState state = plant_.GetState();
  setup_->adapter().SetPositions(setup_->q_start(), state.qpos.data());
  const Pose& X_Bo = setup_->X_Bo_start();
  const Eigen::Quaterniond rotation(X_Bo.linear());
  const int joint = m.body_jntadr[setup_->adapter().object_body()];
  state.qpos.segment<7>(m.jnt_qposadr[joint]) << X_Bo.translation(), rotation.w(), rotation.x(), rotation.y(),
      rotation.z();
  plant_.SetState(state);
}

void ClosedLoop::Settle() {
  SettleOn(LineTrajectory(setup_->X_start(), Vector6d::Zero(), 0.0), setup_->scenario().settle);
  if (setup_->scenario().start == Start::kMoving) StartMoving(trajectory_->Evaluate(0.0));
  if (task_) {
    const std::string where = setup_->scenario().source + ": task: ";
    try {
      task_->Begin(0.0, state_);
    } catch (const InputError& error) {
      throw InputError(where + error.what());
    } catch (const std::invalid_argument& error) {
      throw InputError(where + error.what());
    }
    task_begun_ = true;
  }
  times_ = LoopTimes{};
  checks_.Reset();
}

void ClosedLoop::SettleOn(const Trajectory& trajectory, double duration) {
  const double dt = plant_.time_step();
  const long count = std::lround(duration / dt);
  checks_.Reset();
  for (long i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) * dt;
    ControlStep(EvaluateDesired(trajectory, t), i, t - duration);
    // The first contact is rough; what goes wrong later has a cause that the checks should tell.
    if (check_ && t >= kRoughTime)
      checks_.Compare(plant_, controller_, state_, tau_, &observer_, t - duration, DescribeHandling());
    CheckGrasp();
  }
}

void ClosedLoop::StartMoving(const DesiredMotion& at_start) {
  const RobotModel& model = setup_->model();
  const Vector3d v = at_start.X_d_dot.head<3>();
  const Vector3d heading(std::cos(state_.q[2]), std::sin(state_.q[2]), 0.0);
  // All bodies get the same velocity, the wheels roll.
  EngineState start = plant_.GetState();
  const mjModel& m = setup_->engine();
  VectorXd xi = VectorXd::Zero(model.num_velocities());
  VelocityMap map(setup_->adapter(), Coordinates::kReduced);
  xi.head<2>() = model.base().velocity == DriveVelocity::kTwist
                     ? Vector2d(v.dot(heading), 0.0)
                     : Vector2d::Constant(v.dot(heading) / model.base().wheel_radius);
  map.SetState(state_.q, xi);
  VectorXd boost = VectorXd::Zero(m.nv);
  map.Expand(xi, boost.data());
  const int object = m.jnt_dofadr[m.body_jntadr[setup_->adapter().object_body()]];
  boost.segment<3>(object) = v;
  start.qvel += boost;
  plant_.SetState(start);

  Vector6d velocity = Vector6d::Zero();
  velocity.head<3>() = v;
  SettleOn(LineTrajectory(setup_->X_start(), velocity, 0.0), kSettleMoving);

  // Back to where it began: on a level floor every place is alike.
  EngineState moved = plant_.GetState();
  const Vector3d way =
      static_cast<double>(std::lround(kSettleMoving / plant_.time_step())) * plant_.time_step() * v;
  const int base = m.jnt_qposadr[setup_->adapter().base_joints()[0]];
  const int body = m.jnt_qposadr[m.body_jntadr[setup_->adapter().object_body()]];
  moved.qpos.segment<2>(base) -= way.head<2>();
  moved.qpos.segment<3>(body) -= way;
  plant_.SetState(moved);
}

DesiredMotion ClosedLoop::EvaluateDesired(const Trajectory& trajectory, double t) const {
  // Semi-implicit Euler steps like a leapfrog: velocities belong to the middle of the step before.
  DesiredMotion desired = trajectory.Evaluate(t);
  desired.X_d_dot = trajectory.Evaluate(t - 0.5 * plant_.time_step()).X_d_dot;
  return desired;
}

Handling ClosedLoop::DescribeHandling() const {
  if (!task_) return {};
  return {.partial = true,
          .holding = task_begun_ && IsHolding(task_->phase()),
          .contacts = task_->demand().contacts};
}

void ClosedLoop::CalcTaskTorque(double t) {
  const ContactSet contacts_before = task_->demand().contacts;
  const Phase phase_before = task_->phase();
  if (task_begun_) {
    touch_.fingertips = observer_.FindTouching(plant_);
    task_->Update(t, told_, touch_, &controller_.options().posture);
  }
  controller_.SetState(told_);
  tau_before_ = tau_;
  try {
    tau_ = handling_->CalcTorque(told_, task_->demand());
  } catch (const GraspForceError& error) {
    if (task_->phase() != Phase::kGrip && task_->phase() != Phase::kTakeOver) throw;
    task_->Refuse(t, error.what());
    tau_ = handling_->CalcTorque(told_, task_->demand());
  }
  const bool switched = task_->phase() != phase_before || task_->demand().contacts != contacts_before;
  if (task_begun_ && switched) {
    torque_jump_ = std::max(torque_jump_, (tau_ - tau_before_).cwiseAbs().maxCoeff());
  }
}

void ClosedLoop::ControlStep(const DesiredMotion& desired, long step, double t) {
  const auto begin = Clock::now();
  plant_.BeginStep();
  const auto read = Clock::now();
  qvel_ = Eigen::Map<const VectorXd>(plant_.data().qvel, plant_.model().nv);
  observer_.Read(plant_, &state_);
  CheckRobot();
  told_ = state_;
  for (ContactCoordinates& kappa : told_.kappa) kappa.alpha_o.u += setup_->scenario().control.contact_error;
  desired_ = desired;
  if (task_) {
    CalcTaskTorque(t);
    times_.grasp_force += handling_->force_seconds();
    if (task_->demand().grip > 0.0) ++times_.solves;
    desired_ = task_->demand().desired;
    if (!task_->demand().carried) {
      desired_ = DesiredMotion{};
      desired_.X_d = X_o();
    }
  } else {
    controller_.SetState(told_);
    if (step % control_interval_ == 0) {
      tau_ = controller_.CalcTorque(desired);
      times_.grasp_force += controller_.force_seconds();
      ++times_.solves;
    }
  }
  CheckTorques(t);
  const auto control = Clock::now();
  plant_.SetTorques(tau_);
  plant_.EndStep();
  const auto end = Clock::now();
  times_.plant += Seconds(begin, read) + Seconds(control, end);
  times_.controller += Seconds(read, control);
}

void ClosedLoop::Step() {
  step_time_ = time();
  ControlStep(trajectory_ ? EvaluateDesired(*trajectory_, step_time_) : DesiredMotion{}, step_, step_time_);
  error_.position = desired_.X_d.head<3>() - state_.X_Bo.translation();
  error_.orientation =
      LogSo3(state_.X_Bo.linear().transpose() * CalcRotationZyz(desired_.X_d.tail<3>())).norm();
  ++step_;
  if (check_) {
    const auto begin = Clock::now();
    CompareModel();
    checks_.Compare(plant_, controller_, state_, tau_, &observer_, step_time_, DescribeHandling());
    times_.cross_check += Seconds(begin, Clock::now());
  }
  CheckGrasp();
  if (task_) CheckTask();
}

void ClosedLoop::CheckTask() {
  touch_.support_force =
      (state_.X_Bo.linear() * observer_.ReadSupportWrench(plant_, state_.X_Bo).head<3>()).z();
  if (task_->is_done() && !task_->failure().empty()) throw RunFailure(task_->failure());
  if (!task_->is_done() && step_ >= num_steps_) {
    throw RunFailure("the task was not done in time, it was in phase " + Quote(NameOf(task_->phase())));
  }
}

void ClosedLoop::CompareModel() {
  if (task_) {
    const std::vector<double>& overlap = state_.overlap;
    model_check_->IncludeContacts(
        std::all_of(overlap.begin(), overlap.end(), [](double depth) { return depth > -Observer::kFar; }));
  }
  model_check_->Compare(controller_.robot(), controller_.grasp(), state_, observer_.X_W0(), step_);
  const std::span<const double> errors = model_check_->step_errors();
  bool newly_failed = false;
  for (size_t i = 0; i < errors.size(); ++i) {
    if (StepModelCheck::IsOfContacts(i) && !model_check_->includes_contacts()) continue;
    const bool failed_before = model_checks_[i].failed;
    model_checks_[i].Add(errors[i], step_time_);
    newly_failed = newly_failed || (model_checks_[i].failed && !failed_before);
  }
  if (!newly_failed) return;
  const std::vector<CheckRecord> records = model_check_->records();
  const RobotModel& model = setup_->model();
  for (size_t i = 0; i < records.size(); ++i) {
    if (records[i].failed) {
      model_checks_[i].where = Describe(records[i].first_failure, model, model.num_base_velocities());
    }
  }
}

Vector6d ClosedLoop::X_o() const {
  if (setup_->scenario().control.orientation == OrientationFeedback::kAngles)
    return controller_.grasp().X_o();
  Vector6d X_o;
  X_o << state_.X_Bo.translation(), CalcAnyZyzAngles(state_.X_Bo.linear());
  return X_o;
}

void ClosedLoop::CheckRobot() const {
  const BaseDeparture& departure = observer_.departure();
  if (departure.tilt < kLargestTilt && std::abs(departure.height) < kLargestSink) return;
  throw RunFailure("the robot fell: tilt " + FormatNumber(departure.tilt) + " rad, height " +
                   FormatNumber(departure.height) + " m off");
}

void ClosedLoop::CheckTorques(double t) {
  if (!tau_.allFinite()) throw RunFailure("a torque is not a number");
  effort_ = plant_.CalcEffort(tau_, &busiest_motor_);
  checks_.JudgeEffort(effort_, t);
  if (effort_ <= 1.0) return;
  throw RunFailure("motor " + Quote(plant_.motor_name(busiest_motor_)) + " is at its limit, " +
                   FormatNumber(plant_.torque_limit(busiest_motor_)) + " N m");
}

void ClosedLoop::CheckGrasp() {
  if (task_ && (!task_begun_ || !IsHolding(task_->phase()))) return;
  std::string missing;
  const std::span<const EngineContact> contacts = observer_.ReadContacts(plant_);
  for (size_t i = 0; i < contacts.size(); ++i) {
    if (!contacts[i].touching) missing = setup_->scenario().grasp.fingertips[i];
  }
  steps_without_grasp_ = missing.empty() ? 0 : steps_without_grasp_ + 1;
  if (static_cast<double>(steps_without_grasp_) * plant_.time_step() < kGraspTimeout) return;
  throw GraspLost("the grasp is lost: fingertip " + Quote(missing) + " no longer touches the object");
}

}  // namespace dexcheck
