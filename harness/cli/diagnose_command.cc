#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"
#include "harness/cli/consistency_report.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/output_file.h"
#include "harness/cli/terminal.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/engine_extras.h"
#include "harness/descriptions/read_description.h"
#include "harness/diagnosis/diagnose.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck::cli {
namespace {

struct DiagnoseRequest : ConsistencyRequest {
  DiagnosisOptions diagnosis;
};

size_t CountRemaining(const Diagnosis& diagnosis) {
  return diagnosis.remaining_terms.size() + diagnosis.remaining_constants.size();
}

/// One list of what is wrong: conventions, then numbers.
struct Answer {
  std::vector<Hypothesis> likely;       ///< What explains it besides.
  std::vector<Hypothesis> conventions;  ///< `explained` is the fraction of the residual.
  Diagnosis numbers;                    ///< Of the file with these conventions undone.

  /// Takes conventions out of the file when several parts share one, or when less remains without them.
  /// @param undone what is wrong besides.
  void TakeConventions(Diagnosis undone) {
    const auto is_number = [](const Hypothesis& one) { return one.ids[0].starts_with("number."); };
    const bool is_shared = std::ranges::any_of(
        likely, [&](const Hypothesis& one) { return !is_number(one) && one.parts.size() > 1; });
    const size_t remaining = CountRemaining(undone);
    if (remaining >= CountRemaining(numbers) && !(remaining == 0 && is_shared)) return;
    std::erase_if(likely, is_number);
    conventions.swap(likely);
    // Fractions of what is left, as fractions of all.
    const auto divide = [](double part, double all) { return all > 0.0 ? part / all : 0.0; };
    const double left = divide(undone.residual, numbers.residual);
    const double forces = divide(undone.residual_of_forces, numbers.residual_of_forces);
    double sum = 0.0;
    for (const Hypothesis& one : conventions) sum += one.explained;
    for (Hypothesis& one : conventions) one.explained *= (1.0 - left) / sum;
    for (Repair& cause : undone.causes) {
      cause.explained *= left;
      cause.explained_of_forces *= forces;
    }
    undone.explained = 1.0 - left + left * undone.explained;
    undone.explained_of_forces = 1.0 - forces + forces * undone.explained_of_forces;
    undone.agrees = false;
    numbers = std::move(undone);
  }
};

void PrintRemaining(const DiagnoseRequest& request, const RobotModel& model, const Diagnosis& diagnosis) {
  fmt::print("What remains after these repairs:\n");
  for (const ConstantFinding& finding : diagnosis.remaining_constants) {
    fmt::print("  {}: {}: {:.10g} in {}, {:.10g} in {}\n", finding.check, finding.where, finding.model,
               request.files.robot.filename().string(), finding.engine,
               request.files.mjcf.filename().string());
  }
  for (const CheckRecord& record : diagnosis.remaining_terms) {
    fmt::print("  {}: nearest the base: {}; worst relative error {:.1e}\n", record.name,
               Describe(record.first_failure, model, model.num_base_velocities()), record.worst);
  }
}

/// Causes that a rounded number explains, when they are several and there are others: these come first to a
/// reader.
std::vector<const Repair*> FindRounded(const Diagnosis& diagnosis) {
  constexpr size_t kSeveral = 3;
  std::vector<const Repair*> rounded;
  for (const Repair& cause : diagnosis.causes) {
    const bool stands_alone = cause.kind == RepairKind::kParameters || cause.kind == RepairKind::kEngineOnly;
    if (!stands_alone) return {};  // numbers are as they were before this one
    if (LooksRounded(cause, diagnosis.written)) rounded.push_back(&cause);
  }
  if (rounded.size() < kSeveral || rounded.size() == diagnosis.causes.size()) return {};
  return rounded;
}

/// A repair, and the other places at which the same number repairs the same.
struct RepairLine {
  const Repair* first;
  std::string text;
  std::vector<std::string> others = {};
  double explained = 0.0;
};

std::vector<RepairLine> ListRepairs(const Diagnosis& diagnosis, const std::vector<const Repair*>& left_out,
                                    const std::string& file) {
  std::vector<RepairLine> lines;
  const auto after_place = [](const std::string& text) { return text.substr(text.find(": ") + 1); };
  for (const Repair& cause : diagnosis.causes) {
    if (std::ranges::find(left_out, &cause) != left_out.end()) continue;
    const std::string text = Describe(cause, diagnosis.written, file);
    const auto alike = std::ranges::find_if(lines, [&](const RepairLine& line) {
      return cause.kind == RepairKind::kParameters && cause.equivalents.empty() &&
             line.first->equivalents.empty() && after_place(line.text) == after_place(text);
    });
    if (alike == lines.end()) {
      lines.push_back({&cause, text, {}, cause.explained});
    } else {
      alike->others.push_back(text.substr(0, text.find(": ")));
      alike->explained += cause.explained;
    }
  }
  return lines;
}

std::string FormatPercent(double fraction) {
  constexpr double kLeast = 1e-6;
  return fraction < kLeast ? "under 0.0001 %" : fmt::format("{:.4g} %", 100.0 * fraction);
}

void Print(const DiagnoseRequest& request, const RobotModel& model, const Answer& answer) {
  const Diagnosis& diagnosis = answer.numbers;
  const RobotSpec& written = diagnosis.written;
  const std::string file = request.files.robot.filename().string();
  fmt::print("DISAGREE: {} against {}.\n", file, request.files.mjcf.filename().string());
  PrintHypotheses(answer.likely);
  if (diagnosis.causes.empty() && answer.conventions.empty())
    fmt::print("No change of single numbers explains it.\n");
  const std::vector<const Repair*> rounded = FindRounded(diagnosis);
  int number = 0;
  for (const Hypothesis& one : answer.conventions) {
    fmt::print("{}. {}; explains {:.4g} % of the residual\n", ++number, one.text, 100.0 * one.explained);
    for (const std::string& value : one.values) fmt::print("   {}\n", value);
  }
  for (const RepairLine& line : ListRepairs(diagnosis, rounded, file)) {
    fmt::print("{}. {}", ++number, line.text);
    if (!line.others.empty())
      fmt::print(", and so at {} more ({})", line.others.size(), JoinNames(line.others));
    if (line.first->kind == RepairKind::kEngineOnly) {
      fmt::print("\n");
      continue;
    }
    fmt::print("; explains {} of the residual\n", FormatPercent(line.explained));
    for (const Repair& equal : line.first->equivalents)
      fmt::print("   or, just as well: {}\n", Describe(equal, written, file));
  }
  if (!rounded.empty()) {
    std::vector<std::string> names;
    names.reserve(rounded.size());
    for (const Repair* const cause : rounded) names.push_back(DescribeShort(*cause, written));
    fmt::print("And {} that agree to 4 digits, as rounded numbers do (--digits 4 judges by that): {}\n",
               rounded.size(), JoinNames(names));
  }
  const size_t repairs = answer.conventions.size() + diagnosis.causes.size();
  if (repairs > 1) fmt::print("Together: {:.4g} %.\n", 100.0 * diagnosis.explained);
  if (CountRemaining(diagnosis) == 0) {
    fmt::print("With {} the two agree to {}.\n", repairs == 1 ? "it repaired" : "these repaired",
               request.DescribeTolerance());
  } else {
    PrintRemaining(request, model, diagnosis);
  }
}

Json ToJson(const Repair& cause, const RobotSpec& spec, const std::string& file) {
  Json json = {{"text", Describe(cause, spec, file)}, {"what", DescribeShort(cause, spec)}};
  json["changes"] = Json::array();
  for (size_t i = 0; i < cause.parameters.size(); ++i) {
    const Parameter& parameter = cause.parameters[i];
    json["changes"].push_back({{"part", DescribePart(spec, parameter)},
                               {"quantity", DescribeQuantity(parameter)},
                               {"unit", UnitOf(spec, parameter)},
                               {"value", ToPrinted(spec, parameter, GetValue(spec, parameter))},
                               {"repair", ToPrinted(spec, parameter, cause.values[i])}});
  }
  json["explained"] = cause.explained;
  json["explained_of_forces"] = cause.explained_of_forces;
  json["equivalents"] = Json::array();
  for (const Repair& equal : cause.equivalents) json["equivalents"].push_back(ToJson(equal, spec, file));
  return json;
}

std::string ToText(const DiagnoseRequest& request, const Answer& answer,
                   const std::vector<Hypothesis>& hypotheses, const std::vector<std::string>& notes) {
  const Diagnosis& diagnosis = answer.numbers;
  const std::string file = request.files.robot.filename().string();
  Json json = {
      {"robot", request.files.robot.string()}, {"mjcf", request.files.mjcf.string()},
      {"mujoco", mj_versionString()},          {"samples", request.diagnosis.samples},
      {"seed", request.diagnosis.seed},        {"verdict", diagnosis.agrees ? "pass" : "disagreement"},
      {"explained", diagnosis.explained},      {"explained_of_forces", diagnosis.explained_of_forces}};
  if (const std::optional<double> tolerance = request.judging.Find()) json["tolerance"] = *tolerance;
  json["notes"] = ListLoadNotes();
  for (const std::string& note : notes) json["notes"].push_back(note);
  json["hypotheses"] = ListHypotheses(hypotheses);
  json["causes"] = Json::array();
  for (const Hypothesis& one : answer.conventions)
    json["causes"].push_back({{"text", one.text},
                              {"ids", one.ids},
                              {"parts", one.parts},
                              {"changes", Json::array()},
                              {"explained", one.explained},
                              {"equivalents", Json::array()}});
  for (const Repair& cause : diagnosis.causes)
    json["causes"].push_back(ToJson(cause, diagnosis.written, file));
  json["remaining"] = Json::array();
  for (const ConstantFinding& finding : diagnosis.remaining_constants)
    json["remaining"].push_back(finding.check);
  for (const CheckRecord& record : diagnosis.remaining_terms) json["remaining"].push_back(record.name);
  return json.dump(2) + "\n";
}

/// Numbers are repaired in a parameter file or a URDF, by an MJCF that is taken to be right.
void RequireRepairable(const DescriptionFile& file, const DescriptionFile& mjcf) {
  if (file.format() == RobotFormat::kMjcf)
    throw InputError(
        file.path().string() +
        ": must be a parameter file or a URDF to be repaired, is an MJCF (dexcheck import writes a "
        "parameter file from it)");
  if (mjcf.format() != RobotFormat::kMjcf)
    throw InputError(mjcf.path().string() + ": must be an MJCF, which is taken to be right");
}

/// What is to be repaired, completed by what only the MJCF states when it is a URDF. What a URDF has no place
/// for is taken out of the engine's model.
/// @param robot as its file has it. @param notes on what is the engine's.
RobotModel Complete(const DiagnoseRequest& request, const MjcfFile& document, RobotDescription robot,
                    mjModel* engine, std::vector<std::string>* notes) {
  const std::string mjcf = request.files.mjcf.filename().string();
  const bool is_table = robot.format == RobotFormat::kToml;
  if (!is_table) SetAsideMotors(mjcf, engine);
  const Completion completion = CompleteFromEngine(*engine, mjcf, &robot, request.ignore, is_table);
  UndoOneSided(completion.one_sided, &robot.spec);
  const BaseType base = robot.spec.base.type;
  if (base == BaseType::kFixed || base == BaseType::kFloating) {
    if (const std::optional<std::string> inertias = TakeCompiledInertias(document, *engine, &robot))
      notes->push_back(*inertias);
  }
  return RobotModel(robot.spec);
}

/// Returns the changes that would repair the first file.
Answer FindAnswer(const DiagnoseRequest& request, const RobotDescription& robot, const DescriptionFile& mjcf,
                  const std::function<bool(const char*)>& progress, std::vector<Hypothesis>* hypotheses,
                  std::vector<std::string>* notes) {
  const MjModelPtr engine = mjcf.CopyEngine();
  const RobotModel model = Complete(request, mjcf.document(), robot, engine.get(), notes);
  RequireNoBalls(model, "in a diagnosis of single numbers (dexcheck consistency names likely faults)");
  const auto diagnose = [&](const RobotModel& own, const RobotDescription& rows) {
    return Diagnose(own, *engine, request.files.mjcf.string(), request.diagnosis, progress,
                    {rows.joints.begin(), rows.joints.end()});
  };
  Answer answer;
  answer.numbers = diagnose(model, robot);
  ExplainedDifference why;
  const std::optional<RobotDescription> right = mjcf.TryToDescribe();
  if (!answer.numbers.agrees && right)
    why = Explain(robot, *right, std::max(request.diagnosis.tolerance, kHypothesisTolerance));
  answer.likely = why.hypotheses;
  if (why.undone) {
    try {
      std::vector<std::string> said;
      const MjModelPtr other = mjcf.CopyEngine();
      const RobotModel undone = Complete(request, mjcf.document(), *why.undone, other.get(), &said);
      answer.TakeConventions(diagnose(undone, *why.undone));
    } catch (const InputError&) {
      // With what other faults leave of it, it is no robot.
    }
  }
  *hypotheses = std::move(why.hypotheses);
  return answer;
}

int Run(DiagnoseRequest request) {
  request.TakeFiles("diagnose");
  request.diagnosis.tolerance = request.judging.Find().value_or(0.0);
  request.options.ignore = request.ignore;
  request.options.seed = request.diagnosis.seed;
  DescriptionFile file(request.files.robot);
  DescriptionFile mjcf(request.files.mjcf);
  CatchInterrupts();
  ResultFile json(request.json_file);
  constexpr long kStages = 4;
  long stage = 0;
  ProgressBar bar("diagnosing", kStages, request.quiet);
  const auto progress = [&](const char*) { return bar.GoOn(std::min(stage++, kStages)); };
  std::vector<std::string> notes;
  std::vector<Hypothesis> hypotheses;
  std::string unrepaired;  // why no numbers are named
  Answer answer;
  const Comparison comparison = Compare(request, &file, &mjcf, [](long) { return !IsInterrupted(); });
  if (comparison.result.Agrees()) {
    notes = comparison.notes;
  } else {
    try {
      RequireRepairable(file, mjcf);
      answer = FindAnswer(request, file.Describe(), mjcf, progress, &hypotheses, &notes);
    } catch (const InputError& error) {
      unrepaired = error.what();
    }
  }
  const bool has_answer = !answer.numbers.agrees;
  answer.numbers.agrees = comparison.result.Agrees();
  bar.Finish();
  json.Write([&] { return ToText(request, answer, hypotheses, notes); });
  if (!json.TakesStdout()) {
    if (!request.quiet) {
      for (const std::string& note : notes) fmt::print("{}\n", note);
    }
    if (IsInterrupted()) fmt::print("INTERRUPTED. So far:\n");
    if (has_answer) {
      Print(request, *comparison.model, answer);
    } else {
      PrintVerdict(request, comparison, /*suggest=*/false);
      if (!unrepaired.empty()) fmt::print("No repair was looked for: {}\n", unrepaired);
    }
  }
  if (IsInterrupted()) return ReportFailure("interrupted");
  return comparison.result.Agrees() ? kSuccess : kDisagreement;
}

}  // namespace

void AddDiagnoseCommand(Command app) {
  constexpr std::uint64_t kMaxSamples = 1000;
  const auto request = std::make_shared<DiagnoseRequest>();
  Command command = app.AddCommand("diagnose", "Say why model and engine disagree, and what would repair it");
  AddFileOptions(command, "What may be wrong, instead of --robot and --mjcf: parameter file (TOML) or URDF",
                 "What is right: MJCF", request.get());
  constexpr int kSamplesOfVerdict = 200;
  AddSampleOptions(command, kMaxSamples, &request->diagnosis.samples, &request->diagnosis.seed,
                   fmt::format("Number of random states that a repair is fitted to; the verdict has {}",
                               kSamplesOfVerdict));
  request->options.samples = kSamplesOfVerdict;
  AddJudgingOptions(command, request.get());
  AddIgnoreOption(command, &request->ignore);
  AddJsonOption(command, "the results", &request->json_file);
  command.AddFlag("--quiet", &request->quiet, "No progress, and causes only");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
