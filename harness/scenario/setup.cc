#include "harness/scenario/setup.h"

#include <cmath>
#include <utility>

#include "controller/common/errors.h"
#include "controller/contact/shapes.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/files.h"
#include "harness/engine/engine.h"

namespace dexcheck {
namespace {

/// An object in the place of none, so that its terms are numbers that nobody reads.
const ObjectModel& NoObject() {
  static const ObjectModel none{
      .name = "", .shape = SolidSphere{1.0}, .body = {1.0, Vector3d::Zero(), Matrix3d::Identity()}};
  return none;
}

/// A robot that holds nothing needs no surface of its own.
std::unique_ptr<Surface> MakeObjectSurface(const Scenario& scenario, const RobotModel& model) {
  if (scenario.joint_task() != nullptr) return std::make_unique<Sphere>(1.0);
  try {
    return MakeSurface(model.object()->shape);
  } catch (const std::invalid_argument& error) {
    throw InputError(model.spec().source + ": " + error.what());
  }
}

}  // namespace

Setup::Setup(const Scenario& scenario, const std::filesystem::path& robot, const std::filesystem::path& mjcf)
    : Setup(scenario, robot, mjcf, LoadMjcf(mjcf)) {}

Setup::Setup(const Scenario& scenario, const std::filesystem::path& robot, const std::filesystem::path& mjcf,
             MjModelPtr engine)
    : Setup(scenario, ParseRobotModel(ReadBytes(robot.string()), robot.string(), scenario.model_overrides),
            mjcf, std::move(engine)) {}

Setup::Setup(const Scenario& scenario, RobotModel model, const std::filesystem::path& mjcf, MjModelPtr engine)
    : scenario_(scenario),
      robots_(scenario, std::move(model), mjcf, std::move(engine)),
      surface_(MakeObjectSurface(scenario, robots_.model)),
      hold_(FindHold(scenario, robots_.model)) {
  if (scenario_.joint_task() != nullptr) {
    joints_.emplace(MakeJointPlan(scenario_, robots_, &start_));
  } else if (scenario_.pick_task() != nullptr) {
    start_ = PlacePickTask(robots_.model, *surface_, &hold_, &scenario_);
  } else {
    start_ = SolveGrasp(robots_.model, *surface_, hold_, &scenario_);
  }
  if (scenario_.plant.bonded) MakeBonds(scenario_, hold_, *surface_, &robots_, &start_);
  DeclareMismatch(scenario_, mjcf, &robots_);
}

const ObjectModel& Setup::object() const { return has_object() ? *model().object() : NoObject(); }

const ObjectModel& Setup::declared_object() const {
  return has_object() ? *declared_model().object() : NoObject();
}

std::unique_ptr<Trajectory> Setup::MakeTrajectory() const {
  const TrajectoryTask* const task = scenario_.trajectory_task();
  return task == nullptr ? nullptr : task->trajectory(start_.X_o + task->start_error);
}

PartContext Setup::MakePartContext() const {
  return {&model(), fingertips().size(), scenario_.plant.time_step, scenario_.seed, scenario_.source};
}

GraspModelOptions Setup::MakeModelOptions() const {
  if (joints() != nullptr) return {.orientation = OrientationFeedback::kRotation};
  return MakeControllerOptions();
}

Sampling Setup::MakeSampling() const {
  const PlantOptions& plant = scenario_.plant;
  Sampling sampling{.time_step = 2.0 * plant.velocity_age(),
                    .hold = std::max(1L, std::lround(plant.control_step / plant.time_step))};
  if (scenario_.control.kappa == ContactSource::kIntegrated)
    sampling.contacts = {plant.time_step, plant.velocity_age()};
  return sampling;
}

GraspControllerOptions Setup::MakeControllerOptions() const {
  const ControlOptions& control = scenario_.control;
  GraspControllerOptions options(model());
  options.law = control.law;
  options.gains = control.gains;
  options.orientation = control.orientation;
  options.weight.kind = control.weight;
  if (control.weight == RedundancyWeight::Kind::kDiagonal) {
    const int base = model().num_base_velocities();
    options.weight.w.setOnes(model().num_velocities());
    options.weight.w.head(base).setConstant(control.platform_weight);
    for (const int joint : hold_.arm_joints) options.weight.w[base + joint] = control.arm_weight;
  }
  options.posture.q_posture = start_.q.tail(model().num_joints());
  options.posture.stiffness.setConstant(control.posture_frequency * control.posture_frequency);
  // The platform has no posture; damped, it would hold the object back.
  options.posture.damping.tail(model().num_joints()).setConstant(2.0 * control.posture_frequency);
  options.X_o_start = start_.X_o;
  options.bonds = start_.bonds;
  options.mu = control.mu;
  options.f_min = control.f_min;
  options.f_max = control.f_max;
  if (HasStiffness(control.law) && !joints_) options.stiffness = FindStiffness(options);
  return options;
}

ObjectStiffness Setup::FindStiffness(const GraspControllerOptions& options) const {
  GraspModel grasp(model(), fingertips(), object().body, *surface_, options);
  MeasuredState state{start_.q,     VectorXd::Zero(model().num_velocities()),
                      start_.X_Bo,  Vector6d::Zero(),
                      start_.kappa, std::vector<double>(fingertips().size(), 0.0)};
  if (start_.kappa.empty()) {
    ModelTerms kinematics(model(), Coordinates::kReduced);
    kinematics.SetState(state.q, state.xi);
    for (const int tip : fingertips()) {
      const Pose X_of = start_.X_Bo.inverse() * kinematics.CalcFramePose(tip);
      state.kappa.push_back(FindTipContact(model(), tip, *surface_, X_of));
    }
  }
  grasp.SetState(state);
  ObjectSpaceInertia inertia(model(), static_cast<int>(fingertips().size()));
  inertia.Compute(grasp.robot(), grasp.grasp());
  const ControlOptions& control = scenario_.control;
  ObjectStiffness stiffness = CalcStiffness(control.gains, inertia.Lambda(), start_.X_Bo.linear());
  if (control.stiffness) stiffness.K = *control.stiffness;
  if (control.damping) stiffness.D = *control.damping;
  return stiffness;
}

}  // namespace dexcheck
