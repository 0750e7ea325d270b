#include "harness/diagnosis/mutation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "controller/common/errors.h"
#include "harness/descriptions/analytic_provider.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

class MutantList {
 public:
  explicit MutantList(const RobotSpec& spec) : spec_(spec) {}

  void AddParameters(double scale) {
    for (const Parameter& parameter : ListParameters(spec_)) {
      const double value = GetValue(spec_, parameter);
      double change = scale * GetScale(spec_, parameter);
      // An inertia at the edge of what is possible may be changed to one side only.
      TryChange(spec_, parameter, &change);
      Mutant& mutant = Add(DescribeGroup(parameter), {parameter});
      mutant.change = [parameter, value, change](RobotSpec* spec) {
        SetValue(spec, parameter, value + change);
      };
    }
  }

  void AddStructure() {
    const int joints = static_cast<int>(spec_.joints.size());
    for (int i = 0; i < joints; ++i) {
      const Joint& joint = spec_.joints[static_cast<size_t>(i)];
      AddStructural("axis reversed", RepairKind::kAxisReversed, i, -1);
      AddShift("alpha a quarter turn off", {Kind::kAlpha, i, 0}, 0.5 * kPi);
      AddShift("home angle a quarter turn off", {Kind::kHomeAngle, i, 0}, 0.5 * kPi);
      if (joint.parent >= 0) AddStructural("rows exchanged", RepairKind::kRowsSwapped, joint.parent, i);
      for (int j = i + 1; j < joints; ++j) {
        if (spec_.joints[static_cast<size_t>(j)].parent == joint.parent)
          AddStructural("places exchanged", RepairKind::kPosesSwapped, i, j);
      }
      AddShift("armature missing", {Kind::kArmature, i, 0}, -joint.armature);
      AddShift("damping missing", {Kind::kDamping, i, 0}, -joint.damping);
      AddBodies(i);
    }
    if (spec_.base.type == BaseType::kFloating) AddBodies(-1);
    for (int k = 0; k < 3; ++k)
      AddShift("gravity reversed", {Kind::kGravity, -1, k}, -2.0 * spec_.gravity[k]);
  }

  std::vector<Mutant> Take() { return std::move(mutants_); }

 private:
  /// What is mistaken of a link's body as a whole. @param link by its joint; -1: the base.
  void AddBodies(int link) {
    AddScaledBody(link);
    AddBody("inertia about the frame's origin", link, [](MassProperties* body) {
      const Matrix3d c = Skew(body->com);
      body->inertia -= body->mass * c * c;
    });
    AddBody("products of inertia negated", link, [](MassProperties* body) {
      const Matrix3d moments = body->inertia.diagonal().asDiagonal();
      body->inertia = 2.0 * moments - body->inertia;
    });
    AddBody("inertia with x and z exchanged", link, [](MassProperties* body) {
      Matrix3d exchange;
      exchange << 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0;
      body->inertia = exchange * body->inertia * exchange;
    });
  }

  Mutant& Add(const std::string& kind, const std::vector<Parameter>& parameters) {
    Mutant& mutant = mutants_.emplace_back();
    mutant.kind = kind;
    mutant.expected.parameters = parameters;
    mutant.name = DescribeShort(mutant.expected, spec_);
    return mutant;
  }

  void AddShift(const std::string& kind, const Parameter& parameter, double shift) {
    if (shift == 0.0) return;
    const double value = GetValue(spec_, parameter) + shift;
    Mutant& mutant = Add(kind, {parameter});
    mutant.change = [parameter, value](RobotSpec* spec) { SetValue(spec, parameter, value); };
  }

  /// A solid taken for one of a tenth more mass.
  void AddScaledBody(int link) {
    if (!(BodyOf(spec_, link).mass > 0.0)) return;
    std::vector<Parameter> numbers = {{Kind::kMass, link, 0}, {Kind::kInertia, link, 0}};
    Add("solid of another mass", numbers).change = [link](RobotSpec* spec) {
      constexpr double kRatio = 1.1;
      BodyOf(spec, link).mass *= kRatio;
      BodyOf(spec, link).inertia *= kRatio;
    };
  }

  void AddBody(const std::string& kind, int link, void (*change)(MassProperties*)) {
    MassProperties changed = BodyOf(spec_, link);
    const Matrix3d before = changed.inertia;
    change(&changed);
    constexpr double kSame = 1e-9;  // of the trace: a tensor that the fault leaves as it is
    if ((changed.inertia - before).norm() <= kSame * before.trace()) return;
    std::vector<Parameter> entries;
    entries.reserve(6);
    for (int k = 0; k < 6; ++k) entries.push_back({Kind::kInertia, link, k});
    Mutant& mutant = Add(kind, entries);
    mutant.change = [link, change](RobotSpec* spec) { change(&BodyOf(spec, link)); };
  }

  void AddStructural(const std::string& kind, RepairKind cause_kind, int joint, int other) {
    Repair cause;
    cause.kind = cause_kind;
    cause.joint = joint;
    cause.other = other;
    RobotSpec changed = spec_;
    Apply(cause, &changed);
    if (IsSamePlacement(changed)) return;
    Mutant& mutant = mutants_.emplace_back();
    mutant.kind = kind;
    mutant.expected = cause;
    mutant.name = DescribeShort(cause, spec_);
    mutant.change = [cause](RobotSpec* spec) { Apply(cause, spec); };
  }

  /// Whether two rows or places that were exchanged are alike.
  [[nodiscard]] bool IsSamePlacement(const RobotSpec& changed) const {
    for (size_t i = 0; i < spec_.joints.size(); ++i) {
      const MdhRow& a = spec_.joints[i].mdh;
      const MdhRow& b = changed.joints[i].mdh;
      if (a.alpha != b.alpha || a.a != b.a || a.q != b.q || a.d != b.d) return false;
      if (spec_.joints[i].X_PB.matrix() != changed.joints[i].X_PB.matrix()) return false;
    }
    return true;
  }

  const RobotSpec& spec_;
  std::vector<Mutant> mutants_;
};

}  // namespace

void AddFailed(std::span<const CheckRecord> records, std::string* names) {
  for (const CheckRecord& record : records)
    if (record.failed) *names += (names->empty() ? "" : " ") + record.name;
}

bool HasEffect(const RobotModel& model, DynamicsProvider* other, int samples, std::uint64_t seed) {
  constexpr double kRounding = 1e-14;
  AnalyticProvider right(model, "model");
  TermComparison comparison(model, kAskedByConsistency, {&right, other});
  CompareAtStates(
      FeedRandomStates(model, samples, {}, seed, comparison.needs_second_velocity(),
                       model.object().has_value()),
      [](long) { return true; }, &comparison);
  const std::vector<CheckRecord> terms = comparison.TakePairs().front().terms;
  return std::any_of(terms.begin(), terms.end(),
                     [](const CheckRecord& record) { return record.worst > kRounding; });
}

std::vector<Mutant> ListMutants(const RobotSpec& spec, double scale) {
  MutantList list(spec);
  list.AddParameters(scale);
  list.AddStructure();
  return list.Take();
}

bool IsNamedBy(const Mutant& mutant, const Repair& cause) {
  const Repair& expected = mutant.expected;
  if (cause.kind != expected.kind) return false;
  if (cause.kind != RepairKind::kParameters)
    return cause.joint == expected.joint && cause.other == expected.other;
  if (expected.parameters.size() == 1) return cause.parameters == expected.parameters;
  const Parameter& named = cause.parameters.front();
  const Parameter& changed = expected.parameters.front();
  const bool several = changed.kind != expected.parameters.back().kind;
  return named.kind == changed.kind && named.index == changed.index &&
         (!several || cause.parameters.size() > 1);
}

void TryMutant(const RobotModel& model, const mjModel& engine, const std::string& engine_source,
               const MutationOptions& options, Mutant* mutant) {
  RobotSpec spec = model.spec();
  mutant->change(&spec);
  const std::optional<RobotModel> changed = TryModel(spec);
  if (!changed) {
    mutant->outcome = MutantOutcome::kRefused;
    return;
  }
  ConsistencyOptions check;
  check.samples = options.samples;
  check.seed = options.seed;
  const ConsistencyResult result =
      CheckConsistency(Adapter(*changed, engine, engine_source), check, [](long) { return true; });
  AddFailed(result.constants.records, &mutant->failed_checks);
  AddFailed(result.terms, &mutant->failed_checks);
  if (result.Agrees()) {
    AnalyticProvider other(*changed, "changed", model);
    const bool has_effect = HasEffect(model, &other, options.samples, options.seed);
    mutant->outcome = has_effect ? MutantOutcome::kSurvived : MutantOutcome::kNoEffect;
    return;
  }
  mutant->outcome = MutantOutcome::kKilled;
  if (!options.diagnose) return;
  const Diagnosis diagnosis = Diagnose(*changed, engine, engine_source, {}, [](const char*) { return true; });
  mutant->explained = diagnosis.explained;
  if (diagnosis.causes.empty()) return;
  const Repair& first = diagnosis.causes.front();
  mutant->named = DescribeShort(first, spec);
  mutant->named_first = IsNamedBy(*mutant, first);
  mutant->named_equal = std::any_of(first.equivalents.begin(), first.equivalents.end(),
                                    [&](const Repair& equal) { return IsNamedBy(*mutant, equal); });
}

}  // namespace dexcheck
