#include "harness/run/run_mutation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

// Where the object is where it should be, feedback is nothing whatever its gains are: laws are judged from an
// error on, m and rad, that comes within some steps. It takes 4 mm/s^2 at 20 rad/s, far below what softens
// contacts or makes wheels slip.
constexpr double kOffset = 1e-5;
constexpr double kOffsetTime = 5e-3;  // s

/// A trajectory that begins later, and goes a little off.
class LaterTrajectory final : public Trajectory {
 public:
  LaterTrajectory(std::unique_ptr<Trajectory> whole, double from, double offset)
      : whole_(std::move(whole)), from_(from), offset_(offset) {}
  [[nodiscard]] DesiredMotion Evaluate(double t) const override {
    DesiredMotion motion = whole_->Evaluate(t + from_);
    motion.X_d.array() += offset_ * CalcMinJerk(t, kOffsetTime).s;
    return motion;
  }

 private:
  std::unique_ptr<Trajectory> whole_;
  double from_, offset_;
};

// Positions and rates that differ by less are the same, m, rad and s.
constexpr double kSameMotion = 1e-12;
// Faults that are there from the beginning settle so long at the most, s.
constexpr double kSettle = 0.3;

/// The engine's simulation among the parts.
EnginePlant* FindEngine(const LoopParts& parts) {
  auto* const plant = dynamic_cast<EnginePlant*>(parts.plant.get());
  if (plant == nullptr) throw std::logic_error("a campaign has the engine's plant");
  return plant;
}

void InjectFault(const Setup& setup, const PlantFault& fault, LoopParts* parts) {
  EnginePlant* const engine = FindEngine(*parts);
  parts->plant.release();
  parts->plant = std::make_unique<FaultyPlant>(setup, std::unique_ptr<EnginePlant>(engine), fault);
}

std::string JoinFailed(const RunChecks& checks) {
  std::string names;
  for (const std::span<const CheckRecord> records : {checks.model_checks(), checks.motion_checks()}) {
    for (const CheckRecord& record : records) {
      if (record.failed) names += (names.empty() ? "" : " ") + record.name;
    }
  }
  return names;
}

}  // namespace

RunCampaign::RunCampaign(const Scenario& scenario, std::filesystem::path robot, std::filesystem::path mjcf,
                         const RunMutationOptions& options, const std::function<bool()>& should_stop)
    : scenario_(scenario),
      robot_(std::move(robot)),
      mjcf_(std::move(mjcf)),
      options_(options),
      compiled_(LoadMjcf(mjcf_)) {
  if (scenario.pick_task() != nullptr)
    throw InputError(scenario.source + ": task: faults are made in runs along a trajectory");
  if (scenario.plant.type == PlantType::kRigid)
    throw InputError(scenario.source + ": plant.type: faults are made in a run of the engine's plant");
  MakeSetups();
  if (scenario.joint_task() == nullptr) MoveToStart(should_stop);
  if (!should_stop()) RequireNoFaultToPass(should_stop);
  if (tau_.size() == 0) tau_.setOnes(setup_->model().num_velocities());
  ListFaults();
}

void RunCampaign::MakeSetups() {
  if (scenario_.joint_task() != nullptr) {
    // Arms settle fast, and a motion of joints has no later beginning: faults are there from the first.
    Scenario scenario = scenario_;
    scenario.duration = options_.from + options_.duration;
    scenario.settle = std::min(scenario.settle, kSettle);
    setup_ = MakeSetup(scenario, nullptr);
    return;
  }
  // Even a run that is looked at from its beginning starts settled, one step in.
  options_.from = std::max(options_.from, scenario_.plant.time_step);
  setup_ = MakeSetup(MakeScenario(options_.from, options_.duration, 0.0), nullptr);
  offsetd_ = MakeSetup(MakeScenario(options_.from, options_.duration, kOffset), nullptr);
}

void RunCampaign::ListFaults() {
  const RobotModel& model = setup_->model();
  if (options_.draws > 0) {
    for (const DrawnFaults& drawn :
         DrawFaults(*setup_, {static_cast<size_t>(options_.draws), static_cast<size_t>(options_.together),
                              options_.seed, options_.duration, tau_})) {
      plants_.push_back(drawn.fault);
      singles_.push_back(drawn.each);
      mutants_.push_back({.kind = drawn.fault.kind,
                          .name = drawn.fault.name,
                          .truth = drawn.truth,
                          .injected = drawn.truth});
    }
    return;
  }
  if (options_.parameters > 0) {
    const std::vector<Parameter> numbers = ListParameters(model.spec());
    const size_t count = std::min(numbers.size(), static_cast<size_t>(options_.parameters));
    for (size_t i = 0; i < count; ++i) {
      parameters_.push_back(numbers[i * numbers.size() / count]);
      mutants_.push_back({.kind = "number",
                          .name = DescribePart(model.spec(), parameters_.back()) + ": " +
                                  DescribeQuantity(parameters_.back()),
                          .expected = Cause::kModel});
    }
  }
  // Those of another law are not known.
  const bool knows_law =
      scenario_.control.law == ControlLaw::kComputedTorque && scenario_.joint_task() == nullptr;
  if (options_.laws && knows_law) laws_ = ListLawFaults(!setup_->adapter().wheels().empty());
  for (const LawFault& law : laws_) {
    mutants_.push_back({.kind = law.part == SIZE_MAX ? "law, otherwise" : "law, one part",
                        .name = law.name,
                        .expected = Cause::kControlLaw,
                        .part = law.part == SIZE_MAX ? "" : ListLawParts()[law.part].name});
  }
  if (options_.equations && knows_law) {
    equations_ = ListEquationFaults(model, scenario_.control.orientation == OrientationFeedback::kAngles);
  }
  for (const EquationFault& equation : equations_) {
    mutants_.push_back(
        {.kind = "equation", .name = equation.name, .expected = Cause::kModel, .part = equation.check});
  }
  if (options_.plants) plants_ = ListPlantFaults(*setup_);
  for (const PlantFault& fault : plants_)
    mutants_.push_back({.kind = fault.kind, .name = fault.name, .expected = fault.cause, .part = fault.part});
}

std::unique_ptr<Setup> RunCampaign::MakeSetup(const Scenario& scenario, const RobotModel* model) const {
  MjModelPtr engine(mj_copyModel(nullptr, compiled_.get()));
  if (model != nullptr) return std::make_unique<Setup>(scenario, *model, mjcf_, std::move(engine));
  return std::make_unique<Setup>(scenario, robot_, mjcf_, std::move(engine));
}

Scenario RunCampaign::MakeScenario(double from, double duration, double offset) const {
  Scenario scenario = scenario_;
  scenario.duration = duration;
  if (!(from > 0.0)) return scenario;
  scenario.start = Start::kRest;
  scenario.settle = 0.0;
  scenario.expect.from = std::max(0.0, scenario_.expect.from - from);
  auto& task = std::get<TrajectoryTask>(scenario.task);
  task.trajectory = [whole = task.trajectory, from, offset](const Vector6d& X_start) {
    return std::make_unique<LaterTrajectory>(whole(X_start), from, offset);
  };
  if (offset != 0.0) scenario.expect = {};
  return scenario;
}

void RunCampaign::GoToStart(const LoopParts& parts) const {
  EnginePlant* const plant = FindEngine(parts);
  if (start_) plant->simulation().SetState(*start_);
}

void RunCampaign::MoveToStart(const std::function<bool()>& should_stop) {
  const std::unique_ptr<Setup> whole = MakeSetup(MakeScenario(0.0, options_.from, 0.0), nullptr);
  LoopParts parts = MakeLoopParts(*whole);
  EnginePlant* const plant = FindEngine(parts);
  ClosedLoop loop(*whole, /*check=*/false, std::move(parts));
  if (!loop.Settle(should_stop)) return;
  while (!loop.is_finished() && !should_stop()) loop.Step();
  start_ = plant->simulation().GetState();
}

void RunCampaign::RequireNoFaultToPass(const std::function<bool()>& should_stop) {
  for (const Setup* setup : {setup_.get(), offsetd_.get()}) {
    if (setup == nullptr) continue;
    RunMutant none;
    // With the injector in place, and nothing injected.
    PlantFault nothing;
    nothing.engine = [](const Setup&, mjModel*) {};
    LoopParts parts = MakeLoopParts(*setup);
    GoToStart(parts);
    InjectFault(*setup, nothing, &parts);
    VectorXd* const end = setup == setup_.get() ? &end_ : &offsetd_end_;
    if (!RunLoop(*setup, std::move(parts), &none, end, should_stop)) return;
    if (!none.killed) continue;
    throw InputError(
        scenario_.source + ": must pass before faults are made in it, got " +
        (none.failure.empty() ? NameOf(none.cause) + (" (" + none.evidence + ")") : none.failure));
  }
}

bool RunCampaign::RunLoop(const Setup& setup, LoopParts parts, RunMutant* mutant, VectorXd* end,
                          const std::function<bool()>& should_stop) {
  Runner runner(setup, /*check=*/true, std::move(parts));
  const RunResult& result = runner.Run([](const StepRecord&) {}, should_stop);
  if (result.interrupted) return false;
  const PlantReading& reading = runner.loop().record().reading;
  end->resize(reading.qpos.size() + reading.qvel.size());
  *end << reading.qpos, reading.qvel;
  if (tau_.size() == 0) tau_ = runner.loop().record().drive.tau;
  mutant->killed = result.verdict != Verdict::kPass;
  mutant->cause = result.attribution.cause;
  mutant->evidence = result.attribution.evidence;
  mutant->score = ScoreNames(mutant->truth, mutant->injected, result.causes);
  for (const Explanation& one : result.causes)
    mutant->causes += (mutant->causes.empty() ? "" : "; ") + one.Tell();
  mutant->names_part = mutant->evidence.find(mutant->part) != std::string::npos;
  mutant->failure = result.failure;
  mutant->failed_checks = JoinFailed(runner.loop().checks());
  mutant->position_error = result.tracking.position_max();
  const Expectation& expect = setup.scenario().expect;
  mutant->is_as_expected =
      result.failure.empty() && !(expect.position && mutant->position_error > *expect.position);
  return true;
}

bool RunCampaign::RunPlant(const PlantFault& fault, RunMutant* mutant, VectorXd* end,
                           const std::function<bool()>& should_stop) {
  std::unique_ptr<Setup> whole;
  if (fault.from_start) {
    Scenario scenario = MakeScenario(0.0, options_.from + options_.duration, 0.0);
    scenario.settle = std::min(scenario.settle, kSettle);
    whole = MakeSetup(scenario, nullptr);
  }
  const Setup& setup = fault.from_start ? *whole : *setup_;
  LoopParts parts = MakeLoopParts(setup);
  if (!fault.from_start) GoToStart(parts);
  InjectFault(setup, fault, &parts);
  if (fault.sensors) parts.hidden_sensor_fault = fault.sensors(setup);
  return RunLoop(setup, std::move(parts), mutant, end, should_stop);
}

bool RunCampaign::KeepFound(const std::vector<PlantFault>& each, RunMutant* mutant,
                            const std::function<bool()>& should_stop) {
  if (each.size() < 2) return true;
  std::vector<Fault> found;
  for (size_t i = 0; i < each.size(); ++i) {
    RunMutant alone;
    VectorXd end;
    if (!RunPlant(each[i], &alone, &end, should_stop)) return false;
    if (alone.killed) found.push_back(mutant->truth[i]);
  }
  mutant->truth = found;
  return true;
}

bool RunCampaign::Run(size_t index, const std::function<bool()>& should_stop) {
  RunMutant& mutant = mutants_[index];
  VectorXd end;
  if (!RunFault(index, &end, should_stop)) return false;
  const VectorXd& right = IsLaw(index) ? offsetd_end_ : end_;
  mutant.no_effect = !mutant.killed && end.size() == right.size() && right.size() > 0 &&
                     (end - right).lpNorm<Eigen::Infinity>() < kSameMotion;
  return true;
}

bool RunCampaign::RunFault(size_t index, VectorXd* end, const std::function<bool()>& should_stop) {
  RunMutant& mutant = mutants_[index];
  try {
    if (index < parameters_.size()) {
      const RobotModel model = ChangeNumber(setup_->model().spec(), parameters_[index], options_.scale);
      const std::unique_ptr<Setup> setup = MakeSetup(setup_->scenario(), &model);
      LoopParts parts = MakeLoopParts(*setup);
      GoToStart(parts);
      return RunLoop(*setup, std::move(parts), &mutant, end, should_stop);
    }
    const bool is_law = IsLaw(index);
    index -= parameters_.size();
    if (!is_law) index -= laws_.size();
    const bool is_equation = !is_law && index < equations_.size();
    if (!is_law && !is_equation) {
      index -= equations_.size();
      if (!singles_.empty() && !KeepFound(singles_[index], &mutant, should_stop)) return false;
      return RunPlant(plants_[index], &mutant, end, should_stop);
    }
    const Setup& setup = is_law ? *offsetd_ : *setup_;
    LoopParts parts = MakeLoopParts(setup);
    GoToStart(parts);
    if (is_law) {
      parts.controller = std::make_unique<FaultyLaw>(setup, laws_[index]);
    } else {
      parts.controller = std::make_unique<FaultyLaw>(setup, equations_[index]);
    }
    return RunLoop(setup, std::move(parts), &mutant, end, should_stop);
  } catch (const InputError& error) {
    mutant.refused = true;
    mutant.failure = error.what();
    return true;
  }
}

}  // namespace dexcheck
