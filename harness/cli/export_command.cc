#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/commands.h"
#include "harness/cli/output_file.h"
#include "harness/log/log_reader.h"

namespace dexcheck::cli {
namespace {

/// Text is handed on in pieces of this size.
constexpr size_t kChunk = size_t{1} << 20;

struct Request {
  std::filesystem::path run_folder;
  std::string csv_file;
  std::vector<std::string> patterns;
  long every = 1;
  bool list = false;
};

bool Matches(const std::string& pattern, const SignalInfo& signal) {
  return ::fnmatch(pattern.c_str(), signal.name.c_str(), 0) == 0;
}

/// The signals that match, in the log's order; all of them without patterns. Time is always among them.
std::vector<SignalInfo> ChooseSignals(const LogReader& log, const Request& request) {
  std::vector<std::string> names;
  for (const SignalInfo& signal : log.signals()) names.push_back(signal.name);
  for (const std::string& pattern : request.patterns) {
    const auto matches = [&](const SignalInfo& signal) { return Matches(pattern, signal); };
    if (std::any_of(log.signals().begin(), log.signals().end(), matches)) continue;
    const std::string nearest = FindNearest(pattern, names);
    throw InputError("--signals: no signal matches " + Quote(pattern) +
                     (nearest.empty() ? " (see --list)" : ", did you mean " + Quote(nearest) + "?"));
  }
  std::vector<SignalInfo> chosen;
  for (const SignalInfo& signal : log.signals()) {
    const auto is_match = [&](const std::string& pattern) { return Matches(pattern, signal); };
    if (chosen.empty() || request.patterns.empty() ||
        std::any_of(request.patterns.begin(), request.patterns.end(), is_match)) {
      chosen.push_back(signal);
    }
  }
  return chosen;
}

/// A field of a CSV line, in quotes where its text needs them.
std::string ToField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) {
    field += c;
    if (c == '"') field += c;
  }
  return field + '"';
}

/// "time [s],object/X_o.x [m],...": name, column and unit.
std::string MakeHeader(const std::vector<SignalInfo>& signals) {
  std::string header;
  for (const SignalInfo& signal : signals) {
    const std::vector<std::string> units = ListUnits(signal);
    for (size_t k = 0; k < units.size(); ++k) {
      std::string name = signal.name;
      if (!signal.columns.empty()) {
        name += '.' + signal.columns[k];
      } else if (units.size() > 1) {
        name += '.' + std::to_string(k);
      }
      if (!header.empty()) header += ',';
      header += ToField(name + " [" + units[k] + "]");
    }
  }
  return header + '\n';
}

/// 17 significant digits, which read back as the same number, and a comma.
void AddNumber(double value, std::string* text) {
  if (std::isnan(value)) {
    *text += "nan,";  // of either sign
  } else {
    fmt::format_to(std::back_inserter(*text), "{:.17g},", value);
  }
}

void WriteCsv(const LogReader& log, const std::vector<SignalInfo>& signals, const Request& request) {
  OutputFile file(request.csv_file);
  std::vector<RowMatrixXd> values;
  values.reserve(signals.size());
  for (const SignalInfo& signal : signals) values.push_back(log.ReadSignal(signal.name));
  std::string text = MakeHeader(signals);
  for (long row = 0; row < log.rows(); row += request.every) {
    for (const RowMatrixXd& signal : values) {
      for (const double value : signal.row(row)) AddNumber(value, &text);
    }
    text.back() = '\n';
    if (text.size() < kChunk) continue;
    file.Append(text);
    text.clear();
  }
  file.Append(text);
  file.Finish();
}

/// "m, rad": each unit once.
std::string ListDistinctUnits(const SignalInfo& signal) {
  std::vector<std::string> seen;
  std::string text;
  for (const std::string& unit : ListUnits(signal)) {
    if (std::find(seen.begin(), seen.end(), unit) != seen.end()) continue;
    seen.push_back(unit);
    text += (text.empty() ? "" : ", ") + unit;
  }
  return text;
}

void PrintList(const LogReader& log, const std::vector<SignalInfo>& signals) {
  size_t name_width = 0;
  size_t unit_width = 0;
  for (const SignalInfo& signal : signals) {
    name_width = std::max(name_width, signal.name.size());
    unit_width = std::max(unit_width, ListDistinctUnits(signal).size());
  }
  fmt::print("{} rows\n{:<{}}  {:>7}  {:<{}}  {}\n", log.rows(), "signal", name_width, "numbers", "unit",
             unit_width, "description");
  for (const SignalInfo& signal : signals) {
    fmt::print("{:<{}}  {:>7}  {:<{}}  {}\n", signal.name, name_width, signal.width,
               ListDistinctUnits(signal), unit_width, signal.description);
  }
}

int Run(const Request& request) {
  if (!request.list && request.csv_file.empty()) {
    throw InputError("export: --csv FILE.csv or --list is required (see dexcheck export --help)");
  }
  const LogReader log(request.run_folder / "log.h5");
  const std::vector<SignalInfo> signals = ChooseSignals(log, request);
  if (request.list) {
    PrintList(log, signals);
  } else {
    WriteCsv(log, signals, request);
  }
  return kSuccess;
}

}  // namespace

void AddExportCommand(Command app) {
  const auto request = std::make_shared<Request>();
  Command command = app.AddCommand("export", "Write a run's log as a table of numbers (CSV)");
  command.AddOption("RUN_DIR", &request->run_folder, "Folder of the run, with its log.h5").Required();
  Option csv = command.AddOption("--csv", &request->csv_file, "File to write (- for standard output)")
                   .TypeName("FILE.csv");
  command
      .AddOption("--signals", &request->patterns,
                 "Only time and these signals; * stands for any text: time,object/*,check/M_bar")
      .TypeName("A,B,...")
      .Delimiter(',')
      .Repeatable();
  command.AddOption("--every", &request->every, "Only the first of every N rows")
      .TypeName("N")
      .Check(WholeNumber(1, std::numeric_limits<int>::max()))
      .ShowDefault();
  command.AddFlag("--list", &request->list, "Print the signals, their units and descriptions").Excludes(csv);
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
