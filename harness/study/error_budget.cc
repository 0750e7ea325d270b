#include "harness/study/error_budget.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

#include "controller/common/errors.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/trajectory.h"
#include "controller/model/platform.h"
#include "harness/base/process_pool.h"
#include "harness/checks/step_record.h"
#include "harness/plant/disturbances.h"
#include "harness/plant/motor_drive.h"
#include "harness/plant/sensing.h"
#include "harness/run/loop_parts.h"
#include "harness/run/runner.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

namespace {

/// Errors by step: of the object's position (3), m, or of joints (n), rad or m.
struct Errors {
  std::vector<double> values;  ///< One step behind the other.
  size_t size = 3;             ///< Numbers of a step.
  void Append(const VectorXd& error) {
    size = static_cast<size_t>(error.size());
    values.insert(values.end(), error.begin(), error.end());
  }
  [[nodiscard]] size_t CountSteps() const { return values.size() / size; }
  [[nodiscard]] Eigen::Map<const VectorXd> At(size_t step) const {
    return {values.data() + step * size, static_cast<Eigen::Index>(size)};
  }
};

/// Predicts to first order what a plant that is not ideal makes of the tracking error: along the run of an
/// ideal one it computes at each step what would be measured, what the law would send then, what the motors
/// would deliver, and how the rigid system (19), (46), (48) with the plant's own masses and pushes would
/// accelerate. That acceleration less the ideal one, d, drives the error. Of the object's position, with the
/// gains of (57),
///
///   e_ddot + K_v e_dot + K_p e = -d,   e = X_d - X_o
///
/// and in the same way of the joints that follow a motion of their own, e = q_d - q, by computed torque. The
/// other laws of joints leave e_ddot = -d - M^-1 (K e + D e_dot).
class ErrorPrediction {
 public:
  /// @param setup of the scenario with its imperfections; outlives this.
  /// @param acts_at_rest whether the run begins with the error that the first d has in the end.
  ErrorPrediction(const Setup& setup, bool acts_at_rest)
      : sensing_(setup.scenario().imperfections.sensing, setup.MakePartContext()),
        drive_(MakeLoopParts(setup).plant->motors(), setup.scenario().imperfections.actuation,
               setup.MakePartContext()),
        disturbances_(setup.scenario().imperfections.disturbances, setup.MakePartContext()),
        controller_(MakeScenarioLaw(setup)),
        model_(setup.declared_model(), setup.fingertips(), setup.declared_object().body, setup.surface(),
               setup.MakeModelOptions()),
        dynamics_(setup.declared_model(), static_cast<int>(setup.fingertips().size())),
        actuation_(setup.model()),
        joint_motion_(setup.joints() == nullptr ? nullptr : &setup.joints()->motion),
        time_step_(setup.scenario().plant.time_step),
        acts_at_rest_(acts_at_rest) {
    force_.setZero(setup.model().num_velocities());
    command_.tau = force_;
    if (joint_motion_ == nullptr) {
      trajectory_ = setup.MakeTrajectory();
      controller_->Follow(*trajectory_);
      K_p_ = setup.scenario().control.gains.K_p.head<3>();
      K_v_ = setup.scenario().control.gains.K_v.head<3>();
    } else {
      const JointGains& gains = setup.joints()->gains;
      is_decoupled_ = setup.scenario().control.law == ControlLaw::kComputedTorque;
      K_p_ = is_decoupled_ ? gains.K_p : gains.K;
      K_v_ = is_decoupled_ ? gains.K_v : gains.D;
    }
    e_.setZero(K_p_.size());
    e_dot_ = e_ddot_ = acceleration_ = e_;
  }

  /// Acceleration at a step of the ideal run: of the object's origin, world (3), m/s^2, or of the joints (n).
  /// Once at each step.
  const VectorXd& CalcAcceleration(const StepRecord& ideal) {
    const MeasuredState& true_state = ideal.reading.state;
    sensing_.Measure(ideal.reading, &measured_);
    if (!has_begun_ && joint_motion_ != nullptr) controller_->Begin(ideal.time, measured_);
    has_begun_ = true;
    controller_->Step(measured_, ideal.time, &command_);
    drive_.Drive(command_.tau, true_state.xi, &tau_);
    actuation_.CalcForce(tau_, force_);
    const std::span<const Wrench> wrenches = disturbances_.Evaluate(ideal.time, true_state);
    model_.SetState(true_state);
    AddRobotForce(wrenches, model_.robot(), force_);
    if (joint_motion_ != nullptr) {
      acceleration_ = dynamics_.PredictFree(model_.robot(), force_).xi_dot;
      return acceleration_;
    }
    const Vector6d push = CalcObjectWrench(wrenches, true_state.X_Bo);
    const Vector6d& V_Bo_dot =
        dynamics_.Predict(model_.robot(), model_.grasp(), force_, ObjectSupport::kHand, nullptr, &push)
            .V_Bo_dot;
    // p_ddot = R (v_dot + omega x v)
    const Vector3d v = true_state.V_Bo.head<3>(), omega = true_state.V_Bo.tail<3>();
    acceleration_ = true_state.X_Bo.linear() * (V_Bo_dot.head<3>() + omega.cross(v));
    return acceleration_;
  }

  /// One step of the error. @param d as CalcAcceleration.
  void Step(const VectorXd& d) {
    const MatrixXd& M = model_.robot().M();
    if (errors_.values.empty() && acts_at_rest_) {
      const VectorXd at_rest = is_decoupled_ ? d : VectorXd(M * d);
      e_ = (K_p_ > 0.0).select(-at_rest.array() / K_p_, 0.0);
    }
    errors_.Append(e_);
    e_ddot_ = -(K_v_ * e_dot_.array() + K_p_ * e_.array());
    if (!is_decoupled_) {
      // Springs and dampers add to the forces, M^-1 (force + bias - bias).
      force_ = e_ddot_ + dynamics_.bias();
      e_ddot_ = dynamics_.PredictFree(model_.robot(), force_).xi_dot;
    }
    e_dot_ += time_step_ * (e_ddot_ - d);
    e_ += time_step_ * e_dot_;
  }

  /// The error at each step, less that of the ideal run.
  [[nodiscard]] const Errors& errors() const { return errors_; }

 private:
  Sensing sensing_;
  MotorDrive drive_;
  Disturbances disturbances_;
  std::unique_ptr<Trajectory> trajectory_;
  std::unique_ptr<Controller> controller_;
  GraspModel model_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
  const JointMotion* joint_motion_;  // null of an object
  bool is_decoupled_ = true;         // the error's dynamics have gains of their own
  Reading measured_;
  Command command_;
  VectorXd tau_, force_;      // n
  Eigen::ArrayXd K_p_, K_v_;  // or K, D
  double time_step_;
  bool acts_at_rest_;
  bool has_begun_ = false;
  VectorXd acceleration_, e_, e_dot_, e_ddot_;
  Errors errors_;
};

constexpr ErrorSize kNoPrediction{std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::quiet_NaN()};

/// Errors of one run, by step: of the object's position, or of each joint that follows a motion of its own.
struct Measured {
  Errors errors;
  std::vector<std::vector<double>> predicted;  ///< Values of errors, by source; of the ideal run.
  std::string failure;
};

VectorXd CalcError(const StepRecord& step) {
  const VectorXd& q_d = step.command.joints.q;
  if (q_d.size() > 0) return q_d - step.reading.state.q.tail(q_d.size());
  return step.error.position;
}

/// @param predictions made along the run; of the ideal one.
Measured RunOnce(const Setup& setup, const std::vector<std::unique_ptr<ErrorPrediction>>& predictions) {
  Measured measured;
  std::unique_ptr<ErrorPrediction> reference;
  if (!predictions.empty()) reference = std::make_unique<ErrorPrediction>(setup, /*acts_at_rest=*/true);
  Runner runner(setup, /*check=*/false);
  const RunResult& result = runner.Run(
      [&](const StepRecord& step) {
        measured.errors.Append(CalcError(step));
        if (!reference) return;
        const VectorXd ideal = reference->CalcAcceleration(step);
        for (const auto& prediction : predictions)
          prediction->Step(prediction->CalcAcceleration(step) - ideal);
      },
      [] { return false; });
  measured.failure = result.failure;
  for (const auto& prediction : predictions) measured.predicted.push_back(prediction->errors().values);
  return measured;
}

ErrorSize CalcSize(const Errors& errors, size_t from, bool of_joints) {
  ErrorStatistics lengths;
  for (size_t i = from; i < errors.CountSteps(); ++i) {
    const auto error = errors.At(i);
    const double length = of_joints ? error.cwiseAbs().maxCoeff() : error.norm();
    lengths.Add(length, length * length);
  }
  return {lengths.rms(), lengths.max};
}

/// a + sign b, as far as both go.
Errors Add(Errors a, double sign, const Errors& b) {
  a.values.resize(std::min(a.values.size(), b.values.size()));
  for (size_t i = 0; i < a.values.size(); ++i) a.values[i] += sign * b.values[i];
  return a;
}

bool IsAt(const ByName& value, const ByName& rest) { return value.Is(rest.all); }
template <typename Value>
bool IsAt(const Value& value, const Value& rest) {
  return value == rest;
}

/// Unit of the joints' errors.
std::string NameUnit(const RobotModel& model) {
  const bool slides = std::ranges::any_of(
      model.joints(), [](const Joint& joint) { return joint.type == JointType::kPrismatic; });
  return slides ? "rad or m" : "rad";
}

}  // namespace

std::vector<ErrorSource> ListErrorSources(const Imperfections& imperfections) {
  std::vector<ErrorSource> list;
  // Keys that are not at rest, which is where dropping puts them. The first step draws of a noise what is no
  // error that lasts.
  const auto add = [&](const char* name, auto part, auto member, bool acts_at_rest = true) {
    using Part = std::remove_cvref_t<decltype(imperfections.*part)>;
    if (IsAt((imperfections.*part).*member, Part().*member)) return;
    list.push_back({name, [=](Imperfections* i) { (i->*part).*member = Part().*member; }, acts_at_rest});
  };
  using S = SensingOptions;
  using A = ActuationOptions;
  using M = MismatchOptions;
  constexpr auto kSensing = &Imperfections::sensing;
  constexpr auto kActuation = &Imperfections::actuation;
  constexpr auto kMismatch = &Imperfections::mismatch;
  add("sensing.joint_counts", kSensing, &S::joint_counts);
  add("sensing.joint_noise", kSensing, &S::joint_noise, false);
  add("sensing.velocity", kSensing, &S::velocity);
  add("sensing.velocity_noise", kSensing, &S::velocity_noise, false);
  add("sensing.odometry", kSensing, &S::odometry);
  add("sensing.object_position_noise", kSensing, &S::object_position_noise, false);
  add("sensing.object_orientation_noise", kSensing, &S::object_orientation_noise, false);
  add("sensing.object_rate", kSensing, &S::object_rate);
  add("sensing.object_latency", kSensing, &S::object_latency);
  add("sensing.object_velocity", kSensing, &S::object_velocity);
  add("sensing.latency", kSensing, &S::latency);
  add("actuation.delay", kActuation, &A::delay);
  add("actuation.torque_step", kActuation, &A::torque_step);
  add("actuation.gain_error", kActuation, &A::gain_error);
  add("actuation.lag", kActuation, &A::lag);
  add("actuation.limit", kActuation, &A::limit);
  add("actuation.backlash", kActuation, &A::backlash);
  if (const A& motors = imperfections.actuation; !motors.coulomb.Is(0.0) || !motors.stribeck.Is(0.0))
    list.push_back(
        {"actuation.coulomb", [](Imperfections* i) { i->actuation.coulomb = i->actuation.stribeck = {}; }});
  for (const DisturbanceOptions& one : imperfections.disturbances) {
    list.push_back({one.key + " (" + one.body + ")",
                    [key = one.key](Imperfections* i) {
                      std::erase_if(i->disturbances, [&](const auto& other) { return other.key == key; });
                    },
                    /*acts_at_rest=*/false});
  }
  add("disturbance (slope)", kMismatch, &M::slope);
  for (const Payload& payload : imperfections.mismatch.payloads)
    list.push_back({payload.key + " (payload)", [key = payload.key](Imperfections* i) {
                      std::erase_if(i->mismatch.payloads, [&](const Payload& p) { return p.key == key; });
                    }});
  add("mismatch.mass", kMismatch, &M::mass);
  add("mismatch.mass_within", kMismatch, &M::mass_within);
  add("mismatch.com", kMismatch, &M::com);
  add("mismatch.damping", kMismatch, &M::damping);
  add("mismatch.armature", kMismatch, &M::armature);
  add("mismatch.friction", kMismatch, &M::friction);
  return list;
}

nlohmann::ordered_json ToJson(const ErrorBudget& budget) {
  const std::string suffix = budget.of_joints ? "" : "_m";
  const auto size = [&](const ErrorSize& error) {
    return nlohmann::ordered_json{{"rms" + suffix, error.rms}, {"max" + suffix, error.max}};
  };
  nlohmann::ordered_json json = {
      {"scenario", budget.scenario},        {"complete", budget.is_complete()}, {"failure", budget.failure},
      {"ideal", size(budget.ideal)},        {"all", size(budget.all)},          {"sum", size(budget.sum)},
      {"predicted", size(budget.predicted)}};
  if (budget.of_joints) json["unit"] = budget.unit;
  json["sources"] = nlohmann::ordered_json::array();
  for (const BudgetEntry& entry : budget.entries) {
    json["sources"].push_back({{"name", entry.name},
                               {"alone", size(entry.alone)},
                               {"predicted", size(entry.predicted)},
                               {"without", size(entry.without)},
                               {"interaction", entry.interaction},
                               {"interacts", entry.interacts()},
                               {"failure", entry.failure}});
  }
  return json;
}

bool ErrorBudget::is_complete() const {
  return failure.empty() &&
         std::ranges::all_of(entries, [](const BudgetEntry& e) { return e.failure.empty(); });
}

ErrorBudget CalcErrorBudget(const Scenario& scenario, const std::filesystem::path& robot,
                            const std::filesystem::path& mjcf, int jobs,
                            const std::function<bool(long done, long total)>& progress) {
  if (scenario.pick_task() != nullptr)
    throw InputError(scenario.source + ": task: a budget needs a trajectory");
  const std::vector<ErrorSource> sources = ListErrorSources(scenario.imperfections);
  if (sources.empty()) {
    throw InputError(scenario.source +
                     ": has nothing in [sensing], [actuation], [[disturbance]] or "
                     "[mismatch] that could cost accuracy");
  }
  const MjModelPtr engine = LoadMjcf(mjcf);  // compiled once
  const auto from = static_cast<size_t>(std::lround(scenario.expect.from / scenario.plant.time_step));
  ErrorBudget budget;
  budget.scenario = scenario.name;
  budget.of_joints = scenario.joint_task() != nullptr;
  const auto size_of = [&](const Errors& errors) { return CalcSize(errors, from, budget.of_joints); };
  const auto without = [&](const std::function<bool(size_t)>& dropped) {
    Scenario kept = scenario;
    for (size_t i = 0; i < sources.size(); ++i) {
      if (dropped(i)) sources[i].drop(&kept.imperfections);
    }
    return std::make_unique<Setup>(kept, robot, mjcf, MjModelPtr(mj_copyModel(nullptr, engine.get())));
  };
  // Made here, so that a fault of the scenario is an input error.
  const std::unique_ptr<Setup> ideal_setup = without([](size_t) { return true; });
  const std::unique_ptr<Setup> all_setup = without([](size_t) { return false; });
  if (budget.of_joints) budget.unit = NameUnit(ideal_setup->model());

  // Run 0 is the ideal one, along which all predictions are made, run 1 that with all sources; then come for
  // each source that with it alone and that with all others.
  const bool knows_law = scenario.knows_law();
  const auto only = [&](size_t source) { return without([&](size_t other) { return other != source; }); };
  const auto run = [&](size_t job) {
    std::vector<std::unique_ptr<Setup>> alone;
    std::vector<std::unique_ptr<ErrorPrediction>> predictions;
    // Without the law nobody knows what it would send.
    for (size_t i = 0; job == 0 && knows_law && i < sources.size(); ++i) {
      alone.push_back(only(i));
      predictions.push_back(std::make_unique<ErrorPrediction>(*alone[i], sources[i].acts_at_rest));
    }
    const size_t source = job / 2 - 1;
    const Measured measured = job < 2 ? RunOnce(job == 0 ? *ideal_setup : *all_setup, predictions)
                              : job % 2 == 0
                                  ? RunOnce(*only(source), {})
                                  : RunOnce(*without([&](size_t other) { return other == source; }), {});
    return PackBytes(measured.errors.size, measured.errors.values, measured.predicted, measured.failure);
  };
  std::vector<Measured> runs(2 * sources.size() + 2);
  size_t taken = 0;
  const auto take = [&](size_t job, const std::string& result) {
    Measured& one = runs[job];
    UnpackBytes(result, &one.errors.size, &one.errors.values, &one.predicted, &one.failure);
    taken = job + 1;
  };
  RunJobs("a run", runs.size(), jobs, run, take,
          [&] { return !progress(static_cast<long>(taken), static_cast<long>(runs.size())); });

  const Measured& ideal = runs[0];
  const Measured& all = runs[1];
  budget.failure = taken < runs.size() ? "interrupted" : ideal.failure.empty() ? all.failure : ideal.failure;
  if (taken < 2) return budget;
  budget.ideal = size_of(ideal.errors);
  budget.all = size_of(all.errors);
  const double scale =
      std::max(size_of(Add(all.errors, -1.0, ideal.errors)).rms, std::numeric_limits<double>::min());
  Errors sum = ideal.errors, predicted = sum;
  for (size_t i = 0; 2 * i + 3 < taken; ++i) {
    const Measured& one = runs[2 * i + 2];
    const Measured& others = runs[2 * i + 3];
    BudgetEntry entry;
    entry.name = sources[i].name;
    entry.failure = one.failure.empty() ? others.failure : one.failure;
    entry.alone = size_of(one.errors);
    entry.without = size_of(others.errors);
    entry.predicted = kNoPrediction;
    if (knows_law) {
      const Errors prediction{ideal.predicted[i], ideal.errors.size};
      entry.predicted = size_of(prediction);
      predicted = Add(std::move(predicted), 1.0, prediction);
    }
    const Errors alone_added = Add(one.errors, -1.0, ideal.errors);
    entry.interaction = size_of(Add(Add(all.errors, -1.0, others.errors), -1.0, alone_added)).rms / scale;
    sum = Add(std::move(sum), 1.0, alone_added);
    budget.entries.push_back(entry);
  }
  budget.sum = size_of(sum);
  budget.predicted = knows_law ? size_of(predicted) : kNoPrediction;
  return budget;
}

}  // namespace dexcheck
