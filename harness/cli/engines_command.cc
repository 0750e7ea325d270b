#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "controller/common/text.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/cli/consistency_report.h"
#include "harness/comparison/engine_comparison.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck::cli {
namespace {

struct EnginesRequest : Outputs {
  std::filesystem::path robot;
  EngineComparisonOptions options;
  UrdfOptions urdf;
  int digits = 6;  ///< MuJoCo 2.2.2 diagonalises inertias to 1e-6 or better.
};

/// Worst differences of a pair, by the names of terms; empty for those that one of the two does not have.
std::string FormatCell(const ComparedPair& pair, const std::string& term) {
  for (const CheckRecord& record : pair.terms) {
    if (record.name == term) return fmt::format("{:.1e}{}", record.worst, record.failed ? "!" : " ");
  }
  return "- ";
}

const CheckRecord* FindWorst(const ComparedPair& pair) {
  const auto by_bound = [](const CheckRecord& a, const CheckRecord& b) {
    return a.worst / a.bound < b.worst / b.bound;
  };
  const auto worst = std::ranges::max_element(pair.terms, by_bound);
  return worst == pair.terms.end() ? nullptr : &*worst;
}

std::vector<std::string> NamesOf(const std::vector<size_t>& group, const EngineComparisonResult& result) {
  std::vector<std::string> names;
  names.reserve(group.size());
  for (const size_t provider : group) names.push_back(result.names[provider]);
  return names;
}

void AddTables(const EnginesRequest& request, const RobotModel& model, const EngineComparisonResult& result,
               Report* report) {
  report->details = fmt::format("\n{}: {}\n{} random states (seed {}), {} engines\n\n", model.name(),
                                request.robot.filename().string(), result.samples,
                                request.options.states.seed, result.names.size());
  for (const std::string& note : result.notes) report->Add("  " + note, 4);
  for (const std::string& absent : result.absent) report->Add("  not compared: " + absent, 4);
  if (!result.notes.empty() || !result.absent.empty()) report->details += "\n";

  const auto letter = [](size_t provider) { return std::string(1, static_cast<char>('A' + provider)); };
  const auto name = [&](const ComparedPair& pair) {
    return letter(pair.first) + " - " + letter(pair.second);
  };
  for (size_t i = 0; i < result.names.size(); ++i)
    report->details += letter(i) + "  " + result.names[i] + "\n";
  std::vector<std::string> terms;
  for (const ComparedPair& pair : result.pairs) {
    for (const CheckRecord& record : pair.terms) {
      if (std::ranges::find(terms, record.name) == terms.end()) terms.push_back(record.name);
    }
  }
  constexpr size_t kPairsInARow = 6;
  for (size_t begin = 0; begin < result.pairs.size(); begin += kPairsInARow) {
    const size_t end = std::min(begin + kPairsInARow, result.pairs.size());
    std::vector<TableRow> rows = {{}, {{"worst difference"}}};
    for (size_t i = begin; i < end; ++i) rows.back().cells.push_back(name(result.pairs[i]) + " ");
    for (const std::string& term : terms) {
      rows.push_back({{term}});
      for (size_t i = begin; i < end; ++i) rows.back().cells.push_back(FormatCell(result.pairs[i], term));
    }
    report->AddTable("<>>>>>>", rows);
  }
  report->details += "\nwhere it is worst\n";
  const int base = model.num_base_velocities();
  for (const ComparedPair& pair : result.pairs) {
    const CheckRecord* const worst = FindWorst(pair);
    const std::string where =
        worst == nullptr ? "no term in common"
                         : fmt::format("{} {}, state {}", worst->name, Describe(worst->where, model, base),
                                       static_cast<long>(worst->at));
    report->Add(name(pair) + "  " + where, 7);
  }
  report->Add(
      fmt::format("\nDifferences are relative to each term's own scale; those above {:g} are marked by "
                  "\"!\".",
                  request.options.tolerance),
      0);
}

Answer AnswerForEngines(const EngineComparisonResult& result) {
  Answer answer{.word = "AGREE",
                .sentence = JoinNames(result.names) + " agree in all terms that they share."};
  if (!result.Agrees()) {
    answer = {Answer::Tone::kBad, "DISAGREE", "these do not give the same terms.", {}, result.settings};
    for (const std::vector<size_t>& group : result.groups)
      answer.causes.push_back(JoinNames(NamesOf(group, result)) +
                              (group.size() > 1 ? " agree" : " stands alone"));
  }
  return answer;
}

Json ToJson(const EnginesRequest& request, const RobotModel& model, const EngineComparisonResult& result) {
  Json json = {{"robot", request.robot.string()},
               {"verdict", result.Agrees() ? "pass" : "disagreement"},
               {"samples", result.samples},
               {"seed", request.options.states.seed},
               {"tolerance", request.options.tolerance},
               {"engines", result.names},
               {"absent", result.absent},
               {"notes", result.notes},
               {"settings", result.settings}};
  json["groups"] = Json::array();
  for (const std::vector<size_t>& group : result.groups) json["groups"].push_back(NamesOf(group, result));
  json["pairs"] = Json::array();
  for (const ComparedPair& pair : result.pairs) {
    Json entry = {{"first", result.names[pair.first]}, {"second", result.names[pair.second]}};
    entry["terms"] = Json::object();
    for (const CheckRecord& record : pair.terms) {
      Json& term = entry["terms"][record.name] = DescribeRecord(record, model);
      term["first"] = record.model_value;
      term["second"] = record.engine_value;
    }
    json["pairs"].push_back(entry);
  }
  return json;
}

Report MakeReport(const EnginesRequest& request, const RobotModel& model,
                  const EngineComparisonResult& result) {
  Report report{.answer = AnswerForEngines(result),
                .data = ToJson(request, model, result),
                .suite = "engine_comparison." + request.robot.stem().string()};
  AddTables(request, model, result, &report);
  for (const ComparedPair& pair : result.pairs) {
    for (const CheckRecord& record : pair.terms)
      report.AddCase(result.names[pair.first] + " - " + result.names[pair.second], record,
                     Describe(record.where, model, model.num_base_velocities()));
  }
  if (!result.Agrees()) report.code = kDisagreement;
  if (result.samples < request.options.states.samples)
    report.SetIncomplete(result.samples, request.options.states.samples, "states were compared");
  if (result.lacks_requested)
    report.failure = "a library that was requested is not there: " + JoinNames(result.absent);
  return report;
}

int Run(EnginesRequest request) {
  CatchInterrupts();
  request.options.tolerance = std::pow(10.0, -request.digits);
  request.options.programs_folder = FindInstalled("libexec/dexcheck");
  ReportOutput files(request);
  const DescriptionFile file(request.robot, request.urdf);
  const RobotDescription robot = file.Describe();
  const RobotModel model(robot.spec);
  ProgressBar bar("comparing", request.options.states.samples, request.quiet);
  const EngineComparisonResult result =
      RunEngineComparison(file, robot, request.options, [&](long samples) { return bar.GoOn(samples); });
  bar.Finish();
  return files.Write(MakeReport(request, model, result));
}

}  // namespace

void AddEngineComparisonCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<EnginesRequest>(
      app, "engines", "Compare one robot's terms in several physics engines, pair by pair",
      {"dexcheck engines arm.urdf", "dexcheck engines arm.urdf --engine 'mine=python3 mine.py'"});
  request->options.states.samples = 100;
  AddOption(command, "ROBOT", &request->robot, "URDF; with fewer engines an MJCF or a parameter file (TOML)")
      ->type_name("FILE")
      ->required();
  std::string names;
  for (const EngineComparisonEngine& engine : ListEngineComparisonEngines())
    names += (names.empty() ? "" : ", ") + engine.name;
  AddOption(command, "--engines NAME,...", &request->options.engines,
            "Which of " + names + "; all that are there when none is named")
      ->delimiter(',');
  AddOption(command, "--engine NAME=CMD", &request->options.programs,
            "One more: a program of your own that provides terms (harness/descriptions/README.md)")
      ->allow_extra_args(false);
  AddOption(command, "--mjcf FILE.xml", &request->options.mjcf, "What MuJoCo reads instead of ROBOT");
  AddOption(command, "--node-modules FOLDER", &request->options.node_modules, "Folder of @mujoco/mujoco");
  command->add_flag("--floating", request->urdf.floating, "The root of a URDF floats");
  AddSampleOptions(command, 1000000, &request->options.states.samples, &request->options.states.seed);
  AddOption(command, "--digits N", &request->digits,
            "Agreement to this many digits of a term's scale is enough")
      ->check(WholeNumber(1, 15))
      ->capture_default_str();
  AddJsonOption(command, "the results", &request->json_file);
  AddJUnitOption(command, &request->junit_file);
  AddIgnoreOption(command, &request->options.states.ignore);
  command->add_flag("--quiet", request->quiet, "Print the verdict only");
}

}  // namespace dexcheck::cli
