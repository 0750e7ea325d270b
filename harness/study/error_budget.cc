#include "harness/study/error_budget.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "controller/common/errors.h"
#include "harness/run/runner.h"
#include "harness/study/error_prediction.h"

namespace dexcheck {
namespace {

/// By step: of the object's position, or of each joint that follows a motion of its own.
using Errors = std::vector<VectorXd>;

VectorXd CalcError(const StepRecord& step) {
  const VectorXd& q_d = step.command.joints.q;
  if (q_d.size() > 0) return q_d - step.reading.state.q.tail(q_d.size());
  return step.error.position;
}

/// What one run came to.
struct Measured {
  Errors errors;
  std::string failure;
};

Measured RunOnce(const Setup& setup) {
  Measured measured;
  Runner runner(setup, /*check=*/false);
  const RunResult& result = runner.Run(
      [&](const StepRecord& step) { measured.errors.push_back(CalcError(step)); }, [] { return false; });
  measured.failure = result.failure;
  return measured;
}

/// The ideal run, along which all predictions are made.
Measured RunIdeal(const Setup& setup, const std::vector<std::unique_ptr<ErrorPrediction>>& predictions) {
  Measured measured;
  ErrorPrediction reference(setup, /*acts_at_rest=*/true);
  Runner runner(setup, /*check=*/false);
  const RunResult& result = runner.Run(
      [&](const StepRecord& step) {
        measured.errors.push_back(CalcError(step));
        const VectorXd ideal = reference.CalcAcceleration(step);
        for (const auto& prediction : predictions)
          prediction->Step(prediction->CalcAcceleration(step) - ideal);
      },
      [] { return false; });
  measured.failure = result.failure;
  return measured;
}

ErrorSize CalcSize(const Errors& errors, size_t from, bool of_joints) {
  ErrorSize size;
  double squares = 0.0;
  for (size_t i = from; i < errors.size(); ++i) {
    const double length = of_joints ? errors[i].cwiseAbs().maxCoeff() : errors[i].norm();
    squares += length * length;
    size.max = std::max(size.max, length);
  }
  if (errors.size() > from) size.rms = std::sqrt(squares / static_cast<double>(errors.size() - from));
  return size;
}

/// a += sign b, as far as both go.
void Add(const Errors& b, double sign, Errors* a) {
  a->resize(std::min(a->size(), b.size()));
  for (size_t i = 0; i < a->size(); ++i) (*a)[i] += sign * b[i];
}

/// A source with one number or one by name.
ErrorSource ByKey(const char* name, std::function<void(Imperfections*)> drop) {
  return {name, std::move(drop)};
}

void ListSensing(const SensingOptions& s, std::vector<ErrorSource>* list) {
  const auto add = [&](bool given, const char* name, auto drop) {
    if (given) list->push_back(ByKey(name, drop));
  };
  // What the first step draws is no error that lasts.
  const auto add_noise = [&](bool given, const char* name, auto drop) {
    if (given) list->push_back({name, drop, /*acts_at_rest=*/false});
  };
  add(!s.joint_counts.Is(0.0), "sensing.joint_counts",
      [](Imperfections* i) { i->sensing.joint_counts = {}; });
  add_noise(!s.joint_noise.Is(0.0), "sensing.joint_noise",
            [](Imperfections* i) { i->sensing.joint_noise = {}; });
  add(s.velocity != VelocitySource::kMeasured, "sensing.velocity",
      [](Imperfections* i) { i->sensing.velocity = VelocitySource::kMeasured; });
  add_noise(!s.velocity_noise.Is(0.0), "sensing.velocity_noise",
            [](Imperfections* i) { i->sensing.velocity_noise = {}; });
  add(s.odometry, "sensing.odometry", [](Imperfections* i) { i->sensing.odometry = false; });
  add_noise(s.object_position_noise > 0.0, "sensing.object_position_noise",
            [](Imperfections* i) { i->sensing.object_position_noise = 0.0; });
  add_noise(s.object_orientation_noise > 0.0, "sensing.object_orientation_noise",
            [](Imperfections* i) { i->sensing.object_orientation_noise = 0.0; });
  add(s.object_rate > 0.0, "sensing.object_rate", [](Imperfections* i) { i->sensing.object_rate = 0.0; });
  add(s.object_latency > 0.0, "sensing.object_latency",
      [](Imperfections* i) { i->sensing.object_latency = 0.0; });
  add(s.object_velocity != VelocitySource::kMeasured, "sensing.object_velocity",
      [](Imperfections* i) { i->sensing.object_velocity = VelocitySource::kMeasured; });
  add(s.latency > 0.0, "sensing.latency", [](Imperfections* i) { i->sensing.latency = 0.0; });
}

void ListActuation(const ActuationOptions& a, std::vector<ErrorSource>* list) {
  const auto add = [&](bool given, const char* name, auto drop) {
    if (given) list->push_back(ByKey(name, drop));
  };
  add(a.delay > 0.0, "actuation.delay", [](Imperfections* i) { i->actuation.delay = 0.0; });
  add(!a.torque_step.Is(0.0), "actuation.torque_step",
      [](Imperfections* i) { i->actuation.torque_step = {}; });
  add(!a.gain_error.Is(0.0), "actuation.gain_error", [](Imperfections* i) { i->actuation.gain_error = {}; });
  add(!a.lag.Is(0.0), "actuation.lag", [](Imperfections* i) { i->actuation.lag = {}; });
  add(!a.backlash.Is(0.0), "actuation.backlash", [](Imperfections* i) { i->actuation.backlash = {}; });
  add(!a.coulomb.Is(0.0) || !a.stribeck.Is(0.0), "actuation.coulomb", [](Imperfections* i) {
    i->actuation.coulomb = {};
    i->actuation.stribeck = {};
  });
}

void ListMismatch(const MismatchOptions& m, std::vector<ErrorSource>* list) {
  const ByName one{.all = 1.0};
  const auto add = [&](bool given, const std::string& name, const std::function<void(Imperfections*)>& drop) {
    if (given) list->push_back({name, drop});
  };
  add(!m.slope.isZero(0.0), "disturbance (slope)", [](Imperfections* i) { i->mismatch.slope.setZero(); });
  for (const Payload& payload : m.payloads) {
    add(true, payload.key + " (payload)", [key = payload.key](Imperfections* i) {
      std::erase_if(i->mismatch.payloads, [&](const Payload& p) { return p.key == key; });
    });
  }
  add(!m.mass.Is(1.0), "mismatch.mass", [one](Imperfections* i) { i->mismatch.mass = one; });
  add(!m.mass_within.Is(0.0), "mismatch.mass_within", [](Imperfections* i) { i->mismatch.mass_within = {}; });
  add(!m.com.empty(), "mismatch.com", [](Imperfections* i) { i->mismatch.com.clear(); });
  add(!m.damping.Is(1.0), "mismatch.damping", [one](Imperfections* i) { i->mismatch.damping = one; });
  add(!m.armature.Is(1.0), "mismatch.armature", [one](Imperfections* i) { i->mismatch.armature = one; });
}

/// Makes setups of one scenario with other imperfections; the scene is compiled once.
class SetupMaker {
 public:
  SetupMaker(const Scenario& scenario, std::filesystem::path robot, std::filesystem::path mjcf)
      : scenario_(scenario), robot_(std::move(robot)), mjcf_(std::move(mjcf)), engine_(LoadMjcf(mjcf_)) {}

  [[nodiscard]] std::unique_ptr<Setup> Make(const Imperfections& imperfections) const {
    Scenario scenario = scenario_;
    scenario.imperfections = imperfections;
    return std::make_unique<Setup>(scenario, robot_, mjcf_, MjModelPtr(mj_copyModel(nullptr, engine_.get())));
  }

 private:
  Scenario scenario_;
  std::filesystem::path robot_, mjcf_;
  MjModelPtr engine_;
};

/// Of the joints' errors.
std::string NameUnit(const RobotModel& model) {
  const bool slides = std::any_of(model.joints().begin(), model.joints().end(),
                                  [](const Joint& joint) { return joint.type == JointType::kPrismatic; });
  return slides ? "rad or m" : "rad";
}

}  // namespace

std::vector<ErrorSource> ListErrorSources(const Imperfections& imperfections) {
  std::vector<ErrorSource> list;
  ListSensing(imperfections.sensing, &list);
  ListActuation(imperfections.actuation, &list);
  for (const DisturbanceOptions& one : imperfections.disturbances) {
    list.push_back({one.key + " (" + one.body + ")",
                    [key = one.key](Imperfections* i) {
                      std::erase_if(i->disturbances, [&](const auto& other) { return other.key == key; });
                    },
                    /*acts_at_rest=*/false});
  }
  ListMismatch(imperfections.mismatch, &list);
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
         std::all_of(entries.begin(), entries.end(), [](const BudgetEntry& e) { return e.failure.empty(); });
}

ErrorBudget CalcErrorBudget(const Scenario& scenario, const std::filesystem::path& robot,
                            const std::filesystem::path& mjcf,
                            const std::function<bool(long done, long total)>& progress) {
  if (scenario.pick_task() != nullptr)
    throw InputError(scenario.source + ": task: a budget needs a trajectory");
  const std::vector<ErrorSource> sources = ListErrorSources(scenario.imperfections);
  if (sources.empty()) {
    throw InputError(scenario.source +
                     ": asks for nothing of [sensing], [actuation], [[disturbance]] or "
                     "[mismatch] that could cost accuracy");
  }
  const SetupMaker maker(scenario, robot, mjcf);
  const auto from = static_cast<size_t>(std::lround(scenario.expect.from / scenario.plant.time_step));
  const auto total = static_cast<long>(2 * sources.size() + 2);
  long done = 0;
  ErrorBudget budget;
  budget.scenario = scenario.name;
  budget.of_joints = scenario.joint_task() != nullptr;
  const auto size_of = [&](const Errors& errors) { return CalcSize(errors, from, budget.of_joints); };
  const auto stop = [&] {
    if (progress(done++, total)) return false;
    budget.failure = "interrupted";
    return true;
  };
  const auto without = [&](const std::function<bool(size_t)>& dropped) {
    Imperfections kept = scenario.imperfections;
    for (size_t i = 0; i < sources.size(); ++i) {
      if (dropped(i)) sources[i].drop(&kept);
    }
    return maker.Make(kept);
  };

  if (stop()) return budget;
  std::vector<std::unique_ptr<Setup>> alone;
  std::vector<std::unique_ptr<ErrorPrediction>> predictions;
  for (size_t i = 0; i < sources.size(); ++i) {
    alone.push_back(without([&](size_t other) { return other != i; }));
    predictions.push_back(std::make_unique<ErrorPrediction>(*alone[i], sources[i].acts_at_rest));
  }
  const std::unique_ptr<Setup> ideal_setup = without([](size_t) { return true; });
  if (budget.of_joints) budget.unit = NameUnit(ideal_setup->model());
  const Measured ideal = RunIdeal(*ideal_setup, predictions);
  if (stop()) return budget;
  const Measured all = RunOnce(*without([](size_t) { return false; }));
  budget.failure = ideal.failure.empty() ? all.failure : ideal.failure;
  budget.ideal = size_of(ideal.errors);
  budget.all = size_of(all.errors);
  Errors all_added = all.errors;
  Add(ideal.errors, -1.0, &all_added);
  const double scale = std::max(size_of(all_added).rms, std::numeric_limits<double>::min());

  Errors sum = ideal.errors, predicted = ideal.errors;
  for (size_t i = 0; i < sources.size(); ++i) {
    BudgetEntry entry;
    entry.name = sources[i].name;
    if (stop()) return budget;
    const Measured one = RunOnce(*alone[i]);
    alone[i].reset();
    if (stop()) return budget;
    const Measured others = RunOnce(*without([&](size_t other) { return other == i; }));
    entry.failure = one.failure.empty() ? others.failure : one.failure;
    entry.alone = size_of(one.errors);
    entry.without = size_of(others.errors);
    entry.predicted = size_of(predictions[i]->errors());
    Errors alone_added = one.errors;
    Add(ideal.errors, -1.0, &alone_added);
    Errors company = all.errors;
    Add(others.errors, -1.0, &company);
    Add(alone_added, -1.0, &company);
    entry.interaction = size_of(company).rms / scale;
    Add(alone_added, 1.0, &sum);
    Add(predictions[i]->errors(), 1.0, &predicted);
    budget.entries.push_back(entry);
  }
  budget.sum = size_of(sum);
  budget.predicted = size_of(predicted);
  return budget;
}

}  // namespace dexcheck
