#include "harness/study/trial.h"

#include <limits>
#include <new>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "controller/model/parameter_reader.h"
#include "harness/engine/engine.h"
#include "harness/engine/remove_looks.h"
#include "harness/run/runner.h"
#include "harness/study/trial_monitor.h"

namespace dexcheck {
namespace {

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

/// What is wrong with the robot is told from its text, which has lines.
RobotModel MakeModel(const StudyInputs& inputs, const Scenario& scenario) {
  if (inputs.model && scenario.model_overrides == inputs.model_overrides) return *inputs.model;
  const std::string source = inputs.robot.string();
  try {
    if (inputs.model_document)
      return ParseRobotModel(*inputs.model_document, source, scenario.model_overrides);
  } catch (const InputError&) {
  }
  return ParseRobotModel(ReadTextFile(source), source, scenario.model_overrides);
}

Setup MakeSetup(const StudyInputs& inputs, const Scenario& scenario) {
  return Setup(scenario, MakeModel(inputs, scenario), inputs.mjcf, MakeEngine(inputs));
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

/// The range of a key beside these values of the others of its table.
Variation FindRange(const Study& study, size_t index, const std::vector<double>& values) {
  const std::span<const Variation> all(study.variations);
  const size_t keys = study.num_keys();
  if (index < keys) return FixRange(all.first(keys), index, values);
  return FixRange(all.subspan(keys), index - keys,
                  {values.begin() + static_cast<std::ptrdiff_t>(keys), values.end()});
}

}  // namespace

Scenario MakeTrialScenario(const StudyInputs& inputs, const Trial& trial) {
  Scenario scenario = ParseScenario(inputs.scenario_text, inputs.scenario_source, inputs.scenario_folder,
                                    ListOverrides(inputs.study, trial));
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
    result.failure = run.failure;
    if (run.interrupted) {
      const bool of_joints = setup.joints() != nullptr;
      result.failure = std::string(of_joints ? "an error of a joint" : "the position error") +
                       " is above stop_error, " + FormatNumber(limit) +
                       (of_joints ? " rad at t = " : " m at t = ") +
                       FormatNumber(runner.loop().record().time) + " s";
    }
    result.metrics = monitor.CalcMetrics(run.tracking);
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
    const std::vector<double> point = ValuesAt(study.keys(), std::vector<double>(study.num_keys(), 0.5));
    trial = ListTrialsOfPoint(study, 0, point, ListDraws(study)).front();
  } else {
    trial = ListTrials(study).front();
  }
  const Scenario first = MakeTrialScenario(*inputs, trial);
  MjModelPtr engine = LoadMjcf(inputs->mjcf);
  RemovePictures(engine.get());
  inputs->engine = std::move(engine);
  const Setup setup = MakeSetup(*inputs, first);
  inputs->model = std::make_shared<const RobotModel>(setup.model());
  inputs->model_overrides = first.model_overrides;
  const std::string robot = inputs->robot.string();
  inputs->model_document = std::make_shared<const TomlDocument>(ReadTextFile(robot), robot);
  const Runner runner(setup, study.check);  // sensors and motors know more names than the setup
  const std::vector<double> parameters = trial.parameters;
  for (size_t i = 0; i < study.variations.size(); ++i) {
    const Variation range = FindRange(study, i, parameters);
    for (const double end : {range.from, range.to}) {
      trial.parameters = parameters;
      trial.parameters[i] = end;
      for (size_t j = i + 1; j < parameters.size(); ++j) {
        if (study.variations[j].depends_on_others())
          trial.parameters[j] = ValueAt(FindRange(study, j, trial.parameters), 0.5);
      }
      MakeTrialScenario(*inputs, trial);
    }
  }
}

}  // namespace dexcheck
