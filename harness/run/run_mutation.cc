#include "harness/run/run_mutation.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "harness/checks/check_table.h"
#include "harness/diagnosis/mutation.h"

namespace dexcheck {
namespace {

// Start error by which laws are judged, m and rad: feedback is zero whatever its gains are while the object
// follows exactly. The error comes within some steps, by 4 mm/s^2 at 20 rad/s, far below accelerations that
// soften contacts or make wheels slip.
constexpr double kOffset = 1e-5;
constexpr double kOffsetTime = 5e-3;  // s

/// A trajectory that begins later, and is offset a little from some time on.
class LaterTrajectory final : public Trajectory {
 public:
  LaterTrajectory(std::unique_ptr<Trajectory> whole, double later, double offset, double begin)
      : whole_(std::move(whole)), later_(later), offset_(offset), begin_(begin) {}
  [[nodiscard]] DesiredMotion Evaluate(double t) const override {
    DesiredMotion motion = whole_->Evaluate(t + later_);
    motion.X_d.array() += offset_ * CalcMinJerk(t - begin_, kOffsetTime).s;
    return motion;
  }

 private:
  std::unique_ptr<Trajectory> whole_;
  double later_, offset_, begin_;
};

// Positions and rates that differ by less are the same, m, rad and s.
constexpr double kSameMotion = 1e-12;
// Faults that are there from the beginning settle so long at the most, s.
constexpr double kSettle = 0.3;

// A campaign judges names: its searches end late, s of processor time.
constexpr double kSearchSeconds = 60.0;

/// The engine's simulation among the parts.
EnginePlant* FindEngine(const LoopParts& parts) {
  auto* const plant = dynamic_cast<EnginePlant*>(parts.plant.get());
  if (plant == nullptr) throw std::logic_error("a campaign has the engine's plant");
  return plant;
}

/// @param begin when the fault begins, s.
void InjectFault(const Setup& setup, const InjectedFault& fault, double begin, LoopParts* parts) {
  const auto clock = std::make_shared<RunClock>();
  EnginePlant* const engine = FindEngine(*parts);
  static_cast<void>(parts->plant.release());  // it is the engine
  parts->plant =
      std::make_unique<FaultyPlant>(setup, std::unique_ptr<EnginePlant>(engine), fault, clock, begin);
  if (fault.sensors) {
    // The change is called before the fault begins as well, since its memory must know the time before.
    parts->hidden_sensor_fault = [clock, change = fault.sensors(setup), begin, wrong = MeasuredState()](
                                     double t, MeasuredState* state) mutable {
      wrong = *state;
      const double since = clock->Since(begin, t);
      change(since, &wrong);
      if (since >= 0.0) *state = wrong;
    };
  }
  if (fault.controller) {
    parts->controller = fault.controller(setup, std::move(parts->controller),
                                         [clock, begin] { return clock->Since(begin, clock->time) >= 0.0; });
    parts->follower = nullptr;
  }
  parts->controller = std::make_unique<ClockedController>(std::move(parts->controller), clock);
}

InjectedFault JoinAll(const FaultSet& set) {
  return std::accumulate(set.begin() + 1, set.end(), set.front(),
                         [](const auto& a, const auto& b) { return dexcheck::Join(a, b); });
}

}  // namespace

bool RunMutant::is_named() const {
  if (all.truth.empty())
    return has_right_cause() && (evidence + " " + failed_checks).find(all.part) != std::string::npos;
  return killed && score.right == static_cast<int>(truth.size()) && score.wrong == 0;
}

bool RunMutant::is_as_alone() const {
  if (!killed || score.wrong > 0 || faults.size() == 1) return killed && score.wrong == 0;
  return std::equal(alone.begin(), alone.end(), score.outcomes.begin(), score.outcomes.end(),
                    [](CauseOutcome by_itself, CauseOutcome here) { return here <= by_itself; });
}

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
  if (options.duration == 0.0)
    options_.duration =
        scenario.joint_task() == nullptr ? 0.1 : std::max(0.1, scenario.duration - options.from);
  MakeSetups();
  if (scenario.joint_task() == nullptr && begin_ == 0.0) MoveToStart(should_stop);
  std::string failure = RunWithoutFault(should_stop);
  if (!failure.empty() && start_) {
    // The checks' memory begins with contacts at rest, which they are not where forces change fast.
    start_.reset();
    tau_.resize(0);
    begin_ = options_.from;
    MakeSetups();
    failure = RunWithoutFault(should_stop);
  }
  if (!failure.empty())
    throw InputError(scenario_.source + ": must pass before faults are made in it, got " + failure);
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
  // The memory of sensors and motors is no part of the plant's state.
  if (!scenario_.imperfections.is_ideal()) begin_ = options_.from;
  setup_ = MakeSetup(MakeScenario(options_.from, options_.duration, 0.0), nullptr);
  offset_setup_ = MakeSetup(MakeScenario(options_.from, options_.duration, kOffset), nullptr);
}

void RunCampaign::ListFaults() {
  const auto add = [&](std::vector<FaultSet> sets) {
    for (FaultSet& set : sets) {
      InjectedFault all = JoinAll(set);
      mutants_.push_back({.faults = std::move(set), .all = std::move(all)});
    }
  };
  DrawOptions draw{.together = static_cast<size_t>(options_.together),
                   .seed = options_.seed,
                   .duration = options_.duration,
                   .tau = tau_,
                   .kinds = options_.kinds};
  if (options_.draws > 0) {
    draw.count = static_cast<size_t>(options_.draws);
    return add(DrawFaults(*setup_, draw));
  }
  add(ListNumberFaults(*setup_, static_cast<size_t>(options_.parameters), options_.scale));
  // The fault lists know only the paper's law.
  const bool is_paper_law = !scenario_.controller.exists() &&
                            scenario_.control.law == ControlLaw::kComputedTorque &&
                            scenario_.joint_task() == nullptr;
  if (options_.laws && is_paper_law) add(ListLawFaults(*setup_));
  if (options_.equations && is_paper_law) add(ListEquationFaults(*setup_));
  if (!options_.plants) return;
  draw.count = 1;
  add(DrawEachKind(*setup_, draw));
}

std::unique_ptr<Setup> RunCampaign::MakeSetup(const Scenario& scenario, const RobotModel* model) const {
  MjModelPtr engine(mj_copyModel(nullptr, compiled_.get()));
  if (model != nullptr) return std::make_unique<Setup>(scenario, *model, mjcf_, std::move(engine));
  return std::make_unique<Setup>(scenario, robot_, mjcf_, std::move(engine));
}

Scenario RunCampaign::MakeScenario(double from, double duration, double offset) const {
  Scenario scenario = scenario_;
  scenario.duration = duration + begin_;
  if (!(from > 0.0)) return scenario;
  const double later = from - begin_;
  if (later > 0.0) {
    scenario.start = Start::kRest;
    scenario.settle = 0.0;
    scenario.expect.from = std::max(0.0, scenario_.expect.from - from);
  }
  auto& task = std::get<TrajectoryTask>(scenario.task);
  task.trajectory = [whole = task.trajectory, later, offset, begin = begin_](const Vector6d& X_start) {
    return std::make_unique<LaterTrajectory>(whole(X_start), later, offset, begin);
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

std::string RunCampaign::RunWithoutFault(const std::function<bool()>& should_stop) {
  for (const Setup* setup : {setup_.get(), offset_setup_.get()}) {
    if (setup == nullptr || should_stop()) continue;
    RunMutant none;
    // This run has the injector in place, and no fault.
    InjectedFault nothing;
    nothing.engine = [](const Setup&, mjModel*) {};
    LoopParts parts = MakeLoopParts(*setup);
    parts.search.seconds = kSearchSeconds;
    GoToStart(parts);
    InjectFault(*setup, nothing, begin_, &parts);
    VectorXd* const way = setup == setup_.get() ? &way_ : &offset_way_;
    if (!RunLoop(*setup, std::move(parts), &none, way, should_stop) || !none.killed) continue;
    return none.failure.empty() ? NameOf(none.cause) + (" (" + none.evidence + ")") : none.failure;
  }
  return "";
}

bool RunCampaign::RunLoop(const Setup& setup, LoopParts parts, RunMutant* mutant, VectorXd* way,
                          const std::function<bool()>& should_stop) {
  Runner runner(setup, /*check=*/true, std::move(parts));
  const auto read = [](const PlantReading& reading, VectorXd* state) {
    state->resize(reading.qpos.size() + reading.qvel.size());
    *state << reading.qpos, reading.qvel;
  };
  VectorXd begin;
  const RunResult& result = runner.Run(
      [&](const StepRecord& step) {
        if (begin.size() == 0) read(step.reading, &begin);
      },
      should_stop);
  if (result.interrupted) return false;
  read(runner.loop().record().reading, way);
  if (begin.size() == way->size()) *way -= begin;
  if (tau_.size() == 0) tau_ = runner.loop().record().drive.tau;
  mutant->killed = result.verdict != Verdict::kPass;
  mutant->cause = result.attribution.cause;
  mutant->evidence = result.attribution.evidence;
  mutant->score = ScoreNames(mutant->truth, mutant->all.truth, result.causes);
  for (const Explanation& one : result.causes)
    mutant->causes += (mutant->causes.empty() ? "" : "; ") + one.Describe();
  mutant->failure = result.failure;
  AddFailed(runner.loop().checks().model_checks(), &mutant->failed_checks);
  AddFailed(runner.loop().checks().motion_checks(), &mutant->failed_checks);
  mutant->position_error = result.tracking.position.max;
  return true;
}

bool RunCampaign::RunFault(const InjectedFault& fault, RunMutant* mutant, VectorXd* way,
                           const std::function<bool()>& should_stop) {
  const bool needs_error = fault.needs_error && offset_setup_ != nullptr;
  const Setup* setup = needs_error ? offset_setup_.get() : setup_.get();
  std::unique_ptr<Setup> own;
  double begin = begin_;
  if (fault.from_start) {
    Scenario scenario = MakeScenario(0.0, options_.from + options_.duration - begin_, 0.0);
    scenario.settle = std::min(scenario.settle, kSettle);
    own = MakeSetup(scenario, nullptr);
    setup = own.get();
    if (scenario_.joint_task() == nullptr) begin = options_.from;
  }
  if (fault.model) {
    const RobotModel model = fault.model(setup->model());
    own = MakeSetup(setup->scenario(), &model);
    setup = own.get();
  }
  LoopParts parts = MakeLoopParts(*setup);
  parts.search.seconds = kSearchSeconds;
  if (!fault.from_start) GoToStart(parts);
  InjectFault(*setup, fault, begin, &parts);
  return RunLoop(*setup, std::move(parts), mutant, way, should_stop);
}

bool RunCampaign::FindTruth(RunMutant* mutant, const std::function<bool()>& should_stop) {
  mutant->truth = mutant->all.truth;
  if (mutant->faults.size() < 2) return true;
  mutant->truth.clear();
  for (const InjectedFault& one : mutant->faults) {
    RunMutant alone{.faults = {}, .all = one, .truth = one.truth};
    VectorXd way;
    if (!RunFault(one, &alone, &way, should_stop)) return false;
    if (!alone.killed) continue;
    mutant->truth.insert(mutant->truth.end(), one.truth.begin(), one.truth.end());
    const std::vector<CauseOutcome>& outcomes = alone.score.outcomes;
    mutant->alone.insert(mutant->alone.end(), outcomes.begin(), outcomes.end());
  }
  return true;
}

bool RunCampaign::Run(size_t index, const std::function<bool()>& should_stop) {
  RunMutant& mutant = mutants_[index];
  VectorXd way;
  try {
    if (!FindTruth(&mutant, should_stop) || !RunFault(mutant.all, &mutant, &way, should_stop)) return false;
  } catch (const InputError& error) {
    mutant.refused = true;
    mutant.failure = error.what();
    return true;
  }
  const bool may_be_late = mutant.score.not_explained > 0 && mutant.faults.size() > 1;
  for (size_t i = 0; may_be_late && i < mutant.faults.size(); ++i) {
    RunMutant fewer{.faults = mutant.faults, .all = {}};
    fewer.faults.erase(fewer.faults.begin() + static_cast<std::ptrdiff_t>(i));
    fewer.all = JoinAll(fewer.faults);
    VectorXd its_way;
    if (!RunFault(fewer.all, &fewer, &its_way, should_stop)) return false;
    // A fault that begins after the others have ended the run is not in it: all is the same, bit by bit.
    if (its_way != way || fewer.causes != mutant.causes) continue;
    fewer.all.name += "; too late: " + mutant.faults[i].name;
    mutant = {.faults = fewer.faults, .all = fewer.all};
    return Run(index, should_stop);
  }
  const VectorXd& right = mutant.all.needs_error && offset_way_.size() > 0 ? offset_way_ : way_;
  // Faults in the plant alone are explained by forces, down to a millionth of those balanced (StepStore).
  constexpr double kExplained = 1e-6;
  const bool is_of_law = mutant.all.model || mutant.all.controller;
  const double unseen = is_of_law ? 0.0 : kExplained;
  const double same = std::max(kSameMotion, unseen * right.lpNorm<Eigen::Infinity>());
  mutant.no_effect = !mutant.killed && way.size() == right.size() && right.size() > 0 &&
                     (way - right).lpNorm<Eigen::Infinity>() < same;
  const bool goes_on =
      scenario_.joint_task() != nullptr && scenario_.duration > options_.from + options_.duration;
  return mutant.killed || !options_.looks_on || !goes_on || LookOn(&mutant, should_stop);
}

bool RunCampaign::LookOn(RunMutant* mutant, const std::function<bool()>& should_stop) {
  if (whole_ == nullptr) {
    RunMutationOptions options = options_;
    options.looks_on = false;
    options.duration = scenario_.duration - options.from;
    whole_ = std::make_unique<RunCampaign>(scenario_, robot_, mjcf_, options, should_stop);
  }
  whole_->mutants_ = {{.faults = mutant->faults, .all = mutant->all}};
  const bool is_done = whole_->Run(0, should_stop);
  // A motion may end where it began: its displacement then is no scale for the effect of a fault.
  const RunMutant& later = whole_->mutants_.front();
  if (later.killed || !mutant->no_effect) *mutant = later;
  return is_done;
}

}  // namespace dexcheck
