#include "harness/study/trial.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/parameter_reader.h"
#include "harness/base/files.h"
#include "harness/engine/machine.h"
#include "harness/run/joint_margins.h"
#include "harness/run/runner.h"

namespace dexcheck {

namespace {

/// A run without a start error diverged when its error is above this, rms, m; of joints rad.
constexpr double kLostTrack = 0.01;
constexpr double kLostTrackOfJoints = 0.1;
/// Fingertips or wheels that slide further than this have slipped, m; the bounds of the cross-check.
constexpr double kFingertipSlipBound = 2e-4;
constexpr double kWheelSlipBound = 1e-3;
/// An error within this fraction of the start error has settled.
constexpr double kSettledFraction = 0.02;

/// The message without the folders of this machine.
std::string WithoutFolders(std::string message, const StudyInputs& inputs) {
  for (const std::filesystem::path& file : {inputs.robot, inputs.mjcf}) {
    const std::string folder = file.parent_path().string() + "/";
    for (size_t at = message.find(folder); at != std::string::npos; at = message.find(folder)) {
      message.erase(at, folder.size());
    }
  }
  return message;
}

MjModelPtr MakeEngine(const StudyInputs& inputs) {
  if (!inputs.engine) return LoadMjcf(inputs.mjcf);
  MjModelPtr copy(mj_copyModel(nullptr, inputs.engine.get()));
  if (!copy) throw std::bad_alloc();
  return copy;
}

/// The robot is read again for a trial that changes it.
Setup MakeSetup(const StudyInputs& inputs, const Scenario& scenario) {
  const std::string source = inputs.robot.string();
  const bool is_read = inputs.model && scenario.model_overrides == inputs.model_overrides;
  return Setup(scenario,
               is_read ? *inputs.model : ParseRobotModel(ReadBytes(source), source, scenario.model_overrides),
               inputs.mjcf, MakeEngine(inputs));
}

/// None of a loop that is not stable: nothing is left. Of a law that is not known they are not, either.
void SetMargins(const Setup& setup, std::array<double, kNumMetrics>* metrics) {
  if (setup.joints() == nullptr || !setup.scenario().knows_law()) return;
  const std::optional<JointMargins> margins =
      CalcJointMargins(setup, setup.joints()->gains, /*together=*/false);
  if (!margins) return;
  const bool stable = margins->is_stable();
  (*metrics)[kGainMargin] = stable ? margins->least.gain : 1.0;
  (*metrics)[kPhaseMargin] = stable ? margins->least.phase : 0.0;
  (*metrics)[kDelayMargin] = stable ? margins->least.delay : 0.0;
}

bool HasDiverged(const Setup& setup, const TrialResult& result) {
  if (!result.failure.empty()) return true;
  if (setup.scenario().start_error().norm() > 0.0) return !(result.metrics[kErrorGrowth] <= 1.0);
  if (setup.joints() != nullptr) return !(result.metrics[kJointErrorRms] <= kLostTrackOfJoints);
  return !(result.metrics[kPositionErrorRms] <= kLostTrack);
}

Outcome Classify(const Setup& setup, const RunResult& run, const TrialResult& result) {
  if (run.grasp_lost) return Outcome::kLostContact;
  if (HasDiverged(setup, result)) return Outcome::kDiverged;
  if (result.metrics[kWheelSlip] > kWheelSlipBound) return Outcome::kWheelsSpun;
  if (result.metrics[kFingertipSlip] > kFingertipSlipBound) return Outcome::kSlipped;
  if (run.attribution.cause == Cause::kModel) return Outcome::kChecksDisagreed;
  return Outcome::kTracked;
}

/// Watches one run: its metrics while it runs, from the plant alone, so that no cross-check is needed.
/// Nothing allocates after construction.
class TrialMonitor {
 public:
  /// @param num_steps that the run has.
  TrialMonitor(const Setup& setup, long num_steps)
      : num_steps_(num_steps),
        time_step_(setup.scenario().plant.time_step),
        of_joints_(setup.joints() != nullptr),
        has_heading_(setup.model().num_base_positions() == 3),
        fingertip_slips_(setup.fingertips().size(), Vector3d::Zero()),
        wheel_slips_(setup.adapter().wheels().size(), Vector3d::Zero()),
        cone_margin_(std::numeric_limits<double>::infinity()) {
    const Vector6d& start = setup.scenario().start_error();
    by_position_ = start.head<3>().norm() > 0.0 || start.tail<3>().norm() == 0.0;
    start_error_ = by_position_ ? start.head<3>().norm() : start.tail<3>().norm();
    if (by_position_ && start_error_ > 0.0) direction_ = start.head<3>() / start_error_;
    for (const EngineWheel& wheel : setup.adapter().wheels()) motor_dofs_.push_back(wheel.dof);
    for (const int dof : setup.adapter().joint_dofs()) motor_dofs_.push_back(dof);
  }

  /// Takes in a step.
  void Record(const StepRecord& step) {
    // A step that ended before the plant responded has no slip of its own.
    const bool is_complete = step.step > steps_;
    steps_ = step.step;
    RecordError(step);
    if (is_complete) RecordSlip(step);
    RecordMotors(step);
  }

  /// Error of the last step: of the object's position, m, or of a motion of joints the largest, rad or m.
  [[nodiscard]] double error() const { return error_; }

  /// All metrics of the steps so far, those of `tracking` included.
  [[nodiscard]] std::array<double, kNumMetrics> CalcMetrics(const TrackingStatistics& tracking) const {
    std::array<double, kNumMetrics> metrics;
    metrics.fill(std::numeric_limits<double>::quiet_NaN());
    metrics[kSimulatedTime] = static_cast<double>(steps_) * time_step_;
    if (steps_ == 0) return metrics;
    if (of_joints_) {
      metrics[kJointErrorRms] = tracking.joints.rms();
      metrics[kJointErrorMax] = tracking.joints.max;
    } else {
      metrics[kPositionErrorRms] = tracking.position.rms();
      metrics[kPositionErrorMax] = tracking.position.max;
      metrics[kOrientationErrorRms] = tracking.orientation.rms();
      metrics[kOrientationErrorMax] = tracking.orientation.max;
    }
    if (start_error_ > 0.0 && settled_) metrics[kSettlingTime] = settled_since_;
    if (start_error_ > 0.0 && by_position_) metrics[kOvershoot] = overshoot_;
    if (quarter_steps_[1] > 0 && quarter_squares_[0] > 0.0) {
      metrics[kErrorGrowth] = std::sqrt(quarter_squares_[1] / static_cast<double>(quarter_steps_[1]) /
                                        (quarter_squares_[0] / static_cast<double>(quarter_steps_[0])));
    }
    metrics[kPeakTorque] = peak_torque_;
    metrics[kPeakEffort] = peak_effort_;
    metrics[kEnergy] = energy_;
    if (std::isfinite(cone_margin_)) metrics[kConeMargin] = cone_margin_;
    metrics[kFingertipSlip] = fingertip_slip_;
    metrics[kWheelSlip] = wheel_slip_;
    return metrics;
  }

 private:
  void RecordError(const StepRecord& step) {
    const TrackingError& error = step.error;
    error_ = of_joints_ ? error.joints : error.position.norm();
    const double size = by_position_ ? error_ : error.orientation;
    const bool inside = size <= kSettledFraction * start_error_;
    if (inside && !settled_) settled_since_ = step.time;
    settled_ = inside;
    if (start_error_ > 0.0) {
      overshoot_ = std::max(overshoot_, -error.position.dot(direction_) / start_error_);
    }
    const long quarter = 4 * (step.step - 1) / std::max(num_steps_, 1L);
    if (quarter != 0 && quarter != 3) return;
    const size_t which = quarter == 0 ? 0 : 1;
    quarter_squares_[which] += size * size;
    ++quarter_steps_[which];
  }

  void RecordSlip(const StepRecord& step) {
    const auto slide = [&](const BodyContact& contact, const Matrix3d& R, Vector3d* distance,
                           double* largest) {
      if (contact.touching) *distance += time_step_ * (R.transpose() * contact.slip);
      *largest = std::max(*largest, distance->norm());
    };
    const MeasuredState& state = step.reading.state;
    for (size_t i = 0; i < fingertip_slips_.size(); ++i) {
      const BodyContact& contact = step.response.fingertips[i];
      if (contact.touching) cone_margin_ = std::min(cone_margin_, contact.cone_margin);
      slide(contact, state.X_Bo.linear(), &fingertip_slips_[i], &fingertip_slip_);
    }
    const double phi = has_heading_ ? state.q[2] : 0.0;
    const Matrix3d R_B0 = Eigen::AngleAxisd(phi, Vector3d::UnitZ()).toRotationMatrix();
    for (size_t i = 0; i < wheel_slips_.size(); ++i) {
      slide(step.response.wheels[i], R_B0, &wheel_slips_[i], &wheel_slip_);
    }
  }

  void RecordMotors(const StepRecord& step) {
    const VectorXd& tau = step.command.tau;
    double power = 0.0;
    for (size_t i = 0; i < motor_dofs_.size(); ++i) {
      power += std::abs(tau[static_cast<Eigen::Index>(i)] * step.reading.qvel[motor_dofs_[i]]);
    }
    energy_ += power * time_step_;
    peak_torque_ = std::max(peak_torque_, tau.cwiseAbs().maxCoeff());
    peak_effort_ = std::max(peak_effort_, step.drive.effort);
  }

  long num_steps_;
  double time_step_;
  bool of_joints_;
  bool has_heading_;
  long steps_ = 0;                         // that were completed
  Vector3d direction_ = Vector3d::Zero();  // of the start error
  double error_ = 0.0;                     // of the last step
  double start_error_ = 0.0;               // m, or rad when the object is only turned
  bool by_position_ = true;
  double settled_since_ = 0.0;  // s
  bool settled_ = false;
  double overshoot_ = 0.0;
  std::array<double, 2> quarter_squares_{};  // first and last quarter
  std::array<long, 2> quarter_steps_{};
  std::vector<Vector3d> fingertip_slips_, wheel_slips_;  // m
  std::vector<int> motor_dofs_;                          // by entry of tau'
  double fingertip_slip_ = 0.0, wheel_slip_ = 0.0, cone_margin_;
  double peak_torque_ = 0.0, peak_effort_ = 0.0, energy_ = 0.0;
};

bool IsSameNumber(double a, double b) {
  return (std::isnan(a) && std::isnan(b)) ||
         std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

ScenarioDocument OpenScenario(const StudyInputs& inputs) {
  ScenarioDocument document(inputs.scenario_text, inputs.scenario_source, inputs.scenario_folder);
  for (const std::string& assignment : inputs.controller) document.Override(assignment);
  for (const std::string& assignment : inputs.study.overrides) document.Override(assignment);
  return document;
}

Scenario MakeTrialScenario(const StudyInputs& inputs, const Trial& trial) {
  ScenarioDocument document = inputs.scenario_document ? *inputs.scenario_document : OpenScenario(inputs);
  for (size_t i = 0; i < trial.parameters.size(); ++i) {
    const Variation& variation = inputs.study.variations[i];
    // A text may be any value, and "KEY+" adds to a list.
    if (variation.labels.empty() && !variation.key.ends_with('+')) {
      document.Set(variation.key, trial.parameters[i]);
    } else {
      document.Override(variation.key + "=" + FormatValue(variation, trial.parameters[i]));
    }
  }
  Scenario scenario = document.Read();
  scenario.seed = trial.seed;
  return scenario;
}

TrialResult RunTrial(const StudyInputs& inputs, const Trial& trial) {
  TrialResult result;
  try {
    const Scenario scenario = MakeTrialScenario(inputs, trial);
    const Setup setup = MakeSetup(inputs, scenario);
    Runner runner(setup, inputs.study.check);
    TrialMonitor monitor(setup, runner.loop().num_steps());
    const double limit = inputs.study.stop_error;
    const auto is_lost = [&] { return limit > 0.0 && monitor.error() > limit; };
    const RunResult& run = runner.Run([&](const StepRecord& step) { monitor.Record(step); }, is_lost);
    if (run.controller_failed) throw Error(run.failure);
    result.failure = run.failure;
    if (run.interrupted) {
      const bool of_joints = setup.joints() != nullptr;
      result.failure = std::string(of_joints ? "an error of a joint" : "the position error") +
                       " is above stop_error, " + FormatNumber(limit) +
                       (of_joints ? " rad at t = " : " m at t = ") +
                       FormatNumber(runner.loop().record().time) + " s";
    }
    result.metrics = monitor.CalcMetrics(run.tracking);
    if (NeedsMargins(inputs.study)) SetMargins(setup, &result.metrics);
    result.outcome = Classify(setup, run, result);
  } catch (const InputError& error) {
    result.metrics.fill(std::numeric_limits<double>::quiet_NaN());
    result.outcome = Outcome::kRefused;
    result.failure = WithoutFolders(error.what(), inputs);
  }
  return result;
}

void CheckTrials(StudyInputs* inputs) {
  const Study& study = inputs->study;
  Trial trial;
  if (study.is_search()) {
    const std::vector<double> middle(study.variations.size(), 0.5);
    trial = ListTrialsOfPoint(study, 0, ValuesAt(study.variations, middle)).front();
  } else {
    trial = ListTrials(study).front();
  }
  inputs->scenario_document = std::make_shared<const ScenarioDocument>(OpenScenario(*inputs));
  const Scenario first = MakeTrialScenario(*inputs, trial);
  inputs->engine = LoadMjcf(inputs->mjcf);
  const Setup setup = MakeSetup(*inputs, first);
  inputs->model_overrides = first.model_overrides;
  inputs->model = std::make_shared<const RobotModel>(setup.model());
  const Runner runner(setup, study.check);  // sensors and motors know more names than the setup
  inputs->controller_hash = HashController(first.controller);
  const std::vector<double> parameters = trial.parameters;
  for (size_t i = 0; i < study.variations.size(); ++i) {
    trial.parameters = parameters;
    for (const double end : {study.variations[i].from, study.variations[i].to}) {
      trial.parameters[i] = end;
      MakeTrialScenario(*inputs, trial);
    }
  }
}

Metric FindErrorMetric(const std::vector<TrialRow>& rows) {
  const bool of_joints = std::ranges::any_of(rows, [](const TrialRow& row) {
    return std::isfinite(row.result.metrics[kJointErrorRms]) &&
           !std::isfinite(row.result.metrics[kPositionErrorRms]);
  });
  return of_joints ? kJointErrorRms : kPositionErrorRms;
}

bool IsSame(const TrialRow& a, const TrialRow& b) {
  if (a.trial.seed != b.trial.seed || a.trial.parameters != b.trial.parameters ||
      a.result.outcome != b.result.outcome) {
    return false;
  }
  const bool exactly = a.machine == b.machine;
  if (exactly && a.result.failure != b.result.failure) return false;
  if (!exactly && !a.result.failure.empty() && !b.result.failure.empty()) return true;
  for (size_t i = 0; i < a.result.metrics.size(); ++i) {
    const double x = a.result.metrics[i];
    const double y = b.result.metrics[i];
    if (exactly ? !IsSameNumber(x, y)
                : !IsSameWithin(kMetricTolerance, x, y, std::max(std::abs(x), std::abs(y)))) {
      return false;
    }
  }
  return a.result.failure == b.result.failure;
}

}  // namespace dexcheck
