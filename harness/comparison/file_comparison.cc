#include "harness/comparison/file_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/comparison/constant_checks.h"
#include "harness/comparison/description_match.h"
#include "harness/comparison/engine_constants.h"
#include "harness/comparison/engine_contacts.h"
#include "harness/comparison/engine_parts.h"
#include "harness/corrections/read_printed.h"
#include "harness/descriptions/alike_names.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/engine_provider.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/result_files.h"
#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine.h"

namespace dexcheck {

namespace {

/// Notes the joints of a scene that are no part of the robot.
void NoteOthers(const Adapter& adapter, Comparison* comparison) {
  std::vector<std::string> names;
  for (const int joint : adapter.other_joints())
    names.push_back(NameOf(adapter.engine(), mjOBJ_JOINT, joint));
  if (!names.empty()) {
    comparison->not_compared.push_back("not connected to the robot: joints " + JoinNames(names));
  }
}

bool IsOfFrames(const std::string& term) { return term == "frame_pose" || term == "J" || term == "J_dot_xi"; }

/// A term of which no number was compared is no agreement.
void NoteTermsOfFrames(Comparison* comparison) {
  std::vector<std::string> names = comparison->result.not_compared;
  std::erase_if(names, [](const std::string& name) { return !IsOfFrames(name); });
  if (!names.empty())
    comparison->not_compared.push_back("terms of frames, because the two share no frame: " +
                                       JoinNames(names));
}

/// Widens bounds by roundings that the table of terms does not count: kStep for each step along a chain, of
/// both sides together, and kRotation for a rotation on one side.
/// - A table that dexcheck import wrote has for each row a product of three transforms, the decomposition
/// into three angles (one more product), and their composition when it is read (two): six rotations in all.
/// Its angles are short decimals, each within 8 pi eps (FormatTidy).
/// - A link's frame is placed by both chains at zero, with as many roundings again.
void CountRoundings(int imported, bool has_link_frames, std::vector<CheckRecord>* records, int held = 0) {
  constexpr double kStep = 16.0;
  constexpr double kRotation = 8.0;
  constexpr double kImport = 6.0 * kRotation + 3.0 * 8.0 * kPi;
  for (CheckRecord& record : *records) {
    record.bound *=
        (1.0 + held + imported * kImport / kStep) * (has_link_frames && IsOfFrames(record.name) ? 2.0 : 1.0);
    record.failed = !(record.worst <= record.bound);
  }
}

bool IsMechanism(const RobotDescription& robot) {
  const BaseType base = robot.spec.base.type;
  return (base == BaseType::kFixed || base == BaseType::kFloating) && !robot.spec.object;
}

/// The robots of two files, brought to the same statements.
struct FilePair {
  RobotDescription first;
  /// None where only the adapter finds the first robot in the second file's engine: a robot on wheels or with
  /// an object, and a parameter file of another mechanism.
  std::optional<RobotDescription> second;
  Completion completion;
};

/// @param engine the second file's; null where it is compared as a description.
FilePair Complete(const DescriptionFile& first, const DescriptionFile& second, const mjModel* engine,
                  const ConsistencyOptions& options, Comparison* comparison) {
  const std::string file = second.path().filename().string();
  FilePair pair{first.Describe(), {}, {}};
  if (engine == nullptr || IsMechanism(pair.first)) {
    try {
      std::array<RobotDescription, 2> sides = {
          pair.first, engine == nullptr ? second.Describe() : ReadMjcfDescription(*engine, file)};
      pair.completion = CompletePair(options.ignore, options.part, &sides);
      if (engine != nullptr) {
        const auto inertias = TakeCompiledInertias(second.document(), *engine, &sides[0]);
        if (inertias) comparison->notes.push_back(*inertias);
      }
      pair.first = std::move(sides[0]);
      pair.second = std::move(sides[1]);
      return pair;
    } catch (const InputError&) {
      if (engine == nullptr || first.format() != RobotFormat::kToml) throw;
    }
  }
  if (engine != nullptr) pair.completion = CompleteTable(*engine, file, &pair.first, options.ignore);
  return pair;
}

/// Compares motors and wheels with an engine's, and names the changes that compilers of MJCFs made.
/// @param robots with the names of joints of the second.
void CompareBesideEngine(const std::array<const DescriptionFile*, 2>& files,
                         const std::array<const RobotDescription*, 2>& robots, Comparison* comparison) {
  ConstantChecks& constants = comparison->result.constants;
  const bool has_motors = std::ranges::any_of(
      constants.findings, [](const ConstantFinding& finding) { return finding.check == "motor_limit"; });
  if (!has_motors) CheckMotorsAndWheels(*robots[0], *robots[1], &constants);
  for (const size_t side : {0U, 1U}) {
    if (files[side]->format() != RobotFormat::kMjcf) continue;
    NameCompiledChanges(ListCompiledChanges(files[side]->document(), *files[side]->CopyEngine()), robots,
                        side, &constants, &comparison->notes);
  }
}

/// Lists the parts that the first of two MJCFs has besides its mechanism, notes what else the two have, and
/// takes parts that both have out of the second one. @param names of the first file's joints in the second.
std::vector<EnginePart> ListFirstParts(const DescriptionFile& first, const std::vector<std::string>& names,
                                       mjModel* engine, EngineParts* parts, Comparison* comparison) {
  const MjModelPtr own_engine = first.CopyEngine();
  const RobotDescription described = first.Describe();
  const RobotModel model(described.spec);
  EngineParts own = ListEngineParts(Adapter(model, *own_engine, first.path().string()), {false, true});
  const std::string file = first.path().filename(), other = comparison->second.filename();
  const std::vector<std::string> own_names = ListJointNames(described);
  for (EnginePart& part : own.parts) {
    for (std::string& target : part.acts_on) {
      const auto at = static_cast<size_t>(std::ranges::find(own_names, target) - own_names.begin());
      if (part.kind == PartKind::kActuator && at < own_names.size() && own_names.size() == names.size())
        target = names[at];
    }
  }
  MatchMotors(own.parts, &parts->parts);
  comparison->without_effect = CompareOptions(own_engine->opt, engine->opt, file, other);
  Append(CompareContacts(own.notes, parts->notes), &comparison->without_effect);
  Append(CompareRunElements(*own_engine, *engine), &comparison->without_effect);
  Append(CompareMotorOrder(own.parts, parts->parts, file, other), &comparison->without_effect);
  Append(ListLoneMotors(own.parts, parts->parts, file, other), &comparison->not_compared);
  Append(LeaveOutShared(own.parts, parts->parts, *own_engine, engine), &comparison->not_compared);
  return std::move(own.parts);
}

/// Compares a description's constants with those of an engine's model, and takes out of it what both have.
ConstantChecks CompareEngineConstants(const DescriptionFile& first, const FilePair& pair,
                                      const ConsistencyOptions& options, const Adapter& adapter,
                                      mjModel* engine, Comparison* comparison) {
  const std::string file = comparison->second.filename().string();
  EngineParts parts = ListEngineParts(
      adapter, {first.format() == RobotFormat::kUrdf, true, Contains(options.ignore, "coupling")});
  if (!parts.motors.empty())
    comparison->not_compared.push_back("motors: only " + file +
                                       " says how they make their forces (servos, muscles, transmissions, "
                                       "gears): " +
                                       JoinNames(parts.motors));
  FirstFile stated{true, pair.second ? &pair.first : nullptr, options.ignore, file};
  if (first.format() == RobotFormat::kMjcf)
    stated.parts = ListFirstParts(first, ListJointNames(pair.first), engine, &parts, comparison);
  ConstantChecks constants = CheckConstants(adapter, parts, stated);
  Append(constants.not_compared, &comparison->not_compared);
  return constants;
}

/// Compares constants and terms. The second file's are the engine's where it has one.
void CompareTwo(const DescriptionFile& first, const DescriptionFile& second, const UrdfOptions& urdf,
                const ConsistencyOptions& options, const Progress& progress, Comparison* comparison) {
  const MjModelPtr engine = comparison->with_engine ? second.CopyEngine() : nullptr;
  const FilePair pair = Complete(first, second, engine.get(), options, comparison);
  const RobotDescription& robot = pair.first;
  const Completion& completion = pair.completion;
  const RobotModel& model = comparison->model.emplace(robot.spec);
  AnalyticProvider of_first(model, robot.spec.source, options.make_view, options.object);
  std::optional<Adapter> adapter;
  std::optional<RobotModel> other_model;
  std::unique_ptr<DynamicsProvider> of_second;
  ConstantChecks constants;
  if (engine) {
    adapter.emplace(model, *engine, second.path().string());
    constants = CompareEngineConstants(first, pair, options, *adapter, engine.get(), comparison);
    of_second = std::make_unique<EngineProvider>(*adapter, "engine");
  } else {
    constants = CheckConstants(robot, *pair.second);
    other_model.emplace(pair.second->spec);
    of_second = std::make_unique<AnalyticProvider>(*other_model, pair.second->spec.source, model);
  }
  comparison->result = CompareTerms(model, &of_first, of_second.get(), options, progress);
  comparison->result.constants = std::move(constants);
  // A held joint is a step of its chain that the model no longer has.
  const int imported = (robot.is_imported ? 1 : 0) + (pair.second && pair.second->is_imported ? 1 : 0);
  CountRoundings(imported, completion.has_link_frames, &comparison->result.terms, completion.held);
  // Each shape of two MJCFs that can touch was compared, and what the notes of one concern.
  const bool is_whole = engine && first.format() == RobotFormat::kMjcf;
  const std::optional<RobotDescription>& other = engine ? comparison->read_second : pair.second;
  if (other) {
    Append(CompareWithoutEffect(robot, *other), &comparison->without_effect);
    if (!is_whole) Append(CompareShapes(robot, *other), &comparison->without_effect);
    if (engine) CompareBesideEngine({&first, &second}, {&robot, &*other}, comparison);
  }
  if (!is_whole) Append(robot.notes, &comparison->notes);
  if (!engine) Append(pair.second->notes, &comparison->notes);
  Append(completion.notes, &comparison->notes);
  Append(completion.not_compared, &comparison->not_compared);
  if (adapter) NoteOthers(*adapter, comparison);
  comparison->digits = JudgeByDigits({&first, &second}, urdf, options, &of_first, of_second.get(), model,
                                     options.part, &comparison->result);
}

/// Gives joints the limits of `actuatorfrcrange`, a word of later engines, where motors state none, or where
/// both files have them.
void LimitEfforts(const DescriptionFile& file, const DescriptionFile& other, PrintedRobot* robot) {
  constexpr double kDigits = 1e-7;
  for (PrintedLink& link : robot->links) {
    std::optional<PrintedScalar>& effort = link.joint.scalars[static_cast<size_t>(JointScalar::kEffort)];
    const auto range = file.force_ranges().find(link.joint.name);
    const bool counts = !effort || other.force_ranges().contains(link.joint.name);
    if (range != file.force_ranges().end() && counts && !(effort && effort->value < range->second))
      effort = PrintedScalar{range->second, kDigits * range->second};
  }
}

/// The causes of the differences between two mechanisms.
std::optional<FileCauses> TryToExplain(const DescriptionFile& a, const DescriptionFile& b,
                                       const ConsistencyOptions& options, Comparison* comparison) {
  const auto is_mechanism = [](const auto& robot) { return robot && IsMechanism(*robot); };
  const bool has_bodies = a.format() == RobotFormat::kBodies || b.format() == RobotFormat::kBodies;
  if (has_bodies || !options.part.empty() || !is_mechanism(comparison->read_first) ||
      !is_mechanism(comparison->read_second))
    return std::nullopt;
  PrintedRobot first = ReadPrintedRobot(a);
  PrintedRobot second = ReadPrintedRobot(b);
  LimitEfforts(a, b, &first);
  LimitEfforts(b, a, &second);
  LeaveOutUnstated(options.ignore, &first);
  LeaveOutUnstated(options.ignore, &second);
  const bool are_urdfs = first.format == RobotFormat::kUrdf && second.format == RobotFormat::kUrdf;
  if (are_urdfs && first.has_motors != second.has_motors)
    comparison->not_compared.push_back("transmissions: only " + (first.has_motors ? first : second).source +
                                       " has any");
  return FindCauses(first, second);
}

/// Adds to each cause the effect of its constant on the motion, or the compiler's setting that made it.
void AddEffects(const ConstantChecks& constants, FileCauses* causes) {
  for (CorrectionItem& cause : causes->items) {
    const auto finding = std::ranges::find_if(constants.findings, [&](const ConstantFinding& one) {
      const auto is_there = [&](const std::string& place) {
        return (one.where + " ").starts_with(place + " ");
      };
      return !one.effect.empty() && IsExplained(one.check, cause) &&
             std::ranges::any_of(cause.places, is_there);
    });
    if (finding != constants.findings.end()) cause.text += "; " + finding->effect;
  }
}

/// Whether causes are fewer than two robots would have, and at most half of the joints have no partner.
bool IsOneRobot(const FileCauses& causes, const RobotDescription& robot) {
  constexpr size_t kFew = 3;
  size_t lonely = 0;
  for (const CorrectionItem& item : causes.items)
    lonely += static_cast<size_t>(std::ranges::count(item.sites, SiteKind::kPresence, &Site::kind));
  const size_t joints = robot.spec.joints.size();
  return !causes.agrees && 2 * lonely <= joints &&
         causes.items.size() + causes.unexplained.size() <= Worst(kFew, joints);
}

}  // namespace

void Comparison::JudgeByTolerance(double tolerance) {
  dexcheck::JudgeByTolerance(tolerance, &result.constants);
  dexcheck::JudgeByTolerance(tolerance, &result.terms);
  if (!causes) return;
  const auto fails = [&](const char* name) {
    return std::ranges::any_of(result.terms,
                               [&](const CheckRecord& check) { return check.name == name && check.failed; });
  };
  const bool moves_wrong = fails("joint_axis") || fails("frame_pose") || fails("J");
  LeaveOutWithin(
      tolerance,
      [&](SiteKind kind) {
        if (kind == SiteKind::kCom) return fails("link_com");
        if (kind == SiteKind::kInertia) return fails("link_inertia");
        const bool is_place = kind == SiteKind::kPosition || kind == SiteKind::kRotation ||
                              kind == SiteKind::kAxis || kind == SiteKind::kAxisPoint;
        return !is_place || moves_wrong;
      },
      &*causes);
  if (result.Agrees()) causes.reset();
}

Comparison CompareFiles(const std::filesystem::path& a, const std::filesystem::path& b,
                        const UrdfOptions& urdf, const ConsistencyOptions& options,
                        const Progress& progress) {
  DescriptionFile first(a, urdf);
  DescriptionFile second(b, urdf);
  return CompareFiles(&first, &second, urdf, options, progress);
}

Comparison CompareFiles(DescriptionFile* a, DescriptionFile* b, const UrdfOptions& urdf,
                        const ConsistencyOptions& options, const Progress& progress) {
  // Terms of an MJCF are the engine's; bodies of a table are those that a file was made from.
  const DescriptionFile& user_first = *a;
  const DescriptionFile& user_second = *b;
  const auto rank = [](const DescriptionFile& file) {
    return file.format() == RobotFormat::kBodies ? 2 : file.format() == RobotFormat::kMjcf ? 1 : 0;
  };
  if (rank(*a) > rank(*b)) std::swap(a, b);
  const DescriptionFile& first = *a;
  DescriptionFile& second = *b;
  if (second.format() == RobotFormat::kBodies) second.PlaceOn(first.Describe());
  Comparison comparison;
  comparison.first = first.path();
  comparison.second = second.path();
  const bool is_mjcf = second.format() == RobotFormat::kMjcf;
  comparison.with_engine = is_mjcf && options.part.empty();
  if (is_mjcf && !comparison.with_engine)
    comparison.notes.push_back("part of a robot: the terms of " + second.path().filename().string() +
                               " are computed by the analytic model from what MuJoCo compiled; an MJCF's "
                               "other contents are not compared");
  comparison.read_first = first.TryToDescribe();
  comparison.read_second = second.TryToDescribe();
  try {
    CompareTwo(first, second, urdf, options, progress, &comparison);
  } catch (const InputError& error) {
    if (!comparison.read_first || !comparison.read_second || !options.part.empty()) throw;
    // Names that were exchanged, a joint that one file lacks and a joint of another type make another
    // mechanism of one robot.
    comparison.causes = TryToExplain(user_first, user_second, options, &comparison);
    if (!comparison.causes || !IsOneRobot(*comparison.causes, *comparison.read_first)) throw;
    comparison.model.emplace(comparison.read_first->spec);
    comparison.not_compared.push_back(std::string("terms: ") + error.what());
    return comparison;
  }
  comparison.causes = TryToExplain(user_first, user_second, options, &comparison);
  if (comparison.causes) AddEffects(comparison.result.constants, &*comparison.causes);
  NoteTermsOfFrames(&comparison);
  return comparison;
}

double CalcTolerance(const ConsistencyResult& result) {
  constexpr double kOtherRates = 4.0;  // states of a run over the states that are compared
  double worst = 0.0;
  for (const auto* records : {&result.constants.records, &result.terms}) {
    for (const CheckRecord& record : *records) {
      if (record.worst > record.bound) worst = Worst(worst, record.worst);
    }
  }
  if (worst == 0.0) return 0.0;
  const double unit = std::pow(10.0, std::floor(std::log10(kOtherRates * worst)));
  return std::ceil(kOtherRates * worst / unit) * unit;
}

namespace {

/// A description whose terms stand first: the analytic model's, or of an MJCF the engine's.
struct Reference {
  Reference(const DescriptionFile& file, Comparison* comparison) : robot(file.Describe()) {
    comparison->first = file.path();
    comparison->notes = robot.notes;
    comparison->model.emplace(robot.spec);
    if (file.format() == RobotFormat::kMjcf) {
      provider =
          std::make_unique<EngineProvider>(robot.spec, file.CopyEngine(), file.path().string(), "MuJoCo");
    } else {
      provider = std::make_unique<AnalyticProvider>(*comparison->model, file.path().filename().string());
    }
  }
  RobotDescription robot;
  std::unique_ptr<DynamicsProvider> provider;
};

/// Notes the convention of the base where the other side chose it.
void NoteConvention(const Reference& reference, LayoutProvider* provider,
                    const std::function<StateFeed()>& make_feed, Comparison* comparison) {
  if (!provider->layout().is_floating()) return;
  comparison->notes.push_back("the other side's base is taken as " +
                              Describe(provider->layout().convention()));
  if (comparison->result.Agrees()) return;
  const std::optional<BaseConvention> other =
      FindOtherConvention(*comparison->model, reference.provider.get(), provider, make_feed);
  if (!other) return;
  comparison->notes.push_back("all its terms agree with its base taken as " + Describe(*other) +
                              ": this is its convention, and its key \"base\" can say so");
}

}  // namespace

Comparison CompareResults(const std::filesystem::path& file, const ResultsSource& source,
                          const UrdfOptions& urdf, const ConsistencyOptions& options,
                          const Progress& progress) {
  Comparison comparison;
  const Reference reference(DescriptionFile(file, urdf), &comparison);
  std::unique_ptr<LayoutProvider> provider;
  std::function<StateFeed()> make_feed = [&] { return FeedRandomStates(*comparison.model, options); };
  if (source.results.empty()) {
    comparison.second = "the program";
    provider = std::make_unique<ProgramProvider>(source.program, reference.robot, source.program_options);
  } else {
    comparison.second = source.results;
    auto results = std::make_unique<ResultFiles>(source.results, reference.robot);
    make_feed = [&read = *results] {
      return [&read](DynamicsState* state) { return read.ReadState(state); };
    };
    provider = std::move(results);
  }
  Append(DescribeCoordinates(reference.robot), &comparison.notes);
  comparison.result =
      CompareProviders(*comparison.model, reference.provider.get(), provider.get(), make_feed(), progress);
  if (!comparison.result.not_compared.empty())
    comparison.not_compared.push_back("terms without results: " + JoinNames(comparison.result.not_compared));
  if (provider->is_reduced()) {
    comparison.notes.push_back(
        "joints that follow others have no coordinate there: compared are T^T M T and T^T of the "
        "forces, with xi = T xi_free");
  }
  NoteConvention(reference, provider.get(), make_feed, &comparison);
  return comparison;
}

Comparison CompareFunctions(const std::filesystem::path& file, const TermFunctions& functions,
                            const UrdfOptions& urdf, const ConsistencyOptions& options) {
  if (!functions.M && !functions.c && !functions.g && !functions.h && !functions.friction) {
    throw InputError(functions.name + ": must have one of M, c, g, h, friction");
  }
  Comparison comparison;
  const Reference reference(DescriptionFile(file, urdf), &comparison);
  comparison.second = functions.name;
  FunctionProvider provider(functions, comparison.model->num_velocities());
  comparison.result =
      CompareProviders(*comparison.model, reference.provider.get(), &provider,
                       FeedRandomStates(*comparison.model, options), [](long) { return true; });
  return comparison;
}

}  // namespace dexcheck
