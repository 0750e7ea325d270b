#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/report/run_comparison.h"
#include "harness/report/run_data.h"

namespace dexcheck::cli {
namespace {

/// Signals that are printed unless --all is given.
constexpr size_t kMostPrinted = 10;

struct CompareRequest : Outputs {
  std::vector<std::string> run_folders;
  RunComparisonOptions options;
  std::optional<double> tolerance;  ///< With it, a difference is exit code 1.
  bool all = false;
  std::filesystem::path model, columns;  ///< Of recordings that are no runs.
};

/// "2.6e-15", "0", "infinite".
std::string FormatShort(double value) {
  if (!std::isfinite(value)) return "infinite";
  if (value == 0.0) return "0";
  const double size = std::abs(value);
  return size >= 0.01 && size < 1e4 ? fmt::format("{:.3g}", value) : fmt::format("{:.1e}", value);
}

std::string Show(const std::optional<double>& value) { return value ? FormatShort(*value) : "-"; }

std::string ShowUnit(const std::string& unit) { return unit == "1" ? "" : unit; }

/// Adds a line for each number: a value of each run, marked where it fails, and its ratios to the first.
void AddNumbers(const std::vector<ComparedNumber>& numbers, bool all, Report* report) {
  std::vector<TableRow> rows;
  std::string align = "<";
  for (const ComparedNumber& number : numbers) {
    if (!all && !number.fails_anywhere()) continue;
    TableRow& row = rows.emplace_back();
    row.cells = {"  " + number.name};
    align = "<" + std::string(number.values.size(), '>') + "<" + std::string(number.values.size() - 1, '<');
    for (size_t i = 0; i < number.values.size(); ++i)
      row.cells.push_back(Show(number.values[i]) + (number.fails[i] ? "!" : " "));
    row.cells.push_back(ShowUnit(number.unit));
    for (size_t i = 1; i < number.values.size(); ++i) row.cells.push_back("x " + Show(number.CalcRatio(i)));
  }
  report->AddTable(align, rows);
}

void AddSignals(const RunComparison& comparison, bool all, Report* report) {
  const auto equal = std::ranges::count_if(
      comparison.signals, [](const SignalDifference& signal) { return signal.difference == 0.0; });
  report->details += fmt::format("\nsignals: {} of {} are equal bit for bit; differences, over sizes\n",
                                 equal, comparison.signals.size());
  std::vector<TableRow> rows;
  for (const SignalDifference& signal : comparison.signals) {
    if (!all && (signal.difference == 0.0 || rows.size() == kMostPrinted)) break;
    rows.push_back({{fmt::format("  {} - A", static_cast<char>('A' + signal.run)), signal.NameColumn(),
                     FormatShort(signal.difference), ShowUnit(signal.unit), FormatShort(signal.fraction()),
                     fmt::format("at {:.3f} s", signal.at_time)}});
  }
  report->AddTable("<<><><", rows);
  if (!comparison.not_compared.empty())
    report->Add(fmt::format("  {} signals are not in all runs", comparison.not_compared.size()));
}

void AddDetails(const CompareRequest& request, const RunComparison& comparison, Report* report) {
  std::string& text = report->details;
  text += "\n";
  for (size_t i = 0; i < request.run_folders.size(); ++i) {
    text += fmt::format("{}  {}: {}\n", static_cast<char>('A' + i), request.run_folders[i],
                        comparison.verdicts[i]);
  }
  text += fmt::format("\ninputs{}\n", comparison.inputs.empty() ? ": the same" : "");
  for (const InputDifference& input : comparison.inputs) {
    text += fmt::format("  {}\n", input.name);
    for (size_t i = 0; i < input.values.size(); ++i)
      text += fmt::format("    {}  {}\n", static_cast<char>('A' + i),
                          input.values[i].empty() ? "none" : input.values[i]);
  }
  text += "\nresults\n";
  AddNumbers(comparison.results, true, report);
  const auto failing = std::ranges::count_if(comparison.checks, std::mem_fn(&ComparedNumber::fails_anywhere));
  text += fmt::format("\nchecks: {} of {} are above their bounds (!)\n", failing, comparison.checks.size());
  AddNumbers(comparison.checks, request.all, report);
  AddSignals(comparison, request.all, report);
}

int Run(CompareRequest request) {
  request.options.tolerance = request.tolerance.value_or(0.0);
  if (!request.model.empty()) {
    if (request.run_folders.size() != 2) throw InputError("--model: needs two recordings");
    return CompareTwoRecordings(
        {request, request.model, request.run_folders[0], request.run_folders[1], request.columns});
  }
  if (request.tolerance && !(*request.tolerance >= 0.0 && std::isfinite(*request.tolerance)))
    throw InputError("--tolerance: must not be negative, got " + FormatNumber(*request.tolerance));
  if (request.run_folders.size() < 2) throw InputError("compare: at least two runs are needed");
  if (request.run_folders.size() > 26) throw InputError("compare: at most 26 runs are compared");
  std::vector<std::unique_ptr<RunData>> runs;
  std::vector<const RunData*> pointers;
  for (const std::string& folder : request.run_folders) {
    runs.push_back(std::make_unique<RunData>(folder));
    pointers.push_back(runs.back().get());
  }
  ReportOutput files(request);
  const RunComparison comparison = CompareRuns(pointers, request.options);
  Report report{.answer = MakeAnswer(comparison),
                .data = ToJson(comparison, request.run_folders),
                .page = [&] { return MakeComparisonPage(pointers, request.run_folders, comparison); }};
  AddDetails(request, comparison, &report);
  if (request.tolerance && !comparison.IsSame()) report.code = kDisagreement;
  const ExitCode code = files.Write(report);
  if (code != kSuccess && comparison.signals.empty()) throw InputError("--tolerance: no signal was compared");
  return code;
}

}  // namespace

void AddCompareCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<CompareRequest>(
      app, "compare",
      "Compare runs: inputs, results, checks and signals; or, with --model, recordings of a robot",
      {"dexcheck compare run_a run_b --page comparison.html",
       "dexcheck compare run_a run_b --tolerance 1e-9"});
  AddOption(command, "RUN_DIR", &request->run_folders,
            "Folders of runs, or recordings; all are compared with the first")
      ->required()
      ->type_name("RUN_DIR...");
  AddOption(command, "--tolerance REL", &request->tolerance,
            "Exit with 1 when a signal differs by more than this fraction of its size, or a verdict differs");
  AddOption(command, "--signals A,B,...", &request->options.patterns,
            "Only these signals, such as object/*,tau")
      ->delimiter(',')
      ->allow_extra_args(false);
  AddOption(command, "--page FILE.html", &request->page_file, "Write a page with signals and differences");
  CLI::Option* const model =
      AddOption(command, "--model MODEL", &request->model,
                "Parameter file, URDF or MJCF of the robot of two recordings: what differs is named");
  AddOption(command, "--columns FILE.toml", &request->columns, "Which column of the recordings is what")
      ->needs(model);
  AddJsonOption(command, "the numbers", &request->json_file);
  command->add_flag("--all", request->all, "Print all checks and signals");
  command->add_flag("--quiet", request->quiet, "Print the last line only");
}

}  // namespace dexcheck::cli
