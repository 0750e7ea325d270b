#include "harness/study/exciting_motion.h"

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/checks/check_table.h"
#include "harness/engine/engine.h"
#include "harness/run/excitation.h"
#include "harness/run/runner.h"

namespace dexcheck {
namespace {

constexpr int kSamples = 24;      // of a run
constexpr int kDigits = 3;        // of a value that is found
constexpr double kStep = 0.15;    // of a range, at first
constexpr double kClose = 0.005;  // of a range: near enough to end
// A check far below what it may take, or far above, says no more by being farther.
constexpr double kFar = 3.0;

constexpr const char* kTables[] = {"trajectory", "joint_motion", "stance"};

TomlDocument Open(const Scenario& scenario) {
  TomlDocument document(scenario.text, scenario.source);
  for (const std::string& assignment : scenario.overrides) {
    for (const char* table : kTables)
      if (assignment.starts_with(table)) document.Override(assignment);
  }
  return document;
}

/// Entries of a table, in the file's order; none without it.
std::vector<std::pair<std::string, TomlValue>> ListEntries(TomlTable& table, const char* key) {
  const auto value = table.Find(key);
  return value && value->IsTable() ? value->AsTable().GetEntries()
                                   : std::vector<std::pair<std::string, TomlValue>>{};
}

constexpr double kAmplitudes = 3.0, kOthers = 2.0;  // factors that a value may be changed by

void AddKey(const TomlValue& value, double factor, std::vector<MotionKey>* keys) {
  const double x = value.AsNumber();
  if (x != 0.0) keys->push_back({value.path(), x, x / factor, x * factor});
}

/// Keys of one oscillation or weave, or of the parts of a sum.
void AddKeys(const std::vector<std::pair<std::string, TomlValue>>& entries, std::vector<MotionKey>* keys) {
  for (const auto& [name, value] : entries) {
    if (name == "parts" || name == "oscillations") {
      for (const TomlValue& part : value.AsList()) AddKeys(part.AsTable().GetEntries(), keys);
    } else if (name == "xyz" || name == "zyz" || name == "zyz_deg") {
      for (const TomlValue& component : value.AsList()) AddKey(component, kAmplitudes, keys);
    } else if (name == "amplitude" || name == "amplitude_deg") {
      AddKey(value, kAmplitudes, keys);
    } else if (name == "frequency" || name == "speed" || name == "wavelength") {
      AddKey(value, kOthers, keys);
    }
  }
}

/// By path, "trajectory.parts[1].xyz[0]", as an override takes it.
std::string ToOverridePath(std::string path) {
  for (size_t at = path.find('['); at != std::string::npos; at = path.find('[')) path[at] = '.';
  path.erase(std::remove(path.begin(), path.end(), ']'), path.end());
  return path;
}

double Round(double value) { return std::stod(FormatNumber(value, kDigits)); }

/// What the checks of the motion took, by check.
struct Taken {
  std::string name;
  double worst = 0.0, bound = 0.0;
};

class MotionSearch {
 public:
  MotionSearch(const Scenario& scenario, std::filesystem::path robot, std::filesystem::path mjcf,
               const ExcitingMotionOptions& options, const std::function<bool(int runs)>& go_on)
      : scenario_(scenario),
        robot_(std::move(robot)),
        mjcf_(std::move(mjcf)),
        engine_(LoadMjcf(mjcf_)),
        options_(options),
        go_on_(go_on) {
    result_.keys = ListMotionKeys(scenario);
    if (result_.keys.empty()) {
      throw InputError(scenario.source + ": must have a trajectory, or a motion of joints, that oscillates");
    }
    result_.floor = CalcBound(*FindCheck("inverse_dynamics_robot"), scenario);
  }

  ExcitingMotion Run() {
    RunGiven();
    const auto n = static_cast<unsigned>(result_.keys.size());
    std::vector<double> x = x_;
    nlopt::opt method(nlopt::LN_COBYLA, n);
    method.set_lower_bounds(0.0);
    method.set_upper_bounds(1.0);
    method.set_initial_step(kStep);
    method.set_xtol_abs(kClose);
    method.set_max_objective([](const std::vector<double>& at, std::vector<double>& /*gradient*/,
                                void* self) { return static_cast<MotionSearch*>(self)->CalcObjective(at); },
                             this);
    method.add_inequality_mconstraint(CalcConstraints, this, std::vector<double>(limits_.size() + 1, 1e-6));
    double value = 0.0;
    try {
      method.optimize(x, value);
    } catch (const nlopt::forced_stop&) {       // runs are over, or the user interrupted
    } catch (const nlopt::roundoff_limited&) {  // as near as it gets
    }
    for (size_t k = 0; k < result_.keys.size(); ++k) {
      if (result_.found.values[k] != result_.keys[k].value)
        result_.overrides.push_back(MakeOverride(k, result_.found.values[k]));
    }
    return result_;
  }

 private:
  static double ToUnit(const MotionKey& key, double value) {
    return std::log(value / key.from) / std::log(key.to / key.from);
  }
  [[nodiscard]] std::string MakeOverride(size_t key, double value) const {
    return result_.keys[key].key + "=" + FormatNumber(value);
  }

  /// One run. @param taken by each of its checks that apply.
  JudgedMotion Try(const std::vector<double>& values, std::vector<Taken>* taken) {
    JudgedMotion motion;
    motion.values = values;
    std::vector<std::string> overrides = scenario_.overrides;
    for (size_t k = 0; k < values.size(); ++k) overrides.push_back(MakeOverride(k, values[k]));
    Scenario changed = ParseScenario(scenario_.text, scenario_.source,
                                     std::filesystem::path(scenario_.source).parent_path(), overrides);
    changed.seed = scenario_.seed;
    const Setup setup(changed, robot_, mjcf_, MjModelPtr(mj_copyModel(nullptr, engine_.get())));
    Runner runner(setup, /*check=*/true);
    std::vector<MotionSample> samples;
    TreeFactor factor(setup.model());
    const long every = std::max(1L, runner.loop().num_steps() / kSamples);
    const RunResult& run = runner.Run(
        [&](const StepRecord& step) {
          if (step.step % every == 0) samples.push_back(TakeMotionSample(step, &factor));
        },
        [] { return false; });
    ++result_.runs;
    motion.failure = run.failure;
    if (motion.failure.empty() && run.attribution.cause == Cause::kModel)
      motion.failure = run.attribution.evidence;
    for (const CheckRecord& check : runner.loop().checks().motion_checks()) {
      if (check.applies) taken->push_back({check.name, check.worst, check.bound});
    }
    if (motion.failure.empty()) motion.singular_values = CalcSingularValues(setup.model().spec(), samples);
    return motion;
  }

  void RunGiven() {
    std::vector<double> values;
    for (const MotionKey& key : result_.keys) values.push_back(key.value);
    std::vector<Taken> taken;
    result_.given = Try(values, &taken);
    const auto failed =
        std::ranges::find_if(taken, [](const Taken& check) { return !(check.worst <= check.bound); });
    if (!result_.given.failure.empty() || failed != taken.end()) {
      throw InputError(scenario_.source + ": must pass before its motion is changed, got " +
                       (failed != taken.end() ? failed->name + " above its bound" : result_.given.failure));
    }
    for (const Taken& check : taken)
      limits_.push_back({check.name, std::max(options_.fraction * check.bound, check.worst), check.bound});
    result_.rank = CountAbove(result_.given.singular_values, result_.floor);
    if (result_.rank == 0)
      throw InputError(scenario_.source + ": no number of the model shows in its forces");
    Judge(taken, &result_.given, &constraints_);
    result_.found = result_.given;
    for (const MotionKey& key : result_.keys) x_.push_back(ToUnit(key, key.value));
    last_ = result_.given;
  }

  /// @param constraints log of what each check takes over what it may, and, last, whether the run came to its
  /// end.
  void Judge(const std::vector<Taken>& taken, JudgedMotion* motion, std::vector<double>* constraints) const {
    constraints->assign(limits_.size() + 1, kFar);
    constraints->back() = motion->failure.empty() ? -kFar : kFar;
    double nearest = 0.0;
    for (size_t i = 0; i < limits_.size() && i < taken.size(); ++i) {
      const double limit = limits_[i].worst;
      const double worst = taken[i].worst;
      const double over = worst <= 0.0 ? -kFar : limit <= 0.0 ? kFar : std::log(worst / limit);
      (*constraints)[i] = std::isnan(over) ? kFar : std::clamp(over, -kFar, kFar);
      // What the motion given takes already is no news.
      if (limit > options_.fraction * limits_[i].bound || limit <= 0.0 || worst / limit <= nearest) continue;
      nearest = worst / limit;
      motion->nearest = limits_[i].name + ", " + FormatNumber(worst / limits_[i].bound, 2) + " of its bound";
    }
    motion->excess = 0.0;
    for (const double over : *constraints) motion->excess += std::max(0.0, over);
    if (motion->failure.empty()) motion->smallest = motion->singular_values[result_.rank - 1];
  }

  /// Makes the run of a point, unless it is the last one.
  void Evaluate(const std::vector<double>& x) {
    if (x == x_) return;
    if (result_.runs >= options_.runs || !go_on_(result_.runs)) throw nlopt::forced_stop();
    std::vector<double> values;
    for (size_t k = 0; k < x.size(); ++k) {
      const MotionKey& key = result_.keys[k];
      values.push_back(Round(key.from * std::pow(key.to / key.from, x[k])));
    }
    std::vector<Taken> taken;
    last_ = Try(values, &taken);
    x_ = x;
    Judge(taken, &last_, &constraints_);
    if (last_.excess <= 0.0 && last_.smallest > result_.found.smallest) result_.found = last_;
  }

  double CalcObjective(const std::vector<double>& x) {
    Evaluate(x);
    const double smallest = last_.failure.empty() ? last_.smallest : 0.0;
    // A motion that fails is as bad as one that shows nothing.
    return std::log(std::max(smallest, 1e-3 * result_.floor));
  }

  static void CalcConstraints(unsigned /*m*/, double* values, unsigned n, const double* x,
                              double* /*gradient*/, void* self) {
    auto* const search = static_cast<MotionSearch*>(self);
    search->Evaluate({x, x + n});
    std::ranges::copy(search->constraints_, values);
  }

  const Scenario& scenario_;
  std::filesystem::path robot_, mjcf_;
  MjModelPtr engine_;
  ExcitingMotionOptions options_;
  const std::function<bool(int runs)>& go_on_;
  ExcitingMotion result_;
  std::vector<Taken> limits_;  // worst: what each may take
  // The last point.
  std::vector<double> x_;
  JudgedMotion last_;
  std::vector<double> constraints_;
};

}  // namespace

std::vector<MotionKey> ListMotionKeys(const Scenario& scenario) {
  const TomlDocument document = Open(scenario);
  TomlTable root = document.Open();
  std::vector<MotionKey> keys;
  for (const char* table : kTables) AddKeys(ListEntries(root, table), &keys);
  for (MotionKey& key : keys) key.key = ToOverridePath(key.key);
  return keys;
}

ExcitingMotion FindExcitingMotion(const Scenario& scenario, const std::filesystem::path& robot,
                                  const std::filesystem::path& mjcf, const ExcitingMotionOptions& options,
                                  const std::function<bool(int runs)>& go_on) {
  return MotionSearch(scenario, robot, mjcf, options, go_on).Run();
}

}  // namespace dexcheck
