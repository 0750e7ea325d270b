#include "harness/diagnosis/mutation.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "harness/corrections/read_printed.h"
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
      Mutant& mutant = Add(DescribeGroup(parameter), parameter);
      mutant.change = [parameter, value, change](RobotSpec* spec) {
        SetValue(spec, parameter, value + change);
      };
    }
  }

  void AddStructure() {
    const int joints = static_cast<int>(spec_.joints.size());
    for (int i = 0; i < joints; ++i) {
      const Joint& joint = spec_.joints[static_cast<size_t>(i)];
      AddShift("alpha a quarter turn off", {Kind::kAlpha, i, 0}, 0.5 * kPi);
      AddShift("home angle a quarter turn off", {Kind::kHomeAngle, i, 0}, 0.5 * kPi);
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
  /// Adds faults of a body as a whole. @param link by its joint; -1: the base.
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

  Mutant& Add(const std::string& kind, const Parameter& number, bool is_whole = false) {
    Mutant& mutant = mutants_.emplace_back();
    mutant.kind = kind;
    mutant.number = number;
    mutant.name =
        DescribePart(spec_, number) + ": " + (is_whole ? DescribeGroup(number) : DescribeQuantity(number));
    return mutant;
  }

  void AddShift(const std::string& kind, const Parameter& parameter, double shift) {
    if (shift == 0.0) return;
    const double value = GetValue(spec_, parameter) + shift;
    Mutant& mutant = Add(kind, parameter);
    mutant.change = [parameter, value](RobotSpec* spec) { SetValue(spec, parameter, value); };
  }

  /// A solid taken for one of a tenth more mass.
  void AddScaledBody(int link) {
    if (!(BodyOf(spec_, link).mass > 0.0)) return;
    Add("solid of another mass", {Kind::kMass, link, 0}).change = [link](RobotSpec* spec) {
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
    Add(kind, {Kind::kInertia, link, 0}, /*is_whole=*/true).change = [link, change](RobotSpec* spec) {
      change(&BodyOf(spec, link));
    };
  }

  const RobotSpec& spec_;
  std::vector<Mutant> mutants_;
};

/// Files that agree are known better than to the digits of their numbers: takes these as exact.
void TakeAsExact(PrintedRobot* robot) {
  const auto take = [](double* half) {
    constexpr double kHalf = 1e-9;
    *half = std::min(*half, kHalf);
  };
  for (PrintedLink& link : robot->links) {
    for (const LinkNumber& number : ListNumbers(&link.origin)) take(number.half);
    for (double& half : link.joint.half_axis) take(&half);
    for (auto& number : link.joint.scalars)
      if (number) take(&number->half);
    for (size_t k = 0; link.joint.range && k < 2; ++k) take(&(*link.joint.range)[k].half);
    if (!link.inertial) continue;
    for (const LinkNumber& number : ListNumbers(&*link.inertial)) take(number.half);
  }
}

PrintedRobot PrintExactly(const RobotDescription& description) {
  PrintedRobot robot = PrintDescription(description);
  LeaveOutUnstated({}, &robot);
  TakeAsExact(&robot);
  return robot;
}

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

bool IsNamedBy(const RobotSpec& spec, const Parameter& number, const CorrectionItem& cause) {
  const std::optional<SiteKind> site = FindSite(number.kind);
  if (!site) return false;
  std::string place = number.kind == Kind::kGravity ? "robot" : DescribePart(spec, number);
  if (place.starts_with("base ")) place = "link " + place.substr(5);
  if (std::ranges::find(cause.places, place) == cause.places.end()) return false;
  // A solid of another mass has an inertia that goes with it.
  if (cause.fault.kind == CorrectionKind::kWithMass) return number.kind == Kind::kMass;
  if (cause.fault.whole) return IsOfBody(cause.fault.of) == IsOfBody(*site);
  return cause.fault.of == *site;
}

MutatedPair::MutatedPair(const DescriptionFile& first, const DescriptionFile& second)
    : robot(first.Describe()),
      model(robot.spec),
      engine(second.CopyEngine()),
      source(second.path().string()) {
  PrintedRobot printed = ReadPrintedRobot(second);
  LeaveOutUnstated({}, &printed);
  TakeAsExact(&printed);
  if (FindCauses(PrintExactly(robot), printed).agrees) reference = std::move(printed);
}

void TryMutant(const MutatedPair& pair, const MutationOptions& options, Mutant* mutant) {
  RobotDescription changed = pair.robot;
  mutant->change(&changed.spec);
  const std::optional<RobotModel> model = TryModel(changed.spec);
  if (!model) {
    mutant->outcome = MutantOutcome::kRefused;
    return;
  }
  ConsistencyOptions check;
  check.samples = options.samples;
  check.seed = options.seed;
  const ConsistencyResult result =
      CheckConsistency(Adapter(*model, *pair.engine, pair.source), check, [](long) { return true; });
  AddFailed(result.constants.records, &mutant->failed_checks);
  AddFailed(result.terms, &mutant->failed_checks);
  if (result.Agrees()) {
    AnalyticProvider other(*model, "changed", pair.model);
    const bool has_effect = HasEffect(pair.model, &other, options.samples, options.seed);
    mutant->outcome = has_effect ? MutantOutcome::kSurvived : MutantOutcome::kNoEffect;
    return;
  }
  mutant->outcome = MutantOutcome::kKilled;
  if (!options.diagnose || !pair.reference) return;
  const FileCauses found = FindCauses(PrintExactly(changed), *pair.reference);
  if (found.items.empty()) return;
  const CorrectionItem& first = found.items.front();
  const auto names = [&](const CorrectionItem& item) {
    return IsNamedBy(changed.spec, mutant->number, item);
  };
  mutant->named = first.text;
  mutant->explained = first.explained;
  mutant->named_first = names(first);
  mutant->named_equal = std::ranges::any_of(first.rivals, names);
}

}  // namespace dexcheck
