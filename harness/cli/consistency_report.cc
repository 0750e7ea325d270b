#include "harness/cli/consistency_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "controller/common/text.h"
#include "harness/base/check_record.h"
#include "harness/comparison/consistency.h"
#include "harness/comparison/file_differences.h"
#include "harness/engine/engine.h"

namespace dexcheck::cli {
namespace {

/// How two descriptions agree, or that they do not.
const char* NameOutcome(const ConsistencyRequest& request, const Comparison& comparison) {
  if (!comparison.Agrees()) return "differ";
  if (comparison.digits) return "digits";
  return request.judging.Find() ? "tolerance" : "rounding";
}

/// "arm.urdf: 4 to 8 digits, arm.xml: exact"
std::string DescribeDigits(const DigitVerdict& verdict) {
  std::string text;
  for (const PrintedDigits& file : verdict.files) {
    text += (text.empty() ? "" : ", ") + file.file + ": ";
    if (file.count == 0) {
      text += "exact";
    } else if (file.fewest == file.most) {
      text += fmt::format("{} digit{}", file.most, file.most == 1 ? "" : "s");
    } else {
      text += fmt::format("{} to {} digits", file.fewest, file.most);
    }
  }
  return text;
}

/// Returns whether all checks are listed: those of two that agree to rounding are.
bool ListsAll(const Comparison& comparison) { return comparison.result.Agrees() && !comparison.digits; }

/// A line for each; else one for what differs, with its place, and the names of all that agrees in one way.
void AddRecords(const char* title, const std::vector<CheckRecord>& records, const Comparison& comparison,
                const RobotModel* places, std::vector<TableRow>* rows) {
  if (ListsAll(comparison)) {
    rows->push_back({{title, "compared", "worst error", "bound", "digits", ""}});
    for (const CheckRecord& record : records)
      rows->push_back(
          {{record.name, std::to_string(record.comparisons), fmt::format("{:.2e}", record.worst),
            fmt::format("{:.1e}", record.bound), std::to_string(CountDigits(record.worst)), "ok"}});
    return;
  }
  std::map<std::string, std::string> agreeing;
  rows->push_back({{title, "worst error", "bound", ""}});
  for (const CheckRecord& record : records) {
    if (record.failed) {
      rows->push_back({{record.name, fmt::format("{:.2e}", record.worst), fmt::format("{:.1e}", record.bound),
                        places == nullptr ? "DIFFERS"
                                          : "DIFFERS at " + Describe(record.where, *places,
                                                                     places->num_base_velocities())}});
    } else {
      const bool is_within = comparison.digits && comparison.digits->units.contains(record.name);
      std::string& names = agreeing[is_within ? "within digits" : "ok"];
      names += (names.empty() ? ": " : ", ") + record.name;
    }
  }
  for (const auto& [outcome, names] : agreeing) rows->push_back({{}, fmt::format("  {}{}", outcome, names)});
}

Json ToJson(const DigitVerdict& verdict, const RobotModel& model) {
  Json json = {{"states", verdict.states},
               {"files", Json::array()},
               {"units", Json::object()},
               {"exceeds", Json::array()}};
  for (const PrintedDigits& file : verdict.files)
    json["files"].push_back(
        {{"file", file.file}, {"numbers", file.count}, {"fewest", file.fewest}, {"most", file.most}});
  for (const auto& [check, units] : verdict.units) json["units"][check] = units;
  for (const ConstantFinding& excess : verdict.excesses) {
    json["exceeds"].push_back({{"check", excess.check},
                               {"where", excess.where},
                               {"component", NameComponent(excess)},
                               {"unit", UnitOf(excess, &model)},
                               {"units", excess.units},
                               {"model", excess.model},
                               {"engine", excess.engine}});
    if (excess.too_loose > 0.0) json["exceeds"].back()["precision"] = excess.too_loose;
  }
  if (!verdict.loosest.what.empty())
    json["loosest"] = {{"what", verdict.loosest.what}, {"precision", verdict.loosest.fraction}};
  return json;
}

/// "; loosest: inertia of link forearm, compared to 0.5 %"
std::string DescribeLoosest(const LoosestNumber& loosest) {
  if (loosest.what.empty()) return "";
  return fmt::format("; loosest: {}, compared to {:.2g} %", loosest.what, 100.0 * loosest.fraction);
}

Json ToJson(const CorrectionItem& cause) {
  Json json = {{"text", cause.text},           {"id", cause.id},
               {"places", cause.places},       {"changes", Json::array()},
               {"explained", cause.explained}, {"alternatives", Json::array()}};
  const auto show = [](const std::optional<double>& value) { return value ? Json(*value) : Json(); };
  for (const FileChange& change : cause.changes) {
    Json& entry = json["changes"].emplace_back(Json{{"place", change.place}, {"quantity", change.quantity}});
    if (!change.unit.empty()) entry["unit"] = change.unit;
    entry["value"] = show(change.value);
    entry["repair"] = show(change.repair);
  }
  for (const CorrectionItem& other : cause.rivals) json["alternatives"].push_back(ToJson(other));
  return json;
}

/// Returns the answer for files whose causes are known.
/// @param left what would still differ with the causes corrected; empty for nothing known.
Answer AnswerByCauses(const ConsistencyRequest& request, const Comparison& comparison,
                      const std::string& left) {
  const FileCauses& causes = *comparison.causes;
  Answer answer{Answer::Tone::kBad, "DISAGREE", causes.file + " differs from " + causes.reference + "."};
  for (const CorrectionItem& cause : causes.items) {
    std::string& text =
        answer.causes.emplace_back(fmt::format("{}; explains {:.3g} %", cause.text, 100.0 * cause.explained));
    for (const CorrectionItem& other : cause.rivals) text += "\n     or, just as well: " + other.text;
  }
  std::vector<std::string> unexplained = causes.unexplained;
  for (const std::string& line : ListOtherDifferences(comparison)) unexplained.push_back(line);
  for (const std::string& line : unexplained) answer.remarks.push_back("not explained: " + line);
  if (!left.empty()) {
    answer.remarks.push_back("with that corrected, they still differ: " + left);
  } else if (!request.exact && unexplained.empty()) {
    const std::string digits =
        comparison.digits ? "within the printed digits (" + DescribeDigits(*comparison.digits) + ")"
        : comparison.result.samples == 0 ? "as far as it is printed; no motion was compared"
                                         : "to " + request.DescribeTolerance();
    answer.remarks.push_back("everything else agrees " + digits);
  }
  return answer;
}

/// Returns the answer for terms that differ, without causes: each difference, the real ones first.
Answer AnswerByTerms(const ConsistencyRequest& request, const Comparison& comparison,
                     const std::string& left_out) {
  const Differences differences = SortDifferences(comparison);
  Answer answer{Answer::Tone::kBad, "DISAGREE", {}, differences.real, {}};
  const std::string to_digits = fmt::format("agrees to {} digits", differences.digits);
  if (differences.real.empty()) {
    answer.sentence =
        fmt::format("everything agrees to {} digits, but not to rounding; --digits {} accepts that{}.",
                    differences.digits, differences.digits, left_out);
    answer.causes = differences.rounded;
    return answer;
  }
  if (comparison.digits && std::ranges::all_of(comparison.digits->excesses,
                                               [](const auto& excess) { return excess.too_loose > 0.0; })) {
    answer.sentence = fmt::format(
        "nothing differs, but the files print too few digits to confirm {} number{} within {:g} %; "
        "--precision accepts more{}.",
        differences.real.size(), differences.real.size() == 1 ? "" : "s", request.precision, left_out);
    return answer;
  }
  const std::string within =
      comparison.digits ? "agrees within the printed digits (" + DescribeDigits(*comparison.digits) + ")"
                        : "agrees to " + request.DescribeTolerance();
  const size_t count = differences.real.size();
  const std::string quantities =
      count == 1 ? "1 quantity differs" : fmt::format("{} quantities differ", count);
  answer.sentence = fmt::format("{}; everything else {}{}.", quantities,
                                differences.rounded.empty() ? within : to_digits, left_out);
  if (!differences.following.empty()) answer.remarks.push_back(differences.following);
  return answer;
}

/// @param compare the two as the options say.
template <typename CompareBy>
Comparison JudgeAsAsked(const ConsistencyRequest& request, const CompareBy& compare) {
  ConsistencyOptions options = request.options;
  const std::optional<double> tolerance = request.judging.Find();
  options.within_digits = !request.exact && !tolerance;
  options.precision = 0.01 * request.precision;
  Comparison comparison = compare(options);
  if (tolerance) comparison.JudgeByTolerance(*tolerance);
  return comparison;
}

Json MakeData(const ConsistencyRequest& request, const Comparison& comparison, const Report& report) {
  const RobotModel& model = *comparison.model;
  const ConsistencyResult& result = comparison.result;
  Json json = {{"robot", comparison.first.string()},
               {"mjcf", comparison.second.string()},
               {"mujoco", mj_versionString()},
               {"samples", result.samples},
               {"samples_requested", request.options.samples},
               {"seed", request.options.seed},
               {"seconds", result.seconds},
               {"verdict", report.code == kDisagreement ? "disagreement"
                           : report.failure.empty()     ? "pass"
                                                        : "failed"},
               {"outcome", NameOutcome(request, comparison)}};
  json["notes"] = comparison.notes;
  for (const std::string& note : comparison.not_compared) json["notes"].push_back(note);
  json["differences"] = ListDifferences(comparison);
  json["not_compared"] = comparison.not_compared;
  json["without_effect"] = comparison.without_effect;
  if (const std::optional<double> tolerance = request.judging.Find()) json["tolerance"] = *tolerance;
  json["checks"] = Json::object();
  for (const auto* records : {&result.constants.records, &result.terms}) {
    for (const CheckRecord& record : *records) json["checks"][record.name] = DescribeRecord(record, model);
  }
  if (comparison.digits) json["digits"] = ToJson(*comparison.digits, model);
  json["findings"] = Json::array();
  for (const ConstantFinding& finding : result.constants.findings) {
    json["findings"].push_back({{"check", finding.check},
                                {"where", finding.where},
                                {"model", finding.model},
                                {"engine", finding.engine}});
    if (!finding.effect.empty()) json["findings"].back()["effect"] = finding.effect;
  }
  json["engine_notes"] = Json::array();
  for (const ConstantNote& note : result.constants.notes)
    json["engine_notes"].push_back({{"kind", note.kind}, {"text", note.text}});
  AddCauses(comparison, &json);
  return json;
}

/// Adds what failed first, then where to look.
void AddTables(const ConsistencyRequest& request, const Comparison& comparison, Report* report) {
  const RobotModel& model = *comparison.model;
  const ConsistencyResult& result = comparison.result;
  report->details =
      fmt::format("\n{}: {} against {}{}\n{} random states (seed {}), {:.1f} s\n\n", model.name(),
                  comparison.first.filename().string(), comparison.second.filename().string(),
                  comparison.with_engine ? std::string(", MuJoCo ") + mj_versionString() : "", result.samples,
                  request.options.seed, result.seconds);

  const auto list = [&](const char* title, const std::vector<std::string>& lines) {
    if (lines.empty()) return;
    report->details += fmt::format("{}:\n", title);
    for (const std::string& line : lines) report->Add("  " + line, 4);
    report->details += "\n";
  };
  list("not compared", comparison.not_compared);
  list("differs without effect on these terms", comparison.without_effect);
  list("worth knowing", comparison.notes);
  std::vector<TableRow> rows;
  const std::vector<CheckRecord>& constants = result.constants.records;
  if (!constants.empty()) AddRecords("constant", constants, comparison, nullptr, &rows);
  if (!result.constants.notes.empty()) {
    rows.push_back(
        {{},
         fmt::format("{} notes on contacts, solver and motors' limits, which matter in runs: --json",
                     result.constants.notes.size())});
  }
  if (!rows.empty()) rows.emplace_back();
  AddRecords("term", result.terms, comparison, &model, &rows);
  report->AddTable(ListsAll(comparison) ? "<>>>><" : "<>><", rows);
  const std::string bounds = request.judging.Find()
                                 ? "bounds are the given tolerance, or rounding where that is wider"
                                 : "bounds follow from rounding";
  const std::string digits =
      comparison.digits
          ? fmt::format(" Larger ones were compared with the files' printed digits at {} states.",
                        comparison.digits->states)
          : "";
  report->Add("\nErrors are relative to each term's scale; " + bounds + " (harness/README.md)." + digits +
                  " --json gives the place of each.",
              0);
}

/// Adds each check as a case, and each cause.
void AddCases(const Comparison& comparison, Report* report) {
  const RobotModel& model = *comparison.model;
  const ConsistencyResult& result = comparison.result;
  const auto add = [&](const std::string& group, const CheckRecord& record) {
    report->AddCase(group, record, Describe(record.where, model, model.num_base_velocities()));
  };
  for (const CheckRecord& record : result.constants.records) add("constant", record);
  for (const CheckRecord& record : result.terms) add("term", record);
  // A constant that the engine's model alone has belongs to no check of its own.
  for (const ConstantFinding& finding : result.constants.findings) {
    if (std::ranges::find(report->cases, finding.check, &JUnitCase::name) == report->cases.end())
      report->cases.push_back({"constant", finding.check, finding.where});
  }
  if (!comparison.causes) return;
  for (const CorrectionItem& cause : comparison.causes->items)
    report->cases.push_back({"cause", cause.id, cause.text});
}

}  // namespace

void AddJudgingOptions(CLI::App* command, ConsistencyRequest* request) {
  const std::array<CLI::Option*, 2> tolerance = AddToleranceOptions(command, &request->judging);
  command
      ->add_flag("--exact", request->exact,
                 "Two files must agree to rounding, not only within the digits that they print")
      ->excludes(tolerance[0])
      ->excludes(tolerance[1]);
  AddOption(command, "--precision PERCENT", &request->precision,
            "Coarsest printed precision that still counts as agreement, % of a number's size")
      ->check(PositiveNumber())
      ->excludes(tolerance[0])
      ->excludes(tolerance[1])
      ->capture_default_str();
}

Comparison Compare(const ConsistencyRequest& request, const Progress& progress) {
  return JudgeAsAsked(request, [&](const ConsistencyOptions& options) {
    const RobotFiles& files = request.files;
    if (request.has_results())
      return CompareResults(files.robot, request.source, request.urdf, options, progress);
    return CompareFiles(files.robot, files.mjcf, request.urdf, options, progress);
  });
}

Comparison Compare(const ConsistencyRequest& request, DescriptionFile* robot, DescriptionFile* mjcf,
                   const Progress& progress) {
  return JudgeAsAsked(request, [&](const ConsistencyOptions& options) {
    return CompareFiles(robot, mjcf, request.urdf, options, progress);
  });
}

Json DescribeRecord(const CheckRecord& record, const RobotModel& model) {
  const int base = model.num_base_velocities();
  Json json = ToJson(record, /*timed=*/false);
  json["compared"] = record.comparisons;
  json["where"] = Describe(record.where, model, base);
  json["sample"] = static_cast<long>(record.at);
  json["model"] = record.model_value;
  json["engine"] = record.engine_value;
  json["digits"] = CountDigits(record.worst);
  if (record.failed) json["first_failure"] = Describe(record.first_failure, model, base);
  return json;
}

void AddCauses(const Comparison& comparison, Json* json) {
  (*json)["causes"] = Json::array();
  (*json)["unexplained"] = Json::array();
  if (comparison.Agrees()) return;
  const bool has_causes = comparison.causes && !comparison.causes->agrees;
  if (has_causes) {
    for (const CorrectionItem& cause : comparison.causes->items) (*json)["causes"].push_back(ToJson(cause));
    (*json)["unexplained"] = comparison.causes->unexplained;
  }
  for (const std::string& line : has_causes ? ListOtherDifferences(comparison) : ListDifferences(comparison))
    (*json)["unexplained"].push_back(line);
}

Answer MakeAnswer(const ConsistencyRequest& request, const Comparison& comparison,
                  const RepairTrial& repair) {
  const ConsistencyResult& result = comparison.result;
  const auto count = [](const std::vector<std::string>& notes, const char* what) {
    std::string names;
    for (const std::string& note : notes)
      names += (names.empty() ? "" : ", ") + note.substr(0, note.find(':'));
    return notes.empty() ? "" : fmt::format("; {} {} ({})", notes.size(), what, Abbreviate(names));
  };
  const std::string left_out = count(comparison.not_compared, "not compared") +
                               count(comparison.without_effect, comparison.without_effect.size() == 1
                                                                    ? "differs without effect on these terms"
                                                                    : "differ without effect on these terms");
  Answer answer{.word = "AGREE"};
  if (comparison.causes && !comparison.causes->agrees) {
    answer = AnswerByCauses(request, comparison, repair.left);
  } else if (!result.Agrees()) {
    answer = AnswerByTerms(request, comparison, left_out);
  } else {
    const std::string terms = result.terms.size() == 1
                                  ? "the only compared term, " + result.terms.front().name
                                  : fmt::format("all {} terms", result.terms.size());
    if (comparison.digits) {
      answer.sentence =
          fmt::format("{} agree{} within the printed digits ({}){}; --exact asks for rounding alone{}.",
                      terms, result.terms.size() == 1 ? "s" : "", DescribeDigits(*comparison.digits),
                      DescribeLoosest(comparison.digits->loosest), left_out);
    } else {
      const bool is_of_model =
          comparison.first == comparison.second || comparison.first.extension() == ".toml";
      const std::string both = request.has_results() ? "the description and the results"
                               : comparison.with_engine && is_of_model
                                   ? "the analytic model and MuJoCo"
                                   : fmt::format("{} and {}", comparison.first.filename().string(),
                                                 comparison.second.filename().string());
      answer.sentence =
          fmt::format("{} agree to {} in {}{}.", both, request.DescribeTolerance(), terms, left_out);
    }
  }
  if (!repair.command.empty()) answer.remarks.push_back("repair: " + repair.command);
  return answer;
}

Report MakeReport(const ConsistencyRequest& request, const Comparison& comparison,
                  const RepairTrial& repair) {
  const ConsistencyResult& result = comparison.result;
  Report report{.answer = MakeAnswer(request, comparison, repair),
                .suite = "consistency." + comparison.first.stem().string(),
                .seconds = result.seconds};
  if (!comparison.Agrees()) report.code = kDisagreement;
  if (!request.IsWhole(result))
    report.SetIncomplete(result.samples, request.options.samples, "states were compared");
  report.data = MakeData(request, comparison, report);
  AddTables(request, comparison, &report);
  AddCases(comparison, &report);
  return report;
}

}  // namespace dexcheck::cli
