#include "harness/sides/file_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "harness/engine/engine.h"
#include "harness/sides/complete_description.h"
#include "harness/sides/description_check.h"
#include "harness/sides/description_match.h"
#include "harness/sides/engine_extras.h"
#include "harness/sides/join_names.h"
#include "harness/sides/model_comparison.h"
#include "harness/sides/read_description.h"
#include "harness/sides/robot_file.h"

namespace dexcheck {
namespace {

using Progress = std::function<bool(long)>;

void AppendTo(std::vector<std::string>* notes, const std::vector<std::string>& more) {
  notes->insert(notes->end(), more.begin(), more.end());
}

/// What moves in a scene and is no part of the robot.
void NoteOthers(const Adapter& adapter, std::vector<std::string>* notes) {
  std::vector<std::string> names;
  for (const int joint : adapter.other_joints())
    names.push_back(NameOf(adapter.engine(), mjOBJ_JOINT, joint));
  if (!names.empty())
    notes->push_back("no part of the robot, since nothing joins them to it: joints " + JoinNames(names));
}

/// A parameter file against the engine.
void CompareTableWithEngine(const ConsistencyOptions& options, const Progress& progress,
                            Comparison* comparison) {
  const RobotDescription table = ReadDescription(comparison->first);
  comparison->model.emplace(table.spec);
  const MjModelPtr engine = LoadMjcf(comparison->second);
  const Adapter adapter(*comparison->model, *engine, comparison->second.string());
  comparison->result = CheckConsistency(adapter, options, progress);
  AppendTo(&comparison->notes, CheckDescription(table, adapter, &comparison->result.gate));
  NoteOthers(adapter, &comparison->notes);
  AppendTo(&comparison->notes, DescribeCoordinates(table));
}

/// A URDF, or another MJCF, against the engine.
void CompareDescriptionWithEngine(const UrdfOptions& urdf, const ConsistencyOptions& options,
                                  const Progress& progress, Comparison* comparison) {
  RobotDescription robot = ReadDescription(comparison->first, urdf);
  const RobotDescription written = robot;
  const MjModelPtr engine = LoadMjcf(comparison->second);
  const bool is_mjcf = FindFormat(comparison->first) == RobotFormat::kMjcf;
  if (!is_mjcf) {
    const std::optional<std::string> motors =
        SetAsideMotors(comparison->second.filename().string(), engine.get());
    if (motors) robot.notes.push_back(*motors);
  }
  Completion completion = CompleteFromEngine(*engine, comparison->second.filename().string(), &robot);
  comparison->model.emplace(robot.spec);
  const Adapter adapter(*comparison->model, *engine, comparison->second.string());
  std::optional<Extras> extras;
  if (is_mjcf) extras = CompareExtras(written, comparison->first, adapter, engine.get());
  comparison->result = CheckConsistency(adapter, options, progress);
  GateResult& gate = comparison->result.gate;
  std::erase_if(gate.records, [&](const CheckRecord& record) {
    return !record.failed && std::find(completion.unstated.begin(), completion.unstated.end(), record.name) !=
                                 completion.unstated.end();
  });
  const std::vector<std::string> others = CheckDescription(robot, adapter, &gate);
  if (extras) AddExtras(*extras, &gate);
  if (!is_mjcf) AppendTo(&comparison->notes, robot.notes);  // an MJCF's are about what CompareExtras compares
  for (const auto& notes : {completion.notes, others, DescribeCoordinates(robot)})
    AppendTo(&comparison->notes, notes);
  NoteOthers(adapter, &comparison->notes);
}

/// Two descriptions without the engine.
void CompareTwoDescriptions(const UrdfOptions& urdf, const ConsistencyOptions& options,
                            const Progress& progress, Comparison* comparison) {
  RobotDescription a = ReadDescription(comparison->first, urdf);
  RobotDescription b = ReadDescription(comparison->second, urdf);
  const std::vector<std::string> taken = CompleteEachOther(&a, &b);
  for (const auto& notes : {a.notes, b.notes, taken, DescribeCoordinates(a)}) {
    AppendTo(&comparison->notes, notes);
  }
  comparison->model.emplace(a.spec);
  comparison->result = CompareDescriptions(a, b, options, progress);
}

}  // namespace

Comparison CompareFiles(const std::filesystem::path& a, const std::filesystem::path& b,
                        const UrdfOptions& urdf, const ConsistencyOptions& options,
                        const Progress& progress) {
  Comparison comparison;
  comparison.first = a;
  comparison.second = b;
  if (FindFormat(a) == RobotFormat::kMjcf && FindFormat(b) != RobotFormat::kMjcf) {
    std::swap(comparison.first, comparison.second);
  }
  comparison.with_engine = FindFormat(comparison.second) == RobotFormat::kMjcf;
  if (!comparison.with_engine) {
    CompareTwoDescriptions(urdf, options, progress, &comparison);
  } else if (FindFormat(comparison.first) == RobotFormat::kToml) {
    CompareTableWithEngine(options, progress, &comparison);
  } else {
    CompareDescriptionWithEngine(urdf, options, progress, &comparison);
  }
  return comparison;
}

void ExplainComparison(const UrdfOptions& urdf, Comparison* comparison, double tolerance) {
  if (comparison->result.Agrees()) return;
  comparison->hypotheses = ExplainDifference(comparison->first, comparison->second, urdf,
                                             std::max(tolerance, kHypothesisTolerance));
}

std::vector<std::string> ListDifferences(const Comparison& comparison) {
  const RobotModel& model = *comparison.model;
  const int base = model.num_base_velocities();
  const std::string first = comparison.first.filename().string();
  const std::string second = comparison.second.filename().string();
  std::vector<std::string> lines;
  for (const GateFinding& finding : comparison.result.gate.findings) {
    lines.push_back(fmt::format("{}: {}: {:.12g} in {}, {:.12g} in {}", finding.check, finding.where,
                                finding.model, first, finding.engine, second));
  }
  for (const CheckRecord& record : comparison.result.terms) {
    if (!record.failed) continue;
    lines.push_back(fmt::format(
        "{}: nearest the base: {}; worst: {}: {:.12g} in {}, {:.12g} in {} (sample {})", record.name,
        Describe(record.first_failure, model, base), Describe(record.where, model, base), record.model_value,
        comparison.with_engine ? "the model" : first, record.engine_value,
        comparison.with_engine ? "MuJoCo" : second, static_cast<long>(record.at)));
  }
  return lines;
}

}  // namespace dexcheck
