#include "harness/diagnosis/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>

#include "harness/descriptions/constant_table.h"
#include "harness/diagnosis/repair_trial.h"

namespace dexcheck {
namespace {

// Solved numbers that no person would have written have some twelve digits.
constexpr double kSolved = 1e-11;

/// "dry friction" of the check "joint_dry_friction": what a finding of something that only the MJCF has is
/// about.
std::string InWords(const std::string& check) {
  std::string words = check.substr(check.starts_with("joint_") ? 6 : check.starts_with("tendon_") ? 7 : 0);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

/// Takes from the engine's model what the analytic model cannot have, and says what it was.
std::vector<Repair> Neutralise(const Adapter& adapter, const ConstantChecks& constants, mjModel* engine) {
  std::vector<Repair> causes;
  for (const ConstantFinding& finding : constants.findings) {
    if (!finding.engine_only) continue;
    Repair& cause = causes.emplace_back();
    cause.kind = RepairKind::kEngineOnly;
    cause.note = fmt::format("{}: {} of {:.9g} only in the MJCF: the analytic model has none", finding.where,
                             InWords(finding.check), finding.engine);
    if (finding.where.starts_with("free joint of "))
      cause.note += " (<joint type=\"free\"> takes the defaults of <joint>, <freejoint> does not)";
  }
  if (causes.empty()) return causes;
  for (const int joint : adapter.joint_ids()) MakeIdle(EnginePart::kJoint, joint, kRobotJoint, engine);
  for (const int joint : adapter.base_joints()) MakeIdle(EnginePart::kJoint, joint, kFreeJoint, engine);
  for (const EngineWheel& wheel : adapter.wheels())
    MakeIdle(EnginePart::kJoint, wheel.joint, kWheelJoint, engine);
  for (int i = 0; i < static_cast<int>(engine->ntendon); ++i)
    MakeIdle(EnginePart::kTendon, i, kRobotJoint, engine);
  engine->opt.disableflags = 0;
  engine->opt.density = 0.0;
  engine->opt.viscosity = 0.0;
  return causes;
}

/// Whether a body that can be has become one that no robot can have.
bool MakesImpossible(const RobotSpec& before, const RobotSpec& after) {
  const auto makes = [](const MassProperties& from, const MassProperties& to) {
    return FindPhysicalInconsistency(from).empty() && !FindPhysicalInconsistency(to).empty();
  };
  if (makes(before.base.body, after.base.body)) return true;
  for (size_t i = 0; i < before.joints.size(); ++i) {
    if (makes(before.joints[i].body, after.joints[i].body)) return true;
  }
  return false;
}

/// Takes numbers out of a cause; what remains of it has no equivalents that are known.
void ForgetNumbers(const std::vector<Parameter>& numbers, Repair* cause) {
  for (size_t i = cause->parameters.size(); i-- > 0;) {
    if (std::find(numbers.begin(), numbers.end(), cause->parameters[i]) == numbers.end()) continue;
    cause->parameters.erase(cause->parameters.begin() + static_cast<std::ptrdiff_t>(i));
    cause->values.erase(cause->values.begin() + static_cast<std::ptrdiff_t>(i));
    cause->equivalents.clear();
  }
}

class Diagnostician {
 public:
  Diagnostician(const RobotModel& model, const mjModel& engine, const std::string& source,
                const DiagnosisOptions& options, FileTerms terms)
      : model_(model),
        engine_(mj_copyModel(nullptr, &engine)),
        setup_{*engine_, source, options, std::move(terms)},
        file_(setup_.terms.Write(model.spec())) {
    result_.written = result_.repaired = file_;
  }

  Diagnosis Run(const std::function<bool(const char*)>& progress) {
    const ConsistencyResult before = Compare(model_);
    result_.agrees = before.Agrees();
    if (result_.agrees) return std::move(result_);
    result_.causes = Neutralise(Adapter(model_, *engine_, setup_.source), before.constants, engine_.get());
    if (progress("constants")) Accept(RepairTrial(result_.repaired, setup_).ReadConstants());
    if (progress("geometry")) {
      for (const Repair& cause : WalkGeometry(RepairTrial(result_.repaired, setup_))) Accept({cause});
    }
    if (progress("bodies")) Accept(RepairTrial(result_.repaired, setup_).ReadBodies());
    progress("verdict");
    KeepWhatRepairs();
    ListRemaining();
    Weigh();
    return std::move(result_);
  }

 private:
  [[nodiscard]] ConsistencyResult Compare(const RobotModel& model) const {
    ConsistencyOptions options;
    options.samples = setup_.options.samples;
    options.seed = setup_.options.seed;
    ConsistencyResult result =
        CheckConsistency(Adapter(model, *engine_, setup_.source), options, [](long) { return true; });
    if (setup_.options.tolerance > 0.0) JudgeByTolerance(setup_.options.tolerance, &result);
    return result;
  }

  /// Takes repairs with values as they will be printed, unless the result cannot be a robot; another repair
  /// may have to come first then. A value that is printed like the file's repairs nothing.
  void Accept(std::vector<Repair> causes) {
    while (std::erase_if(causes, [&](const Repair& cause) { return TryAccept(cause); }) > 0) {
    }
  }

  bool TryAccept(Repair cause) {
    Repair printed = cause;
    printed.parameters.clear();
    if (cause.kind == RepairKind::kParameters) printed.values.clear();
    for (size_t i = 0; i < cause.parameters.size(); ++i) {
      const Parameter& parameter = cause.parameters[i];
      const double value = RoundPrinted(parameter, cause.values[i]);
      if (value != ReadBackPrinted(file_, parameter, GetValue(result_.repaired, parameter)))
        printed.Add(parameter, value);
    }
    if (printed.parameters.empty() && !cause.parameters.empty()) return true;
    for (Repair& equal : printed.equivalents) {
      for (size_t i = 0; i < equal.parameters.size(); ++i)
        equal.values[i] = RoundPrinted(equal.parameters[i], equal.values[i]);
    }
    RobotSpec repaired = result_.repaired;
    Apply(printed, &repaired);
    if (!setup_.TryModel(repaired) || MakesImpossible(file_, repaired)) return false;
    result_.repaired = std::move(repaired);
    // Of a number that is repaired again, the last value holds, in whatever order the repairs are printed.
    for (Repair& earlier : result_.causes) ForgetNumbers(printed.parameters, &earlier);
    std::erase_if(result_.causes, [](const Repair& earlier) {
      return earlier.kind == RepairKind::kParameters && earlier.parameters.empty();
    });
    result_.causes.push_back(std::move(printed));
    return true;
  }

  /// As a person would have written it, unless that is another number; in the precision printed.
  [[nodiscard]] double RoundPrinted(const Parameter& parameter, double value) const {
    const double rounded = RoundSolved(result_.repaired, parameter, value);
    const bool same = rounded == 0.0 || std::abs(rounded - value) <= kSolved * std::abs(value);
    return ReadBackPrinted(file_, parameter, same ? rounded : value);
  }

  /// The file with repairs made, in their order; none when that is no robot.
  [[nodiscard]] std::unique_ptr<RepairTrial> Try(const std::vector<Repair>& causes) const {
    RobotSpec written = file_;
    for (const Repair& cause : causes) Apply(cause, &written);
    if (!setup_.TryModel(written)) return nullptr;
    return std::make_unique<RepairTrial>(std::move(written), setup_);
  }

  /// Withdraws causes whose part (joint row, frame, body, constant) does not agree after all of them are
  /// applied, until all that stay do, and equivalents that do not do as well: nothing wrong is printed,
  /// however many numbers are wrong at once.
  void KeepWhatRepairs() {
    std::vector<Repair>& causes = result_.causes;
    for (size_t dropped = 1; dropped > 0 && !causes.empty();) {
      const std::unique_ptr<RepairTrial> trial = Try(causes);
      dropped = 1;
      if (trial) {
        dropped = std::erase_if(causes, [&](const Repair& cause) { return !trial->IsRepairedBy(cause); });
      } else {
        causes.pop_back();
      }
    }
    for (size_t i = 0; i < causes.size(); ++i) {
      std::vector<Repair> others = causes;
      std::erase_if(causes[i].equivalents, [&](const Repair& equivalent) {
        others[i] = equivalent;
        const std::unique_ptr<RepairTrial> trial = Try(others);
        return !trial || !std::all_of(others.begin(), others.end(),
                                      [&](const Repair& cause) { return trial->IsRepairedBy(cause); });
      });
    }
    result_.repaired = file_;
    for (const Repair& cause : causes) Apply(cause, &result_.repaired);
  }

  void ListRemaining() {
    const ConsistencyResult after = Compare(RobotModel(setup_.terms.Read(result_.repaired)));
    const double solved = std::max(kSolved, setup_.options.tolerance);
    std::copy_if(after.constants.findings.begin(), after.constants.findings.end(),
                 std::back_inserter(result_.remaining_constants), [&](const ConstantFinding& finding) {
                   if (finding.engine_only) return false;  // named already
                   const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
                   return !(std::abs(finding.model - finding.engine) <= solved * size);
                 });
    std::copy_if(after.terms.begin(), after.terms.end(), std::back_inserter(result_.remaining_terms),
                 [&](const CheckRecord& record) { return record.failed && !(record.worst <= solved); });
  }

  struct Size {
    double all = 0.0;
    double forces = 0.0;
  };

  /// Squared residuals of geometry, bodies, joint constants and forces, each by its own scale.
  [[nodiscard]] Size Measure(const RobotSpec& written) const {
    const RepairTrial trial(written, setup_);
    Size size;
    size.forces = trial.evidence().CalcForceResidual(trial.model()).squaredNorm();
    std::vector<int> items(trial.placement().items().size());
    std::iota(items.begin(), items.end(), 0);
    size.all = size.forces + trial.placement().CalcResidual(items).squaredNorm();
    for (const ConstantFinding& finding : trial.constants().findings) {
      if (finding.engine_only) continue;
      const double larger = std::max(std::abs(finding.model), std::abs(finding.engine));
      const double apart = (finding.model - finding.engine) / larger;
      if (std::isfinite(apart)) size.all += apart * apart;
    }
    return size;
  }

  /// What each cause explains after those before it; the largest first.
  void Weigh() {
    RobotSpec written = file_;
    const Size before = Measure(written);
    result_.residual = before.all;
    result_.residual_of_forces = before.forces;
    Size last = before;
    const auto fraction = [](double from, double to, double of) { return of > 0.0 ? (from - to) / of : 0.0; };
    for (Repair& cause : result_.causes) {
      if (cause.kind == RepairKind::kEngineOnly) continue;
      Apply(cause, &written);
      const Size now = Measure(written);
      cause.explained = fraction(last.all, now.all, before.all);
      cause.explained_of_forces = fraction(last.forces, now.forces, before.forces);
      last = now;
    }
    result_.explained = before.all > 0.0 ? fraction(before.all, last.all, before.all) : 1.0;
    result_.explained_of_forces =
        before.forces > 0.0 ? fraction(before.forces, last.forces, before.forces) : 1.0;
    // Rows and axes that were exchanged or turned must be repaired in the order found.
    if (std::any_of(result_.causes.begin(), result_.causes.end(),
                    [](const Repair& cause) { return cause.joint >= 0; }))
      return;
    std::stable_sort(result_.causes.begin(), result_.causes.end(),
                     [](const Repair& a, const Repair& b) { return a.explained > b.explained; });
  }

  const RobotModel& model_;
  MjModelPtr engine_;
  TrialSetup setup_;
  RobotSpec file_;
  Diagnosis result_;
};

}  // namespace

Diagnosis Diagnose(const RobotModel& model, const mjModel& engine, const std::string& engine_source,
                   const DiagnosisOptions& options, const std::function<bool(const char*)>& progress,
                   std::vector<WrittenRow> rows) {
  return Diagnostician(model, engine, engine_source, options, FileTerms(std::move(rows))).Run(progress);
}

}  // namespace dexcheck
