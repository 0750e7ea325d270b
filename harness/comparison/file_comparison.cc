#include "harness/comparison/file_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/comparison/body_comparison.h"
#include "harness/comparison/description_match.h"
#include "harness/comparison/engine_constants.h"
#include "harness/comparison/engine_contacts.h"
#include "harness/comparison/engine_parts.h"
#include "harness/corrections/read_printed.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/engine_provider.h"
#include "harness/descriptions/link_frame_tree.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/result_files.h"
#include "harness/engine/engine.h"

namespace dexcheck {
namespace {

void AppendTo(std::vector<std::string>* notes, const std::vector<std::string>& more) {
  notes->insert(notes->end(), more.begin(), more.end());
}

/// Notes the joints of a scene that are no part of the robot.
void NoteOthers(const Adapter& adapter, Comparison* comparison) {
  std::vector<std::string> names;
  for (const int joint : adapter.other_joints())
    names.push_back(NameOf(adapter.engine(), mjOBJ_JOINT, joint));
  if (!names.empty()) {
    comparison->not_compared.push_back("no part of the robot, since nothing joins them to it: joints " +
                                       JoinNames(names));
  }
}

bool IsOfFrames(const std::string& term) { return term == "frame_pose" || term == "J" || term == "J_dot_xi"; }

/// A term of which no number was compared is no agreement.
void NoteTermsOfFrames(Comparison* comparison) {
  std::vector<std::string> names = comparison->result.not_compared;
  std::erase_if(names, [](const std::string& name) { return !IsOfFrames(name); });
  if (!names.empty())
    comparison->not_compared.push_back("terms of frames, since the two have none in common: " +
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

/// Changes that bring a description and an engine's model together.
struct EngineCompletion {
  Completion completion;
  bool has_link_frames = false;
  bool states_all = false;  ///< A table whose constants were not completed.
};

/// Completes a description, and gives it frames of links and the inertias that the engine compiled. A robot
/// on wheels, one with an object, and a parameter file of another mechanism are left to the adapter.
EngineCompletion Complete(const ConsistencyOptions& options, const MjcfFile& mjcf, const mjModel& engine,
                          bool is_table, Comparison* comparison, RobotDescription* robot) {
  const std::string file = comparison->second.filename().string();
  const BaseType base = robot->spec.base.type;
  EngineCompletion result;
  if ((base == BaseType::kFixed || base == BaseType::kFloating) && !robot->spec.object) {
    RobotDescription completed = *robot;
    try {
      result.completion = CompleteFromEngine(engine, file, &completed, options.ignore);
      RobotDescription compiled = ReadMjcfDescription(engine, file);
      result.has_link_frames = AddLinkFrames(&completed, &compiled);
      const std::optional<std::string> inertias = TakeCompiledInertias(mjcf, engine, &completed);
      if (inertias) comparison->notes.push_back(*inertias);
      *robot = std::move(completed);
      return result;
    } catch (const InputError&) {
      if (!is_table) throw;
    }
  }
  result.completion = CompleteFromEngine(engine, file, robot, options.ignore, is_table);
  result.states_all = is_table;
  return result;
}

/// Notes joints whose actuatorfrcrange, a word of later engines, is not the limit that the other file states.
void NoteForceRanges(const DescriptionFile& file, const RobotDescription& other, Comparison* comparison) {
  std::vector<std::string> names;
  for (size_t i = 0; i < other.joints.size(); ++i) {
    const auto range = file.force_ranges().find(other.spec.joints[i].name);
    const std::optional<StatedForces>& forces = other.joints[i].forces;
    if (forces && range != file.force_ranges().end() && range->second != forces->upper)
      names.push_back(
          fmt::format("{}: {:.6g} here, {:.6g} there", range->first, range->second, forces->upper));
  }
  if (!names.empty())
    comparison->without_effect.push_back("actuatorfrcrange of " + file.path().filename().string() + ": " +
                                         JoinNames(names));
}

/// Compares motors, wheels and shapes, and names the changes that compilers of MJCFs made.
/// @param robot the first description, with the second's names.
void CompareBeside(const DescriptionFile& first, const RobotDescription& robot, const DescriptionFile& second,
                   Comparison* comparison) {
  ConstantChecks& constants = comparison->result.constants;
  const RobotDescription& other = *comparison->read_second;
  const bool has_motors = std::ranges::any_of(
      constants.findings, [](const ConstantFinding& finding) { return finding.check == "motor_limit"; });
  if (!has_motors) CheckMotorsAndWheels(robot, other, &constants);
  AppendTo(&comparison->without_effect, CompareWithoutEffect(robot, other));
  // Each shape of two MJCFs that can touch was compared.
  if (first.format() != RobotFormat::kMjcf)
    AppendTo(&comparison->without_effect, CompareShapes(robot, other));
  for (const size_t side : {0U, 1U}) {
    const DescriptionFile& file = side == 0 ? first : second;
    NoteForceRanges(file, side == 0 ? other : robot, comparison);
    if (file.format() != RobotFormat::kMjcf) continue;
    NameCompiledChanges(ListCompiledChanges(file.document(), *file.CopyEngine()), {&robot, &other}, side,
                        &constants, &comparison->notes);
  }
}

/// Lists the parts that the first of two MJCFs has besides its mechanism, notes what else the two have, and
/// takes parts that both have out of the second one.
std::vector<EnginePart> ListFirstParts(const DescriptionFile& first, const RobotDescription& written,
                                       const EngineParts& parts, mjModel* engine, Comparison* comparison) {
  const MjModelPtr own_engine = first.CopyEngine();
  const RobotModel model(written.spec);
  EngineParts own = ListEngineParts(Adapter(model, *own_engine, first.path().string()), {false, true});
  const std::string file = first.path().filename(), other = comparison->second.filename();
  comparison->without_effect = CompareOptions(own_engine->opt, engine->opt, file, other);
  AppendTo(&comparison->without_effect, CompareContacts(own.notes, parts.notes));
  AppendTo(&comparison->not_compared, ListLoneMotors(own.parts, parts.parts, file, other));
  AppendTo(&comparison->not_compared, LeaveOutShared(own.parts, parts.parts, *own_engine, engine));
  return std::move(own.parts);
}

/// Compares a description with the engine.
void CompareWithEngine(const DescriptionFile& first, const DescriptionFile& second, const UrdfOptions& urdf,
                       const ConsistencyOptions& options, const Progress& progress, Comparison* comparison) {
  const std::string file = comparison->second.filename().string();
  const RobotDescription written = first.Describe();
  RobotDescription robot = written;
  const MjModelPtr engine = second.CopyEngine();
  const RobotFormat format = first.format();
  const EngineCompletion completed =
      Complete(options, second.document(), *engine, format == RobotFormat::kToml, comparison, &robot);
  const Completion& completion = completed.completion;
  comparison->model.emplace(robot.spec);
  const Adapter adapter(*comparison->model, *engine, comparison->second.string());
  const EngineParts parts =
      ListEngineParts(adapter, {format == RobotFormat::kUrdf, true, Ignores("coupling", options.ignore)});
  if (!parts.motors.empty())
    comparison->not_compared.push_back("motors: only " + file +
                                       " says how they make their forces (servos, muscles, transmissions, "
                                       "gears): " +
                                       JoinNames(parts.motors));
  FirstFile stated{true, completed.states_all ? nullptr : &robot, options.ignore, file};
  if (format == RobotFormat::kMjcf)
    stated.parts = ListFirstParts(first, written, parts, engine.get(), comparison);
  comparison->result = CompareTermsWithEngine(adapter, options, progress);
  CountRoundings(robot.is_imported ? 1 : 0, completed.has_link_frames, &comparison->result.terms);
  ConstantChecks& constants = comparison->result.constants;
  constants = CheckConstants(adapter, parts, stated);
  AppendTo(&comparison->not_compared, constants.not_compared);
  if (comparison->read_second) CompareBeside(first, robot, second, comparison);
  // The notes of an MJCF concern quantities that CompareParts compares.
  if (format != RobotFormat::kMjcf) AppendTo(&comparison->notes, robot.notes);
  AppendTo(&comparison->not_compared, completion.not_compared);
  AppendTo(&comparison->notes, completion.notes);
  NoteOthers(adapter, comparison);
  AnalyticProvider model(adapter.model(), "model", options.make_view, options.object);
  EngineProvider of_engine(adapter, "engine");
  comparison->digits = JudgeByDigits({&first, &second}, urdf, options, &model, &of_engine, *comparison->model,
                                     {}, &comparison->result);
}

/// Compares two descriptions without the engine.
void CompareTwoDescriptions(const DescriptionFile& first, const DescriptionFile& second,
                            const UrdfOptions& urdf, const ConsistencyOptions& options,
                            const Progress& progress, Comparison* comparison) {
  const RobotPart& part = options.part;
  RobotDescription a = first.Describe();
  RobotDescription b = second.Describe();
  int held = 0;
  if (!part.empty()) {
    AppendTo(&comparison->not_compared, TakePart(part, &a, &b, &held));
    comparison->read_first = a;
    comparison->read_second = b;
  }
  const Completion completion = CompleteEachOther(&a, &b, options.ignore);
  for (const auto& notes : {a.notes, b.notes, completion.notes}) {
    AppendTo(&comparison->notes, notes);
  }
  AppendTo(&comparison->not_compared, completion.not_compared);
  const bool has_link_frames = AddLinkFrames(&a, &b);
  comparison->model.emplace(a.spec);
  comparison->result = CompareDescriptions(a, b, options, progress);
  // A held joint is a step of its chain that the model no longer has.
  CountRoundings((a.is_imported ? 1 : 0) + (b.is_imported ? 1 : 0), has_link_frames,
                 &comparison->result.terms, held);
  AppendTo(&comparison->without_effect, CompareWithoutEffect(a, b));
  AppendTo(&comparison->without_effect, CompareShapes(a, b));
  const RobotModel other(b.spec);
  AnalyticProvider of_a(*comparison->model, a.spec.source);
  AnalyticProvider of_b(other, b.spec.source, *comparison->model);
  comparison->digits = JudgeByDigits({&first, &second}, urdf, options, &of_a, &of_b, *comparison->model, part,
                                     &comparison->result);
}

/// Compares a part of two robots. An MJCF's terms are the analytic model's with MuJoCo's numbers.
void ComparePart(const DescriptionFile& first, const DescriptionFile& second, const UrdfOptions& urdf,
                 const ConsistencyOptions& options, const Progress& progress, Comparison* comparison) {
  comparison->with_engine = false;
  if (second.format() == RobotFormat::kMjcf)
    comparison->notes.push_back("part of a robot: the terms of " + second.path().filename().string() +
                                " are those of what MuJoCo compiled, by the analytic model; what an MJCF has "
                                "besides the mechanism is not compared");
  CompareTwoDescriptions(first, second, urdf, options, progress, comparison);
}

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

/// The causes of the differences between two mechanisms.
std::optional<FileCauses> TryToExplain(const DescriptionFile& a, const DescriptionFile& b,
                                       const ConsistencyOptions& options, const Comparison& comparison) {
  const auto is_mechanism = [](const std::optional<RobotDescription>& robot) {
    return robot && !robot->spec.object &&
           (robot->spec.base.type == BaseType::kFixed || robot->spec.base.type == BaseType::kFloating);
  };
  const bool has_bodies = a.format() == RobotFormat::kBodies || b.format() == RobotFormat::kBodies;
  if (has_bodies || !options.part.empty() || !is_mechanism(comparison.read_first) ||
      !is_mechanism(comparison.read_second))
    return std::nullopt;
  PrintedRobot first = ReadPrintedRobot(a);
  PrintedRobot second = ReadPrintedRobot(b);
  LeaveOutUnstated(options.ignore, &first);
  LeaveOutUnstated(options.ignore, &second);
  return FindCauses(first, second);
}

/// Adds to each cause the effect of its constant on the motion, or the compiler's setting that made it.
void AddEffects(const ConstantChecks& constants, FileCauses* causes) {
  for (size_t i = 0; i < causes->causes.size(); ++i) {
    FileCause& cause = causes->causes[i];
    const auto finding = std::ranges::find_if(constants.findings, [&](const ConstantFinding& one) {
      const auto is_there = [&](const std::string& place) {
        return (one.where + " ").starts_with(place + " ");
      };
      return !one.effect.empty() && IsExplained(one.check, causes->corrections.items[i]) &&
             std::ranges::any_of(cause.places, is_there);
    });
    if (finding != constants.findings.end()) cause.text += "; " + finding->effect;
  }
}

/// Whether causes are fewer than two robots would have, and at most half of the joints have no partner.
bool IsOneRobot(const FileCauses& causes, const RobotDescription& robot) {
  constexpr size_t kFew = 3;
  size_t lonely = 0;
  for (const CorrectionItem& item : causes.corrections.items)
    lonely += static_cast<size_t>(std::ranges::count(item.sites, SiteKind::kPresence, &Site::kind));
  const size_t joints = robot.spec.joints.size();
  return !causes.agrees && 2 * lonely <= joints &&
         causes.causes.size() + causes.unexplained.size() <= Worst(kFew, joints);
}

}  // namespace

void Comparison::JudgeByTolerance(double tolerance) {
  dexcheck::JudgeByTolerance(tolerance, &result);
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
  comparison.with_engine = second.format() == RobotFormat::kMjcf;
  comparison.read_first = first.TryToDescribe();
  comparison.read_second = second.TryToDescribe();
  try {
    if (!options.part.empty()) {
      ComparePart(first, second, urdf, options, progress, &comparison);
    } else if (comparison.with_engine) {
      CompareWithEngine(first, second, urdf, options, progress, &comparison);
    } else {
      CompareTwoDescriptions(first, second, urdf, options, progress, &comparison);
    }
  } catch (const InputError& error) {
    if (!comparison.read_first || !comparison.read_second || !options.part.empty()) throw;
    // Names that were exchanged, a joint that one file lacks and a joint of another type make another
    // mechanism of one robot.
    comparison.causes = TryToExplain(user_first, user_second, options, comparison);
    if (!comparison.causes || !IsOneRobot(*comparison.causes, *comparison.read_first)) throw;
    comparison.model.emplace(comparison.read_first->spec);
    comparison.not_compared.push_back(std::string("terms: ") + error.what());
    return comparison;
  }
  comparison.causes = TryToExplain(user_first, user_second, options, comparison);
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
  AppendTo(&comparison.notes, DescribeCoordinates(reference.robot));
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
